"""Usage and bad input: exit status 2, what, where and what to do on standard error, and nothing written."""
import unittest

from program import BAD_INPUT, DOUBLE_FUNNEL, FREE_SPACE, Case

COMMANDS = ["plan", "verify", "replay", "view", "sample", "equilibrium", "simulate"]


class Usage(Case):
    def test_help_of_every_command_has_an_example(self):
        for command in COMMANDS:
            stdout, _ = self.tendril(command, "--help")
            self.assertIn(f"tendril {command} ", stdout)
            self.assertIn("Example", stdout)

    def test_help_names_every_command(self):
        stdout, _ = self.tendril("--help")
        for command in COMMANDS:
            self.assertIn(f"  {command} ", stdout)

    def test_version_is_one_line(self):
        self.assertRegex(self.tendril("--version")[0], r"^tendril \d+\.\d+\.\d+\n$")

    def test_wrong_usage_is_refused(self):
        for arguments in ([], ["plans"], ["plan"], ["plan", FREE_SPACE, "--sed", "1"], ["plan", FREE_SPACE, "--seed", "-1"],
                          ["plan", FREE_SPACE, "--seed", "one"], ["plan", FREE_SPACE, "--time-limit", "0"],
                          ["plan", FREE_SPACE, "--time-limit", "nan"], ["plan", FREE_SPACE, "--threads", "0"],
                          ["sample", FREE_SPACE], ["sample", FREE_SPACE, "--count", "0"], ["equilibrium", FREE_SPACE],
                          ["equilibrium", FREE_SPACE, "--wrench", "1", "2", "3"],
                          ["equilibrium", FREE_SPACE, "--wrench", *"000000", "--ends", *"00010000001000"],
                          ["simulate", FREE_SPACE]):
            with self.subTest(arguments):
                self.assert_refused(*arguments)


class BadScenario(Case):
    def assert_plan_refuses(self, *replacements, saying, scenario=FREE_SPACE):
        file = self.variant(scenario, *replacements)
        self.assert_refused("plan", file, "-o", self.folder / "plan", saying=saying)
        return file

    def test_a_missing_file_is_named(self):
        self.assert_refused("plan", "nowhere.yaml", saying=["nowhere.yaml"])

    def test_unknown_key_names_the_file_the_line_and_the_nearest_key(self):
        line = 1 + FREE_SPACE.read_text().splitlines().index("grippers:")
        self.assert_plan_refuses(("grippers:\n", "gripers:\n"), saying=[f"variant.yaml:{line}", "gripers", "grippers"])

    def test_a_bad_value_names_its_key_and_what_it_must_be(self):
        self.assert_plan_refuses(("radius_m: 0.01", "radius_m: -0.01"), saying=["variant.yaml:6", "radius_m", "-0.01"])

    def test_a_missing_key_is_named(self):
        self.assert_plan_refuses(("  length_m: 1.0\n", ""), saying=["variant.yaml", "length_m"])

    def test_a_quaternion_that_is_not_unit_is_refused(self):
        self.assert_plan_refuses(("[1, 0, 0, 0]", "[1, 0.1, 0, 0]"), saying=["orientation_wxyz"])

    def test_text_that_is_not_yaml_is_refused(self):
        self.write("variant.yaml", "rod: [1, 2\n")
        self.assert_refused("plan", "variant.yaml", saying=["variant.yaml"])

    def test_a_missing_mesh_is_named(self):
        self.assert_plan_refuses(("double-funnel.obj", "funnel.obj"), scenario=DOUBLE_FUNNEL, saying=["funnel.obj"])

    def test_a_start_in_contact_says_where_and_how_deep(self):
        # Across the left plate, 0.7 off the axis.
        self.assert_plan_refuses(("[-2, -0.5, 0]", "[-1.5, -0.5, 0.7]"), scenario=DOUBLE_FUNNEL,
                                 saying=["start", "node", "face", "mm"])

    def test_an_unstable_start_is_refused(self):
        # Compressed by twice the buckling load of clamped ends, 4 pi^2 EI/L^2 = 15.5 N.
        self.assert_plan_refuses(("wrench: [0, 0, 0, 0, 0, 0]", "wrench: [0, 0, 0, -31, 0, 0]"),
                                 saying=["start", "stable"])

    def test_plan_needs_a_goal(self):
        text = FREE_SPACE.read_text()
        self.write("variant.yaml", text[:text.index("goal:")])
        self.assert_refused("plan", "variant.yaml", saying=["goal"])

    def test_an_unknown_planner_is_named_with_the_nearest(self):
        self.assert_refused("plan", FREE_SPACE, "--planner", "tendrill", saying=["tendrill", "tendril"])

    def test_an_output_folder_that_cannot_be_made_is_refused_before_planning(self):
        file = self.write("file", "")
        self.assert_refused("plan", FREE_SPACE, "-o", file / "out", saying=[file])


class BadSolution(Case):
    def test_a_missing_solution_is_named(self):
        for command in ("verify", "replay", "view"):
            self.assert_refused(command, "nowhere.json", saying=["nowhere.json"])

    def test_text_that_is_not_a_solution_is_refused(self):
        for text in ("", "{", "[]", "{}", '{"tendril_solution": 2}'):
            self.write("solution.json", text)
            for command in ("verify", "replay", "view"):
                self.assert_refused(command, "solution.json", saying=["solution.json"])


if __name__ == "__main__":
    unittest.main()
