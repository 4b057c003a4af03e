#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

#include "example.h"

namespace tendril {
namespace {

using test::kExample;

// ------------------------------------------------------------------ equality of every bit

bool sameBits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}
template <class Derived>
bool sameBits(const Eigen::MatrixBase<Derived>& a, const Eigen::MatrixBase<Derived>& b) {
  for (Eigen::Index i = 0; i < a.size(); ++i)
    if (!sameBits(a(i), b(i))) return false;
  return true;
}
bool sameBits(const Pose& a, const Pose& b) {
  return sameBits(a.position, b.position) && sameBits(a.rotation.coeffs(), b.rotation.coeffs());
}
bool sameBits(const Placement& a, const Placement& b) {
  if (a.index() != b.index()) return false;
  if (const auto* ends = std::get_if<GripperPoses>(&a))
    return sameBits(ends->first, std::get<GripperPoses>(b).first) &&
           sameBits(ends->last, std::get<GripperPoses>(b).last);
  const auto &pa = std::get<PoseAndWrench>(a), &pb = std::get<PoseAndWrench>(b);
  return sameBits(pa.pose, pb.pose) && sameBits(pa.wrench, pb.wrench);
}
template <class T>
bool sameBits(const std::optional<T>& a, const std::optional<T>& b) {
  return a.has_value() == b.has_value() && (!a || sameBits(*a, *b));
}

void expectSame(const Scenario& a, const Scenario& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.summary, b.summary);
  EXPECT_TRUE(sameBits(a.rod.length, b.rod.length));
  EXPECT_TRUE(sameBits(a.rod.radius, b.rod.radius));
  EXPECT_TRUE(sameBits(a.rod.density, b.rod.density));
  EXPECT_TRUE(sameBits(a.rod.c, b.rod.c));
  EXPECT_EQ(a.rod.elements, b.rod.elements);
  EXPECT_EQ(a.rod.self_contact, b.rod.self_contact);
  ASSERT_EQ(a.rod.rest_curvature.size(), b.rod.rest_curvature.size());
  for (std::size_t i = 0; i < a.rod.rest_curvature.size(); ++i)
    EXPECT_TRUE(sameBits(a.rod.rest_curvature[i], b.rod.rest_curvature[i]));
  ASSERT_EQ(a.environment.meshes.size(), b.environment.meshes.size());
  for (std::size_t i = 0; i < a.environment.meshes.size(); ++i) {
    EXPECT_EQ(a.environment.meshes[i].file, b.environment.meshes[i].file);
    EXPECT_TRUE(sameBits(a.environment.meshes[i].scale, b.environment.meshes[i].scale));
    EXPECT_TRUE(sameBits(a.environment.meshes[i].pose, b.environment.meshes[i].pose));
  }
  EXPECT_TRUE(sameBits(a.environment.workspace.min, b.environment.workspace.min));
  EXPECT_TRUE(sameBits(a.environment.workspace.max, b.environment.workspace.max));
  EXPECT_TRUE(sameBits(a.environment.friction, b.environment.friction));
  EXPECT_TRUE(sameBits(a.environment.gravity, b.environment.gravity));
  EXPECT_EQ(a.grippers.grasps, b.grippers.grasps);
  EXPECT_TRUE(sameBits(a.grippers.max_speed, b.grippers.max_speed));
  EXPECT_TRUE(sameBits(a.grippers.max_turn, b.grippers.max_turn));
  EXPECT_TRUE(sameBits(a.grippers.max_force, b.grippers.max_force));
  EXPECT_TRUE(sameBits(a.grippers.max_torque, b.grippers.max_torque));
  EXPECT_EQ(a.simulation.inertia, b.simulation.inertia);
  EXPECT_EQ(a.simulation.scheme, b.simulation.scheme);
  EXPECT_TRUE(sameBits(a.simulation.time_step, b.simulation.time_step));
  EXPECT_TRUE(sameBits(a.simulation.drag, b.simulation.drag));
  EXPECT_TRUE(sameBits(a.simulation.stiffness_damping, b.simulation.stiffness_damping));
  EXPECT_TRUE(sameBits(a.simulation.contact_distance, b.simulation.contact_distance));
  EXPECT_EQ(a.simulation.newton_iterations, b.simulation.newton_iterations);
  EXPECT_TRUE(sameBits(a.simulation.newton_tolerance, b.simulation.newton_tolerance));
  EXPECT_TRUE(sameBits(a.simulation.step_tolerance, b.simulation.step_tolerance));
  EXPECT_TRUE(sameBits(a.start, b.start));
  EXPECT_TRUE(sameBits(a.start_pose, b.start_pose));
  ASSERT_EQ(a.goal.has_value(), b.goal.has_value());
  if (a.goal) {
    EXPECT_TRUE(sameBits(a.goal->placement, b.goal->placement));
    EXPECT_TRUE(sameBits(a.goal->position_tolerance, b.goal->position_tolerance));
    EXPECT_TRUE(sameBits(a.goal->angle_tolerance, b.goal->angle_tolerance));
    EXPECT_TRUE(sameBits(a.goal->shape_tolerance, b.goal->shape_tolerance));
  }
  ASSERT_EQ(a.moduli.has_value(), b.moduli.has_value());
  if (a.moduli) {
    EXPECT_TRUE(sameBits(a.moduli->young_modulus, b.moduli->young_modulus));
    EXPECT_TRUE(sameBits(a.moduli->shear_modulus, b.moduli->shear_modulus));
    EXPECT_TRUE(sameBits(a.moduli->poisson_ratio, b.moduli->poisson_ratio));
    EXPECT_TRUE(sameBits(a.moduli->shear_correction, b.moduli->shear_correction));
  }
  std::vector<std::string> settings_a, settings_b;
  const auto list = [](std::vector<std::string>& out) {
    return [&out](const char* key, const auto& field, auto&&...) {
      out.push_back(key + (" = " + nlohmann::json(field).dump()));
    };
  };
  visitPlannerSettings(a.planner, list(settings_a));
  visitPlannerSettings(b.planner, list(settings_b));
  EXPECT_EQ(settings_a, settings_b);
}

