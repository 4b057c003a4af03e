/// tendril/planner.h: Algorithms 1 (EXTEND) and 2 (RRT) of the paper on OMPL, and the planner `tendril`.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <limits>
#include <memory>

#include "tendril/dynamics.h"
#include "tendril/solution.h"
#include "tendril/statics.h"

namespace tendril {

/// One phase of an extension: one gripper moves to a pose, the other end is held where it is or let go.
struct Phase {
  End moving = End::first;
  bool hold_other = false;
  Pose target;
  double speed = 1;  // in (0, 1]: share of the gripper's largest speeds
};

/// What the planner decides at once, an OMPL control: phases carried out one after the other.
struct Extension {
  std::vector<Phase> phases;
};

/// A way to grow the tree. Derive from it, and plan with it beside the built-in ones
/// (PlanRequest::strategies); examples/own_strategy.cpp is one in a file.
class ExtendStrategy {
 public:
  virtual ~ExtendStrategy() = default;

  /// From one state of the tree on: called with the rod as it is (world frame, m), gives the next extension,
  /// or nothing when done. Every state it leads to joins the tree.
  using Steps = std::function<std::optional<Extension>(const RodShape& now)>;
  /// Starts to grow from `from` toward `target`, a stable rod of as many nodes. All chance must come from
  /// `random`, or plans are not reproducible. Must be safe to call from several threads.
  [[nodiscard]] virtual Steps begin(const RodProperties& rod, const RodShape& from, const RodShape& target,
                                    Random& random) const = 0;
};

/// A strategy and how often it is taken, in proportion to the shares of the others.
struct StrategyShare {
  double share = 1;
  std::shared_ptr<const ExtendStrategy> strategy;
};

struct PlanProgress {
  double elapsed_s = 0;
  std::int64_t states = 0, steps = 0;
  double nearest_m = 0;  // distance (6) of the nearest state to the goal's shape
};

struct PlanRequest {
  std::string planner =
      "tendril";  // tendril, paper, or an OMPL control planner: RRT, KPIECE1, EST, SST, PDST
  std::uint64_t seed = 1;
  double time_limit_s = 1200;  // loading and planning, counted from `started`
  std::chrono::steady_clock::time_point started = std::chrono::steady_clock::now();
  int threads = 1;
  const std::atomic<bool>* cancel = nullptr;             // set by Ctrl-C
  std::function<void(const PlanProgress&)> on_progress;  // may be empty; called a few times a second
  std::vector<StrategyShare> strategies;  // besides the built-in ones, whose shares add up to 1; tendril only
};

/// Names --planner accepts.
[[nodiscard]] const std::vector<std::string>& plannerNames();

/// The scenario's start as a shape of rod.elements elements. Throws InputError saying which of static
/// equilibrium, clear of the meshes, stable fails, where (node, face, millimetres) and what to change. With
/// `any_shape` (simulate) it only has to be clear of the meshes.
[[nodiscard]] RodShape startShape(const Scenario& scenario, const Obstacles& obstacles,
                                  bool any_shape = false);
/// The goal's shape: the stable, contact-free equilibrium of least energy at the goal. Throws InputError as
/// above.
[[nodiscard]] RodShape goalShape(const Scenario& scenario, const Obstacles& obstacles);

/// What a scenario's static rods are drawn from: stable, whole in the workspace, clear, under its gravity.
/// Refers to `obstacles`.
[[nodiscard]] SamplingSpace samplingSpace(const Scenario& scenario, const Obstacles& obstacles);

/// Plans. The result's status is `solved` only for an exact solution, still to be verified by the caller;
/// otherwise its trajectory is the motion that came nearest to the goal. Fills everything but run.version,
/// run.host, mesh hashes. Reseeds OMPL's generators, so one call at a time per process. Throws InputError on
/// a bad start, goal or planner name.
[[nodiscard]] Solution plan(const Scenario& scenario, const Obstacles& obstacles, const PlanRequest& request);

/// What a motion costs. Forces are those of Quantities at the end of every step.
struct MotionCost {
  double time = 0;           // s
  double path = 0;           // m, way of both gripped ends while they are gripped
  double turn = 0;           // rad, likewise
  double gripper_force = 0;  // N, the largest
  double contact_force = 0;  // N, the largest at one contact
};

/// Calls visit(key, member) for every number of MotionCost.
template <class Visit>
void visitMotionCost(Visit&& visit) {
  visit("motion_time_s", &MotionCost::time);
  visit("gripper_path_m", &MotionCost::path);
  visit("gripper_turn_rad", &MotionCost::turn);
  visit("largest_gripper_force_n", &MotionCost::gripper_force);
  visit("largest_contact_force_n", &MotionCost::contact_force);
}

struct OptimizeRequest {
  double time_limit_s = std::numeric_limits<double>::infinity();              // from the call on
  std::int64_t candidates = std::numeric_limits<std::int64_t>::max();         // tried at most
  const std::atomic<bool>* cancel = nullptr;                                  // set by Ctrl-C
  std::function<void(const MotionCost& best, double elapsed_s)> on_progress;  // may be empty
};

struct Improvement {
  Solution solution;
  MotionCost before, after;
  std::int64_t candidates = 0, accepted = 0;
};

/// Improves a solved plan of the library's for as long as the request allows, by random changes, each
/// simulated exactly. No number of MotionCost grows, and the sum of their ratios to those of `plan` falls
/// with every change accepted; the goal region is reached. Chance comes from the plan's seed, so the result
/// is a function of the plan and of the number of candidates. Still to be verified by the caller, who keeps
/// `plan` until then.
[[nodiscard]] Improvement optimize(const Solution& plan, const Obstacles& obstacles,
                                   const OptimizeRequest& request);

}  // namespace tendril
