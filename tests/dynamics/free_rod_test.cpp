/// The rod without obstacles: against independent solutions of the Cosserat boundary value problem and exact
/// laws.
#include <gtest/gtest.h>

#include <cmath>

#include "dynamics/scenes.h"

namespace tendril {
namespace {

using scenes::nothing;
using scenes::rodScenario;
using scenes::straight;

/// The tip of a rod clamped horizontally at its first node, settled under gravity.
Vector3 settledTip(double young_modulus, int elements) {
  Scenario s = rodScenario(young_modulus, elements);
  s.environment.gravity = {0, 0, -9.81};
  s.simulation.inertia = false;
  s.simulation.drag = 0.1;
  s.simulation.stiffness_damping = 0;
  s.simulation.time_step = 0.5;
  s.grippers.max_force = 1e6, s.grippers.max_torque = 1e6;  // a clamp
  const Obstacles obstacles = nothing();
  RodModel model(s, obstacles);
  model.newton.tolerance = 1e-10;
  RodState state = RodState::atRest(straight({}, 1, elements));
  RodWorkspace workspace;
  Control clamp;
  clamp.held = {true, false};
  ControlRunner runner(model, clamp, state);
  for (int k = 0; k < 3000; ++k) {
    const Vector3 before = state.nodes.back().position;
    runner.advance(state, workspace);
    if ((state.nodes.back().position - before).norm() < 1e-9) break;
  }
  return state.nodes.back().position;
}

TEST(FreeRod, HeavyCantileverSettlesOntoTheCosseratSolution) {
  // Tip (x, z) of the boundary value problem solved to a residual of 1e-9.
  const Vector3 soft = settledTip(1e6, 40), stiff = settledTip(1e8, 40);
  EXPECT_LT((soft - Vector3(0.074541, 0, -0.975029)).norm(), 3e-5) << soft.transpose();
  EXPECT_LT((stiff - Vector3(0.893350, 0, -0.419313)).norm(), 2e-6) << stiff.transpose();
}

TEST(FreeRod, FreeMotionDecaysAsExpOfMinusDragTimesTime) {
  Scenario s = rodScenario(5e7, 10);
  s.simulation.time_step = 0.001;
  s.simulation.drag = 2;
  s.simulation.scheme = Scheme::second_order;
  const Obstacles obstacles = nothing();
  const RodModel model(s, obstacles);
  RodState state = RodState::atRest(straight({}, 1, 10));
  for (Vector6& v : state.velocities) v << 0, 0, 0, 0.3, -0.2, 0.1;
  RodWorkspace workspace;
  for (int k = 0; k < 500; ++k) step(model, {}, state, workspace);
  const double left = std::exp(-2 * 0.5);
  EXPECT_NEAR(state.velocities[3][3], 0.3 * left, 0.3 * 2e-3);
  EXPECT_NEAR(state.nodes[5].position.y(), -0.2 * (1 - left) / 2, 2e-4);
}

/// The velocity of node i's mass: an end node's sits a sixth of an element inside.
Vector3 massVelocity(const RodState& state, std::size_t i) {
  const double inside = 1.0 / 6 / static_cast<double>(state.nodes.size() - 1);
  const double offset = i == 0 ? inside : i + 1 == state.nodes.size() ? -inside : 0;
  const Vector3 w = state.velocities[i].head<3>();
  return state.velocities[i].tail<3>() + state.nodes[i].rotation * w.cross(Vector3(offset, 0, 0));
}

TEST(FreeRod, FreeFlightConservesMomentum) {
  Scenario s = rodScenario(5e7, 20);
  s.simulation.drag = 0;
  const Obstacles obstacles = nothing();
  const RodModel model(s, obstacles);
  RodState state = RodState::atRest(straight({}, 1, 20));
  Random random(3);
  for (Vector6& v : state.velocities)
    for (int i = 3; i < 6; ++i) v[i] = random.uniform(-0.3, 0.3);
  const auto momentum = [&] {
    Vector3 sum = Vector3::Zero();
    for (std::size_t i = 0; i < state.nodes.size(); ++i)
      sum += (i == 0 || i == 20 ? 0.5 : 1.0) * massVelocity(state, i);
    return sum;
  };
  const Vector3 before = momentum();
  RodWorkspace workspace;
  for (int k = 0; k < 100; ++k) step(model, {}, state, workspace);
  EXPECT_LT((momentum() - before).norm(), 1e-3 * before.norm());
}

TEST(FreeRod, SecondOrderSchemeFollowsTheUndampedFallOfACantilever) {
  // E = 1e8, undamped: tip about (0.616, -0.720) at 0.5 s and (0.9993, 0.011) at 1 s.
  Scenario s = rodScenario(1e8, 40);
  s.environment.gravity = {0, 0, -9.81};
  s.simulation = {.inertia = true,
                  .scheme = Scheme::second_order,
                  .time_step = 0.001,
                  .drag = 0,
                  .stiffness_damping = 0,
                  .contact_distance = 0.005};
  s.grippers.max_force = 1e6, s.grippers.max_torque = 1e6;
  const Obstacles obstacles = nothing();
  const RodModel model(s, obstacles);
  RodState state = RodState::atRest(straight({}, 1, 40));
  RodWorkspace workspace;
  Control clamp;
  clamp.held = {true, false};
  ControlRunner runner(model, clamp, state);
  for (int k = 0; k < 500; ++k) runner.advance(state, workspace);
  EXPECT_LT((state.nodes.back().position - Vector3(0.616, 0, -0.720)).norm(), 1e-3)
      << state.nodes.back().position.transpose();
  for (int k = 0; k < 500; ++k) runner.advance(state, workspace);
  EXPECT_LT((state.nodes.back().position - Vector3(0.9993, 0, 0.011)).norm(), 1e-3)
      << state.nodes.back().position.transpose();
}

TEST(FreeRod, GripperNeverMovesFasterThanItsLimitsAndArrives) {
  Scenario s = rodScenario(5e7, 20);
  const Obstacles obstacles = nothing();
  const RodModel model(s, obstacles);
  const double dt = s.simulation.time_step;
  RodState state = RodState::atRest(straight({}, 1, 20));
  RodWorkspace workspace;
  Control move;
  move.held = {true, true};
  move.moving = End::last;
  move.target = {expSO3({0, 0, 1.5}), {0.4, 0.5, 0.1}};
  ControlRunner runner(model, move, state);
  for (int k = 0; k < 150; ++k) {
    const Pose before = state.nodes.back();
    runner.advance(state, workspace);
    EXPECT_LE((state.nodes.back().position - before.position).norm(), 1.1 * s.grippers.max_speed * dt);
    EXPECT_LE(angleBetween(before.rotation, state.nodes.back().rotation), 1.1 * s.grippers.max_turn * dt);
  }
  EXPECT_LT((state.nodes.back().position - move.target.position).norm(), 0.01);
  EXPECT_LT(angleBetween(state.nodes.back().rotation, move.target.rotation), 0.1);
  EXPECT_LT(state.nodes.front().position.norm(), 0.01);
}

}  // namespace
}  // namespace tendril
