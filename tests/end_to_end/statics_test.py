"""`equilibrium` and `sample` against closed forms, from what the program prints alone."""
import math
import unittest

from program import DOUBLE_FUNNEL, FREE_SPACE, NO, Case

# The rod of both scenarios: L = 1 m, r = 0.01 m, E = 5e7 Pa, nu = 0.4.
AREA, INERTIA = math.pi * 0.01**2, math.pi * 0.01**4 / 4
EI, EA, GA = 5e7 * INERTIA, 5e7 * AREA, 5e7 / 2.8 * AREA


class EquilibriumCommand(Case):
    def wrench(self, *numbers, expect=0):
        return self.tendril_json("equilibrium", FREE_SPACE, "--wrench", *numbers, expect=expect)["samples"]

    def test_an_end_moment_bends_the_rod_into_an_arc_that_begins_at_the_start_pose(self):
        (arc,) = self.wrench(0, 0, 2 * EI, 0, 0, 0)
        self.assertTrue(arc["stable"])
        self.assertIsNone(arc["first_conjugate_t"])
        self.assertAlmostEqual(arc["energy_j"], 2 * EI, delta=1e-6)  # (2 EI)^2 / 2 EI
        self.assertEqual(arc["base"]["position_m"], [-0.5, 0, 0])
        for found, expected in zip(arc["end"]["position_m"], (-0.5 + math.sin(2) / 2, (1 - math.cos(2)) / 2, 0)):
            self.assertAlmostEqual(found, expected, delta=1e-5)
        for found, expected in zip(arc["end"]["orientation_wxyz"], (math.cos(1), 0, 0, math.sin(1))):
            self.assertAlmostEqual(found, expected, delta=1e-5)
        self.assertEqual(len(arc["nodes"]), 41)
        self.assertEqual(arc["nodes"][-1], arc["end"]["position_m"] + arc["end"]["orientation_wxyz"])

    def test_a_rod_compressed_beyond_its_buckling_load_is_an_equilibrium_but_not_stable(self):
        (rod,) = self.wrench(0, 0, 0, -60 * EI, 0, 0)
        self.assertFalse(rod["stable"])
        p = 60 * EI
        w = math.sqrt(p * (1 - p / EA + p / GA) / EI)
        self.assertAlmostEqual(rod["first_conjugate_t"], 2 * math.pi / w, delta=1e-5)

    def test_an_inverted_rod_is_no_equilibrium(self):
        self.assertEqual(self.wrench(0, 0, 0, -2 * EA, 0, 0, expect=NO), [])

    def test_the_ends_of_an_equilibrium_lead_back_to_its_wrench(self):
        wrench = [0.1, 0.3, 0.6, -1.0, 0.5, 0.8]
        (rod,) = self.wrench(*wrench)
        ends = [x for pose in (rod["base"], rod["end"]) for x in pose["position_m"] + pose["orientation_wxyz"]]
        found = self.tendril_json("equilibrium", FREE_SPACE, "--ends", *ends)["samples"]
        self.assertTrue(all(sample["stable"] for sample in found))
        self.assertEqual([s["energy_j"] for s in found], sorted(s["energy_j"] for s in found))
        nearest = min(found, key=lambda sample: math.dist(sample["wrench"], wrench))
        self.assertLess(math.dist(nearest["wrench"], wrench), 1e-4)

    def test_ends_farther_apart_than_any_rod_reaches_have_no_equilibrium(self):
        found = self.tendril_json("equilibrium", FREE_SPACE, "--ends", 0, 0, 0, 1, 0, 0, 0, 50, 0, 0, 1, 0, 0, 0, expect=NO)
        self.assertEqual(found, {"samples": []})

    def test_numbers_that_make_no_sense_are_refused(self):
        self.assert_refused("equilibrium", FREE_SPACE, "--wrench", 0, 0, "nan", 0, 0, 0, saying=["--wrench"])
        self.assert_refused("equilibrium", FREE_SPACE, "--ends", 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0,
                            saying=["--ends", "first", "2"])

    def test_neither_start_nor_goal_is_needed(self):
        text = FREE_SPACE.read_text()
        file = self.write("rod.yaml", text[:text.index("start:")])
        rod = self.tendril_json("equilibrium", file, "--wrench", 0, 0, 0, 0, 0, 0)["samples"][0]
        self.assertEqual(rod["base"], {"position_m": [0, 0, 0], "orientation_wxyz": [1, 0, 0, 0]})
        self.tendril("sample", file, "--count", 1)


class SampleCommand(Case):
    def sample(self, *arguments, expect=0):
        return self.tendril_json("sample", DOUBLE_FUNNEL, *arguments, expect=expect)["samples"]

    def test_samples_are_stable_inside_the_workspace_and_clear_of_the_plates(self):
        samples = self.sample("--count", 30, "--nodes")
        self.assertEqual(len(samples), 30)
        for sample in samples:
            self.assertTrue(sample["stable"])
            self.assertIsNone(sample["first_conjugate_t"])
            self.assertGreater(sample["energy_j"], 0)
            self.assertEqual(sample["nodes"][0], sample["base"]["position_m"] + sample["base"]["orientation_wxyz"])
            self.assertEqual(sample["nodes"][-1], sample["end"]["position_m"] + sample["end"]["orientation_wxyz"])
            self.assertEqual(len(sample["nodes"]), 41)
            for x, y, z, *_ in sample["nodes"]:
                self.assertTrue(abs(x) <= 2.8 and abs(y) <= 1 and abs(z) <= 1)
            for a, b in zip(sample["nodes"], sample["nodes"][1:]):
                for plate in (-1.5, 1.5):
                    if min(a[0], b[0]) < plate + 0.01 and max(a[0], b[0]) > plate - 0.01:
                        self.assertLess(min(math.hypot(*a[1:3]), math.hypot(*b[1:3])), 0.51)

    def test_nodes_are_given_only_when_asked_for(self):
        self.assertNotIn("nodes", self.sample("--count", 1)[0])

    def test_the_same_seed_gives_the_same_samples_and_another_seed_others(self):
        self.assertEqual(self.sample("--count", 5, "--seed", 7), self.sample("--count", 5, "--seed", 7))
        self.assertNotEqual(self.sample("--count", 5, "--seed", 7), self.sample("--count", 5, "--seed", 8))

    def test_a_workspace_with_no_room_gives_fewer_than_asked(self):
        file = self.variant(FREE_SPACE, ("{min: [-2, -2, -2], max: [2, 2, 2]}", "{min: [-2, -2, -2], max: [2, 2, -1.999]}"))
        text = file.read_text().replace("[-0.5, 0, 0]", "[-0.5, 0, -1.9995]")
        file.write_text(text[:text.index("goal:")])
        found = self.tendril_json("sample", file, "--count", 3, expect=NO)["samples"]
        self.assertLess(len(found), 3)


if __name__ == "__main__":
    unittest.main()
