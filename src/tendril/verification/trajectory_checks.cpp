#include "tendril/verification/trajectory_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tendril::verification {
namespace {

constexpr double kQuaternionTolerance = 1e-9;
constexpr double kLargestShear = 0.5;  // rad, an element's direction from its nodes' x axes
constexpr double kSmallestStretch = 0.8, kLargestStretch = 1.25;
constexpr double kLargestStep = 0.25;      // of L
constexpr double kSpeedAllowance = 1.5;    // of the limits
constexpr double kGripperGive = 0.02;      // of L: a held end is coupled to its gripper by a stiff spring
constexpr double kGripperGiveAngle = 0.1;  // rad
constexpr double kTimeTolerance = 1e-9;    // s, between a control's times and the states'

Check failed(Check check, std::string message) {
  check.passed = false;
  check.message = std::move(message);
  return check;
}

Check passed(Check check, std::string message) {
  check.passed = true;
  check.message = std::move(message);
  return check;
}

/// "state 203 (t = 4.06 s)"
std::string stateName(const Trajectory& trajectory, std::size_t k) {
  return fmt::format("state {} (t = {:.6g} s)", k, trajectory.time_s[k]);
}

/// "between states 202 and 203 (t = 4.04 s to 4.06 s)"
std::string stepName(const Trajectory& trajectory, std::size_t k) {
  return fmt::format("between states {} and {} (t = {:.6g} s to {:.6g} s)", k - 1, k,
                     trajectory.time_s[k - 1], trajectory.time_s[k]);
}

bool isFinite(const Pose& pose) { return pose.position.allFinite() && pose.rotation.coeffs().allFinite(); }

bool isUnit(const Quaternion& q) { return std::abs(q.norm() - 1) <= kQuaternionTolerance; }

std::string heldName(const std::array<bool, 2>& held) {
  if (held[0] && held[1]) return "[first, last]";
  return held[0] ? "[first]" : held[1] ? "[last]" : "[]";
}

bool allowed(const std::array<bool, 2>& held, const GripperLimits& limits) {
  if (!held[0] && !held[1]) return false;  // no grasp stands for a rod that nobody holds
  const Grasp grasp = held[0] && held[1] ? Grasp::both : held[0] ? Grasp::first : Grasp::last;
  return limits.allows(grasp);
}

/// The control during which the motion from state k - 1 to state k happens; null if none covers the whole of
/// it.
const Control* controlOfStep(const Solution& solution, std::size_t k) {
  const double from = solution.trajectory.time_s[k - 1], to = solution.trajectory.time_s[k];
  for (const Control& control : solution.controls)
    if (control.start_s <= from + kTimeTolerance && to <= control.end_s + kTimeTolerance) return &control;
  return nullptr;
}

/// The first state of the control that leads to state k: the state at (or first after) its start.
std::size_t firstState(const Solution& solution, const Control& control) {
  const auto& time = solution.trajectory.time_s;
  const auto it = std::lower_bound(time.begin(), time.end(), control.start_s - kTimeTolerance);
  return std::min(static_cast<std::size_t>(it - time.begin()), time.size() - 1);
}

}  // namespace

Check checkStructure(const Solution& solution) {
  Check check{"structure", false, ""};
  const Trajectory& trajectory = solution.trajectory;
  const std::size_t states = trajectory.shapes.size();
  const auto nodes = static_cast<std::size_t>(solution.scenario.rod.elements) + 1;
  if (states == 0) return failed(check, "the trajectory has no state");
  if (trajectory.time_s.size() != states || trajectory.held.size() != states)
    return failed(check, fmt::format("{} states, but {} times and {} lists of held ends", states,
                                     trajectory.time_s.size(), trajectory.held.size()));
  for (std::size_t k = 0; k < states; ++k) {
    if (!std::isfinite(trajectory.time_s[k]))
      return failed(check, fmt::format("the time of state {} is not finite", k));
    const RodShape& shape = trajectory.shapes[k];
    if (shape.size() != nodes)
      return failed(check, fmt::format("{} has {} nodes; {} elements need {}", stateName(trajectory, k),
                                       shape.size(), nodes - 1, nodes));
    for (std::size_t i = 0; i < nodes; ++i)
      if (!isFinite(shape[i]))
        return failed(check, fmt::format("node {} of {} is not finite", i, stateName(trajectory, k)));
  }
  return passed(check,
                fmt::format("{} states of {} nodes, {:.6g} s", states, nodes, trajectory.time_s.back()));
}

