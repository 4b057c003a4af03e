"""tendril benchmark: what it writes, that it goes on where it stopped, and what it refuses."""
import csv
import json
import signal
import sqlite3
import subprocess
import time
import unittest
import xml.etree.ElementTree

from program import Case, DONE, DOUBLE_FUNNEL, FREE_SPACE, NO, TENDRIL

COLUMNS = ["scenario", "planner", "seed", "threads", "status", "wall_time_s", "cpu_time_s", "iterations", "states", "steps",
           "simulated_time_s", "verified"]
TIMES = {"wall_time_s", "cpu_time_s"}


class Benchmark(Case):
    def rows(self, folder="out"):
        with (self.folder / folder / "runs.csv").open(newline="") as file:
            reader = csv.DictReader(file)
            rows = list(reader)
        self.assertEqual(reader.fieldnames, COLUMNS)
        return rows

    @staticmethod
    def timeless(rows):
        return [{key: value for key, value in row.items() if key not in TIMES} for row in rows]

    def test_every_scenario_planner_and_seed_has_a_row_and_its_plan_is_that_of_the_command_plan(self):
        result = self.tendril_json("benchmark", DOUBLE_FUNNEL, FREE_SPACE, "--planner", "tendril", "--planner", "paper",
                                   "--runs", 2, "--time-limit", 120, "-o", "out")
        rows = self.rows()
        self.assertEqual([(row["scenario"], row["planner"], row["seed"]) for row in rows],
                         [(scenario, planner, seed) for scenario in ("double-funnel", "free-space")
                          for planner in ("tendril", "paper") for seed in ("1", "2")])
        for row in rows:
            self.assertEqual((row["status"], row["verified"], row["threads"]), ("solved", "true", "1"))
        self.assertEqual(result["status"], "done")
        self.assertEqual([entry["solved"] for entry in result["statistics"]], [2, 2, 2, 2])

        plan = self.tendril_json("plan", DOUBLE_FUNNEL, "--planner", "paper", "--seed", 2, "-o", "plan")
        for key in ("iterations", "states", "steps", "simulated_time_s"):
            self.assertEqual(float(rows[3][key]), plan[key])

        summary = (self.folder / "out" / "summary.md").read_text()
        self.assertIn("| double-funnel | paper | 2 of 2 (100.0 %)", summary)
        self.assertIn("`tendril benchmark ", summary)
        for name in ("success.svg", "times.svg"):
            self.assertIn(name, summary)
            drawing = xml.etree.ElementTree.parse(self.folder / "out" / name).getroot()
            text = " ".join(drawing.itertext())
            for word in ("double-funnel", "free-space", "paper", "wall time [s]"):
                self.assertIn(word, text)
        self.assert_database_holds(rows)

    def assert_database_holds(self, rows):
        """The tables and columns that OMPL's ompl_benchmark_statistics.py makes and Planner Arena reads."""
        database = sqlite3.connect(self.folder / "out" / "benchmark.db")
        self.addCleanup(database.close)
        tables = {name: {column[1]: column[2] for column in database.execute(f"PRAGMA table_info({name})")}
                  for name, in database.execute("SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite_%'")}
        self.assertEqual(tables.keys(), {"experiments", "plannerConfigs", "enums", "runs", "progress"})
        self.assertEqual(tables["experiments"], {
            "id": "INTEGER", "name": "VARCHAR(512)", "totaltime": "REAL", "timelimit": "REAL", "memorylimit": "REAL",
            "runcount": "INTEGER", "version": "VARCHAR(128)", "hostname": "VARCHAR(1024)", "cpuinfo": "TEXT", "date": "DATETIME",
            "seed": "VARCHAR(24)", "setup": "TEXT"})
        self.assertEqual(tables["plannerConfigs"], {"id": "INTEGER", "name": "VARCHAR(512)", "settings": "TEXT"})
        self.assertEqual(tables["enums"], {"name": "VARCHAR(512)", "value": "INTEGER", "description": "TEXT"})
        self.assertEqual(tables["progress"], {"runid": "INTEGER", "time": "REAL"})
        runs = tables["runs"]
        self.assertEqual([runs[key] for key in ("id", "experimentid", "plannerid", "time", "solved", "status")],
                         ["INTEGER", "INTEGER", "INTEGER", "REAL", "BOOLEAN", "ENUM"])
        self.assertEqual(database.execute("PRAGMA foreign_key_check").fetchall(), [])
        self.assertEqual(database.execute("PRAGMA integrity_check").fetchall(), [("ok",)])

        found = database.execute("SELECT e.name, p.name, r.seed, s.description, r.time, r.graph_states, r.solved FROM runs r "
                                 "JOIN experiments e ON e.id = experimentid JOIN plannerConfigs p ON p.id = plannerid "
                                 "JOIN enums s ON s.name = 'status' AND s.value = r.status ORDER BY r.id").fetchall()
        self.assertEqual(found, [(row["scenario"], row["planner"], int(row["seed"]), row["status"], float(row["wall_time_s"]),
                                  int(row["states"]), 1) for row in rows])
        self.assertEqual(database.execute("SELECT name, timelimit, runcount FROM experiments").fetchall(),
                         [("double-funnel", 120, 2), ("free-space", 120, 2)])

    def test_stopped_by_ctrl_c_it_keeps_what_is_done_and_goes_on_to_the_same_rows(self):
        arguments = ["benchmark", DOUBLE_FUNNEL, "--runs", "8", "--time-limit", "120", "-o", "out"]
        process = subprocess.Popen([TENDRIL, *arguments], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   text=True)
        while process.poll() is None and not (self.folder / "out" / "runs.csv").exists():
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        stdout, stderr = process.communicate(timeout=60)
        self.assertEqual(process.returncode, NO, stderr)
        self.assertEqual(stderr, "")
        self.assertIn("cancelled", stdout)
        kept = self.rows()
        self.assertIn(len(kept), range(1, 8))
        self.assertTrue((self.folder / "out" / "summary.md").is_file())

        self.tendril(*arguments, "--threads", 2)
        rows = self.rows()
        self.assertEqual(rows[:len(kept)], kept)  # times, too: they were not run again
        self.tendril(*arguments[:-1], "alone")
        self.assertEqual(self.timeless(rows), self.timeless(self.rows("alone")))
        self.assertEqual({path.name for path in (self.folder / "out").iterdir()},
                         {"runs.csv", "summary.md", "benchmark.db", "benchmark.json", "success.svg", "times.svg"})

    def test_a_plan_that_is_not_found_is_a_failure_in_the_table_and_no_error(self):
        scenario = self.variant(DOUBLE_FUNNEL)
        scenario.write_text(scenario.read_text() + "planner: {extend_limit: 1, goal_bias: 0}\n")
        result = self.tendril_json("benchmark", scenario, "--runs", 1, "-o", "out", expect=DONE)
        self.assertEqual(result["statistics"][0]["solved"], 0)
        self.assertIsNone(result["statistics"][0]["wall_time_s"]["mean"])
        self.assertEqual(self.rows()[0]["status"], "iteration_limit")
        self.assertIn("| double-funnel | tendril | 1 | iteration_limit |", (self.folder / "out" / "summary.md").read_text())

    def test_solutions_are_kept_on_request(self):
        self.tendril("benchmark", FREE_SPACE, "--runs", 1, "--keep", "-o", "out")
        kept = self.folder / "out" / "solutions" / "free-space" / "tendril" / "1" / "solution.json"
        self.assertEqual(json.loads(kept.read_text())["run"]["seed"], 1)
        self.assertTrue(self.tendril_json("verify", kept)["valid"])

    def test_bad_input_is_refused_before_anything_is_run_or_written(self):
        self.assert_refused("benchmark", saying=["scenario"])
        self.assert_refused("benchmark", "missing.yaml", saying=["missing.yaml"])
        self.assert_refused("benchmark", FREE_SPACE, "missing.yaml", saying=["missing.yaml"])
        self.assert_refused("benchmark", FREE_SPACE, "--planner", "nothing", saying=["nothing", "tendril", "paper"])
        self.assert_refused("benchmark", FREE_SPACE, "--time-limit", "nan", saying=["--time-limit"])
        self.assert_refused("benchmark", FREE_SPACE, "--runs", 0, saying=["--runs"])
        self.assert_refused("benchmark", FREE_SPACE, self.variant(FREE_SPACE), saying=["free-space", "name"])
        goalless = self.write("goalless.yaml", FREE_SPACE.read_text().partition("goal:")[0])
        self.assert_refused("benchmark", goalless, saying=["goalless.yaml"])

    def test_runs_of_other_settings_are_not_mixed_in(self):
        scenario = self.variant(FREE_SPACE)
        arguments = ["benchmark", scenario, "--runs", 1, "-o", "out"]
        self.tendril(*arguments)
        self.assert_refused(*arguments, "--time-limit", 7, saying=["--time-limit 1200, not 7", "benchmark.json"])
        scenario.write_text(scenario.read_text() + "# changed\n")
        self.assert_refused(*arguments, saying=["variant.yaml", "benchmark.json"])


if __name__ == "__main__":
    unittest.main()
