/// Algorithm 1 of the paper: EXTEND moves first one gripper, then the other, toward a target; and whatever
/// other phases a strategy proposes. Private to planner.
#pragma once

#include <functional>

#include "tendril/planner.h"

namespace tendril {

/// Algorithm 1's two phases: the leading gripper moves to its target with the other end let go (the paper
/// leaves that open: "both or only one of its extremities"), then the other one with the leading end held.
[[nodiscard]] Extension algorithm1(End leading, const std::array<Pose, 2>& targets);

/// The constant side of EXTEND.
struct ExtendSettings {
  double reach = 0.01;       // epsilon, m: a gripper has arrived within this of its target (and kReachAngle)
  double phase_limit = 2.0;  // s of simulated time a phase may take
  double stall_speed =
      0;  // m/s: a phase also ends when no node moves faster than this over kStallWindow; 0: never
};
/// As the scenario has them; without stalls a phase that is stuck goes on to its limit.
[[nodiscard]] ExtendSettings extendSettings(const RodModel& model, const PlannerSettings& settings,
                                            bool stalls);
inline constexpr double kReachAngle = 0.1;   // rad
inline constexpr double kStallWindow = 0.1;  // s
inline constexpr double kCreep = 0.25;       // of a gripper's speed, where the rod snaps

/// What EXTEND did. `controls` are its phases, for the solution; times [s] count from the recorder's start,
/// or from the extension's where nothing is recorded.
struct ExtendReport {
  std::vector<Control> controls;
  std::int64_t steps = 0;
  bool cancelled = false;
  bool left_workspace = false;  // a phase ended because a node would have
};

/// Carries an extension out from `state`, phase by phase; the other end is held or let go as the phase
/// wishes, or, where the scenario's grasps forbid it, the other way; a phase they forbid altogether is left
/// out. The loops run while the distance is > epsilon (the paper prints <) and no longer than phase_limit at
/// full speed; a slow phase has a control for every step. A phase that would carry a node out of the
/// workspace ends with the last state inside. With a recorder the motion is written down; where a step is
/// TrajectoryRecorder::tooFast() the gripper creeps or waits for a step (as controls of their own), and the
/// phase ends if that does not help. `stop` is asked before every step.
class Extend {
 public:
  Extend(const RodModel& model, const ExtendSettings& settings) : model_(model), settings_(settings) {}

  ExtendReport operator()(const Extension& extension, RodState& state, RodWorkspace& workspace,
                          const std::function<bool()>& stop, TrajectoryRecorder* recorder = nullptr) const;

 private:
  enum class Step { done, left_workspace, too_fast };
  Step advance(ControlRunner& runner, const Control& control, RodState& state, RodWorkspace& workspace,
               TrajectoryRecorder* recorder) const;
  [[nodiscard]] std::array<bool, 2> heldIn(const Phase& phase) const;
  [[nodiscard]] bool arrived(const RodShape& shape, End end, const Pose& target) const;

  const RodModel& model_;
  ExtendSettings settings_;
};

}  // namespace tendril