Check checkTimes(const Trajectory& trajectory) {
  Check check{"times", false, ""};
  const auto& time = trajectory.time_s;
  if (time[0] != 0) return failed(check, fmt::format("the first time is {:.6g} s and must be 0", time[0]));
  for (std::size_t k = 1; k < time.size(); ++k)
    if (!(time[k] > time[k - 1]))
      return failed(
          check,
          fmt::format("the time of state {}, {:.17g} s, does not come after that of state {}, {:.17g} s", k,
                      time[k], k - 1, time[k - 1]));
  return passed(check, "from 0, strictly increasing");
}

Check checkQuaternions(const Trajectory& trajectory) {
  Check check{"quaternions", false, ""};
  for (std::size_t k = 0; k < trajectory.shapes.size(); ++k)
    for (std::size_t i = 0; i < trajectory.shapes[k].size(); ++i) {
      const Quaternion& q = trajectory.shapes[k][i].rotation;
      if (!isUnit(q))
        return failed(check, fmt::format("the quaternion of node {} of {} has norm 1 {:+.3g}", i,
                                         stateName(trajectory, k), q.norm() - 1));
    }
  return passed(check, "all of norm 1 to 1e-9");
}

Check checkFrames(const Trajectory& trajectory) {
  Check check{"frames", false, ""};
  double largest = 0;
  for (std::size_t k = 0; k < trajectory.shapes.size(); ++k) {
    const RodShape& shape = trajectory.shapes[k];
    for (std::size_t i = 0; i + 1 < shape.size(); ++i) {
      const Vector3 chord = shape[i + 1].position - shape[i].position;
      const Vector3 tangent = shape[i].rotation * Vector3::UnitX() + shape[i + 1].rotation * Vector3::UnitX();
      const double angle = std::atan2(chord.cross(tangent).norm(), chord.dot(tangent));
      // With no direction to speak of (a zero chord, opposite tangents) the angle means nothing.
      if (!(chord.norm() > 0 && tangent.norm() > 1e-6) || !(angle <= kLargestShear))
        return failed(
            check,
            fmt::format("element {} of {} runs at {:.3g} rad to its nodes' x axes; at most {} rad of shear "
                        "can be believed",
                        i, stateName(trajectory, k), angle, kLargestShear));
      largest = std::max(largest, angle);
    }
  }
  return passed(check, fmt::format("elements run within {:.3g} rad of their nodes' x axes", largest));
}

Check checkWorkspace(const Trajectory& trajectory, const Box& workspace) {
  Check check{"workspace", false, ""};
  for (std::size_t k = 0; k < trajectory.shapes.size(); ++k)
    for (std::size_t i = 0; i < trajectory.shapes[k].size(); ++i) {
      const Vector3& p = trajectory.shapes[k][i].position;
      const Vector3 outside = (workspace.min - p).cwiseMax(p - workspace.max);
      Eigen::Index axis;
      const double distance = outside.maxCoeff(&axis);
      if (distance > 0)
        return failed(check, fmt::format("node {} of {} is {:.6g} mm outside the workspace along {}", i,
                                         stateName(trajectory, k), 1e3 * distance, "xyz"[axis]));
    }
  return passed(check, "every node inside at every moment");
}

