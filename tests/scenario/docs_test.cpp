#include <sstream>

#include "example.h"

namespace tendril {
namespace {

std::string documentation() { return readFile(TENDRIL_SOURCE_DIR "/docs/scenario.md"); }

template <class T>
std::string shown(const T& value) {
  std::ostringstream out;
  out << std::boolalpha << value;
  return out.str();
}

TEST(ScenarioDocumentation, ItsExampleIsAScenarioThatGivesEverySection) {
  const std::string docs = documentation();
  const std::size_t begin = docs.find("```yaml\n") + 8, end = docs.find("```", begin);
  const Scenario s = parseScenario(docs.substr(begin, end - begin), "docs/scenario.md");
  EXPECT_EQ(s.environment.meshes.size(), 1u);
  EXPECT_TRUE(s.start && std::holds_alternative<PoseAndWrench>(*s.start));
  EXPECT_TRUE(s.goal && std::holds_alternative<GripperPoses>(s.goal->placement));
  EXPECT_TRUE(s.goal->shape_tolerance);
}

TEST(ScenarioDocumentation, ListsEveryPlannerSettingAsTheProgramHasIt) {
  const std::string docs = documentation();
  const PlannerSettings defaults;
  std::string table;
  visitPlannerSettings(defaults, [&](const char* key, const auto& field, const auto& low, const auto& high,
                                     const char* unit, const char* meaning) {
    using Field = std::remove_cvref_t<decltype(field)>;
    std::string range;
    if constexpr (std::is_same_v<Field, bool>)
      range = "true, false";
    else if constexpr (std::is_arithmetic_v<Field>)
      range = shown(low) + " to " + shown(high);
    else
      range = "text";
    table += "| `" + std::string(key) + "` | " + shown(field) + " | " + range + " | " + unit + " | " +
             meaning + " |\n";
  });
  EXPECT_NE(docs.find(table), std::string::npos) << "docs/scenario.md must contain these lines:\n" << table;
}

TEST(ScenarioDocumentation, NamesEveryKeyTheProgramWrites) {
  const std::string docs = documentation();
  for (const std::string key : {"tendril_scenario",
                                "name",
                                "summary",
                                "rod",
                                "environment",
                                "grippers",
                                "start",
                                "simulation",
                                "goal",
                                "planner",
                                "length_m",
                                "radius_m",
                                "density_kg_m3",
                                "young_modulus_pa",
                                "poisson_ratio",
                                "shear_modulus_pa",
                                "shear_correction",
                                "stiffness",
                                "elements",
                                "self_contact",
                                "rest_curvature_1_m",
                                "torsion_n_m2",
                                "bending_n_m2",
                                "axial_n",
                                "shear_n",
                                "meshes",
                                "workspace_m",
                                "friction",
                                "gravity_m_s2",
                                "file",
                                "scale",
                                "position_m",
                                "orientation_wxyz",
                                "grasps",
                                "max_speed_m_s",
                                "max_turn_rad_s",
                                "max_force_n",
                                "max_torque_n_m",
                                "pose",
                                "wrench",
                                "tolerance",
                                "angle_rad",
                                "shape_m",
                                "inertia",
                                "scheme",
                                "time_step_s",
                                "drag_1_s",
                                "stiffness_damping_s",
                                "damping",
                                "newton_iterations",
                                "newton_tolerance",
                                "step_tolerance_m",
                                "contact_distance_m"})
    EXPECT_NE(docs.find("`" + key), std::string::npos) << key;
}

}  // namespace
}  // namespace tendril
