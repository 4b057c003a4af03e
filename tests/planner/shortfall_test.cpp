/// What is said of a motion that did not reach the goal, in cases whose answer is known.
#include "tendril/planner/shortfall.h"

#include <gtest/gtest.h>

#include "dynamics/scenes.h"
#include "tendril/planner.h"

namespace tendril {
namespace {

using namespace scenes;

constexpr int kElements = 16;

Scenario openScenario() {
  Scenario s = rodScenario(5e7, kElements);
  s.environment.workspace = {Vector3(-3, -3, -3), Vector3(3, 3, 3)};
  s.environment.meshes = {MeshReference{.file = "meshes/wall.obj", .scale = 1, .pose = {}}};
  s.goal.emplace();
  return s;
}

Shortfall shortfall(const Scenario& s, const Obstacles& obstacles, const RodShape& last,
                    const RodShape& goal) {
  return shortfallOf(s, obstacles, GoalTest(*s.goal, goal, kElements), last, [] { return false; });
}

RodShape straightAt(const Vector3& position, const Vector3& turn = Vector3::Zero()) {
  return straight({expSO3(turn), position}, 1, kElements);
}

const Vector3 kAlongY = {0, 0, std::numbers::pi / 2};

TEST(Shortfall, IsMeasuredFromTheLastStateToTheGoal) {
  const Scenario s = openScenario();
  const RodShape last = straightAt({0, 0, 0}), goal = straightAt({0, 0.3, 0}, {0, 0, 0.5});
  const Shortfall found = shortfall(s, nothing(), last, goal);
  EXPECT_DOUBLE_EQ(found.distance, meanNodeDistance(last, goal));
  EXPECT_DOUBLE_EQ(found.largest_distance, maxNodeDistance(last, goal));
  EXPECT_NEAR(found.end_distance[0], 0.3, 1e-12);
  EXPECT_NEAR(found.end_distance[1], Vector3(std::cos(0.5) - 1, std::sin(0.5) + 0.3, 0).norm(), 1e-12);
  EXPECT_NEAR(found.end_angle[0], 0.5, 1e-12);
  EXPECT_NEAR(found.end_angle[1], 0.5, 1e-12);
}

TEST(Shortfall, NothingButTimeIsMissingInFreeSpace) {
  const Shortfall found =
      shortfall(openScenario(), nothing(), straightAt({0, 0, 0}), straightAt({1, 1.5, 0}, {0, 0, 2}));
  EXPECT_EQ(found.limit, Limit::time);
  EXPECT_FALSE(found.gripper || found.position || found.contact);
}

TEST(Shortfall, ARodAtAClosedWallIsStuckOnItAtItsGrippersLargestForce) {
  const Scenario s = openScenario();
  const Obstacles wall = obstaclesOf({block({0.5, -3, -3}, {0.6, 3, 3})});
  const Shortfall found =
      shortfall(s, wall, straightAt({0.48, -0.5, 0}, kAlongY), straightAt({0.9, -0.5, 0}, kAlongY));
  EXPECT_EQ(found.limit, Limit::force);
  ASSERT_TRUE(found.gripper && found.contact);
  EXPECT_NEAR(*found.gripper_force, s.grippers.max_force, 0.02 * s.grippers.max_force);
  const double end_y = *found.gripper == End::first ? -0.5 : 0.5;
  EXPECT_LT((*found.position - Vector3(0.5, end_y, 0)).norm(), 0.05);
  EXPECT_NEAR(found.contact->position.x(), 0.5, 1e-9);
  EXPECT_LT(found.contact->force.x(), -1);  // the wall pushes back
  EXPECT_EQ(found.contact->mesh, "meshes/wall.obj");
  const Obstacles::Face& face = wall.faces()[static_cast<std::size_t>(found.contact->face)];
  for (const int vertex : face.vertices)
    EXPECT_EQ(wall.vertices()[static_cast<std::size_t>(vertex)].x(), 0.5);
  EXPECT_GT(*found.clearance, 0);
  EXPECT_LT(*found.clearance, s.simulation.contact_distance);
}

TEST(Shortfall, ARodInTheMouthOfAGapNarrowerThanItselfIsStuckForClearance) {
  Scenario s = openScenario();
  s.grippers.grasps = {Grasp::last};
  const double half = 0.8 * s.rod.radius;
  const Obstacles gap = obstaclesOf({block({1, -3, -3}, {1.5, -half, 3}), block({1, half, -3}, {1.5, 3, 3})});
  s.environment.meshes.push_back({.file = "meshes/other_wall.obj", .scale = 1, .pose = {}});
  const Shortfall found = shortfall(s, gap, straightAt({-0.015, 0, 0}), straightAt({0.4, 0, 0}));
  EXPECT_EQ(found.limit, Limit::clearance);
  EXPECT_EQ(found.gripper, End::last);
  ASSERT_TRUE(found.position);
  EXPECT_NEAR(found.position->x(), 1, 1e-3);
  EXPECT_NEAR(std::abs(found.position->y()), half, 1e-9);
  EXPECT_EQ(found.contact->mesh, found.position->y() < 0 ? "meshes/wall.obj" : "meshes/other_wall.obj");
}

TEST(Shortfall, ATwistBeyondTheGrippersTorqueIsStuckForTorque) {
  Scenario s = openScenario();
  s.goal->angle_tolerance = 0.3;
  s.grippers.max_torque = 0.5 * s.rod.bendingStiffness();  // twists it by 0.7 rad
  const RodShape last = straightAt({0, 0, 0});
  RodShape goal = last;
  goal.back().rotation = expSO3({2.5, 0, 0});
  const Shortfall found = shortfall(s, nothing(), last, goal);
  EXPECT_EQ(found.limit, Limit::torque);
  EXPECT_NEAR(*found.gripper_torque, s.grippers.max_torque, 0.02 * s.grippers.max_torque);
  EXPECT_FALSE(found.contact);
}

TEST(Shortfall, AnEndThatTheGripperCannotTurnIsStuckForBendWhereTheTorqueBendsTheRodMost) {
  Scenario s = openScenario();
  s.goal->angle_tolerance = 0.3;
  s.grippers.grasps = {Grasp::both};
  s.grippers.max_torque = s.rod.bendingStiffness();  // turns a clamped beam's end by M L / 4 EI = 0.25 rad
  const RodShape last = straightAt({0, 0, 0});
  RodShape goal = last;
  goal.back().rotation = expSO3({0, 0, 1.2});
  const Shortfall found = shortfall(s, nothing(), last, goal);
  EXPECT_EQ(found.limit, Limit::bend);
  EXPECT_EQ(found.gripper, End::last);
  EXPECT_NEAR(*found.gripper_torque, s.grippers.max_torque, 0.02 * s.grippers.max_torque);
  EXPECT_GT(*found.bend_radius, 1);  // EI/M at the end itself; less moment, and so a wider bend, further in
  EXPECT_LT(*found.bend_radius, 1.3);
  EXPECT_GT(*found.bend_radius_s, 0.9);
  EXPECT_LT((*found.position - Vector3(1, 0, 0)).norm(), 0.1);
}

TEST(Shortfall, ARodThatWouldLeaveTheWorkspaceIsStuckAtItsLimit) {
  Scenario s = openScenario();
  s.environment.workspace.max.x() = 1.3;
  const Shortfall found = shortfall(s, nothing(), straightAt({0.29, 0, 0}), straightAt({0.6, 0, 0}));
  EXPECT_EQ(found.limit, Limit::workspace);
  ASSERT_TRUE(found.position);
  EXPECT_NEAR(found.position->x(), 1.3, 0.025);  // a step's way
  EXPECT_LE(found.position->x(), 1.3);
}

TEST(Shortfall, AnotherEquilibriumBetweenTheSameEndsIsStuckForShape) {
  Scenario s = openScenario();
  s.goal->shape_tolerance = 0.05;
  const std::vector<Equilibrium> between =
      fitEnds(s.rod, {Pose{}, Pose{Quaternion::Identity(), Vector3(0.6, 0.05, 0.02)}});
  ASSERT_GE(between.size(), 2U);
  const RodShape &goal = between[0].nodes, &last = between[1].nodes;
  const Shortfall found = shortfall(s, nothing(), last, goal);
  EXPECT_EQ(found.limit, Limit::shape);
  EXPECT_LT(found.end_distance[1], 1e-6);
  EXPECT_GT(found.largest_distance, 0.05);
  EXPECT_FALSE(found.gripper);
}

TEST(Shortfall, HasDistancesButNoLimitWhenThereIsNoTimeToProbe) {
  const Scenario s = openScenario();
  const RodShape last = straightAt({0, 0, 0}), goal = straightAt({0, 0.3, 0});
  const Shortfall found =
      shortfallOf(s, nothing(), GoalTest(*s.goal, goal, kElements), last, [] { return true; });
  EXPECT_NEAR(found.distance, 0.3, 1e-12);
  EXPECT_FALSE(found.limit);
}

TEST(Shortfall, BelongsToEveryProblemThatIsNotSolvedAndIsTheSameEveryTime) {
  Scenario s = readScenario(TENDRIL_SOURCE_DIR "/scenarios/double-funnel.yaml");
  s.rod.elements = kElements;
  s.rod.radius = 0.035;  // the tunnel's is 0.03
  s.planner.extend_limit = 20;
  const TriangleMesh mesh = loadMeshes(s).front();
  const Obstacles obstacles(std::span(&mesh, 1));
  const Solution a = plan(s, obstacles, {}), b = plan(s, obstacles, {});
  ASSERT_EQ(a.status, PlanStatus::iteration_limit);
  ASSERT_TRUE(a.shortfall && b.shortfall);
  EXPECT_EQ(toJson(*a.shortfall).dump(), toJson(*b.shortfall).dump());
  EXPECT_TRUE(a.shortfall->limit);
  EXPECT_DOUBLE_EQ(a.shortfall->distance,
                   meanNodeDistance(a.trajectory.shapes.back(), goalShape(s, obstacles)));

  s = readScenario(TENDRIL_SOURCE_DIR "/scenarios/free-space.yaml");
  const Solution solved = plan(s, nothing(), {});
  ASSERT_EQ(solved.status, PlanStatus::solved);
  EXPECT_FALSE(solved.shortfall);
}

}  // namespace
}  // namespace tendril
