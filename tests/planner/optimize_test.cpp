/// What becomes of a plan when it is improved: shorter, less force, never worse in any number that is
/// reported.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "planner/scenarios.h"
#include "tendril/planner.h"
#include "tendril/verification.h"

namespace tendril {
namespace {

using namespace scenarios;

struct Planned {
  Scenario scenario;
  Obstacles obstacles;
  Solution solution;
};

Planned planned(const std::string& name, int elements) {
  Scenario read = scenario(name, elements);
  Obstacles obstacles = obstaclesOf(read);
  PlanRequest request;
  request.time_limit_s = 60;
  Solution solution = plan(read, obstacles, request);
  solution.mesh_sha256 = meshHashes(read);
  return {std::move(read), std::move(obstacles), std::move(solution)};
}

const Planned& doubleFunnel() {
  static const Planned plan = planned("double-funnel", 16);
  return plan;
}

Improvement improved(const Planned& plan, std::int64_t candidates) {
  OptimizeRequest request;
  request.candidates = candidates;
  return optimize(plan.solution, plan.obstacles, request);
}

/// The same numbers from the solution alone: its controls simulated once more and measured.
MotionCost measured(const Planned& plan, const Solution& solution) {
  const RodModel model(plan.scenario, plan.obstacles);
  const SimulationResult motion =
      simulate(model, solution.trajectory.shapes.front(), solution.controls, nullptr, true);
  MotionCost cost;
  cost.time = motion.trajectory.time_s.back();
  for (const Extreme& extreme : extremes(motion.quantities, plan.scenario.rod)) {
    const std::string name = extreme.name;
    if (name == "largest_gripper_force_n") cost.gripper_force = extreme.value;
    if (name == "largest_contact_force_n") cost.contact_force = extreme.value;
  }
  std::array<Pose, 2> at = {solution.trajectory.shapes.front().front(),
                            solution.trajectory.shapes.front().back()};
  for (const Quantities& q : motion.quantities) {
    const auto k = static_cast<std::size_t>(q.state);
    for (const End end : kBothEnds) {
      const auto e = static_cast<std::size_t>(end);
      const Pose& to = endPose(motion.trajectory.shapes[k], end);
      if (motion.trajectory.held[k][e]) {
        cost.path += (to.position - at[e].position).norm();
        cost.turn += angleBetween(at[e].rotation, to.rotation);
      }
      at[e] = to;
    }
  }
  return cost;
}

void expectSame(const MotionCost& a, const MotionCost& b) {
  visitMotionCost([&](const char* name, auto member) {
    EXPECT_NEAR(a.*member, b.*member, 1e-9 * std::abs(b.*member)) << name;
  });
}

TEST(Optimize, NoReportedNumberIsWorseAndTheNumbersAreThoseOfTheMotion) {
  const Planned free_space = planned("free-space", 16);
  for (const Planned* each : {&free_space, &doubleFunnel()}) {
    const Planned& plan = *each;
    ASSERT_EQ(plan.solution.status, PlanStatus::solved);
    const Improvement improvement = improved(plan, 40);
    EXPECT_GT(improvement.accepted, 0);
    visitMotionCost([&](const char* name, auto member) {
      EXPECT_LE(improvement.after.*member, improvement.before.*member) << name;
    });
    expectSame(improvement.before, measured(plan, plan.solution));
    expectSame(improvement.after, measured(plan, improvement.solution));
  }
}

TEST(Optimize, AnImprovedPlanPassesTheIndependentVerification) {
  const VerificationReport report = verify(improved(doubleFunnel(), 40).solution);
  for (const Check& check : report.checks) EXPECT_TRUE(check.passed) << check.name << ": " << check.message;
}

TEST(Optimize, TheMotionEndsAtItsFirstStepInTheGoalRegion) {
  Planned plan = planned("free-space", 16);
  // One gripper goes on, aside for a second and back for another.
  const double reached = plan.solution.trajectory.time_s.back();
  const Pose there = plan.solution.trajectory.shapes.back().front();
  Pose aside = there;
  aside.position += 0.05 * Vector3::UnitZ();
  Control control{
      .start_s = reached, .end_s = reached + 1, .held = {true, true}, .moving = End::first, .target = aside};
  plan.solution.controls.push_back(control);
  control.start_s += 1, control.end_s += 1, control.target = there;
  plan.solution.controls.push_back(control);
  const RodShape start = plan.solution.trajectory.shapes.front();
  plan.solution.trajectory =
      simulate(RodModel(plan.scenario, plan.obstacles), start, plan.solution.controls).trajectory;
  ASSERT_TRUE(verify(plan.solution).valid());
  Improvement improvement = improved(plan, 60);
  EXPECT_LT(improvement.after.time, improvement.before.time - 1);
  EXPECT_LT(improvement.after.path, improvement.before.path - 0.05);
  Trajectory& motion = improvement.solution.trajectory;
  const auto inGoal = [&] {
    const VerificationReport report = verify(improvement.solution);
    const auto goal = std::find_if(report.checks.begin(), report.checks.end(),
                                   [](const Check& check) { return check.name == std::string("goal"); });
    return goal != report.checks.end() && goal->passed;
  };
  EXPECT_TRUE(inGoal());
  motion.time_s.pop_back(), motion.held.pop_back(), motion.shapes.pop_back();
  EXPECT_FALSE(inGoal());
}

TEST(Optimize, TheSameNumberOfCandidatesGivesTheSameMotion) {
  const Improvement a = improved(doubleFunnel(), 15), b = improved(doubleFunnel(), 15);
  EXPECT_EQ(a.candidates, 15);
  EXPECT_EQ(a.accepted, b.accepted);
  EXPECT_TRUE(sameMotion(a.solution.trajectory, b.solution.trajectory));
}

TEST(Optimize, WithoutCandidatesOrTimeThePlanStaysAsItIs) {
  const std::atomic<bool> cancelled = true;
  std::array<OptimizeRequest, 3> requests;
  requests[0].candidates = 0;
  requests[1].time_limit_s = 0;
  requests[2].cancel = &cancelled;
  for (const OptimizeRequest& request : requests) {
    const Improvement improvement = optimize(doubleFunnel().solution, doubleFunnel().obstacles, request);
    EXPECT_EQ(improvement.accepted, 0);
    EXPECT_TRUE(sameMotion(improvement.solution.trajectory, doubleFunnel().solution.trajectory));
    EXPECT_EQ(improvement.solution.run.planner, doubleFunnel().solution.run.planner);
    expectSame(improvement.after, improvement.before);
  }
}

TEST(Optimize, AnInterruptionKeepsTheBestSoFar) {
  std::atomic<bool> cancel = false;
  MotionCost last;
  OptimizeRequest request;
  request.cancel = &cancel;
  request.on_progress = [&](const MotionCost& best, double) { cancel = true, last = best; };
  const Improvement improvement = optimize(doubleFunnel().solution, doubleFunnel().obstacles, request);
  EXPECT_EQ(improvement.accepted, 1);
  expectSame(measured(doubleFunnel(), improvement.solution), last);
  EXPECT_TRUE(verify(improvement.solution).valid());
}

}  // namespace
}  // namespace tendril