// ------------------------------------------------------------------ random scenarios, as a person might
// write them

class RandomScenario {
 public:
  explicit RandomScenario(std::uint64_t seed) : random_(seed) {}

  std::string text() {
    nlohmann::json json;
    json["tendril_scenario"] = 1;
    json["name"] = pick(
        {"funnel", "7", "true", "null", "a: b", "\"quoted\" # and 'not'", "Schläuche → öffnen", "{x}", "~"});
    if (coin()) json["summary"] = pick({"", "with a \\ and a / and \u007e", "- item", " spaces ", "1e5"});
    const double length = magnitude(-2, 2);
    json["rod"] = {{"length_m", length},
                   {"radius_m", length * random_.uniform(1e-3, 0.49)},
                   {"density_kg_m3", magnitude(0, 4)},
                   {"elements", static_cast<int>(random_.uniform(4, 1000))}};
    if (coin()) {
      json["rod"]["young_modulus_pa"] = magnitude(3, 12);
      if (coin())
        json["rod"]["poisson_ratio"] = random_.uniform(-0.99, 0.5);
      else
        json["rod"]["shear_modulus_pa"] = magnitude(3, 12);
      if (coin()) json["rod"]["shear_correction"] = magnitude(-1, 1);
    } else {
      json["rod"]["stiffness"] = {{"torsion_n_m2", magnitude(-9, 9)},
                                  {"bending_n_m2", {magnitude(-9, 9), magnitude(-9, 9)}},
                                  {"axial_n", magnitude(-9, 9)},
                                  {"shear_n", {magnitude(-9, 9), magnitude(-9, 9)}}};
    }
    if (coin()) json["rod"]["self_contact"] = coin();
    if (coin()) json["rod"]["rest_curvature_1_m"] = restCurvature(json["rod"]);
    json["environment"] = {{"meshes", nlohmann::json::array()},
                           {"workspace_m", {{"min", numbers(3, -3, -1)}, {"max", numbers(3, 1, 3)}}},
                           {"friction", random_.uniform(0, 2)},
                           {"gravity_m_s2", numbers(3, -10, 10)}};
    for (int i = static_cast<int>(random_.uniform(0, 4)); i > 0; --i) {
      nlohmann::json mesh = {{"file", pick({"a.obj", "folder with blanks/b.ply", "../c.stl"})}};
      if (coin()) mesh["scale"] = magnitude(-4, 2);
      if (coin()) mesh.update(pose());
      json["environment"]["meshes"].push_back(mesh);
    }
    json["grippers"] = {{"grasps", coin() ? std::vector{"both", "last"} : std::vector{"first"}},
                        {"max_speed_m_s", magnitude(-2, 2)},
                        {"max_turn_rad_s", magnitude(-2, 2)}};
    if (coin()) json["grippers"]["max_force_n"] = magnitude(-3, 3);
    if (coin()) json["grippers"]["max_torque_n_m"] = magnitude(-3, 3);
    if (coin()) json["start"] = coin() ? placement() : nlohmann::json{{"pose", pose()}};
    if (coin())
      json["simulation"] = {{"inertia", coin()},
                            {"scheme", coin() ? "second_order" : "implicit_euler"},
                            {"time_step_s", magnitude(-6, 0)},
                            {"drag_1_s", magnitude(-3, 3)},
                            {"newton_iterations", 1 + static_cast<int>(random_.uniform(0, 999))},
                            {"newton_tolerance", magnitude(-11, -2)},
                            {"step_tolerance_m", magnitude(-6, -1)},
                            {"contact_distance_m", magnitude(-5, -1)}};
    if (coin()) {
      json["goal"] = placement();
      if (coin())
        json["goal"]["tolerance"] = {{"angle_rad", random_.uniform(0.01, 3.14)},
                                     {"shape_m", magnitude(-3, 0)}};
    }
    json["planner"] = nlohmann::json::object();
    PlannerSettings settings;
    visitPlannerSettings(settings, [&](const char* key, auto& field, auto low, auto high, auto&&...) {
      if constexpr (std::is_same_v<std::remove_reference_t<decltype(field)>, double>)
        if (coin()) json["planner"][key] = random_.uniform(low, high);
    });
    return json.dump(coin() ? 2 : -1);
  }

