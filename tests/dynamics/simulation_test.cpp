/// Properties of stepping as a whole: settling onto the statics, determinism, allocation.
#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

#include "dynamics/scenes.h"
#include "tendril/statics.h"

namespace {
std::size_t allocations = 0;  // counted by the replaced operator new below
}

[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* p = std::malloc(size == 0 ? 1 : size)) return p;
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(size == 0 ? 1 : size);
}
[[gnu::noinline]] void operator delete(void* p) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept { std::free(p); }

namespace tendril {
namespace {

using namespace scenes;

TEST(Simulation, SettlesOntoTheStaticShapeForTheSameGrippersWithFourthOrder) {
  // Section 2.3: both models share c, so the dynamic rod held at a static equilibrium's ends stays at that
  // equilibrium, but for its discretisation.
  const Obstacles o = nothing();
  const auto errorWith = [&](int elements) {
    Scenario s = rodScenario(5e7, elements);
    s.simulation.inertia = false;
    s.simulation.drag = 0.01;
    s.simulation.time_step = 0.5;
    s.simulation.stiffness_damping = 0;
    s.grippers.max_force = 1e6, s.grippers.max_torque = 1e6;  // clamps
    RodModel model(s, o);
    model.newton.tolerance = 1e-8;
    SamplingSpace space;
    space.box = {.moment = 4, .force = 20};
    RodSampler sampler(s.rod, space, 5);
    double largest = 0;
    for (int trial = 0; trial < 10; ++trial) {
      const Equilibrium& rod = *sampler.next();
      RodState state = RodState::atRest(rod.nodes);
      RodWorkspace workspace;
      std::array<GripperGoal, 2> goals;
      goals[0] = {true, false, rod.nodes.front()}, goals[1] = {true, false, rod.nodes.back()};
      for (int k = 0; k < 60; ++k) step(model, goals, state, workspace);
      largest = std::max(largest, maxNodeDistance(state.nodes, rod.nodes));
    }
    return largest;
  };
  const double coarse = errorWith(20), fine = errorWith(40);
  EXPECT_LT(coarse, 1e-4);
  EXPECT_LT(fine, coarse / 12);
}

Scenario pushScenario() {
  Scenario s = rodScenario(5e7, 20);
  s.environment.friction = 0.2;
  return s;
}

TEST(Simulation, SameControlsGiveTheSameBytesWhateverTheWorkspaceDidBefore) {
  const Scenario s = pushScenario();
  const Obstacles o = obstaclesOf({block({-0.3, -0.3, -0.5}, {0.3, 0.3, -0.015})});
  const RodModel model(s, o);
  const RodShape start = straight({Quaternion::Identity(), {-0.5, 0, 0}}, 1, 20);
  Control push;
  push.end_s = 0.6, push.held = {true, true}, push.moving = End::last,
  push.target.position = {0.2, 0.3, -0.2};
  const std::vector<Control> controls = {push};
  const SimulationResult a = simulate(model, start, controls), b = simulate(model, start, controls);
  ASSERT_EQ(a.trajectory.shapes.size(), b.trajectory.shapes.size());
  EXPECT_EQ(a.trajectory.time_s, b.trajectory.time_s);
  EXPECT_EQ(a.steps, 30);
  EXPECT_DOUBLE_EQ(a.trajectory.time_s.back(), 0.6);
  for (std::size_t k = 0; k < a.trajectory.shapes.size(); ++k)
    EXPECT_EQ(maxNodeDistance(a.trajectory.shapes[k], b.trajectory.shapes[k]), 0);

  // The planner's way: stepping without recording, in a workspace that has served another rod.
  RodWorkspace used;
  RodState other = RodState::atRest(straight({Quaternion::Identity(), {-0.5, 0, 0.1}}, 1, 20));
  for (int k = 0; k < 5; ++k) step(model, {}, other, used);
  RodState state = RodState::atRest(start);
  ControlRunner runner(model, push, state);
  for (int k = 0; k < 30; ++k) runner.advance(state, used);
  EXPECT_EQ(maxNodeDistance(state.nodes, a.trajectory.shapes.back()), 0);
}

TEST(Simulation, AStepToToleranceErrsNoMoreThanTheTolerancesOfItsSteps) {
  // A heavy cantilever falls for 0.4 s: from steps of 40 ms, against 0.1 ms.
  const Obstacles o = nothing();
  const auto fallen = [&](double time_step, double tolerance, Scheme scheme) {
    Scenario s = rodScenario(1e8, 20);
    s.environment.gravity = {0, 0, -9.81};
    s.simulation.time_step = time_step;
    s.simulation.step_tolerance = tolerance;
    s.simulation.scheme = scheme;
    s.simulation.newton_tolerance = 1e-5;
    s.grippers.max_force = 1e6, s.grippers.max_torque = 1e6;
    const RodModel model(s, o);
    RodState state = RodState::atRest(straight({}, 1, 20));
    RodWorkspace workspace;
    Control clamp;
    clamp.held = {true, false};
    ControlRunner runner(model, clamp, state);
    const auto steps = static_cast<int>(std::lround(0.4 / time_step));
    for (int k = 0; k < steps; ++k) runner.advance(state, workspace);
    return state.nodes;
  };
  const RodShape exact = fallen(1e-4, 0, Scheme::second_order);
  for (const double tolerance : {3e-3, 3e-4}) {
    const double error = maxNodeDistance(fallen(0.04, tolerance, Scheme::second_order), exact);
    EXPECT_LT(error, 10 * tolerance);
    EXPECT_LT(error, 0.5 * maxNodeDistance(fallen(0.04, 0, Scheme::second_order), exact));
  }
  EXPECT_LT(maxNodeDistance(fallen(0.04, 3e-3, Scheme::implicit_euler), exact), 10 * 3e-3);
}

TEST(Simulation, AStepInPartsIsRecordedWithoutGaps) {
  Scenario s = pushScenario();
  s.simulation.step_tolerance = 1e-4;
  const Obstacles o = obstaclesOf({block({-0.3, -0.3, -0.5}, {0.3, 0.3, -0.015})});
  const RodModel model(s, o);
  Control push;
  push.end_s = 0.6, push.held = {true, true}, push.moving = End::last;
  push.target.position = {0.2, 0.3, -0.2};
  const std::vector<Control> controls = {push};
  const SimulationResult run =
      simulate(model, straight({Quaternion::Identity(), {-0.5, 0, 0}}, 1, 20), controls);
  EXPECT_EQ(run.steps, 30);
  for (std::size_t k = 1; k < run.trajectory.shapes.size(); ++k) {
    EXPECT_GT(run.trajectory.time_s[k], run.trajectory.time_s[k - 1]);
    RodShape between = run.trajectory.shapes[k];
    for (std::size_t i = 0; i < between.size(); ++i)
      between[i].position = 0.5 * (between[i].position + run.trajectory.shapes[k - 1][i].position);
    EXPECT_GT(bruteForceDistance(between, o), s.rod.radius);
  }
}

TEST(Simulation, StepAllocatesNothingAfterTheFirstInContact) {
  const Scenario s = pushScenario();
  const Obstacles o = obstaclesOf({block({-0.3, -0.3, -0.5}, {0.3, 0.3, -0.015})});
  const RodModel model(s, o);
  RodState state = RodState::atRest(straight({Quaternion::Identity(), {-0.5, 0, 0}}, 1, 20));
  RodWorkspace workspace;
  std::array<GripperGoal, 2> goals;
  goals[0] = {true, true, {Quaternion::Identity(), {-0.5, 0, -0.06}}};
  goals[1] = {true, true, {Quaternion::Identity(), {0.5, 0, -0.06}}};
  for (int k = 0; k < 10; ++k) step(model, goals, state, workspace);
  const std::size_t before = allocations;
  int contacts = 0;
  for (int k = 0; k < 100; ++k) contacts += step(model, goals, state, workspace).contacts;
  EXPECT_EQ(allocations, before);
  EXPECT_GT(contacts, 100);
}

TEST(Simulation, ControlThatIsNoWholeNumberOfStepsIsRefused) {
  Control control;
  control.end_s = 0.05;
  EXPECT_THROW((void)stepCount(control, 0.02), InputError);
  control.end_s = 0.06;
  EXPECT_EQ(stepCount(control, 0.02), 3);
}

}  // namespace
}  // namespace tendril
