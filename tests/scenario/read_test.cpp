#include <cmath>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "example.h"

namespace tendril {
namespace {

using test::changed;
using test::kExample;
using test::messageFor;

TEST(Scenario, DefaultsFollowFromTheRod) {
  const Scenario s = parseScenario(kExample, "scenarios/a.yaml");
  const double bending = 5e7 * std::numbers::pi * 1e-8 / 4;  // EI of a round rod of radius 0.01
  EXPECT_NEAR(s.grippers.max_force, 200 * bending / 4, 1e-12);
  EXPECT_NEAR(s.grippers.max_torque, 10 * bending / 2, 1e-12);
  EXPECT_DOUBLE_EQ(s.simulation.contact_distance, 0.001);
  EXPECT_DOUBLE_EQ(s.goal->position_tolerance, 0.1);
  EXPECT_FALSE(s.goal->angle_tolerance);
  EXPECT_FALSE(s.goal->shape_tolerance);
  EXPECT_TRUE(s.simulation.inertia);
  EXPECT_EQ(s.simulation.scheme, Scheme::implicit_euler);
  EXPECT_DOUBLE_EQ(s.simulation.time_step, 0.02);
  EXPECT_DOUBLE_EQ(s.simulation.drag, 2.0);
  EXPECT_DOUBLE_EQ(s.simulation.stiffness_damping, 0.002);
  EXPECT_FALSE(s.rod.self_contact);
  EXPECT_EQ(s.summary, "");
}

TEST(Scenario, EveryGivenValueArrives) {
  const Scenario s =
      parseScenario(kExample +
                        "simulation: {inertia: false, scheme: second_order, time_step_s: 0.01,\n"
                        "  drag_1_s: 3, stiffness_damping_s: 0, contact_distance_m: 1e-3}\n"
                        "summary: 'two words'\n",
                    "scenarios/a.yaml");
  EXPECT_EQ(s.name, "example");
  EXPECT_EQ(s.summary, "two words");
  EXPECT_EQ(s.rod.length, 2.0);
  EXPECT_EQ(s.rod.radius, 0.01);
  EXPECT_EQ(s.rod.density, 1000);
  EXPECT_EQ(s.rod.elements, 40);
  ASSERT_EQ(s.environment.meshes.size(), 1u);
  EXPECT_EQ(s.environment.meshes[0].file, "meshes/box.obj");
  EXPECT_EQ(s.environment.meshes[0].scale, 0.5);
  EXPECT_EQ(s.environment.workspace.min, Vector3(-2, -1, -1));
  EXPECT_EQ(s.environment.workspace.max, Vector3(2, 1, 1));
  EXPECT_EQ(s.environment.friction, 0.2);
  EXPECT_EQ(s.environment.gravity, Vector3(0, 0, -9.81));
  EXPECT_EQ(s.grippers.grasps, (std::vector{Grasp::both, Grasp::first}));
  EXPECT_TRUE(s.grippers.allows(Grasp::first));
  EXPECT_FALSE(s.grippers.allows(Grasp::last));
  EXPECT_EQ(s.grippers.max_speed, 1.0);
  EXPECT_EQ(s.grippers.max_turn, 4.0);
  EXPECT_EQ(std::get<PoseAndWrench>(*s.start).wrench[2], 0.1);
  EXPECT_EQ(std::get<GripperPoses>(s.goal->placement).last.position, Vector3(1, 0, 1));
  EXPECT_EQ(std::get<GripperPoses>(s.goal->placement).last.rotation.x(), 1.0);
  EXPECT_FALSE(s.simulation.inertia);
  EXPECT_EQ(s.simulation.scheme, Scheme::second_order);
  EXPECT_EQ(s.simulation.time_step, 0.01);
  EXPECT_EQ(s.simulation.drag, 3.0);
  EXPECT_EQ(s.simulation.stiffness_damping, 0.0);
  EXPECT_EQ(s.simulation.contact_distance, 1e-3);
}

TEST(Scenario, ADampingRatioAtAFrequencyIsTheRayleighDampingOfAVibration) {
  // m x'' + beta k x' + k x = 0: the ratio is beta omega / 2.
  const Scenario s =
      parseScenario(kExample +
                        "simulation: {damping: {ratio: 0.05, frequency_hz: 2}, newton_iterations: 2,\n"
                        "  newton_tolerance: 0.01, step_tolerance_m: 1e-3}\n",
                    "scenarios/a.yaml");
  EXPECT_NEAR(s.simulation.stiffness_damping * 2 * std::numbers::pi * 2 / 2, 0.05, 1e-15);
  EXPECT_EQ(s.simulation.newton_iterations, 2);
  EXPECT_EQ(s.simulation.newton_tolerance, 0.01);
  EXPECT_EQ(s.simulation.step_tolerance, 1e-3);
  EXPECT_NE(messageFor(kExample + "simulation: {damping: {ratio: 0.05, frequency_hz: 2}, "
                                  "stiffness_damping_s: 0.01}\n")
                .find("exclude each other"),
            std::string::npos);
}

TEST(Scenario, StiffnessFollowsFromModuliAsInSection23) {
  const Vector6 c = parseScenario(kExample, "a.yaml").rod.c;
  const double r = 0.01, pi = std::numbers::pi, e = 5e7, g = e / 2.8;
  Vector6 expected;
  expected << g * pi * std::pow(r, 4) / 2, e * pi * std::pow(r, 4) / 4, e * pi * std::pow(r, 4) / 4,
      e * pi * r * r, g * pi * r * r, g * pi * r * r;
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(c[i], expected[i], 1e-14 * expected[i]) << i;

  const Vector6 with_g =
      parseScenario(changed("poisson_ratio: 0.4", "shear_modulus_pa: 1e7\n  shear_correction: 0.9"), "a.yaml")
          .rod.c;
  EXPECT_NEAR(with_g[4], 0.9 * 1e7 * pi * r * r, 1e-9);
  EXPECT_NEAR(with_g[0], 1e7 * pi * std::pow(r, 4) / 2, 1e-12);
}

TEST(Scenario, StiffnessMayBeGivenInsteadOfModuli) {
  const Scenario s = parseScenario(
      changed("young_modulus_pa: 5.0e7\n  poisson_ratio: 0.4",
              "stiffness: {torsion_n_m2: 1, bending_n_m2: [2, 3], axial_n: 4, shear_n: [5, 6]}"),
      "a.yaml");
  Vector6 expected;
  expected << 1, 2, 3, 4, 5, 6;
  EXPECT_EQ(s.rod.c, expected);
  EXPECT_FALSE(s.moduli);
}

TEST(Scenario, RestCurvatureIsOneForAllElementsOrOneForEach) {
  const auto rodWith = [](const std::string& curvature) {
    return parseScenario(changed("elements: 40", "elements: 4\n  rest_curvature_1_m: " + curvature), "a.yaml")
        .rod;
  };
  const RodProperties one = rodWith("[1, -2, 2]");
  ASSERT_EQ(one.rest_curvature.size(), 1u);
  for (const int k : {0, 3}) EXPECT_EQ(one.restCurvature(k), Vector3(1, -2, 2));
  const RodProperties each = rodWith("[[0, 0, 1], [0, 2, 0], [3, 0, 0], [0, 0, -1]]");
  ASSERT_EQ(each.rest_curvature.size(), 4u);
  EXPECT_EQ(each.restCurvature(1), Vector3(0, 2, 0));
  EXPECT_EQ(each.restCurvature(3), Vector3(0, 0, -1));
  EXPECT_TRUE(parseScenario(kExample, "a.yaml").rod.rest_curvature.empty());
  // The bounds themselves: 1.5 rad for an element of 0.5 m.
  EXPECT_EQ(rodWith("[0, 0, 3]").rest_curvature.front().z(), 3);
}

TEST(Scenario, StartPoseWithoutWrenchIsABaseAndNoStart) {
  const Scenario s = parseScenario(changed("  wrench: [0, 0, 0.1, 0, 0, 0]\n", ""), "a.yaml");
  EXPECT_FALSE(s.start);
  ASSERT_TRUE(s.start_pose);
  EXPECT_EQ(s.start_pose->position, Vector3(0, 0, 0));
}

TEST(Scenario, MeshesAreFoundBesideTheFile) {
  const std::filesystem::path folder = std::filesystem::weakly_canonical(std::filesystem::current_path());
  const Scenario s = parseScenario(kExample, "some/../folder/a.yaml");
  EXPECT_EQ(s.file, folder / "folder/a.yaml");
  EXPECT_EQ(s.meshPath(s.environment.meshes[0]), folder / "folder/meshes/box.obj");
}

TEST(Scenario, TheHashIsThatOfTheBytes) {
  EXPECT_EQ(parseScenario(kExample, "a.yaml").sha256, sha256Hex(kExample));
  EXPECT_NE(parseScenario(kExample + "# a comment\n", "a.yaml").sha256, sha256Hex(kExample));
}

TEST(Scenario, NearlyUnitQuaternionsAreNormalisedAndOthersRefused) {
  const auto first = [](const std::string& wxyz) {
    const std::string text = changed("orientation_wxyz: [1, 0, 0, 0]", "orientation_wxyz: " + wxyz);
    return std::get<PoseAndWrench>(*parseScenario(text, "a.yaml").start).pose.rotation;
  };
  EXPECT_NEAR(first("[0.5, 0.5, 0.5, 0.5009]").norm(), 1.0, 1e-15);
  EXPECT_EQ(first("[0.7071067811865476, 0, 0, 0.7071067811865476]").w(), 0.7071067811865476);
  EXPECT_EQ(messageFor(changed("orientation_wxyz: [1, 0, 0, 0]", "orientation_wxyz: [1.0011, 0, 0, 0]")),
            "scenarios/a.yaml:22: start.pose.orientation_wxyz has length 1.0011; a unit quaternion [w, x, y, "
            "z] has "
            "length 1, to within 0.001.");
}

struct BadInput {
  std::string from, to, message;
};

TEST(Scenario, EveryErrorNamesFileLineKeyAndWhatToDo) {
  const std::string f = "scenarios/a.yaml:";
  const std::vector<BadInput> cases = {
      // ranges
      {"radius_m: 0.01", "radius_m: -0.005", f + "5: rod.radius_m is -0.005; a radius must be > 0."},
      {"radius_m: 0.01", "radius_m: 1.0",
       f + "5: rod.radius_m is 1.0; a radius must be < half the rod's length."},
      {"length_m: 2.0", "length_m: 0", f + "4: rod.length_m is 0; a length must be > 0."},
      {"density_kg_m3: 1000", "density_kg_m3: 0", f + "6: rod.density_kg_m3 is 0; a density must be > 0."},
      {"young_modulus_pa: 5.0e7", "young_modulus_pa: -1",
       f + "7: rod.young_modulus_pa is -1; a modulus must be > 0."},
      {"poisson_ratio: 0.4", "poisson_ratio: 0.51",
       f + "8: rod.poisson_ratio is 0.51; Poisson's ratio must be > -1 and <= 0.5."},
      {"poisson_ratio: 0.4", "poisson_ratio: -1",
       f + "8: rod.poisson_ratio is -1; Poisson's ratio must be > -1 and <= 0.5."},
      {"elements: 40", "elements: 3",
       f + "9: rod.elements is 3; it must be a whole number between 4 and 1000."},
      {"elements: 40", "elements: 1001",
       f + "9: rod.elements is 1001; it must be a whole number between 4 and 1000."},
      {"elements: 40", "elements: 40.0",
       f + "9: rod.elements is 40.0; it must be a whole number between 4 and 1000."},
      {"elements: 40", "elements: 40\n  rest_curvature_1_m: [0, 60, 80]",
       f + "10: rod.rest_curvature_1_m has length 100; times the radius it must be < 1."},
      {"elements: 40", "elements: 40\n  rest_curvature_1_m: [0, 1e300, 1e300]",
       f + "10: rod.rest_curvature_1_m has length inf; times the radius it must be < 1."},
      {"elements: 40", "elements: 40\n  rest_curvature_1_m: [0, -32, 0]",
       f + "10: rod.rest_curvature_1_m has length 32; it turns an element by 1.6 rad, and at most 1.5 is "
           "allowed; give more elements."},
      {"elements: 40",
       "elements: 4\n  rest_curvature_1_m:\n    - [0, 0, 1]\n    - [0, 0, 1]\n    - [0, 3.2, 0]\n"
       "    - [0, 0, 1]",
       f + "13: rod.rest_curvature_1_m[2] has length 3.2; it turns an element by 1.6 rad, and at most 1.5 is "
           "allowed; give more elements."},
      {"scale: 0.5", "scale: 0", f + "13: environment.meshes[0].scale is 0; a scale must be > 0."},
      {"min: [-2, -1, -1]", "min: [-2, 1, -1]",
       f + "14: environment.workspace_m.min must be < environment.workspace_m.max in x, y and z."},
      {"friction: 0.2", "friction: -0.1",
       f + "15: environment.friction is -0.1; it must be between 0 and 10."},
      {"max_speed_m_s: 1", "max_speed_m_s: 0", f + "19: grippers.max_speed_m_s is 0; a speed must be > 0."},
      {"max_turn_rad_s: 4", "max_turn_rad_s: 4\n  max_force_n: -80",
       f + "21: grippers.max_force_n is -80; a force must be > 0."},
      {"goal:", "simulation: {time_step_s: 2}\ngoal:",
       f + "24: simulation.time_step_s is 2; it must be between 1e-06 and 1."},
      {"goal:", "simulation: {drag_1_s: -1}\ngoal:", f + "24: simulation.drag_1_s is -1; drag must be >= 0."},
      {"goal:", "goal:\n  tolerance: {position_m: 0}",
       f + "25: goal.tolerance.position_m is 0; a tolerance must be > 0."},
      {"goal:", "goal:\n  tolerance: {angle_rad: 30}",
       f + "25: goal.tolerance.angle_rad is 30; an angle must be > 0 and at most pi; leave it out for any "
           "orientation."},
      {"radius_m: 0.01", "radius_m: 1e-90",
       f + "4: rod has a stiffness or a bending force EI/L^2 of 0; change the moduli, the radius or the "
           "length."},
      // types
      {"radius_m: 0.01", "radius_m: thin", f + "5: rod.radius_m is \"thin\"; it must be a number."},
      {"radius_m: 0.01", "radius_m: '0.01'", f + "5: rod.radius_m is \"0.01\"; it must be a number."},
      {"radius_m: 0.01", "radius_m:", f + "5: rod.radius_m is empty; it must be a number."},
      {"radius_m: 0.01", "radius_m: [0.01]", f + "5: rod.radius_m is a list; it must be a number."},
      {"radius_m: 0.01", "radius_m: .nan",
       f + "5: rod.radius_m is .nan; it must be a finite decimal number."},
      {"radius_m: 0.01", "radius_m: -.inf",
       f + "5: rod.radius_m is -.inf; it must be a finite decimal number."},
      {"radius_m: 0.01", "radius_m: 1e999",
       f + "5: rod.radius_m is \"1e999\"; it must be a finite decimal number."},
      {"radius_m: 0.01", "radius_m: 0x10",
       f + "5: rod.radius_m is \"0x10\"; it must be a finite decimal number."},
      {"radius_m: 0.01", "radius_m: 10 mm",
       f + "5: rod.radius_m is \"10 mm\"; it must be a finite decimal number."},
      {"name: example", "name: 7", f + "2: name is 7; it must be text; put it in quotes."},
      {"name: example", "name: ''", f + "2: name is \"\"; it must not be."},
      {"elements: 40", "elements: 40\n  self_contact: yes",
       f + "10: rod.self_contact is \"yes\"; it must be true or false."},
      {"elements: 40", "elements: 40\n  rest_curvature_1_m: 2",
       f + "10: rod.rest_curvature_1_m is 2; it must be [twist, bending about y, bending about z], or a list "
           "of "
           "these per element."},
      {"elements: 40", "elements: 40\n  rest_curvature_1_m: []",
       f + "10: rod.rest_curvature_1_m has 0 values; it must be a list of three numbers, [twist, bending "
           "about y, "
           "bending about z]."},
      {"elements: 40", "elements: 40\n  rest_curvature_1_m: [0, 2]",
       f + "10: rod.rest_curvature_1_m has 2 values; it must be a list of three numbers, [twist, bending "
           "about y, "
           "bending about z]."},
      {"elements: 40", "elements: 40\n  rest_curvature_1_m: [0, 0, .inf]",
       f + "10: rod.rest_curvature_1_m[2] is .inf; it must be a finite decimal number."},
      {"elements: 40", "elements: 40\n  rest_curvature_1_m: [0, [0, 0, 1], 0]",
       f + "10: rod.rest_curvature_1_m[1] is a list; it must be a number."},
      {"elements: 40", "elements: 40\n  rest_curvature_1_m: [[0, 0, 1]]",
       f + "10: rod.rest_curvature_1_m has 1 curvatures; give one for each of the rod's 40 elements, or one "
           "without the outer brackets for all."},
      {"elements: 40", "elements: 4\n  rest_curvature_1_m: [[0, 0, 1], [0, 0, 1], [0, 1], [0, 0, 1]]",
       f + "10: rod.rest_curvature_1_m[2] has 2 values; it must be a list of three numbers, [twist, bending "
           "about y, "
           "bending about z]."},
      {"elements: 40", "elements: 4\n  rest_curvature_1_m: [[0, 0, 1], 2, [0, 0, 1], [0, 0, x]]",
       f + "10: rod.rest_curvature_1_m[1] is 2; it must be a list of three numbers, [twist, bending about y, "
           "bending about z]."},
      {"elements: 40", "elements: 4\n  rest_curvature_1_m: [[0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, x]]",
       f + "10: rod.rest_curvature_1_m[3][2] is \"x\"; it must be a number."},
      {"gravity_m_s2: [0, 0, -9.81]", "gravity_m_s2: -9.81",
       f + "16: environment.gravity_m_s2 is -9.81; it must be a list of three numbers, [x, y, z]."},
      {"gravity_m_s2: [0, 0, -9.81]", "gravity_m_s2: [0, -9.81]",
       f + "16: environment.gravity_m_s2 has 2 values; it must be a list of three numbers, [x, y, z]."},
      {"gravity_m_s2: [0, 0, -9.81]", "gravity_m_s2: [0, 0, down]",
       f + "16: environment.gravity_m_s2[2] is \"down\"; it must be a number."},
      {"[0, 0, 0.1, 0, 0, 0]", "[0, 0, 0.1]",
       f + "23: start.wrench has 3 values; it must be a list of six numbers, [m1, m2, m3, n1, n2, n3]."},
      {"  meshes:\n    - file: meshes/box.obj\n      scale: 0.5\n", "  meshes: box.obj\n",
       f + "11: environment.meshes is \"box.obj\"; it must be a list of meshes, [] for free space."},
      // words
      {"[both, first]", "[both, frist]", f + "18: grippers.grasps[1] is \"frist\"; did you mean \"first\"?"},
      {"[both, first]", "[both, both]",
       f + "18: grippers.grasps[1] is \"both\"; it stands there twice; keep one."},
      {"[both, first]", "[]",
       f + "18: grippers.grasps has no values; it must be a list of both, first, last: the ends that may be "
           "held at once."},
      {"goal:", "simulation: {scheme: leapfrog_of_order_two}\ngoal:",
       f + "24: simulation.scheme is \"leapfrog_of_order_two\"; it must be one of implicit_euler, "
           "second_order."},
      // keys
      {"grippers:", "gripers:", f + "17: unknown key \"gripers\"; did you mean \"grippers\"?"},
      {"radius_m: 0.01", "raduis_m: 0.01",
       f + "5: unknown key \"raduis_m\" in rod; did you mean \"radius_m\"?"},
      {"scale: 0.5", "sclae: 0.5",
       f + "13: unknown key \"sclae\" in environment.meshes[0]; did you mean \"scale\"?"},
      {"max: [2, 1, 1]", "max: [2, 1, 1], colour: red",
       f + "14: unknown key \"colour\" in environment.workspace_m; the keys are min, max."},
      {"goal:", "planner: {goal_bais: 0.1}\ngoal:",
       f + "24: unknown key \"goal_bais\" in planner; did you mean \"goal_bias\"?"},
      {"  radius_m: 0.01\n", "", f + "3: rod.radius_m is missing; add it."},
      {"  friction: 0.2\n", "", f + "10: environment.friction is missing; add it."},
      {"name: example\n", "", f + "1: name is missing; add it."},
      {"elements: 40", "elements: 40\n  radius_m: 0.02",
       f + "10: rod.radius_m appears twice (first in line 5); keep one."},
      {"name: example", "? [a, b]\n: c", f + "2: a key must be a word."},
      // combinations
      {"poisson_ratio: 0.4", "poisson_ratio: 0.4\n  shear_modulus_pa: 1e7",
       f + "9: rod.poisson_ratio and rod.shear_modulus_pa exclude each other; keep one."},
      {"elements: 40",
       "elements: 40\n  stiffness: {torsion_n_m2: 1, bending_n_m2: [2, 3], axial_n: 4, shear_n: [5, 6]}",
       f + "7: rod.young_modulus_pa and rod.stiffness exclude each other; keep one."},
      {"  pose: {position_m: [0, 0, 0]", "  grippers: {}\n  pose: {position_m: [0, 0, 0]",
       f + "22: start.grippers and start.pose exclude each other; give pose and wrench, or grippers."},
      {"    last: {position_m: [1, 0, 1], orientation_wxyz: [0, 1, 0, 0]}\n", "",
       f + "25: goal.grippers.last is missing; add it."},
      // versions
      {"tendril_scenario: 1", "tendril_scenario: 2",
       f + "1: tendril_scenario is 2; this program reads version 1."},
      {"tendril_scenario: 1\n", "", f + "1: tendril_scenario is missing; add it."},
      {"tendril_scenario: 1", "tendril_solution: 1", f + "1: this is a solution; a scenario is needed here."},
  };
  for (const BadInput& bad : cases) EXPECT_EQ(messageFor(changed(bad.from, bad.to)), bad.message);
}

TEST(Scenario, TextThatIsNoSingleYamlMappingIsRefusedWithItsLine) {
  EXPECT_EQ(messageFor(""), "scenarios/a.yaml: the file is empty.");
  EXPECT_EQ(messageFor("# nothing but a comment\n"), "scenarios/a.yaml: the file is empty.");
  EXPECT_EQ(messageFor("- a\n- b\n"),
            "scenarios/a.yaml:1: the file is a list; a scenario is a mapping that begins with "
            "tendril_scenario: 1.");
  EXPECT_EQ(messageFor(kExample + "---\n" + kExample),
            "scenarios/a.yaml:28: the text goes on after its end; remove the bracket or document that is too "
            "many.");
  const std::string unclosed = messageFor(changed("[0, 0, -9.81]", "[0, 0, -9.81"));
  EXPECT_TRUE(unclosed.starts_with("scenarios/a.yaml:17: this is not YAML: ")) << unclosed;
  const std::string tab = messageFor(changed("  radius_m", "\tradius_m"));
  EXPECT_TRUE(tab.starts_with("scenarios/a.yaml:5: this is not YAML: ")) << tab;
  EXPECT_EQ(messageFor(changed("example",
                               "ex\xFF"
                               "ample")),
            "scenarios/a.yaml:2: holds the byte 0xff, which is not text; save the file as UTF-8.");
  EXPECT_EQ(messageFor(changed("example", std::string("ex\0ample", 8))),
            "scenarios/a.yaml:2: holds the byte 0x00, which is not text; save the file as UTF-8.");
  EXPECT_EQ(messageFor(changed("name: example", "name: &a [*a]")),
            "scenarios/a.yaml:2: an alias stands inside the value it refers to.");
  EXPECT_EQ(messageFor(changed("name: example", "name: " + std::string(50, '[') + std::string(50, ']'))),
            "scenarios/a.yaml:2: this is nested too deeply.");
  EXPECT_EQ(
      messageFor("{\"tendril_scenario\": 1} {}"),
      "scenarios/a.yaml:1: the text goes on after its end; remove the bracket or document that is too many.");
}

TEST(Scenario, AliasesStandForWhatTheyReferTo) {
  const std::string text =
      changed("min: [-2, -1, -1], max: [2, 1, 1]", "min: &low [-2, -1, -1], max: [2, 1, 1]");
  const Scenario s =
      parseScenario(changed("gravity_m_s2: [0, 0, -9.81]", "gravity_m_s2: *low", text), "a.yaml");
  EXPECT_EQ(s.environment.gravity, Vector3(-2, -1, -1));
  // ten levels of ten aliases each would be 10^10 values
  std::string bomb = kExample + "x0: &x0 [1]\n";
  for (char level = 'a'; level < 'k'; ++level) {
    const std::string before =
        level == 'a' ? "*x0, " : std::string("*") + static_cast<char>(level - 1) + ", ";
    bomb.append({level, ':', ' ', '&', level, ' ', '['});
    for (int j = 0; j < 10; ++j) bomb += before;
    bomb += "]\n";
  }
  EXPECT_EQ(messageFor(bomb), "scenarios/a.yaml:34: the file holds more than 500000 values.");
}

TEST(Scenario, AFileThatIsNotThereIsNamed) {
  EXPECT_THROW(
      {
        try {
          (void)readScenario("no/such.yaml");
        } catch (const InputError& e) {
          EXPECT_STREQ(e.what(), "no/such.yaml: no such file.");
          throw;
        }
      },
      InputError);
}

TEST(Scenario, MessagesAboutEmbeddedJsonNameTheDocumentAndTheKey) {
  nlohmann::json json = toJson(parseScenario(kExample, "a.yaml"));
  json["rod"]["radius_m"] = -1;
  try {
    (void)scenarioFromJson(json, "out/solution.json: scenario");
    FAIL();
  } catch (const InputError& e) {
    EXPECT_STREQ(e.what(), "out/solution.json: scenario.rod.radius_m is -1; a radius must be > 0.");
  }
}

TEST(Scenario, PlannerSettingsAreReadByNameAndKeptInTheirRanges) {
  PlannerSettings defaults;
  visitPlannerSettings(defaults, [](const char* key, auto& field, auto low, auto high, auto&&...) {
    using Field = std::remove_reference_t<decltype(field)>;
    if constexpr (std::is_arithmetic_v<Field> && !std::is_same_v<Field, bool>) {
      EXPECT_GE(field, low) << key;
      EXPECT_LE(field, high) << key;
      const auto with = [&](auto value) {
        std::ostringstream text;
        text << std::setprecision(17) << kExample << "planner:\n  " << key << ": " << value << "\n";
        return text.str();
      };
      EXPECT_EQ(messageFor(with(high)), "");
      const std::string message = messageFor(with(static_cast<Field>(high + 1)));
      EXPECT_TRUE(message.starts_with(std::string("scenarios/a.yaml:29: planner.") + key + " is "))
          << message;
      const Scenario s = parseScenario(with(low), "a.yaml");
      visitPlannerSettings(s.planner, [&](const char* other, const auto& read, auto&&...) {
        if constexpr (std::is_same_v<std::remove_cvref_t<decltype(read)>, Field>) {
          EXPECT_TRUE(std::string(other) != key || read == static_cast<Field>(low)) << key;
        }
      });
    }
  });
}

}  // namespace
}  // namespace tendril
