/// tendril/planner.h: Algorithms 1 (EXTEND) and 2 (RRT) of the paper on OMPL's control planners.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>

#include "tendril/dynamics.h"
#include "tendril/solution.h"
#include "tendril/statics.h"

namespace tendril {

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

}  // namespace tendril
