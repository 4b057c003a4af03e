#include "tendril/verification/ends.h"

#include <fmt/format.h>

#include <optional>

#include "tendril/statics.h"
#include "tendril/verification/clearance.h"

namespace tendril::verification {
namespace {

constexpr double kStartPosition = 2e-3;  // of L
constexpr double kStartAngle = 0.02;     // rad

/// The shapes a placement stands for: the stable, contact-free equilibrium of least energy, or several whose
/// energies are equal to 1e-6 EI/L (mirror images, say). Empty, with the reason in `problem`, if there is
/// none.
std::vector<RodShape> shapesOf(const Placement& placement, const Scenario& scenario, const FaceTree& faces,
                               std::string& problem) {
  const std::vector<Equilibrium> equilibria =
      equilibriaOf(scenario.rod, placement, scenario.environment.gravity);  // by ascending energy
  // A wrench leaves no choice: the shape is what it is, and whether it is clear is for the check of clearance
  // to say.
  if (std::holds_alternative<PoseAndWrench>(placement) && !equilibria.empty())
    return {equilibria.front().nodes};
  std::vector<RodShape> shapes;
  double least_energy = 0;
  const double same = 1e-6 * scenario.rod.bendingStiffness() / scenario.rod.length;
  for (const Equilibrium& equilibrium : equilibria) {
    const double energy = equilibrium.energy + equilibrium.weight_energy;
    if (!shapes.empty() && energy > least_energy + same) break;
    if (!isClear(equilibrium.nodes, scenario.rod, faces)) continue;
    if (shapes.empty()) least_energy = energy;
    shapes.push_back(equilibrium.nodes);
  }
  if (equilibria.empty())
    problem = "it has no stable equilibrium";
  else if (shapes.empty())
    problem = fmt::format("none of its {} stable equilibria is clear of contact", equilibria.size());
  return shapes;
}

/// A frame of the motion and the frame it must be near.
struct FramePair {
  std::string what;
  const Pose& actual;
  const Pose& expected;
};

/// The largest differences among pairs of frames, and where they are.
struct Deviation {
  double position = 0, angle = 0;  // m, rad
  std::string at_position, at_angle;

  void include(const FramePair& pair) {
    const double p = (pair.actual.position - pair.expected.position).norm();
    const double a = angleBetween(pair.actual.rotation, pair.expected.rotation);
    if (at_position.empty() || p > position) position = p, at_position = pair.what;
    if (at_angle.empty() || a > angle) angle = a, at_angle = pair.what;
  }
  [[nodiscard]] std::string words() const {
    return fmt::format("{:.6g} mm ({}) and {:.3g} rad ({})", 1e3 * position, at_position, angle, at_angle);
  }
};

/// Node by node, from the nearest of `candidates`.
Deviation shapeDeviation(const RodShape& actual, const std::vector<RodShape>& candidates) {
  std::optional<Deviation> nearest;
  for (const RodShape& expected : candidates) {
    Deviation deviation;
    for (std::size_t i = 0; i < actual.size(); ++i)
      deviation.include({fmt::format("node {}", i), actual[i], expected[i]});
    if (!nearest || deviation.position < nearest->position) nearest = deviation;
  }
  return *nearest;
}

Deviation gripperDeviation(const RodShape& actual, const GripperPoses& expected) {
  Deviation deviation;
  deviation.include({"first node", actual.front(), expected.first});
  deviation.include({"last node", actual.back(), expected.last});
  return deviation;
}

}  // namespace

Check checkStart(const Solution& solution, const FaceTree& faces) {
  Check check{"start", false, ""};
  const Scenario& scenario = solution.scenario;
  const RodShape& first = solution.trajectory.shapes.front();
  Deviation deviation;
  std::string compared = "frames given by the scenario's start";
  if (!scenario.start) {
    if (!scenario.start_pose) {
      check.message = "the scenario has no start";
      return check;
    }
    deviation.include({"first node", first.front(), *scenario.start_pose});
  } else if (solution.status != PlanStatus::simulated) {
    std::string problem;
    const std::vector<RodShape> shapes = shapesOf(*scenario.start, scenario, faces, problem);
    if (shapes.empty()) {
      check.message = "the scenario's start cannot be compared with: " + problem;
      return check;
    }
    deviation = shapeDeviation(first, shapes);
    compared = "scenario's start";
  } else if (const auto* grippers = std::get_if<GripperPoses>(&*scenario.start)) {
    deviation = gripperDeviation(first, *grippers);
  } else {
    deviation.include({"first node", first.front(), std::get<PoseAndWrench>(*scenario.start).pose});
  }
  const double allowed = kStartPosition * scenario.rod.length;
  check.passed = deviation.position <= allowed && deviation.angle <= kStartAngle;
  check.message = fmt::format("the first state is off the {} by at most {}; {:.6g} mm and {} rad are allowed",
                              compared, deviation.words(), 1e3 * allowed, kStartAngle);
  return check;
}

Check checkGoal(const Solution& solution, const FaceTree& faces) {
  Check check{"goal", false, ""};
  const Scenario& scenario = solution.scenario;
  if (!scenario.goal) {
    check.message = "the scenario has no goal";
    return check;
  }
  const Goal& goal = *scenario.goal;
  const RodShape& last = solution.trajectory.shapes.back();

  std::vector<RodShape> shapes;
  std::string problem;
  const auto* grippers = std::get_if<GripperPoses>(&goal.placement);
  if (!grippers || goal.shape_tolerance) shapes = shapesOf(goal.placement, scenario, faces, problem);
  if (!problem.empty()) {
    check.message = "the scenario's goal cannot be compared with: " + problem;
    return check;
  }
  const Deviation ends =
      gripperDeviation(last, grippers ? *grippers : GripperPoses{shapes[0].front(), shapes[0].back()});
  bool inside = ends.position <= goal.position_tolerance &&
                (!goal.angle_tolerance || ends.angle <= *goal.angle_tolerance);
  std::string measured =
      fmt::format("the last state's ends are off the goal's by at most {}; {:.6g} mm{} allowed", ends.words(),
                  1e3 * goal.position_tolerance,
                  goal.angle_tolerance ? fmt::format(" and {} rad are", *goal.angle_tolerance) : " is");
  if (goal.shape_tolerance) {
    const Deviation whole = shapeDeviation(last, shapes);
    inside = inside && whole.position <= *goal.shape_tolerance;
    measured += fmt::format("; its shape by at most {:.6g} mm ({}), {:.6g} mm is allowed",
                            1e3 * whole.position, whole.at_position, 1e3 * *goal.shape_tolerance);
  }
  check.passed = inside && solution.status == PlanStatus::solved;
  if (solution.status != PlanStatus::solved)
    check.message = fmt::format("not reached: the plan ended with {}; {}", name(solution.status), measured);
  else
    check.message = measured;
  return check;
}

}  // namespace tendril::verification