 private:
  bool coin() { return random_.uniform() < 0.5; }
  double magnitude(double low, double high) { return std::pow(10.0, random_.uniform(low, high)); }
  std::string pick(const std::vector<std::string>& words) {
    return words[static_cast<std::size_t>(random_.uniform() * static_cast<double>(words.size()))];
  }
  std::vector<double> numbers(int count, double low, double high) {
    std::vector<double> out;
    while (static_cast<int>(out.size()) < count) out.push_back(random_.uniform(low, high));
    return out;
  }
  nlohmann::json restCurvature(const nlohmann::json& rod) {
    const double length = rod["length_m"], radius = rod["radius_m"];
    const int elements = rod["elements"];
    const double most =
        std::min(1 / radius, 1.5 * elements / length) / 2;  // sqrt(3) of it is within the bounds
    if (coin()) return numbers(3, -most, most);
    nlohmann::json list = nlohmann::json::array();
    for (int k = 0; k < elements; ++k) list.push_back(numbers(3, -most, most));
    return list;
  }
  nlohmann::json pose() {
    const Quaternion q = random_.rotation();
    const double off =
        random_.uniform() < 0.5 ? 1 : random_.uniform(0.9991, 1.0009);  // a hand-typed quaternion
    return {{"position_m", numbers(3, -2, 2)},
            {"orientation_wxyz", {off * q.w(), off * q.x(), off * q.y(), off * q.z()}}};
  }
  nlohmann::json placement() {
    if (coin()) return {{"grippers", {{"first", pose()}, {"last", pose()}}}};
    return {{"pose", pose()}, {"wrench", numbers(6, -1, 1)}};
  }

  Random random_;
};

TEST(Scenario, WritingAndReadingAgainChangesNoBit) {
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    const std::string text = RandomScenario(seed).text();
    SCOPED_TRACE(text);
    const Scenario once = parseScenario(text, "a.json");
    expectSame(once, parseScenario(toJson(once).dump(), "a.json"));
    expectSame(once, parseScenario(toJson(once).dump(2), "a.json"));
    expectSame(once, scenarioFromJson(nlohmann::json(toJson(once)), "a.json"));
    if (HasFailure()) return;
  }
}

TEST(Scenario, TheSignOfZeroSurvives) {
  const Scenario s = parseScenario(test::changed("[0, 0, -9.81]", "[-0.0, -0, 0]"), "a.yaml");
  EXPECT_TRUE(std::signbit(s.environment.gravity.x()));
  EXPECT_TRUE(std::signbit(s.environment.gravity.y()));
  expectSame(s, parseScenario(toJson(s).dump(), "a.json"));
}

