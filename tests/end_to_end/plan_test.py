"""`plan`, `verify`, `replay` and `view` together, on the two scenarios everybody starts with."""
import json
import math
import os
import pathlib
import re
import shutil
import signal
import subprocess
import time
import unittest

from program import DOUBLE_FUNNEL, FREE_SPACE, NO, TENDRIL, Case

# A rod thicker than the tunnel is wide: there is no plan.
BLOCKED = (("radius_m: 0.01", "radius_m: 0.035"),)


class Plan(Case):
    def plan(self, scenario, *arguments, folder="plan"):
        summary = self.tendril_json("plan", scenario, "-o", folder, *arguments)
        self.assertEqual(summary["status"], "solved")
        self.assertTrue(summary["verified"])
        return summary

    def solution(self, folder="plan"):
        return json.loads((self.folder / folder / "solution.json").read_text())

    def test_free_space_is_planned_verified_and_replayed(self):
        self.plan(FREE_SPACE)
        solution = self.solution()
        self.assertEqual(solution["status"], "solved")
        self.assertEqual(solution["run"]["seed"], 1)
        self.assertTrue(self.tendril_json("verify", "plan/solution.json")["valid"])
        self.assertTrue(self.tendril_json("replay", "plan/solution.json")["reproduced"])

    def test_the_double_funnel_is_planned_from_across_to_across(self):
        summary = self.plan(DOUBLE_FUNNEL, "--seed", 1, "--time-limit", 120)
        self.assertGreater(summary["verification"]["smallest_clearance_m"], 0)
        nodes = self.solution()["trajectory"]["nodes"]
        for found, expected in zip(nodes[0], range(41)):
            self.assertLess(math.dist(found[:3], (-2, -0.5 + expected / 40, 0)), 2e-3)
        self.assertLess(math.dist(nodes[-1][0][:3], (2, -0.5, 0)), 0.05)
        self.assertLess(math.dist(nodes[-1][-1][:3], (2, 0.5, 0)), 0.05)
        in_tunnel = [math.hypot(y, z) for state in nodes for x, y, z, *_ in state if abs(x) < 1]
        self.assertGreater(len(in_tunnel), 0)
        self.assertLess(max(in_tunnel), 0.03 / math.cos(math.pi / 19) - 0.01)
        self.assertTrue(self.tendril_json("verify", "plan/solution.json")["valid"])
        self.assertTrue(self.tendril_json("replay", "plan/solution.json")["reproduced"])

    def test_quantities_of_a_plan_belong_to_its_states_and_change_nothing_else(self):
        self.plan(DOUBLE_FUNNEL, folder="plain")
        summary = self.plan(DOUBLE_FUNNEL, "--quantities")
        plain, solution = self.solution("plain"), self.solution()
        found = solution.pop("quantities")
        self.assertEqual(found, summary["quantities"])
        self.assertEqual(solution["trajectory"], plain["trajectory"])
        self.assertEqual(solution.keys(), plain.keys())
        times = solution["trajectory"]["time_s"]
        self.assertEqual([times[k] for k in found["state"]], found["time_s"])
        self.assertEqual(found["state"][-1], len(times) - 1)
        self.assertGreaterEqual(min(found["clearance_m"]), summary["verification"]["smallest_clearance_m"])
        self.assertTrue(any(found["contacts"]))
        self.assertTrue(self.tendril_json("verify", "plan/solution.json")["valid"])
        self.assertTrue(self.tendril_json("replay", "plan/solution.json")["reproduced"])

    def test_the_same_seed_gives_the_same_bytes_whatever_the_threads(self):
        texts = []
        for folder, threads in (("a", 1), ("b", 1), ("c", 2)):
            self.plan(DOUBLE_FUNNEL, "--seed", 3, "--threads", threads, folder=folder)
            texts.append(self.bytes_of(folder))
        self.assertEqual(texts[0], texts[1])
        self.assertEqual(texts[0], texts[2])

    def bytes_of(self, folder):
        text = (self.folder / folder / "solution.json").read_text()
        return re.sub(r'"(wall_time_s|cpu_time_s|threads)": *[0-9.e+-]+', r'"\1":0', text)

    def test_to_improve_for_no_time_changes_nothing(self):
        self.plan(DOUBLE_FUNNEL, folder="plain")
        summary = self.plan(DOUBLE_FUNNEL, "--optimize", 0, folder="zero")
        self.assertNotIn("optimization", summary)
        self.assertEqual(self.bytes_of("plain"), self.bytes_of("zero"))

    def assert_never_worse(self, summary):
        found = summary["optimization"]
        self.assertGreater(found["candidates"], 0)
        for key, before in found["before"].items():
            self.assertLessEqual(found["after"][key], before, key)
        self.assertEqual(summary["motion_time_s"], found["after"]["motion_time_s"])
        self.assertTrue(self.tendril_json("verify", "plan/solution.json")["valid"])
        self.assertTrue(self.tendril_json("replay", "plan/solution.json")["reproduced"])

    def test_an_improved_plan_is_verified_and_no_worse_in_any_number(self):
        summary = self.plan(DOUBLE_FUNNEL, "--optimize", 2, "--quantities")
        self.assert_never_worse(summary)
        for key in ("largest_gripper_force_n", "largest_contact_force_n"):
            self.assertEqual(summary["optimization"]["after"][key], summary["extremes"][key]["value"])

    def test_ctrl_c_while_improving_keeps_the_plan(self):
        process = subprocess.Popen([TENDRIL, "plan", str(DOUBLE_FUNNEL), "-o", "plan", "--json", "--optimize", "1000"],
                                   cwd=self.folder, stdout=subprocess.PIPE, text=True)
        while NoPlan.processor_seconds(process) < 5:  # planning takes a tenth of that
            time.sleep(0.1)
        process.send_signal(signal.SIGINT)
        stdout, _ = process.communicate()
        self.assertEqual(process.returncode, 0)
        summary = json.loads(stdout)
        self.assertEqual(summary["status"], "solved")
        self.assert_never_worse(summary)

    def test_another_seed_gives_another_plan(self):
        plans = set()  # two seeds may come by the same way: the first thing tried is the goal
        for seed in range(1, 5):
            self.plan(DOUBLE_FUNNEL, "--seed", seed, folder=str(seed))
            plans.add(str(self.solution(str(seed))["trajectory"]))
        self.assertGreater(len(plans), 2)

    def test_the_default_folder_is_named_after_the_scenario(self):
        self.tendril("plan", FREE_SPACE)
        self.assertTrue((self.folder / "out" / "free-space" / "solution.json").is_file())
        self.assertTrue((self.folder / "out" / "free-space" / "view.html").is_file())

    def test_a_moved_solution_is_verified_with_the_scenario_named(self):
        scenario = self.variant(FREE_SPACE)
        self.plan(scenario)
        self.write("elsewhere/place", "")
        shutil.move(scenario, self.folder / "elsewhere" / "moved.yaml")
        shutil.move(self.folder / "plan" / "solution.json", self.folder / "solution.json")
        found = self.tendril_json("verify", "solution.json", "--scenario", "elsewhere/moved.yaml")
        self.assertTrue(found["valid"])

    def test_the_page_is_written_where_asked_and_needs_nothing_else(self):
        self.plan(FREE_SPACE)
        first = (self.folder / "plan" / "view.html").read_bytes()
        self.tendril("view", "plan/solution.json", "-o", "pages/page.html")
        self.assertEqual((self.folder / "pages" / "page.html").read_bytes(), first)
        self.assertNotRegex(first.decode(), r'<(script|link|img)[^>]*(src|href)="(?!data:)')
        (self.folder / "plan" / "view.html").unlink()
        self.tendril("view", "plan/solution.json")
        self.assertEqual((self.folder / "plan" / "view.html").read_bytes(), first)


