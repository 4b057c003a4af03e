/// What a rod must not do: stand still where nothing holds it.
#include <gtest/gtest.h>

#include "dynamics/passages.h"
#include "tendril/dynamics/workspace.h"

namespace tendril {
namespace {

using namespace passages;

TEST(Passage, RodPassesATubeOfTwelveTenthsOfItsRadiusOrSticksByFrictionButNeverJams) {
  for (const double bend : {0.0, 0.5, 1.0})
    for (const double friction : {0.0, 0.2, 0.5})
      for (const double time_step : {0.02, 0.05})
        for (const int elements : {12, 20}) {
          const Passage p = pullThrough({bend, friction, 1, 1, time_step, elements, 0.1});
          EXPECT_EQ(p.outcome, Outcome::passed) << bend << " rad, friction " << friction << ", " << time_step
                                                << " s, N = " << elements << ": " << p.reached;
          EXPECT_EQ(p.stalls, 0);
        }
}

TEST(Passage, RodThatSticksIsInBalanceWithTheFrictionItsContactsCanBear) {
  // A weak gripper, a tube bent by a radian.
  const Passage stuck = pullThrough({1, 0.5, 0.2, 1, 0.02, 12, 0.1});
  EXPECT_EQ(stuck.outcome, Outcome::sticks);
  EXPECT_LT(stuck.residual, 0.01);
  EXPECT_GT(stuck.pull, 0.95);  // all the gripper has
  EXPECT_LE(stuck.friction, stuck.friction_limit);
  EXPECT_EQ(pullThrough({1, 0, 0.2, 1, 0.02, 12, 0.1}).outcome,
            Outcome::passed);  // and without friction it goes
}

TEST(Passage, StrongFastGripperDoesNotFreezeTheRodAtTheLargestLengthOfItsElements) {
  // 2000 EI/L^2 at 5 L/s on twelve elements: such a pull shears them to the length that no motion may exceed.
  for (const double time_step : {0.02, 0.05})
    EXPECT_EQ(pullThrough({1, 0, 10, 5, time_step, 12, 0.02}).outcome, Outcome::passed);
}

TEST(Passage, WhatGuardsALimitHasItsDerivativesAndHoldsTenThousandTimesASpringThere) {
  const Guard guard{.stiffness = 3, .reach = 0.2};
  const double d = 1e-6;
  for (const double e : {0.0, 0.01, 0.1, 0.19, 0.1979, 0.1981, 0.25}) {
    const Guard::Value f = guard(e), before = guard(e - d), after = guard(e + d);
    EXPECT_NEAR((after.energy - before.energy) / (2 * d), f.slope, 1e-5 * f.slope + 1e-5) << e;
    EXPECT_NEAR((after.slope - before.slope) / (2 * d), f.curvature, 1e-4 * f.curvature) << e;
  }
  EXPECT_GT(guard(0.2).slope, 10000 * 3 * 0.2);
}

TEST(Passage, RodWoundUpWithAnyTorqueNeverStallsAndUnwindsAgain) {
  // No element may turn by more than 2.8 rad; a rod that is held there by force must not be stuck there
  // after.
  for (const double torque : {5, 20, 200}) {
    Scenario s = scenes::rodScenario(5e7, 8);
    s.grippers.max_torque = torque * s.rod.c[0] / s.rod.elementLength();
    s.grippers.max_turn = 20;
    const Obstacles nothing = scenes::nothing();
    const RodModel model(s, nothing);
    const RodShape start = scenes::straight({}, 1, 8);
    RodState state = RodState::atRest(start);
    RodWorkspace workspace;
    double most = 0, turned = 0, farthest = 0;
    for (int k = 0; k < 300; ++k) {
      const Quaternion before = state.nodes.back().rotation;
      const double way = k < 150 ? 0.35 : -0.35;
      std::array<GripperGoal, 2> goals;
      goals[0] = {true, false, start.front()};
      goals[1] = {true, true, {before * expSO3({way, 0, 0}), start.back().position}};
      EXPECT_NE(step(model, goals, state, workspace).status, StepReport::Status::stalled) << k;
      turned += logSO3(before.conjugate() * state.nodes.back().rotation).x();
      farthest = std::max(farthest, turned);
      for (std::size_t i = 0; i + 1 < state.nodes.size(); ++i)
        most = std::max(most, angleBetween(state.nodes[i].rotation, state.nodes[i + 1].rotation));
    }
    EXPECT_GT(most, 2.3) << torque;
    EXPECT_LT(most, 2.8 + 1e-9) << torque;
    EXPECT_LT(turned, 0.5 * farthest) << torque;
  }
}

TEST(Passage, RodThatOverpowersItsGripperFallsInStepsThatConverge) {
  // Two hundred times as heavy as its gripper can bear, at a thousandth of the speed it falls with.
  Scenario s = scenes::rodScenario(5e7, 20);
  const double weight = s.rod.density * std::numbers::pi * s.rod.radius * s.rod.radius * s.rod.length * 9.81;
  s.environment.gravity = {0, 0, -9.81};
  s.grippers.max_force = weight / 200, s.grippers.max_speed = 1e-3;
  const Obstacles nothing = scenes::nothing();
  const RodModel model(s, nothing);
  RodState state = RodState::atRest(scenes::straight({}, 1, 20));
  RodWorkspace workspace;
  Control control;
  control.held = {true, false}, control.moving = End::first;
  control.target = {Quaternion::Identity(), {0, 0, 1}};
  ControlRunner runner(model, control, state);
  for (int k = 0; k < 40; ++k)
    EXPECT_EQ(runner.advance(state, workspace).status, StepReport::Status::converged) << k;
  EXPECT_LT(state.nodes.front().position.z(), -0.1);
}

TEST(Passage, OneIterationAStepDoesNotWearTheGapsDownToRounding) {
  // A rod thrown at a wall and dragged along it, every step cut short after one iteration.
  Scenario s = scenes::rodScenario(5e6, 20);
  s.simulation.contact_distance = 0.1 * s.rod.radius;
  s.environment.friction = 0.3;
  s.environment.gravity = {0, 0, -9.81};
  const Obstacles o = scenes::obstaclesOf(
      {scenes::block({-3, -3, -1}, {3, 3, 0}), scenes::block({0.1, -3, 0}, {0.3, 3, 0.2})});
  RodModel model(s, o);
  model.newton.max_iterations = 1;
  RodState state = RodState::atRest(scenes::straight({Quaternion::Identity(), {-1, 0, 0.0115}}, 1, 20));
  RodWorkspace workspace;
  Control control;
  control.held = {true, false}, control.moving = End::first;
  control.target.position = {0.6, 0.3, -0.2};  // through wall and floor
  ControlRunner runner(model, control, state);
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 150; ++k) {
    EXPECT_NE(runner.advance(state, workspace).status, StepReport::Status::stalled) << k;
    least = std::min(least, workspace.impl().contacts.leastGap());
  }
  EXPECT_GT(least, 1e-3 * s.simulation.contact_distance);
  EXPECT_LT(least, s.simulation.contact_distance);
}

}  // namespace
}  // namespace tendril