TEST(Scenario, EveryDefaultIsWritten) {
  const nlohmann::json json = toJson(parseScenario(kExample, "a.yaml"));
  for (const char* pointer :
       {"/summary", "/rod/self_contact", "/rod/shear_correction", "/environment/meshes/0/position_m",
        "/environment/meshes/0/orientation_wxyz", "/grippers/max_force_n", "/grippers/max_torque_n_m",
        "/simulation/inertia", "/simulation/scheme", "/simulation/time_step_s", "/simulation/drag_1_s",
        "/simulation/stiffness_damping_s", "/simulation/contact_distance_m", "/simulation/newton_iterations",
        "/simulation/newton_tolerance", "/simulation/step_tolerance_m", "/goal/tolerance/position_m"})
    EXPECT_TRUE(json.contains(nlohmann::json::json_pointer(pointer))) << pointer;
  const PlannerSettings defaults;
  visitPlannerSettings(defaults, [&](const char* key, const auto& field, auto&&...) {
    ASSERT_TRUE(json["planner"].contains(key)) << key;
    EXPECT_EQ(json["planner"][key], field) << key;
  });
}

TEST(Scenario, RestCurvatureIsWrittenInTheFormItHad) {
  const auto written = [](const std::string& more) -> nlohmann::json {
    return toJson(parseScenario(test::changed("elements: 40", "elements: 4" + more), "a.yaml"))["rod"];
  };
  const std::string key = "\n  rest_curvature_1_m: ";
  EXPECT_FALSE(written("").contains("rest_curvature_1_m"));
  EXPECT_EQ(written(key + "[1, 0, -2.5]")["rest_curvature_1_m"].dump(), "[1.0,0.0,-2.5]");
  EXPECT_EQ(written(key + "[0, 0, 0]")["rest_curvature_1_m"].dump(), "[0.0,0.0,0.0]");
  EXPECT_EQ(written(key + "[[0, 0, 1], [0, 0, 1], [0, 0, 1], [0.5, 0, 1]]")["rest_curvature_1_m"].dump(),
            "[[0.0,0.0,1.0],[0.0,0.0,1.0],[0.0,0.0,1.0],[0.5,0.0,1.0]]");
}

TEST(Scenario, YamlAndTheSameInJsonReadAlike) {
  const Scenario yaml = parseScenario(kExample, "a.yaml");
  const Scenario json = parseScenario(R"({"tendril_scenario":1,"name":"example",
	"rod":{"length_m":2.0,"radius_m":0.01,"density_kg_m3":1000,"young_modulus_pa":5.0E7,"poisson_ratio":4e-1,"elements":40},
	"environment":{"meshes":[{"file":"meshes\/box.obj","scale":0.5}],"workspace_m":{"min":[-2,-1,-1],"max":[2,1,1]},
	"friction":0.2,"gravity_m_s2":[0,0,-9.81]},
	"grippers":{"grasps":["both","first"],"max_speed_m_s":1,"max_turn_rad_s":4},
	"start":{"pose":{"position_m":[0,0,0],"orientation_wxyz":[1,0,0,0]},"wrench":[0,0,0.1,0,0,0]},
	"goal":{"grippers":{"first":{"position_m":[0,0,1],"orientation_wxyz":[1,0,0,0]},
		"last":{"position_m":[1,0,1],"orientation_wxyz":[0,1,0,0]}}}})",
                                      "a.json");
  expectSame(yaml, json);
}

TEST(Scenario, NoDamageToTheTextDoesMoreThanAnInputError) {
  Random random(7);
  const std::string alphabet = "{}[]:,-?&*!|>'\"%@`#~ \n\t0.e\\\x80\x04";
  const std::string json = toJson(parseScenario(kExample, "a.yaml")).dump();
  int accepted = 0;
  for (int i = 0; i < 3000; ++i) {
    std::string text = i % 2 == 0 ? kExample : json;
    for (int edits = 1 + i % 3; edits > 0; --edits) {
      const auto at = static_cast<std::size_t>(random.uniform() * static_cast<double>(text.size()));
      const char letter =
          alphabet[static_cast<std::size_t>(random.uniform() * static_cast<double>(alphabet.size()))];
      switch (random.bits() % 3) {
        case 0:
          text[at] = letter;
          break;
        case 1:
          text.insert(at, 1, letter);
          break;
        default:
          text.erase(at, 1 + random.bits() % 20);
      }
    }
    const std::string message = test::messageFor(text);
    if (message.empty())
      ++accepted;
    else
      EXPECT_TRUE(message.starts_with("scenarios/a.yaml:")) << message;
  }
  EXPECT_GT(accepted, 0);  // blanks, comments, digits
  EXPECT_LT(accepted, 1500);
}

}  // namespace
}  // namespace tendril
