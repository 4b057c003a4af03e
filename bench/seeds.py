#!/usr/bin/env python3
"""Plans a scenario with many seeds, verifies every plan, and writes DIR/runs.csv and DIR/summary.md.

    bench/seeds.py scenarios/double-funnel.yaml --planner tendril --seeds 50 --time-limit 60 -o bench/results/double-funnel

Every run is a process of its own on one thread, one after the other, so the times are those of an idle core if nothing
else runs. wall_time_s counts loading and planning; verifying comes after it and is not counted.
"""
import argparse
import csv
import datetime
import json
import pathlib
import platform
import statistics
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
COLUMNS = ["scenario", "planner", "seed", "threads", "status", "wall_time_s", "cpu_time_s", "iterations", "states", "steps",
           "simulated_time_s", "verified"]


def run(program, scenario, planner, seed, time_limit):
    """One row of runs.csv."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([program, "plan", scenario, "-o", folder, "--seed", str(seed), "--planner", planner,
                        "--time-limit", str(time_limit)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        solution = json.loads((pathlib.Path(folder) / "solution.json").read_text())
        verified = subprocess.run([program, "verify", pathlib.Path(folder) / "solution.json"],
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0
    run = solution["run"]
    row = {"scenario": solution["scenario"]["name"], "planner": planner, "status": solution["status"],
           "verified": str(verified).lower()}
    return row | {key: run[key] for key in COLUMNS if key in run and key not in row}


def processor():
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return platform.processor()


def summary(rows, command):
    """A table row per (scenario, planner)."""
    lines = [f"Made on {datetime.date.today()} on one core of {processor()} by", "", f"    {command}", "",
             "| scenario | planner | solved and verified | wall time s: mean ± deviation | median | slowest | processor s, mean "
             "| states, mean | steps, mean |", "|---|---|---|---|---|---|---|---|---|"]
    groups = {}
    for row in rows:
        groups.setdefault((row["scenario"], row["planner"]), []).append(row)
    for (scenario, planner), group in groups.items():
        good = [row for row in group if row["status"] == "solved" and row["verified"] == "true"]
        numbers = lambda key: [float(row[key]) for row in good] or [float("nan")]
        wall = numbers("wall_time_s")
        lines.append(f"| {scenario} | {planner} | {len(good)} of {len(group)} | {statistics.mean(wall):.3f} ± "
                     f"{statistics.pstdev(wall):.3f} | {statistics.median(wall):.3f} | {max(wall):.3f} "
                     f"| {statistics.mean(numbers('cpu_time_s')):.3f} | {statistics.mean(numbers('states')):.0f} "
                     f"| {statistics.mean(numbers('steps')):.0f} |")
    return "\n".join(lines + ["", "Times are over the runs that were solved and verified.", ""])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario")
    parser.add_argument("--planner", action="append", help="may be given several times; default tendril")
    parser.add_argument("--seeds", type=int, default=50)
    parser.add_argument("--time-limit", type=float, default=60)
    parser.add_argument("--program", default=ROOT / "build/release/tendril")
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    planners = arguments.planner or ["tendril"]
    rows = []
    for planner in planners:
        for seed in range(1, arguments.seeds + 1):
            rows.append(run(arguments.program, arguments.scenario, planner, seed, arguments.time_limit))
            print(",".join(str(rows[-1][key]) for key in COLUMNS), flush=True)
    arguments.output.mkdir(parents=True, exist_ok=True)
    with open(arguments.output / "runs.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    command = " ".join(["bench/seeds.py", arguments.scenario, *(f"--planner {planner}" for planner in planners),
                        f"--seeds {arguments.seeds} --time-limit {arguments.time_limit:g} -o {arguments.output}"])
    (arguments.output / "summary.md").write_text(summary(rows, command))
    print((arguments.output / "summary.md").read_text())


if __name__ == "__main__":
    main()
