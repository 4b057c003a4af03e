/// tendril/dynamics.h: the geometrically exact rod with contact, friction and grippers, one time step at a
/// time.
///
/// Every step minimises an incremental potential by Newton's method; every Newton step is cut back by
/// continuous collision detection, so no iterate ever penetrates. src/tendril/dynamics/README.md has the
/// equations.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <vector>

#include "tendril/geometry.h"
#include "tendril/quantities.h"
#include "tendril/scenario.h"

namespace tendril {

/// The scenario's meshes in its order, scaled and placed. Throws InputError as loadMesh does.
[[nodiscard]] std::vector<TriangleMesh> loadMeshes(const Scenario& scenario);

/// How exactly a step is solved. The motion is free of penetration whatever stands here.
struct NewtonSettings {
  int max_iterations = 30;
  double tolerance =
      1e-3;  // largest node motion (L, rad) of the last iteration, whose error is about its square
};

/// Everything about a simulation that does not change while it runs. Refers to the obstacles, does not own
/// them.
struct RodModel {
  RodModel(const Scenario& scenario, const Obstacles& obstacles);

  RodProperties rod;
  SimulationSettings simulation;
  GripperLimits grippers;
  Box workspace;
  double friction = 0;
  Vector3 gravity = Vector3::Zero();
  NewtonSettings newton;
  const Obstacles* obstacles;
};

/// What one gripper does during one step.
struct GripperGoal {
  bool held = false;
  bool moving = false;  // false: the drive is braked and does not give way
  Pose pose;            // the pose the held end is driven to in this step; unused if free
};

struct StepReport {
  enum class Status { converged, iteration_limit, stalled } status = Status::converged;
  int iterations = 0;
  int contacts = 0;  // active contact terms at the end of the step
};

/// Scratch memory of step(): reused, so that a step allocates nothing after the first. One per thread.
class RodWorkspace {
 public:
  RodWorkspace();
  ~RodWorkspace();
  RodWorkspace(RodWorkspace&&) noexcept;
  /// The shapes the last step passed through, each reached from the one before (the first from the step's
  /// start) with every node on a straight line, certified free; the last is the step's result. One element if
  /// the straight line from start to result is itself free; at least one for each part of a step to
  /// tolerance.
  [[nodiscard]] std::span<const RodShape> wayPoints() const;

  struct Impl;
  [[nodiscard]] Impl& impl() { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

/// Advances `state` by the model's time step. `record_way_points` fills workspace.wayPoints().
StepReport step(const RodModel& model, const std::array<GripperGoal, 2>& goals, RodState& state,
                RodWorkspace& workspace, bool record_way_points = false);

/// The pose a gripper at `from` is driven to within one step toward `target`: straight line, shortest turn,
/// at most max_speed dt and max_turn dt.
[[nodiscard]] Pose approach(const Pose& from, const Pose& target, const GripperLimits& limits, double dt);

/// Carries out one control step by step: holds what is held at the pose it has at the start, moves what
/// moves.
class ControlRunner {
 public:
  ControlRunner(const RodModel& model, const Control& control, const RodState& state);
  /// One time step. Returns the step's report.
  StepReport advance(RodState& state, RodWorkspace& workspace, bool record_way_points = false);

 private:
  const RodModel& model_;
  Control control_;
  std::array<Pose, 2> held_;
};

/// Writes down a motion as it is simulated: every step, and the way points needed to prove it free.
class TrajectoryRecorder {
 public:
  /// Starts at time 0 with `start`, at rest.
  TrajectoryRecorder(const RodModel& model, const RodShape& start);
  /// Carries out and records one time step of `control` (kept by `runner`).
  StepReport advance(ControlRunner& runner, const Control& control, RodState& state, RodWorkspace& workspace);

  [[nodiscard]] std::int64_t steps() const { return steps_; }
  /// Whether the last step's way points carried a held end a longer way than 1.45 times its speed limit
  /// allows: the end went and came back within the step. A plan must not contain such a step.
  [[nodiscard]] bool tooFast() const { return too_fast_; }
  [[nodiscard]] double time() const { return trajectory_.time_s.back(); }
  /// Forgets all that came after `steps` steps. `states` is trajectory().shapes.size() as it was then.
  void truncate(std::int64_t steps, std::size_t states);
  [[nodiscard]] const Trajectory& trajectory() const { return trajectory_; }
  [[nodiscard]] Trajectory take() { return std::move(trajectory_); }

 private:
  const RodModel& model_;
  Trajectory trajectory_;
  std::int64_t steps_ = 0;
  std::vector<double> shares_;
  bool too_fast_ = false;
};

/// Measures `state`, the result of the last step() of `workspace`: all of Quantities but `time`, `state` and
/// what has been summed up since the start. Changes nothing that a later step depends on.
[[nodiscard]] Quantities measure(const RodModel& model, const RodState& state, RodWorkspace& workspace);

/// Measures a motion step by step, and keeps account of the work.
class QuantitiesRecorder {
 public:
  /// `start` is the state before the first step.
  QuantitiesRecorder(const RodModel& model, const RodState& start, RodWorkspace& workspace);
  /// Call after every step: `state` is its result, at `time` [s], the stored state number `stored`.
  void record(double time, std::int64_t stored, const RodState& state, RodWorkspace& workspace);
  [[nodiscard]] std::vector<Quantities> take() { return std::move(quantities_); }

 private:
  const RodModel& model_;
  double start_total_;
  std::array<Pose, 2> ends_;  // before the step
  std::vector<Quantities> quantities_;
};

/// What became of a simulation of several controls.
struct SimulationResult {
  Trajectory trajectory;
  RodState final_state;
  std::vector<Quantities> quantities;  // of every step, if asked for
  std::int64_t steps = 0;
  bool cancelled = false;
};

/// The number of time steps of a control; its times are multiples of the time step. Throws InputError if not.
[[nodiscard]] int stepCount(const Control& control, double time_step);

/// Simulates the controls from `start` (at rest). Deterministic: the same model, start and controls give the
/// same bytes, whether it is measured or not.
[[nodiscard]] SimulationResult simulate(const RodModel& model, const RodShape& start,
                                        std::span<const Control> controls,
                                        const std::atomic<bool>* cancel = nullptr,
                                        bool with_quantities = false);

}  // namespace tendril