Check checkStretch(const Trajectory& trajectory, const RodProperties& rod) {
  Check check{"stretch", false, ""};
  const double h = rod.elementLength();
  double shortest = std::numeric_limits<double>::infinity(), longest = 0;
  const auto fail = [&](std::size_t i, double stretch, const std::string& where) {
    return failed(check, fmt::format("element {} {} is {:.6g} of its rest length; {} to {} is allowed", i,
                                     where, stretch, kSmallestStretch, kLargestStretch));
  };
  for (std::size_t k = 0; k < trajectory.shapes.size(); ++k) {
    const RodShape& to = trajectory.shapes[k];
    const RodShape& from = trajectory.shapes[k == 0 ? 0 : k - 1];
    for (std::size_t i = 0; i + 1 < to.size(); ++i) {
      // a + t b, t in [0, 1]: its length is convex in t, so it is largest at an end and smallest at t =
      // -a.b/b.b
      const Vector3 a = from[i + 1].position - from[i].position;
      const Vector3 b = to[i + 1].position - to[i].position - a;
      const double at_state = (a + b).norm() / h;
      if (!(at_state >= kSmallestStretch && at_state <= kLargestStretch))
        return fail(i, at_state, "of " + stateName(trajectory, k));
      const double b2 = b.squaredNorm(), t = b2 > 0 ? std::clamp(-a.dot(b) / b2, 0.0, 1.0) : 0;
      const double least = std::min(at_state, (a + t * b).norm() / h);
      if (!(least >= kSmallestStretch)) return fail(i, least, stepName(trajectory, k));
      shortest = std::min(shortest, least), longest = std::max(longest, at_state);
    }
  }
  return passed(check, fmt::format("elements {:.6g} to {:.6g} of their rest length", shortest, longest));
}

Check checkSteps(const Trajectory& trajectory, const RodProperties& rod) {
  Check check{"steps", false, ""};
  double largest = 0;
  for (std::size_t k = 1; k < trajectory.shapes.size(); ++k)
    for (std::size_t i = 0; i < trajectory.shapes[k].size(); ++i) {
      const double moved = (trajectory.shapes[k][i].position - trajectory.shapes[k - 1][i].position).norm();
      if (!(moved <= kLargestStep * rod.length))
        return failed(
            check,
            fmt::format("node {} moves {:.6g} mm {}; at most {} of the length, {:.6g} mm, is allowed", i,
                        1e3 * moved, stepName(trajectory, k), kLargestStep, 1e3 * kLargestStep * rod.length));
      largest = std::max(largest, moved);
    }
  return passed(check, fmt::format("no node moves more than {:.6g} mm between states", 1e3 * largest));
}

Check checkControls(const Solution& solution) {
  Check check{"controls", false, ""};
  const double end = solution.trajectory.time_s.back();
  double covered = 0;
  for (std::size_t c = 0; c < solution.controls.size(); ++c) {
    const Control& control = solution.controls[c];
    if (!(std::abs(control.start_s - covered) <= kTimeTolerance))
      return failed(
          check,
          fmt::format("control {} starts at {:.12g} s; it must start where the one before ends, at {:.12g} s",
                      c, control.start_s, covered));
    if (!(control.end_s > control.start_s) || !std::isfinite(control.end_s))
      return failed(check, fmt::format("control {} ends at {:.12g} s, not after its start at {:.12g} s", c,
                                       control.end_s, control.start_s));
    covered = control.end_s;
    if (!allowed(control.held, solution.scenario.grippers))
      return failed(check, fmt::format("control {} holds {}, which is not among the scenario's grasps", c,
                                       heldName(control.held)));
    if (!control.moving) continue;
    if (!control.isHeld(*control.moving))
      return failed(check, fmt::format("control {} moves the {} end but holds {}", c, name(*control.moving),
                                       heldName(control.held)));
    if (!isFinite(control.target) || !isUnit(control.target.rotation))
      return failed(
          check,
          fmt::format(
              "the target of control {} is no pose: its numbers must be finite, its quaternion of norm "
              "1 to 1e-9",
              c));
  }
  if (!(covered >= end - kTimeTolerance))
    return failed(check,
                  fmt::format("the controls end at {:.12g} s, the trajectory at {:.12g} s", covered, end));
  if (solution.status == PlanStatus::solved && covered > end + kTimeTolerance)
    return failed(
        check,
        fmt::format("the controls go on to {:.12g} s, after the goal is reached at {:.12g} s", covered, end));
  for (std::size_t k = 1; k < solution.trajectory.shapes.size(); ++k)
    if (!controlOfStep(solution, k))
      return failed(
          check,
          fmt::format("no single control covers the motion {}; every control must begin and end at a state",
                      stepName(solution.trajectory, k)));
  return passed(check, fmt::format("{} controls cover the trajectory", solution.controls.size()));
}

