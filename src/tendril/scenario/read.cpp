#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <type_traits>

#include "tendril/scenario.h"
#include "tendril/scenario/document.h"

namespace tendril {
namespace fs = std::filesystem;
namespace {

constexpr const char* kMetres = "a length must be > 0.";

/// Modulus G of an isotropic material: G = E / 2(1 + nu), section 2.3.
Scenario::Moduli readModuli(const Value& rod) {
  Scenario::Moduli moduli{};
  moduli.young_modulus = rod.at("young_modulus_pa").number(isPositive, "a modulus must be > 0.");
  const Value *poisson = rod.find("poisson_ratio"), *shear = rod.find("shear_modulus_pa");
  if (poisson && shear)
    shear->fail("rod.poisson_ratio and rod.shear_modulus_pa exclude each other; keep one.");
  if (!poisson && !shear) rod.fail("rod.poisson_ratio is missing; add it, or rod.shear_modulus_pa.");
  if (poisson) {
    moduli.poisson_ratio = poisson->number([](double nu) { return nu > -1 && nu <= 0.5; },
                                           "Poisson's ratio must be > -1 and <= 0.5.");
    moduli.shear_modulus = moduli.young_modulus / (2 * (1 + *moduli.poisson_ratio));
  } else {
    moduli.shear_modulus = shear->number(isPositive, "a modulus must be > 0.");
  }
  if (const Value* correction = rod.find("shear_correction"))
    moduli.shear_correction = correction->number(isPositive, "a shear correction must be > 0.");
  return moduli;
}

Vector6 readStiffness(const Value& stiffness) {
  stiffness.allowKeys({"torsion_n_m2", "bending_n_m2", "axial_n", "shear_n"});
  const char* two = "it must be a list of two numbers > 0.";
  const Eigen::VectorXd bending = stiffness.at("bending_n_m2").vector(2, two);
  const Eigen::VectorXd shear = stiffness.at("shear_n").vector(2, two);
  if ((bending.array() <= 0).any())
    stiffness.at("bending_n_m2").fail("rod.stiffness.bending_n_m2 must be > 0, both.");
  if ((shear.array() <= 0).any()) stiffness.at("shear_n").fail("rod.stiffness.shear_n must be > 0, both.");
  const char* positive = "a stiffness must be > 0.";
  Vector6 c;
  c << stiffness.at("torsion_n_m2").number(isPositive, positive), bending,
      stiffness.at("axial_n").number(isPositive, positive), shear;
  return c;
}

/// One rest curvature: its bend fits the section, and one element can follow it (a chord is then 0.9 h or
/// more).
Vector3 readCurvature(const Value& value, const RodProperties& rod) {
  constexpr double kMostTurn = 1.5;  // rad
  const Vector3 curvature =
      value.vector(3, "it must be a list of three numbers, [twist, bending about y, bending about z].");
  const double length = curvature.norm();
  if (!(length * rod.radius < 1))
    value.fail(fmt::format("{} has length {:.6g}; times the radius it must be < 1.", value.path(), length));
  if (const double turn = length * rod.elementLength(); turn > kMostTurn)
    value.fail(
        fmt::format("{} has length {:.6g}; it turns an element by {:.6g} rad, and at most {} is allowed; "
                    "give more elements.",
                    value.path(), length, turn, kMostTurn));
  return curvature;
}

/// [twist, bending, bending] for the whole rod, or such a list per element; needs rod.elements.
std::vector<Vector3> readRestCurvature(const Value& value, const RodProperties& rod) {
  const std::vector<Value>& items =
      value.list("it must be [twist, bending about y, bending about z], or a list of these per element.");
  if (items.empty() || items.front().kind() != Value::Kind::list) return {readCurvature(value, rod)};
  if (items.size() != static_cast<std::size_t>(rod.elements))
    value.fail(
        fmt::format("{} has {} curvatures; give one for each of the rod's {} elements, or one without "
                    "the outer brackets for all.",
                    value.path(), items.size(), rod.elements));
  std::vector<Vector3> curvatures;
  for (const Value& item : items) curvatures.push_back(readCurvature(item, rod));
  return curvatures;
}

void readRod(const Value& value, Scenario& out) {
  value.allowKeys({"length_m", "radius_m", "density_kg_m3", "young_modulus_pa", "poisson_ratio",
                   "shear_modulus_pa", "shear_correction", "stiffness", "elements", "self_contact",
                   "rest_curvature_1_m"});
  RodProperties& rod = out.rod;
  rod.length = value.at("length_m").number(isPositive, kMetres);
  rod.radius = value.at("radius_m").number(isPositive, "a radius must be > 0.");
  if (rod.radius >= rod.length / 2) value.at("radius_m").refuse("a radius must be < half the rod's length.");
  rod.density = value.at("density_kg_m3").number(isPositive, "a density must be > 0.");
  rod.elements = static_cast<int>(value.at("elements").integer(4, 1000));
  if (const Value* self_contact = value.find("self_contact")) rod.self_contact = self_contact->boolean();
  if (const Value* curvature = value.find("rest_curvature_1_m"))
    rod.rest_curvature = readRestCurvature(*curvature, rod);

  if (const Value* stiffness = value.find("stiffness")) {
    for (const char* key : {"young_modulus_pa", "poisson_ratio", "shear_modulus_pa", "shear_correction"})
      if (const Value* modulus = value.find(key))
        modulus->fail(fmt::format("rod.{} and rod.stiffness exclude each other; keep one.", key));
    rod.c = readStiffness(*stiffness);
  } else {
    if (!value.find("young_modulus_pa"))
      value.fail(
          "rod.young_modulus_pa is missing; add it with rod.poisson_ratio or rod.shear_modulus_pa, or give "
          "rod.stiffness instead.");
    out.moduli = readModuli(value);
    rod.c = stiffnessOfRoundRod(out.moduli->young_modulus, out.moduli->shear_modulus, rod.radius,
                                out.moduli->shear_correction);
  }
  const double force_unit = rod.bendingStiffness() / (rod.length * rod.length);
  for (const double stiffness : {rod.c[0], rod.c[1], rod.c[2], rod.c[3], rod.c[4], rod.c[5], force_unit})
    if (!std::isnormal(stiffness))
      value.fail(fmt::format(
          "rod has a stiffness or a bending force EI/L^2 of {:g}; change the moduli, the radius or "
          "the length.",
          stiffness));
}

MeshReference readMesh(const Value& value) {
  value.allowKeys({"file", "scale", "position_m", "orientation_wxyz"});
  MeshReference mesh;
  mesh.file = value.at("file").text();
  if (mesh.file.empty()) value.at("file").refuse("it must name a mesh.");
  if (const Value* scale = value.find("scale"))
    mesh.scale = scale->number(isPositive, "a scale must be > 0.");
  if (const Value* position = value.find("position_m")) mesh.pose.position = position->vector3();
  if (const Value* orientation = value.find("orientation_wxyz"))
    mesh.pose.rotation = orientation->unitQuaternion();
  return mesh;
}

void readEnvironment(const Value& value, Environment& environment) {
  value.allowKeys({"meshes", "workspace_m", "friction", "gravity_m_s2"});
  for (const Value& mesh : value.at("meshes").list("it must be a list of meshes, [] for free space."))
    environment.meshes.push_back(readMesh(mesh));
  const Value& workspace = value.at("workspace_m");
  workspace.allowKeys({"min", "max"});
  environment.workspace.min = workspace.at("min").vector3();
  environment.workspace.max = workspace.at("max").vector3();
  if ((environment.workspace.min.array() >= environment.workspace.max.array()).any())
    workspace.fail("environment.workspace_m.min must be < environment.workspace_m.max in x, y and z.");
  environment.friction = value.at("friction").number(0, 10);
  environment.gravity = value.at("gravity_m_s2").vector3();
}

void readGrippers(const Value& value, const RodProperties& rod, GripperLimits& grippers) {
  value.allowKeys({"grasps", "max_speed_m_s", "max_turn_rad_s", "max_force_n", "max_torque_n_m"});
  grippers.grasps.clear();
  const char* rule = "it must be a list of both, first, last: the ends that may be held at once.";
  for (const Value& item : value.at("grasps").list(rule)) {
    const auto grasp = static_cast<Grasp>(item.choice({"both", "first", "last"}));
    if (grippers.allows(grasp)) item.refuse("it stands there twice; keep one.");
    grippers.grasps.push_back(grasp);
  }
  if (grippers.grasps.empty())
    value.at("grasps").fail(fmt::format("grippers.grasps has no values; {}", rule));
  grippers.max_speed = value.at("max_speed_m_s").number(isPositive, "a speed must be > 0.");
  grippers.max_turn = value.at("max_turn_rad_s").number(isPositive, "a rate of turn must be > 0.");
  grippers.max_force = 200 * rod.bendingStiffness() / (rod.length * rod.length);
  grippers.max_torque = 10 * rod.bendingStiffness() / rod.length;
  if (const Value* force = value.find("max_force_n"))
    grippers.max_force = force->number(isPositive, "a force must be > 0.");
  if (const Value* torque = value.find("max_torque_n_m"))
    grippers.max_torque = torque->number(isPositive, "a torque must be > 0.");
}

void readSimulation(const Value& value, SimulationSettings& simulation) {
  value.allowKeys({"inertia", "scheme", "time_step_s", "drag_1_s", "stiffness_damping_s", "damping",
                   "contact_distance_m", "newton_iterations", "newton_tolerance", "step_tolerance_m"});
  if (const Value* inertia = value.find("inertia")) simulation.inertia = inertia->boolean();
  if (const Value* scheme = value.find("scheme"))
    simulation.scheme = static_cast<Scheme>(scheme->choice({"implicit_euler", "second_order"}));
  if (const Value* time_step = value.find("time_step_s")) simulation.time_step = time_step->number(1e-6, 1);
  if (const Value* drag = value.find("drag_1_s"))
    simulation.drag = drag->number(isNotNegative, "drag must be >= 0.");
  if (const Value* damping = value.find("stiffness_damping_s"))
    simulation.stiffness_damping = damping->number(isNotNegative, "damping must be >= 0.");
  if (const Value* damping = value.find("damping")) {
    if (value.find("stiffness_damping_s"))
      damping->fail("simulation.damping and simulation.stiffness_damping_s exclude each other; keep one.");
    damping->allowKeys({"ratio", "frequency_hz"});
    // A vibration with stiffness-proportional damping beta has the damping ratio beta omega / 2.
    const double ratio = damping->at("ratio").number(isNotNegative, "a damping ratio must be >= 0.");
    const double frequency = damping->at("frequency_hz").number(isPositive, "a frequency must be > 0.");
    simulation.stiffness_damping = ratio / (std::numbers::pi * frequency);
  }
  if (const Value* iterations = value.find("newton_iterations"))
    simulation.newton_iterations = static_cast<int>(iterations->integer(1, 1000));
  if (const Value* tolerance = value.find("newton_tolerance"))
    simulation.newton_tolerance = tolerance->number(1e-12, 0.1);
  if (const Value* tolerance = value.find("step_tolerance_m"))
    simulation.step_tolerance = tolerance->number(isNotNegative, "a tolerance must be >= 0.");
  if (const Value* distance = value.find("contact_distance_m"))
    simulation.contact_distance = distance->number(isPositive, "a distance must be > 0.");
}

/// `pose` with `wrench`, or `grippers`; a pose alone gives no placement.
std::optional<Placement> readPlacement(const Value& value) {
  const Value *pose = value.find("pose"), *wrench = value.find("wrench"), *grippers = value.find("grippers");
  if (grippers && (pose || wrench))
    grippers->fail(
        fmt::format("{0}.grippers and {0}.{1} exclude each other; give pose and wrench, or grippers.",
                    value.path(), pose ? "pose" : "wrench"));
  if (grippers) {
    grippers->allowKeys({"first", "last"});
    return GripperPoses{grippers->at("first").pose(), grippers->at("last").pose()};
  }
  if (!pose)
    value.fail(
        fmt::format("{0}.pose is missing; give {0}.pose and {0}.wrench, or {0}.grippers.", value.path()));
  if (!wrench) return {};
  return PoseAndWrench{pose->pose(),
                       wrench->vector(6, "it must be a list of six numbers, [m1, m2, m3, n1, n2, n3].")};
}

Goal readGoal(const Value& value, const RodProperties& rod) {
  value.allowKeys({"pose", "wrench", "grippers", "tolerance"});
  const std::optional<Placement> placement = readPlacement(value);
  if (!placement) (void)value.at("wrench");
  Goal goal;
  goal.placement = *placement;
  goal.position_tolerance = 0.05 * rod.length;
  if (const Value* tolerance = value.find("tolerance")) {
    tolerance->allowKeys({"position_m", "angle_rad", "shape_m"});
    const char* rule = "a tolerance must be > 0.";
    if (const Value* position = tolerance->find("position_m"))
      goal.position_tolerance = position->number(isPositive, rule);
    if (const Value* angle = tolerance->find("angle_rad"))
      goal.angle_tolerance =
          angle->number([](double x) { return x > 0 && x < 3.15; },
                        "an angle must be > 0 and at most pi; leave it out for any orientation.");
    if (const Value* shape = tolerance->find("shape_m"))
      goal.shape_tolerance = shape->number(isPositive, rule);
  }
  return goal;
}

void readPlannerSettings(const Value& value, PlannerSettings& settings) {
  std::vector<std::string> keys;
  visitPlannerSettings(settings, [&](const char* key, auto&&...) { keys.emplace_back(key); });
  value.allowKeys(keys);
  visitPlannerSettings(settings, [&](const char* key, auto& field, const auto& low, const auto& high,
                                     auto&&...) {
    using Field = std::remove_reference_t<decltype(field)>;
    const Value* given = value.find(key);
    if (!given) return;
    if constexpr (std::is_same_v<Field, bool>)
      field = given->boolean();
    else if constexpr (std::is_integral_v<Field>)
      field =
          static_cast<Field>(given->integer(static_cast<std::int64_t>(low), static_cast<std::int64_t>(high)));
    else if constexpr (std::is_floating_point_v<Field>)
      field = given->number(static_cast<double>(low), static_cast<double>(high));
    else
      field = given->text();
  });
}

void checkVersion(const Value& root) {
  if (root.kind() != Value::Kind::map)
    root.refuse("a scenario is a mapping that begins with tendril_scenario: 1.");
  if (root.find("tendril_solution")) root.fail("this is a solution; a scenario is needed here.");
  const Value& version = root.at("tendril_scenario");
  if (version.number() != 1) version.refuse("this program reads version 1.");
}

Scenario readScenario(const Value& root) {
  checkVersion(root);
  root.allowKeys({"tendril_scenario", "name", "summary", "rod", "environment", "grippers", "start",
                  "simulation", "goal", "planner"});
  Scenario scenario;
  scenario.name = root.at("name").text();
  if (scenario.name.empty()) root.at("name").refuse("it must not be.");
  if (const Value* summary = root.find("summary")) scenario.summary = summary->text();
  readRod(root.at("rod"), scenario);
  readEnvironment(root.at("environment"), scenario.environment);
  readGrippers(root.at("grippers"), scenario.rod, scenario.grippers);
  if (const Value* start = root.find("start")) {
    start->allowKeys({"pose", "wrench", "grippers"});
    scenario.start = readPlacement(*start);
    if (const Value* pose = start->find("pose")) scenario.start_pose = pose->pose();
  }
  scenario.simulation.contact_distance = 0.1 * scenario.rod.radius;
  if (const Value* simulation = root.find("simulation")) readSimulation(*simulation, scenario.simulation);
  if (const Value* goal = root.find("goal")) scenario.goal = readGoal(*goal, scenario.rod);
  if (const Value* planner = root.find("planner")) readPlannerSettings(*planner, scenario.planner);
  return scenario;
}

/// The file's absolute path. Only its folder is canonical: meshes lie beside the name that was given, link or
/// not.
fs::path absolutePath(const fs::path& file) {
  const fs::path absolute = fs::absolute(file).lexically_normal();
  std::error_code error;
  const fs::path folder = fs::weakly_canonical(fs::absolute(file).parent_path(), error);
  return error ? absolute : folder / absolute.filename();
}

}  // namespace

bool GripperLimits::allows(Grasp grasp) const {
  return std::find(grasps.begin(), grasps.end(), grasp) != grasps.end();
}

fs::path Scenario::meshPath(const MeshReference& mesh) const { return file.parent_path() / mesh.file; }

Scenario readScenario(const fs::path& file) { return parseScenario(readFile(file), file); }

Scenario parseScenario(const std::string& text, const fs::path& file) {
  Scenario scenario = readScenario(Value::fromText(text, file.string()));
  scenario.file = absolutePath(file);
  scenario.sha256 = sha256Hex(text);
  return scenario;
}

Scenario scenarioFromJson(const nlohmann::json& json, const std::string& where) {
  return readScenario(Value::fromJson(json, where));
}

}  // namespace tendril
