"""`simulate`: runs controls, writes a solution that replays bit for bit, refuses bad controls."""
import json
import math
import unittest

from program import DOUBLE_FUNNEL, FREE_SPACE, Case

TARGET = {"position_m": [0.2, 0.3, 0.1], "orientation_wxyz": [math.cos(0.4), 0, 0, math.sin(0.4)]}
MOVE_LAST = [
    {"start_s": 0.0, "end_s": 1.0, "moving": "last", "held": ["first", "last"], "target": TARGET},
    {"start_s": 1.0, "end_s": 1.2, "moving": None, "held": ["first"]},
]


class Simulate(Case):
    def simulate(self, controls=None, scenario=FREE_SPACE):
        self.write("controls.json", json.dumps({"controls": controls or MOVE_LAST}))
        summary = self.tendril_json("simulate", scenario, "--controls", "controls.json", "-o", "run")
        self.assertEqual(summary["status"], "simulated")
        self.assertTrue((self.folder / "run" / "view.html").is_file())
        return json.loads((self.folder / "run" / "solution.json").read_text())

    def test_the_moving_end_arrives_the_held_end_stays_and_the_times_cover_the_controls(self):
        solution = self.simulate()
        self.assertEqual(solution["status"], "simulated")
        time, nodes = solution["trajectory"]["time_s"], solution["trajectory"]["nodes"]
        self.assertEqual(time[0], 0)
        self.assertAlmostEqual(time[-1], 1.2, delta=1e-9)
        self.assertTrue(all(a < b for a, b in zip(time, time[1:])))
        arrived = max(k for k, t in enumerate(time) if t <= 1.0 + 1e-9)
        self.assertLess(math.dist(nodes[arrived][-1][:3], TARGET["position_m"]), 0.02)
        for state in nodes:
            self.assertLess(math.dist(state[0][:3], nodes[0][0][:3]), 0.02)
        held = solution["trajectory"]["held"]
        self.assertEqual(held[1], ["first", "last"])
        self.assertEqual(held[-1], ["first"])

    def test_the_solution_replays_bit_for_bit_from_any_folder(self):
        self.simulate()
        self.assertTrue(self.tendril_json("replay", self.folder / "run" / "solution.json")["reproduced"])
        self.folder = self.folder / "run"
        self.assertTrue(self.tendril_json("replay", "solution.json")["reproduced"])

    def test_a_run_through_contact_replays_bit_for_bit(self):
        # The rod is pulled broadside against the left plate and along it.
        target = {"position_m": [-1.3, 0.6, 0.7], "orientation_wxyz": [math.sqrt(0.5), 0, 0, math.sqrt(0.5)]}
        start = ("position_m: [-2, -0.5, 0]", "position_m: [-1.7, -0.5, 0.7]")
        scenario = self.variant(DOUBLE_FUNNEL, start)
        solution = self.simulate([{"start_s": 0.0, "end_s": 0.6, "moving": "last", "held": ["last"], "target": target}], scenario)
        self.assertLess(max(node[0] for state in solution["trajectory"]["nodes"] for node in state), -1.51 + 1e-8)
        self.assertTrue(self.tendril_json("replay", "run/solution.json")["reproduced"])

    def test_a_changed_number_is_not_reproduced(self):
        solution = self.simulate()
        k = len(solution["trajectory"]["nodes"]) // 2
        solution["trajectory"]["nodes"][k][7][1] += 1e-15
        self.write("run/solution.json", json.dumps(solution))
        found = self.tendril_json("replay", "run/solution.json", expect=1)
        self.assertFalse(found["reproduced"])
        self.assertIn(f"state {k}", found["first_difference"])
        self.assertIn("node 7", found["first_difference"])

    def test_quantities_are_in_the_solution_and_the_summary_only_when_asked_for(self):
        plain = self.simulate()
        self.assertNotIn("quantities", plain)
        scenario = self.variant(FREE_SPACE, ("gravity_m_s2: [0, 0, 0]", "gravity_m_s2: [0, 0, -9.81]"))
        self.write("controls.json", json.dumps({"controls": [
            {"start_s": 0.0, "end_s": 10.0, "moving": None, "held": ["first", "last"], "target": None}]}))
        run = ["simulate", scenario, "--controls", "controls.json", "--quantities"]
        summary = self.tendril_json(*run, "-o", "run")
        solution = json.loads((self.folder / "run" / "solution.json").read_text())
        found, times = solution["quantities"], solution["trajectory"]["time_s"]
        self.assertEqual(found, summary["quantities"])
        self.assertEqual([times[k] for k in found["state"]], found["time_s"])
        self.assertEqual(len(found["time_s"]), 500)
        for key, values in found.items():
            self.assertEqual(len(values), 500, key)

        # At rest the grippers carry the weight together and pull against each other.
        weight = 9.81 * 1000 * math.pi * 0.01**2
        first, last = found["gripper_force_n"][-1]
        for axis, expected in enumerate((0, 0, weight)):
            self.assertAlmostEqual(first[axis] + last[axis], expected, delta=1e-4 * weight)
        radius = summary["extremes"]["smallest_bend_radius_m"]
        self.assertEqual(radius["value"], min(r for r in found["bend_radius_m"] if r))
        self.assertEqual(found["clearance_m"], [None] * 500)
        parts = [key for key in found if key.startswith("energy_") and key != "energy_total_j"]
        self.assertAlmostEqual(sum(found[key][-1] for key in parts), found["energy_total_j"][-1], delta=1e-12)

        self.assertTrue(self.tendril_json("verify", "run/solution.json")["valid"])
        self.assertTrue(self.tendril_json("replay", "run/solution.json")["reproduced"])
        self.tendril("view", "run/solution.json", "-o", "page.html")
        self.assertEqual(self.tendril_json(*run, "-o", "again")["quantities"], summary["quantities"])
        text, _ = self.tendril(*run, "-o", "run")
        self.assertIn("smallest_bend_radius_m", text)

    def test_bad_controls_are_refused(self):
        first = MOVE_LAST[0]
        for bad, word in (({**first, "held": ["first"]}, "moving"), ({**first, "start_s": 0.5}, "start_s"),
                          ({**first, "end_s": 0.0}, "end_s"), ({**first, "end_s": 0.99}, "0.02"),
                          ({**first, "moving": "middle"}, "middle"), ({**first, "targets": TARGET}, "targets"),
                          ({**first, "held": []}, "held")):
            with self.subTest(word):
                self.write("controls.json", json.dumps({"controls": [bad]}))
                self.assert_refused("simulate", FREE_SPACE, "--controls", "controls.json", "-o", "run", saying=[word])

    def test_missing_controls_are_named(self):
        self.assert_refused("simulate", FREE_SPACE, "--controls", "none.json", saying=["none.json"])


if __name__ == "__main__":
    unittest.main()