Check checkHeld(const Solution& solution) {
  Check check{"held", false, ""};
  const Trajectory& trajectory = solution.trajectory;
  const double give = kGripperGive * solution.scenario.rod.length;
  double farthest = 0, most_turned = 0;
  for (std::size_t k = 0; k < trajectory.shapes.size() && !solution.controls.empty(); ++k) {
    const Control* control = k == 0 ? &solution.controls[0] : controlOfStep(solution, k);
    if (!control) continue;  // checkControls says so
    if (trajectory.held[k] != control->held)
      return failed(check,
                    fmt::format("{} says that {} are held, its control holds {}", stateName(trajectory, k),
                                heldName(trajectory.held[k]), heldName(control->held)));
    const std::size_t first = firstState(solution, *control);
    for (const End end : kBothEnds) {
      if (!control->isHeld(end) || control->moving == end) continue;
      const Pose &kept = endPose(trajectory.shapes[first], end), &now = endPose(trajectory.shapes[k], end);
      const double moved = (now.position - kept.position).norm(),
                   turned = angleBetween(kept.rotation, now.rotation);
      if (!(moved <= give && turned <= kGripperGiveAngle))
        return failed(
            check,
            fmt::format("the {} end is held still, but at {} it is {:.6g} mm and {:.3g} rad from where "
                        "it was at {}; its gripper gives at most {:.6g} mm and {} rad",
                        name(end), stateName(trajectory, k), 1e3 * moved, turned,
                        stateName(trajectory, first), 1e3 * give, kGripperGiveAngle));
      farthest = std::max(farthest, moved), most_turned = std::max(most_turned, turned);
    }
  }
  return passed(
      check, fmt::format("as the controls say; ends held still keep their pose to {:.6g} mm and {:.3g} rad",
                         1e3 * farthest, most_turned));
}

Check checkSpeed(const Solution& solution) {
  Check check{"speed", false, ""};
  const Trajectory& trajectory = solution.trajectory;
  const GripperLimits& limits = solution.scenario.grippers;
  double fastest = 0, fastest_turn = 0;
  for (std::size_t k = 1; k < trajectory.shapes.size(); ++k)
    for (const End end : kBothEnds) {
      if (!trajectory.held[k][static_cast<std::size_t>(end)]) continue;
      const Pose &from = endPose(trajectory.shapes[k - 1], end), &to = endPose(trajectory.shapes[k], end);
      const double dt = trajectory.time_s[k] - trajectory.time_s[k - 1];
      const double speed = (to.position - from.position).norm() / dt;
      const double turn = angleBetween(from.rotation, to.rotation) / dt;
      if (speed > kSpeedAllowance * limits.max_speed)
        return failed(
            check,
            fmt::format("the held {} end moves at {:.6g} m/s {}; {} times max_speed_m_s is {:.6g}", name(end),
                        speed, stepName(trajectory, k), kSpeedAllowance, kSpeedAllowance * limits.max_speed));
      if (turn > kSpeedAllowance * limits.max_turn)
        return failed(
            check, fmt::format("the held {} end turns at {:.6g} rad/s {}; {} times max_turn_rad_s is {:.6g}",
                               name(end), turn, stepName(trajectory, k), kSpeedAllowance,
                               kSpeedAllowance * limits.max_turn));
      fastest = std::max(fastest, speed), fastest_turn = std::max(fastest_turn, turn);
    }
  return passed(check, fmt::format("held ends move at up to {:.6g} m/s and turn at up to {:.6g} rad/s",
                                   fastest, fastest_turn));
}

}  // namespace tendril::verification
