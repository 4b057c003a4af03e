"""Every committed scenario is accepted, and so is its way back: both ends are stable equilibria that touch nothing."""
import json
import sys
import unittest

from program import NO, ROOT, Case

sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "scripts"))
import exchange_start_goal

SCENARIOS = sorted(file for file in (ROOT / "scenarios").glob("*.yaml") if not file.stem.endswith("-reversed"))


class Scenarios(Case):
    def accepted(self, text):
        """The scenario as the program read and accepted it; it gets no time to plan."""
        file = self.write("scenario.yaml", text.replace("file: meshes/", f"file: {ROOT}/scenarios/meshes/"))
        self.tendril("plan", file, "--time-limit", "1e-3", "-o", "plan", expect=NO)
        return json.loads((self.folder / "plan" / "solution.json").read_text())["scenario"]

    def test_start_and_goal_are_accepted_and_so_are_the_two_exchanged_with_nothing_else_changed(self):
        for file in SCENARIOS:
            with self.subTest(file.stem):
                there = self.accepted(file.read_text())
                back = self.accepted(exchange_start_goal.exchanged(file.read_text()))
                tolerance = there["goal"].pop("tolerance")
                self.assertEqual(back["goal"].pop("tolerance"), tolerance)
                self.assertEqual((back["start"], back["goal"]), (there["goal"], there["start"]))
                for scenario in (there, back):
                    for key in ("start", "goal", "sha256"):
                        del scenario[key]
                self.assertEqual(back.pop("name"), there.pop("name") + "-reversed")
                self.assertEqual(back, there)

    def test_what_has_no_start_or_goal_is_not_exchanged(self):
        with self.assertRaisesRegex(ValueError, "start"):
            exchange_start_goal.exchanged("name: x\ngoal:\n  pose: {}\n")


if __name__ == "__main__":
    unittest.main()
