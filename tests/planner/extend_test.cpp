/// Algorithm 1 on its own, and the samples it is aimed at.
#include "tendril/planner/extend.h"
#include "tendril/planner.h"

#include <gtest/gtest.h>

#include "dynamics/scenes.h"
#include "tendril/planner/goal.h"
#include "tendril/planner/strategies.h"

namespace tendril {
namespace {

using namespace scenes;

const std::function<bool()> never = [] { return false; };

Scenario emptyScenario() {
  Scenario s = rodScenario(5e7, 16);
  s.environment.workspace = {Vector3(-3, -3, -3), Vector3(3, 3, 3)};
  return s;
}

TEST(Extend, BringsFirstTheLeadingGripperThenTheOtherToItsTarget) {
  const Scenario s = emptyScenario();
  const Obstacles o = nothing();
  const RodModel model(s, o);
  const Extend extend(model, {.reach = 0.01});
  for (const End leading : kBothEnds) {
    RodState state = RodState::atRest(straight({}, 1, 16));
    RodWorkspace workspace;
    const std::array<Pose, 2> targets = {Pose{Quaternion::Identity(), {0.5, 0.5, 0}},
                                         Pose{Quaternion::Identity(), {1.4, 0.6, 0.1}}};
    const ExtendReport report = extend(algorithm1(leading, targets), state, workspace, never);
    ASSERT_EQ(report.controls.size(), 2U);
    EXPECT_EQ(report.controls[0].moving, leading);
    EXPECT_FALSE(report.controls[0].isHeld(other(leading)));  // let go
    EXPECT_EQ(report.controls[1].moving, other(leading));
    EXPECT_TRUE(report.controls[1].isHeld(leading));
    EXPECT_EQ(report.controls[0].end_s, report.controls[1].start_s);
    EXPECT_LT((state.nodes.front().position - targets[0].position).norm(), 0.015);
    EXPECT_LT((state.nodes.back().position - targets[1].position).norm(), 0.015);
  }
}

TEST(Extend, ASlowPhaseTakesItsGripperNoFasterThanItsShareOfTheSpeed) {
  const Scenario s = emptyScenario();
  const Obstacles o = nothing();
  const RodModel model(s, o);
  const Pose target{Quaternion::Identity(), {-0.4, 0, 0}};
  std::array<std::int64_t, 2> steps{};
  for (const double speed : {1.0, 0.5}) {
    RodState state = RodState::atRest(straight({}, 1, 16));
    RodWorkspace workspace;
    TrajectoryRecorder recorder(model, state.nodes);
    const ExtendReport report = Extend(model, {.reach = 0.01})(
        {{{.moving = End::first, .target = target, .speed = speed}}}, state, workspace, never, &recorder);
    steps[speed < 1] = report.steps;
    EXPECT_LT((state.nodes.front().position - target.position).norm(), 0.015);
    for (const Control& control : report.controls)
      if (speed < 1) {
        EXPECT_EQ(stepCount(control, model.simulation.time_step), 1);
      }
    const SimulationResult again = simulate(model, straight({}, 1, 16), report.controls);
    EXPECT_EQ(again.final_state.nodes.front().position, state.nodes.front().position);
  }
  EXPECT_NEAR(static_cast<double>(steps[1]), 2.0 * static_cast<double>(steps[0]), 3);
}

TEST(Extend, RunsOnlyWhileTheDistanceIsGreaterThanEpsilon) {
  const Scenario s = emptyScenario();
  const Obstacles o = nothing();
  const RodModel model(s, o);
  RodState state = RodState::atRest(straight({}, 1, 16));
  RodWorkspace workspace;
  const Extension there = algorithm1(End::first, {state.nodes.front(), state.nodes.back()});
  EXPECT_EQ(Extend(model, {.reach = 0.01})(there, state, workspace, never).steps, 0);
}

TEST(Extend, PhaseEndsAtItsLimitAndWhenNothingMovesAnyMore) {
  Scenario s = emptyScenario();
  const Obstacles wall = obstaclesOf({block({-0.5, -3, -3}, {-0.4, 3, 3})});
  const RodModel model(s, wall);
  const Extension through = algorithm1(
      End::first, {Pose{Quaternion::Identity(), {-1.5, 0, 0}}, Pose{Quaternion::Identity(), {-0.5, 0.5, 0}}});
  RodWorkspace workspace;
  RodState state = RodState::atRest(straight({}, 1, 16));
  ExtendReport report = Extend(model, {.reach = 0.01, .phase_limit = 1})(through, state, workspace, never);
  EXPECT_DOUBLE_EQ(report.controls[0].end_s, 1);
  state = RodState::atRest(straight({}, 1, 16));
  report = Extend(model, {.reach = 0.01, .phase_limit = 20, .stall_speed = 0.05})(through, state, workspace,
                                                                                  never);
  EXPECT_LT(report.controls[0].end_s, 10);
}

TEST(Extend, PhaseEndsWithTheLastStateInsideTheWorkspace) {
  Scenario s = emptyScenario();
  s.environment.workspace.max.x() = 1.3;
  const Obstacles o = nothing();
  const RodModel model(s, o);
  RodState state = RodState::atRest(straight({}, 1, 16));
  RodWorkspace workspace;
  TrajectoryRecorder recorder(model, state.nodes);
  const Extension out = algorithm1(
      End::last, {Pose{Quaternion::Identity(), {1, 0, 0}}, Pose{Quaternion::Identity(), {2, 0, 0}}});
  const ExtendReport report = Extend(model, {.reach = 0.01})(out, state, workspace, never, &recorder);
  for (const RodShape& shape : recorder.trajectory().shapes)
    for (const Pose& node : shape) EXPECT_LE(node.position.x(), 1.3);
  EXPECT_EQ(recorder.steps(), report.steps);
  EXPECT_EQ(maxNodeDistance(recorder.trajectory().shapes.back(), state.nodes), 0);
}

TEST(Along, ACoilIsPulledInPiecesThatStayNearTheScrewLineItUnwindsAlong) {
  // A helix of two turns: radius R, pitch 2 pi p, curvature R / (R^2 + p^2).
  constexpr double R = 0.07, p = 0.0379;
  const double w = 1 / std::hypot(R, p);  // rad per metre of arc length
  const auto helix = [&](double arc) {
    return Vector3(R * std::cos(w * arc), R * std::sin(w * arc), p * w * arc);
  };
  RodProperties rod = rodScenario(5e7, 40).rod;
  rod.rest_curvature = {{0, 0, R * w * w}};
  const Vector3 tangent = w * Vector3(0, R, p);
  const RodShape shape(41, {Quaternion::FromTwoVectors(Vector3::UnitX(), tangent), helix(0)});
  const auto first = [&](const RodProperties& r) {
    return (*along(r, End::last, pieceOf(r), 1)(shape)).phases.front().target.position;
  };
  const double piece = (first(rod) - helix(0)).norm();
  EXPECT_GT(piece, 0.05);
  EXPECT_LT((first(rod) - helix(piece)).norm(), piece / 2);

  rod.rest_curvature.clear();  // a straight rod would be led off it
  EXPECT_GT((first(rod) - helix(0.15)).norm(), 0.15 / 2);
}

TEST(Sampling, SamplesAreStableRodsInsideTheWorkspaceAndClearOfTheMeshes) {
  Scenario s = emptyScenario();
  s.environment.workspace = {Vector3(-0.7, -0.7, -0.7), Vector3(0.7, 0.7, 0.7)};
  const Obstacles o = obstaclesOf({block({-0.2, -0.2, -0.7}, {0.2, 0.2, 0.7})});
  RodSampler sampler(s.rod, samplingSpace(s, o), 9);
  for (int k = 0; k < 30; ++k) {
    const Equilibrium* rod = sampler.next();
    ASSERT_TRUE(rod);
    EXPECT_GT(bruteForceDistance(rod->nodes, o), s.rod.radius);
    for (const Pose& node : rod->nodes) EXPECT_TRUE(s.environment.workspace.contains(node.position));
  }
}

TEST(GoalRegion, IsWithinTheTolerancesOfBothFramesAndOfTheShapeIfAsked) {
  const RodShape goal = straight({}, 1, 10);
  Goal region;
  region.position_tolerance = 0.05;
  RodShape rod = goal;
  rod[5].position.y() += 0.3;  // another shape between the same grippers
  rod.back().position.x() -= 0.04;
  EXPECT_TRUE(GoalTest(region, goal, 10)(rod));
  rod.back().rotation = expSO3({1.5, 0, 0});  // twisted
  EXPECT_TRUE(GoalTest(region, goal, 10)(rod));
  region.angle_tolerance = 0.5;
  EXPECT_FALSE(GoalTest(region, goal, 10)(rod));
  rod.back().rotation = Quaternion::Identity();
  EXPECT_TRUE(GoalTest(region, goal, 10)(rod));
  region.shape_tolerance = 0.1;
  EXPECT_FALSE(GoalTest(region, goal, 10)(rod));
}

}  // namespace
}  // namespace tendril