class Verify(Case):
    def planned(self):
        self.tendril("plan", DOUBLE_FUNNEL, "-o", "plan", "--seed", 1)
        return json.loads((self.folder / "plan" / "solution.json").read_text())

    def assert_invalid(self, solution, check):
        self.write("plan/solution.json", json.dumps(solution))
        report = self.tendril_json("verify", "plan/solution.json", expect=NO)
        self.assertFalse(report["valid"])
        self.assertIn(check, [c["name"] for c in report["checks"] if not c["passed"]])
        stdout, _ = self.tendril("verify", "plan/solution.json", expect=NO)
        self.assertIn("FAIL " + check, stdout)

    def test_a_node_moved_into_the_tunnels_wall_is_found(self):
        solution = self.planned()
        node = next(node for state in solution["trajectory"]["nodes"] for node in state if abs(node[0]) < 0.9)
        node[1] = 0.03  # on the wall
        self.assert_invalid(solution, "clearance")

    def test_a_plan_that_stops_halfway_misses_the_goal(self):
        solution = self.planned()
        half = len(solution["trajectory"]["time_s"]) // 2
        for key, values in solution["trajectory"].items():
            solution["trajectory"][key] = values[:half]
        end = solution["trajectory"]["time_s"][-1]
        solution["controls"] = [c for c in solution["controls"] if c["start_s"] < end]
        solution["controls"][-1]["end_s"] = end
        self.assert_invalid(solution, "goal")

    def test_a_changed_mesh_is_refused(self):
        meshes = self.folder / "meshes"
        shutil.copytree(DOUBLE_FUNNEL.parent / "meshes", meshes)
        shutil.copy(DOUBLE_FUNNEL, self.folder / "funnel.yaml")
        self.tendril("plan", "funnel.yaml", "-o", "plan")
        with (meshes / "double-funnel.obj").open("a") as mesh:
            mesh.write("# changed\n")
        for command in ("verify", "replay", "view"):
            self.assert_refused(command, "plan/solution.json", saying=["double-funnel.obj", "sha256"])


