#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "tendril/planner.h"
#include "tendril/statics.h"

namespace tendril {
namespace {

std::vector<Vector3> positionsOf(const RodShape& shape) {
  std::vector<Vector3> positions;
  for (const Pose& node : shape) positions.push_back(node.position);
  return positions;
}

/// What is wrong with a shape's place, for a message; empty if nothing.
std::string misplacement(const RodShape& shape, const Scenario& scenario, const Obstacles& obstacles) {
  const std::vector<Vector3> positions = positionsOf(shape);
  for (std::size_t i = 0; i < positions.size(); ++i)
    if (!scenario.environment.workspace.contains(positions[i]))
      return fmt::format("leaves environment.workspace_m at node {} ({:.4g}, {:.4g}, {:.4g} m)", i,
                         positions[i].x(), positions[i].y(), positions[i].z());
  // Touching counts as penetrating: a rod without any gap cannot be moved.
  const double least = scenario.rod.radius + obstacles.deviation() + 1e-9 * scenario.rod.length;
  const Obstacles::Clearance near = obstacles.clearance(positions, least);
  if (near.segment >= 0) {
    const auto k = static_cast<std::size_t>(near.segment);
    const bool second = (near.on_rod - positions[k]).norm() > (near.on_rod - positions[k + 1]).norm();
    const Obstacles::Face& face = obstacles.faces()[static_cast<std::size_t>(near.face)];
    return fmt::format("touches or penetrates {} by {:.3g} mm at node {} (face {})",
                       scenario.environment.meshes[static_cast<std::size_t>(face.mesh)].file,
                       1e3 * (least - near.distance), near.segment + (second ? 1 : 0),
                       obstacles.faceInMesh(near.face, near.on_mesh));
  }
  const double self =
      scenario.rod.self_contact ? selfDistance(shape, scenario.rod) : std::numeric_limits<double>::infinity();
  if (self < 2 * scenario.rod.radius)
    return fmt::format("passes through itself by {:.3g} mm", 1e3 * (2 * scenario.rod.radius - self));
  return {};
}

/// The stable, contact-free equilibrium of least energy of a placement. `key` is "start" or "goal".
RodShape judgedShape(const Scenario& scenario, const Obstacles& obstacles, const Placement& placement,
                     const std::string& key) {
  const std::string where = scenario.file.string();
  if (const auto* chart = std::get_if<PoseAndWrench>(&placement)) {
    EquilibriumIntegrator integrator(scenario.rod, scenario.environment.gravity);
    Equilibrium rod;
    if (integrator.solve(chart->pose, chart->wrench, rod) == ChartStatus::inverted)
      throw InputError(
          fmt::format("{}: {}.wrench compresses the rod to nothing (stretch 1 + u4 <= 0.05): no static "
                      "equilibrium; lower its force.",
                      where, key));
    if (rod.stability != Stability::stable)
      throw InputError(
          fmt::format("{}: {} is an equilibrium but not a stable one: stability is lost at {:.3f} of the "
                      "length; lower {}.wrench.",
                      where, key, rod.first_conjugate_t.value_or(1.0), key));
    if (const std::string wrong = misplacement(rod.nodes, scenario, obstacles); !wrong.empty())
      throw InputError(fmt::format("{}: {} shape {}; move {}.pose, change its wrench or thin the rod.", where,
                                   key, wrong, key));
    return rod.nodes;
  }
  const std::vector<Equilibrium> found = equilibriaOf(scenario.rod, placement, scenario.environment.gravity);
  if (found.empty())
    throw InputError(
        fmt::format("{}: no stable static equilibrium was found between {}.grippers.first and last; bring "
                    "them nearer to each other "
                    "than the rod's length; where they face each other exactly, turn or shift one a little "
                    "(a round rod buckles to any side "
                    "alike, and none of these is stable); or give {}.pose and {}.wrench.",
                    where, key, key, key));
  for (const Equilibrium& rod : found)
    if (misplacement(rod.nodes, scenario, obstacles).empty()) return rod.nodes;
  throw InputError(
      fmt::format("{}: {} shape {} (the least of {} stable equilibria between these grippers, none of "
                  "which is free); move {}.grippers or thin the rod.",
                  where, key, misplacement(found.front().nodes, scenario, obstacles), found.size(), key));
}

}  // namespace

SamplingSpace samplingSpace(const Scenario& scenario, const Obstacles& obstacles) {
  const Box& workspace = scenario.environment.workspace;
  return {.box = {.moment = scenario.planner.sample_moment, .force = scenario.planner.sample_force},
          .workspace = Eigen::AlignedBox3d(workspace.min, workspace.max),
          .obstacles = &obstacles,
          .gravity = scenario.environment.gravity};
}

RodShape startShape(const Scenario& scenario, const Obstacles& obstacles, bool any_shape) {
  const std::string where = scenario.file.string();
  if (!scenario.start)
    throw InputError(fmt::format(
        "{}: start is missing: give start.pose with start.wrench, or start.grippers with first and last.",
        where));
  if (!any_shape) return judgedShape(scenario, obstacles, *scenario.start, "start");
  RodShape shape;
  if (const auto* chart = std::get_if<PoseAndWrench>(&*scenario.start)) {
    EquilibriumIntegrator integrator(scenario.rod, scenario.environment.gravity);
    Equilibrium rod;
    if (integrator.shape(chart->pose, chart->wrench, rod) == ChartStatus::inverted)
      throw InputError(
          fmt::format("{}: start.wrench compresses the rod to nothing; lower its force.", where));
    shape = rod.nodes;
  } else {
    const std::vector<Equilibrium> found =
        equilibriaOf(scenario.rod, *scenario.start, scenario.environment.gravity);
    if (found.empty())
      throw InputError(fmt::format("{}: no rod was found between start.grippers.first and last.", where));
    shape = found.front().nodes;
    for (const Equilibrium& rod : found)
      if (misplacement(rod.nodes, scenario, obstacles).empty()) {
        shape = rod.nodes;
        break;
      }
  }
  if (const std::string wrong = misplacement(shape, scenario, obstacles); !wrong.empty())
    throw InputError(fmt::format("{}: start shape {}; move the start or thin the rod.", where, wrong));
  return shape;
}

RodShape goalShape(const Scenario& scenario, const Obstacles& obstacles) {
  if (!scenario.goal)
    throw InputError(fmt::format(
        "{}: goal is missing: give goal.grippers with first and last, or goal.pose with goal.wrench.",
        scenario.file.string()));
  return judgedShape(scenario, obstacles, scenario.goal->placement, "goal");
}

}  // namespace tendril
