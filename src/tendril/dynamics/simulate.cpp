#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tendril/dynamics.h"

namespace tendril {

Pose approach(const Pose& from, const Pose& target, const GripperLimits& limits, double dt) {
  const Vector3 way = target.position - from.position;
  const Vector3 turn = logSO3(from.rotation.conjugate() * target.rotation);
  const double distance = way.norm(), angle = turn.norm();
  const double longest = limits.max_speed * dt, widest = limits.max_turn * dt;
  Pose to = target;
  if (distance > longest) to.position = from.position + way * (longest / distance);
  if (angle > widest) to.rotation = (from.rotation * expSO3(turn * (widest / angle))).normalized();
  return to;
}

ControlRunner::ControlRunner(const RodModel& model, const Control& control, const RodState& state)
    : model_(model), control_(control), held_{state.nodes.front(), state.nodes.back()} {}

StepReport ControlRunner::advance(RodState& state, RodWorkspace& workspace, bool record_way_points) {
  std::array<GripperGoal, 2> goals;
  for (const End end : kBothEnds) {
    GripperGoal& goal = goals[static_cast<std::size_t>(end)];
    goal.held = control_.isHeld(end);
    goal.moving = control_.moving == end;
    if (goal.moving)
      goal.pose =
          approach(endPose(state.nodes, end), control_.target, model_.grippers, model_.simulation.time_step);
    else
      goal.pose = held_[static_cast<std::size_t>(end)];
  }
  return step(model_, goals, state, workspace, record_way_points);
}

int stepCount(const Control& control, double time_step) {
  const double steps = (control.end_s - control.start_s) / time_step;
  const double whole = std::round(steps);
  constexpr double kMostSteps = 1e9, kSlack = 1e-10;  // of time, relative
  if (!(whole <= kMostSteps))
    throw InputError(
        fmt::format("controls: from {} s to {} s is more than 1e9 time steps of {} s; shorten it.",
                    control.start_s, control.end_s, time_step));
  if (whole < 1 || std::abs(control.end_s - control.start_s - whole * time_step) >
                       kSlack * std::max(1.0, std::abs(control.end_s)))
    throw InputError(
        fmt::format("controls: from {} s to {} s is {} time steps of {} s; a control lasts a whole number of "
                    "steps, at least one.",
                    control.start_s, control.end_s, steps, time_step));
  return static_cast<int>(whole);
}

namespace {

/// How far a held end travels between two shapes, in units of its speed limits [s].
double travelTime(const RodShape& a, const RodShape& b, const std::array<bool, 2>& held,
                  const GripperLimits& limits) {
  double longest = 0;
  for (const End end : kBothEnds) {
    if (!held[static_cast<std::size_t>(end)]) continue;
    const Pose &p = endPose(a, end), &q = endPose(b, end);
    longest = std::max({longest, (q.position - p.position).norm() / limits.max_speed,
                        angleBetween(p.rotation, q.rotation) / limits.max_turn});
  }
  return longest;
}

}  // namespace

TrajectoryRecorder::TrajectoryRecorder(const RodModel& model, const RodShape& start) : model_(model) {
  trajectory_.time_s.push_back(0);
  const Grasp usual = model.grippers.grasps.front();  // until a control says otherwise
  trajectory_.held.push_back({usual != Grasp::last, usual != Grasp::first});
  trajectory_.shapes.push_back(start);
}

StepReport TrajectoryRecorder::advance(ControlRunner& runner, const Control& control, RodState& state,
                                       RodWorkspace& workspace) {
  Trajectory& out = trajectory_;
  if (steps_ == 0) out.held[0] = control.held;
  const StepReport report = runner.advance(state, workspace, true);
  ++steps_;
  const double before = out.time_s.back(), after = static_cast<double>(steps_) * model_.simulation.time_step;
  const auto way = workspace.wayPoints();
  // Way points share the step's time in proportion to how far the held ends travel, and a little each.
  const double dt = model_.simulation.time_step, least_share = 0.05 * dt;
  shares_.assign(way.size(), least_share);
  double total = 0, passed = 0;
  for (std::size_t j = 0; j < way.size(); ++j) {
    const RodShape& from = j == 0 ? out.shapes.back() : way[j - 1];
    shares_[j] += travelTime(from, way[j], control.held, model_.grippers);
    total += shares_[j];
  }
  too_fast_ = std::any_of(shares_.begin(), shares_.end(), [&](double share) {
    return share - least_share > 1.45 * dt * share / total;  // travel against the time it is given
  });
  for (std::size_t j = 0; j + 1 < way.size(); ++j) {
    passed += shares_[j];
    out.time_s.push_back(before + (after - before) * (passed / total));
    out.held.push_back(control.held);
    out.shapes.push_back(way[j]);
  }
  out.time_s.push_back(after);
  out.held.push_back(control.held);
  out.shapes.push_back(state.nodes);
  return report;
}

void TrajectoryRecorder::truncate(std::int64_t steps, std::size_t states) {
  steps_ = steps;
  trajectory_.time_s.resize(states);
  trajectory_.held.resize(states);
  trajectory_.shapes.resize(states);
}

SimulationResult simulate(const RodModel& model, const RodShape& start, std::span<const Control> controls,
                          const std::atomic<bool>* cancel, bool with_quantities) {
  SimulationResult result;
  result.final_state = RodState::atRest(start);
  RodWorkspace workspace;
  TrajectoryRecorder recorder(model, start);
  std::optional<QuantitiesRecorder> quantities;
  if (with_quantities) quantities.emplace(model, result.final_state, workspace);
  for (const Control& control : controls) {
    const int steps = stepCount(control, model.simulation.time_step);
    ControlRunner runner(model, control, result.final_state);
    for (int k = 0; k < steps && !result.cancelled; ++k) {
      if (cancel && *cancel) {
        result.cancelled = true;
        break;
      }
      recorder.advance(runner, control, result.final_state, workspace);
      if (quantities)
        quantities->record(recorder.time(), std::ssize(recorder.trajectory().shapes) - 1, result.final_state,
                           workspace);
    }
  }
  result.steps = recorder.steps();
  result.trajectory = recorder.take();
  if (quantities) result.quantities = quantities->take();
  return result;
}

}  // namespace tendril
