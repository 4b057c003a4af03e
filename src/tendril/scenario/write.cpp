#include <nlohmann/json.hpp>
#include <type_traits>

#include "tendril/scenario.h"

namespace tendril {
namespace {

using Json = nlohmann::ordered_json;

Json listOf(const Eigen::Ref<const Eigen::VectorXd>& vector) {
  return Json(std::vector<double>(vector.begin(), vector.end()));
}

Json rodJson(const RodProperties& rod, const std::optional<Scenario::Moduli>& moduli) {
  Json json = {{"length_m", rod.length}, {"radius_m", rod.radius}, {"density_kg_m3", rod.density}};
  if (moduli) {
    json["young_modulus_pa"] = moduli->young_modulus;
    if (moduli->poisson_ratio)
      json["poisson_ratio"] = *moduli->poisson_ratio;
    else
      json["shear_modulus_pa"] = moduli->shear_modulus;
    json["shear_correction"] = moduli->shear_correction;
  } else {
    json["stiffness"] = {{"torsion_n_m2", rod.c[0]},
                         {"bending_n_m2", {rod.c[1], rod.c[2]}},
                         {"axial_n", rod.c[3]},
                         {"shear_n", {rod.c[4], rod.c[5]}}};
  }
  json["elements"] = rod.elements;
  json["self_contact"] = rod.self_contact;
  if (rod.rest_curvature.size() == 1) {
    json["rest_curvature_1_m"] = listOf(rod.rest_curvature.front());
  } else if (!rod.rest_curvature.empty()) {
    Json& list = json["rest_curvature_1_m"] = Json::array();
    for (const Vector3& curvature : rod.rest_curvature) list.push_back(listOf(curvature));
  }
  return json;
}

Json environmentJson(const Environment& environment) {
  Json meshes = Json::array();
  for (const MeshReference& mesh : environment.meshes) {
    Json json = {{"file", mesh.file}, {"scale", mesh.scale}};
    json.update(toJson(mesh.pose));
    meshes.push_back(std::move(json));
  }
  return {{"meshes", std::move(meshes)},
          {"workspace_m",
           {{"min", listOf(environment.workspace.min)}, {"max", listOf(environment.workspace.max)}}},
          {"friction", environment.friction},
          {"gravity_m_s2", listOf(environment.gravity)}};
}

Json grippersJson(const GripperLimits& grippers) {
  Json grasps = Json::array();
  for (const Grasp grasp : grippers.grasps) grasps.push_back(name(grasp));
  return {{"grasps", std::move(grasps)},
          {"max_speed_m_s", grippers.max_speed},
          {"max_turn_rad_s", grippers.max_turn},
          {"max_force_n", grippers.max_force},
          {"max_torque_n_m", grippers.max_torque}};
}

Json simulationJson(const SimulationSettings& simulation) {
  return {{"inertia", simulation.inertia},
          {"scheme", simulation.scheme == Scheme::implicit_euler ? "implicit_euler" : "second_order"},
          {"time_step_s", simulation.time_step},
          {"drag_1_s", simulation.drag},
          {"stiffness_damping_s", simulation.stiffness_damping},
          {"contact_distance_m", simulation.contact_distance},
          {"newton_iterations", simulation.newton_iterations},
          {"newton_tolerance", simulation.newton_tolerance},
          {"step_tolerance_m", simulation.step_tolerance}};
}

Json placementJson(const Placement& placement) {
  if (const auto* grippers = std::get_if<GripperPoses>(&placement))
    return {{"grippers", {{"first", toJson(grippers->first)}, {"last", toJson(grippers->last)}}}};
  const auto& base = std::get<PoseAndWrench>(placement);
  return {{"pose", toJson(base.pose)}, {"wrench", listOf(base.wrench)}};
}

Json goalJson(const Goal& goal) {
  Json tolerance = {{"position_m", goal.position_tolerance}};
  if (goal.angle_tolerance) tolerance["angle_rad"] = *goal.angle_tolerance;
  if (goal.shape_tolerance) tolerance["shape_m"] = *goal.shape_tolerance;
  Json json = placementJson(goal.placement);
  json["tolerance"] = std::move(tolerance);
  return json;
}

}  // namespace

const char* name(Grasp grasp) {
  switch (grasp) {
    case Grasp::both:
      return "both";
    case Grasp::first:
      return "first";
    case Grasp::last:
      return "last";
  }
  return "";
}

Json toJson(const Pose& pose) {
  const Quaternion& q = pose.rotation;
  return {{"position_m", listOf(pose.position)}, {"orientation_wxyz", {q.w(), q.x(), q.y(), q.z()}}};
}

Json toJson(const Control& control) {
  Json held = Json::array();
  for (const End end : kBothEnds)
    if (control.isHeld(end)) held.push_back(name(end));
  return {{"start_s", control.start_s},
          {"end_s", control.end_s},
          {"moving", control.moving ? Json(name(*control.moving)) : Json()},
          {"held", std::move(held)},
          {"target", control.moving ? toJson(control.target) : Json()}};
}

Json toJson(const Scenario& scenario) {
  Json json = {{"tendril_scenario", 1}, {"name", scenario.name}, {"summary", scenario.summary}};
  json["rod"] = rodJson(scenario.rod, scenario.moduli);
  json["environment"] = environmentJson(scenario.environment);
  json["grippers"] = grippersJson(scenario.grippers);
  if (scenario.start)
    json["start"] = placementJson(*scenario.start);
  else if (scenario.start_pose)
    json["start"] = {{"pose", toJson(*scenario.start_pose)}};
  json["simulation"] = simulationJson(scenario.simulation);
  if (scenario.goal) json["goal"] = goalJson(*scenario.goal);
  json["planner"] = Json::object();
  visitPlannerSettings(scenario.planner,
                       [&](const char* key, const auto& field, auto&&...) { json["planner"][key] = field; });
  return json;
}

}  // namespace tendril