class NoPlan(Case):
    """Stopping is timed in processor seconds: the planner runs in one thread, and other tests may run beside it."""

    def start(self, *arguments):
        scenario = self.variant(DOUBLE_FUNNEL, *BLOCKED)
        return subprocess.Popen([TENDRIL, "plan", str(scenario), "-o", "plan", "--json", *arguments], cwd=self.folder,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    @staticmethod
    def processor_seconds(process):
        fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def finish(self, process, status):
        """Processor seconds of the whole run, which must end as `status` with a motion that replays."""
        stdout, stderr = process.stdout.read(), process.stderr.read()
        _, code, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(code)
        process.stdout.close()
        process.stderr.close()
        self.assertEqual(process.returncode, NO, stderr)
        self.assertEqual(stderr, "")  # progress goes to terminals only
        summary = json.loads(stdout)
        self.assertEqual(summary["status"], status)
        self.assertFalse(summary["verified"])
        self.assertEqual(json.loads((self.folder / "plan" / "solution.json").read_text())["status"], status)
        self.assertTrue((self.folder / "plan" / "view.html").is_file())
        self.assertTrue(self.tendril_json("replay", "plan/solution.json")["reproduced"])
        return usage.ru_utime + usage.ru_stime

    def test_a_blocked_rod_is_said_to_be_stuck_in_the_mouth_of_the_tunnel(self):
        scenario = self.variant(DOUBLE_FUNNEL, *BLOCKED, ("\ngoal:", "\nplanner: {extend_limit: 60}\ngoal:"))
        summary = self.tendril_json("plan", scenario, "-o", "plan", expect=NO)
        self.assertEqual(summary["status"], "iteration_limit")
        shortfall = summary["shortfall"]
        solution = json.loads((self.folder / "plan" / "solution.json").read_text())
        self.assertEqual(solution["shortfall"], shortfall)
        last = solution["trajectory"]["nodes"][-1]
        goal = [(2, -0.5 + i / 40, 0) for i in range(41)]
        distances = [math.dist(node[:3], target) for node, target in zip(last, goal)]
        self.assertAlmostEqual(shortfall["distance_m"], sum(distances) / 41, 4)
        self.assertAlmostEqual(shortfall["largest_distance_m"], max(distances), 4)
        for found, expected in zip(shortfall["end_distance_m"], (distances[0], distances[-1])):
            self.assertAlmostEqual(found, expected, 4)

        stdout, _ = self.tendril("plan", scenario, "-o", "again", expect=NO)
        self.assertIn("No plan was found in ", stdout)
        self.assertIn("Try a larger planner.extend_limit", stdout)
        self.assertIn(f"{shortfall['distance_m']:.3g} m from the goal's shape on average", stdout)
        self.assertIn("Shown is the motion that came nearest to the goal", (self.folder / "again" / "view.html").read_text())

    def test_the_time_limit_is_kept_and_the_nearest_motion_written(self):
        self.assertLess(self.finish(self.start("--time-limit", "2"), "time_limit"), 2 + 3)

    def test_ctrl_c_writes_what_there_is_and_calls_it_cancelled(self):
        process = self.start()
        time.sleep(1.5)
        before = self.processor_seconds(process)
        process.send_signal(signal.SIGINT)
        self.assertLess(self.finish(process, "cancelled") - before, 3)


if __name__ == "__main__":
    unittest.main()
