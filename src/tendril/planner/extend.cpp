#include "tendril/planner/extend.h"

#include <algorithm>
#include <cmath>

namespace tendril {

Extension algorithm1(End leading, const std::array<Pose, 2>& targets) {
  const auto target = [&](End end) { return targets[static_cast<std::size_t>(end)]; };
  return {{{.moving = leading, .hold_other = false, .target = target(leading)},
           {.moving = other(leading), .hold_other = true, .target = target(other(leading))}}};
}

ExtendSettings extendSettings(const RodModel& model, const PlannerSettings& settings, bool stalls) {
  return {.reach = settings.reach_fraction * model.rod.length,
          .phase_limit = settings.phase_limit_s,
          .stall_speed = stalls ? settings.stall_fraction * model.grippers.max_speed : 0};
}

/// Which ends are held in a phase; none if the scenario's grasps forbid the motion.
std::array<bool, 2> Extend::heldIn(const Phase& phase) const {
  const Grasp alone = phase.moving == End::first ? Grasp::first : Grasp::last;
  const bool may_hold_both = model_.grippers.allows(Grasp::both),
             may_hold_alone = model_.grippers.allows(alone);
  if (may_hold_both && (phase.hold_other || !may_hold_alone)) return {true, true};
  if (may_hold_alone) return {phase.moving == End::first, phase.moving == End::last};
  return {false, false};
}

bool Extend::arrived(const RodShape& shape, End end, const Pose& target) const {
  const Pose& q = endPose(shape, end);
  return (q.position - target.position).norm() <= settings_.reach &&
         angleBetween(q.rotation, target.rotation) <= kReachAngle;
}

/// One step of `control`, undone where a node leaves the workspace or, if recorded, a gripper would go too
/// fast.
Extend::Step Extend::advance(ControlRunner& runner, const Control& control, RodState& state,
                             RodWorkspace& workspace, TrajectoryRecorder* recorder) const {
  RodState before = state;
  const std::size_t states = recorder ? recorder->trajectory().shapes.size() : 0;
  if (recorder)
    recorder->advance(runner, control, state, workspace);
  else
    runner.advance(state, workspace);
  const bool inside = std::all_of(state.nodes.begin(), state.nodes.end(),
                                  [&](const Pose& node) { return model_.workspace.contains(node.position); });
  if (inside && !(recorder && recorder->tooFast())) return Step::done;
  std::swap(state, before);
  if (recorder) recorder->truncate(recorder->steps() - 1, states);
  return inside ? Step::too_fast : Step::left_workspace;
}

ExtendReport Extend::operator()(const Extension& extension, RodState& state, RodWorkspace& workspace,
                                const std::function<bool()>& stop, TrajectoryRecorder* recorder) const {
  ExtendReport report;
  const double dt = model_.simulation.time_step;
  const auto window = std::max<std::int64_t>(1, std::llround(kStallWindow / dt));
  const std::int64_t first_step = recorder ? recorder->steps() : 0;
  const auto now = [&] { return static_cast<double>(first_step + report.steps) * dt; };
  RodShape window_start;
  for (const Phase& phase : extension.phases) {
    const End moving = phase.moving;
    const auto longest = static_cast<std::int64_t>(std::ceil(settings_.phase_limit / (phase.speed * dt)));
    Control control;
    control.held = heldIn(phase);
    control.moving = moving;
    control.target = phase.target;
    if (!control.isHeld(moving)) continue;
    const auto begin = [&] {
      control.start_s = now();
      return ControlRunner(model_, control, state);
    };
    const auto end = [&] {
      control.end_s = now();
      if (control.end_s > control.start_s) report.controls.push_back(control);
    };
    std::optional<ControlRunner> runner = begin();
    const auto fullStep = [&] {
      const Step step = advance(*runner, control, state, workspace, recorder);
      if (step == Step::done) ++report.steps;
      return step;
    };
    // One step as a control of its own, at a share of the gripper's speed; 0: waits.
    const auto slowStep = [&](double speed) {
      Control slow = control;
      slow.start_s = now();
      slow.target = approach(endPose(state.nodes, moving), phase.target, model_.grippers, speed * dt);
      if (speed == 0) slow.moving.reset();
      ControlRunner slow_runner(model_, slow, state);
      const Step step = advance(slow_runner, slow, state, workspace, recorder);
      if (step == Step::done) {
        ++report.steps;
        slow.end_s = now();
        report.controls.push_back(slow);
        control.start_s = now();
      }
      return step;
    };
    for (std::int64_t steps = 0; steps < longest && !arrived(state.nodes, moving, phase.target); ++steps) {
      if (settings_.stall_speed > 0 && steps % window == 0) {
        const double least = phase.speed * settings_.stall_speed * static_cast<double>(window) * dt;
        if (steps > 0 && maxNodeDistance(window_start, state.nodes) < least) break;
        window_start = state.nodes;
      }
      if (stop()) {
        report.cancelled = true;
        break;
      }
      Step step = phase.speed < 1 ? slowStep(phase.speed) : fullStep();
      if (step == Step::too_fast) {
        // The rod snaps, and would carry its gripper along. Creep, or else wait, until that is over.
        end();
        step = slowStep(phase.speed * kCreep);
        if (step == Step::too_fast) step = slowStep(0);
        runner.emplace(begin());
      }
      report.left_workspace = report.left_workspace || step == Step::left_workspace;
      if (step != Step::done) break;
    }
    end();
    if (report.cancelled) break;
  }
  return report;
}

}  // namespace tendril
