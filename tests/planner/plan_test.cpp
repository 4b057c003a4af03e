/// Planning as a whole, on small scenes: what a plan is, that it is reproducible, and how it says no.
#include <gtest/gtest.h>

#include <algorithm>

#include "planner/scenarios.h"
#include "tendril/planner.h"
#include "tendril/verification.h"

namespace tendril {
namespace {

using namespace scenarios;

Scenario freeSpace(int elements = 16) { return scenario("free-space", elements); }

Solution planned(const Scenario& s, const std::string& planner, std::uint64_t seed = 1, double limit = 60) {
  PlanRequest request;
  request.planner = planner, request.seed = seed, request.time_limit_s = limit;
  Solution solution = plan(s, obstaclesOf(s), request);
  solution.mesh_sha256 = meshHashes(s);
  return solution;
}

std::string failures(const VerificationReport& report) {
  std::string all;
  for (const Check& check : report.checks)
    if (!check.passed) all += check.name + ": " + check.message + "\n";
  return all;
}

TEST(Plan, DoubleFunnelIsSolvedAndVerifiedByAnIndependentCheck) {
  const Solution solution = planned(scenario("double-funnel", 20), "tendril");
  ASSERT_EQ(solution.status, PlanStatus::solved);
  EXPECT_EQ(failures(verify(solution)), "");
  EXPECT_GT(solution.run.iterations, 0);
}

TEST(Plan, EveryPlannerSolvesFreeSpaceAndItsPlanIsVerified) {
  for (const std::string& name : plannerNames()) {
    const Solution solution = planned(freeSpace(), name, 1, 20);
    ASSERT_EQ(solution.status, PlanStatus::solved) << name;
    EXPECT_EQ(failures(verify(solution)), "") << name;
  }
}

TEST(Plan, ARodWithARestCurvatureForEachElementIsPlannedAndVerified) {
  Scenario s = freeSpace(20);
  for (int k = 0; k < 20; ++k) s.rod.rest_curvature.emplace_back(0.02 * k, 0.3, -0.5);
  const Solution solution = planned(s, "tendril", 1, 20);
  ASSERT_EQ(solution.status, PlanStatus::solved);
  EXPECT_EQ(failures(verify(solution)), "");
}

TEST(Plan, ReplayingTheControlsReproducesEveryState) {
  const Scenario s = scenario("double-funnel", 16);
  const Solution solution = planned(s, "tendril", 3);
  ASSERT_FALSE(solution.controls.empty());
  const Obstacles obstacles = obstaclesOf(s);
  const SimulationResult again =
      simulate(RodModel(s, obstacles), solution.trajectory.shapes.front(), solution.controls);
  EXPECT_TRUE(sameMotion(again.trajectory, solution.trajectory));
}

TEST(Plan, OneSeedGivesOneResultAndAnotherSeedAnother) {
  const Scenario s = scenario("double-funnel", 16);
  const Solution a = planned(s, "tendril", 5), b = planned(s, "tendril", 5), c = planned(s, "tendril", 6);
  EXPECT_TRUE(sameMotion(a.trajectory, b.trajectory));
  EXPECT_EQ(a.run.iterations, b.run.iterations);
  EXPECT_EQ(a.run.steps, b.run.steps);
  EXPECT_FALSE(sameMotion(a.trajectory, c.trajectory));
}

Solution plannedBy(int threads, const Scenario& s, std::uint64_t seed) {
  PlanRequest request;
  request.seed = seed, request.time_limit_s = 120, request.threads = threads;
  return plan(s, obstaclesOf(s), request);
}

TEST(Plan, IsTheSameWhateverTheNumberOfThreads) {
  const Scenario s = scenario("critical-tunnel-1.50", 16);
  const Solution one = plannedBy(1, s, 2), three = plannedBy(3, s, 2);
  ASSERT_EQ(one.status, PlanStatus::solved);
  EXPECT_TRUE(sameMotion(one.trajectory, three.trajectory));
  EXPECT_EQ(one.run.iterations, three.run.iterations);
  EXPECT_EQ(one.run.states, three.run.states);
  EXPECT_EQ(one.run.steps, three.run.steps);
}

TEST(Plan, ALimitOnExtensionsGivesTheSameMotionWhateverTheNumberOfThreads) {
  Scenario s = scenario("double-funnel", 16);
  s.planner.extend_limit = 2;
  const Solution one = plannedBy(1, s, 1), three = plannedBy(3, s, 1);
  EXPECT_EQ(one.status, PlanStatus::iteration_limit);
  EXPECT_EQ(three.status, PlanStatus::iteration_limit);
  EXPECT_TRUE(sameMotion(one.trajectory, three.trajectory));
  EXPECT_EQ(one.run.iterations, three.run.iterations);
  EXPECT_EQ(one.run.steps, three.run.steps);
}

/// The whole scene in another place and scale; density and time scale stay.
Scenario moved(const Scenario& s, const Pose& by, double scale) {
  Scenario m = s;
  const auto pose = [&](const Pose& p) { return by * Pose{p.rotation, scale * p.position}; };
  RodProperties& rod = m.rod;
  rod.length *= scale, rod.radius *= scale;
  rod.c.head<3>() *= std::pow(scale, 6);  // so that the time scale sqrt(rho A L^4 / EI) stays
  rod.c.tail<3>() *= std::pow(scale, 4);
  m.moduli.reset();
  for (MeshReference& mesh : m.environment.meshes) mesh.pose = pose(mesh.pose), mesh.scale *= scale;
  // The box is an axis-aligned one; the scene is turned by quarter turns only.
  Box& box = m.environment.workspace;
  const Vector3 a = by * (scale * box.min), b = by * (scale * box.max);
  box.min = a.cwiseMin(b), box.max = a.cwiseMax(b);
  m.grippers.max_speed *= scale;
  m.grippers.max_force *= std::pow(scale, 4), m.grippers.max_torque *= std::pow(scale, 5);
  m.simulation.contact_distance *= scale;
  const auto place = [&](Placement& placement) {
    if (auto* chart = std::get_if<PoseAndWrench>(&placement)) {
      chart->pose = pose(chart->pose);
      chart->wrench.head<3>() *= std::pow(scale, 5), chart->wrench.tail<3>() *= std::pow(scale, 4);
    } else {
      auto& ends = std::get<GripperPoses>(placement);
      ends.first = pose(ends.first), ends.last = pose(ends.last);
    }
  };
  place(*m.start), place(m.goal->placement);
  m.goal->position_tolerance *= scale;
  if (m.goal->shape_tolerance) *m.goal->shape_tolerance *= scale;
  return m;
}

TEST(Plan, SucceedsAlikeInASceneThatIsTurnedShiftedOrScaled) {
  const Quaternion quarter(Eigen::AngleAxisd(M_PI / 2, Vector3::UnitZ()));
  const Scenario s = scenario("double-funnel", 20);
  for (const auto& [by, scale] :
       {std::pair{Pose{quarter, {3, -1, 7}}, 1.0}, {Pose{}, 1000.0}, {Pose{}, 0.001}}) {
    const Solution solution = planned(moved(s, by, scale), "tendril");
    ASSERT_EQ(solution.status, PlanStatus::solved) << scale;
    EXPECT_EQ(failures(verify(solution)), "") << scale;
  }
}

/// The whole scene in a mirror at x = 0. A frame R becomes M R S, M = diag(-1, 1, 1), S = diag(1, 1, -1), so
/// that tangents are mirrored and frames stay right-handed; in it a force f is S f, a moment or a curvature k
/// is -S k.
Scenario mirrored(const Scenario& s) {
  const Vector3 m(-1, 1, 1), polar(1, 1, -1), axial(-1, -1, 1);
  Scenario mirror = s;
  const auto pose = [&](const Pose& p) {
    const Matrix3 turned = m.asDiagonal() * p.rotation.toRotationMatrix() * polar.asDiagonal();
    return Pose{Quaternion(turned), m.cwiseProduct(p.position)};
  };
  for (MeshReference& mesh : mirror.environment.meshes) {  // M = -1 times half a turn about x
    mesh.scale = -mesh.scale;
    mesh.pose = {Quaternion(0, 1, 0, 0) * mesh.pose.rotation, m.cwiseProduct(mesh.pose.position)};
  }
  Box& box = mirror.environment.workspace;
  const double low = box.min.x();
  box.min.x() = -box.max.x(), box.max.x() = -low;
  for (Vector3& curvature : mirror.rod.rest_curvature) curvature = axial.cwiseProduct(curvature);
  const auto place = [&](Placement& placement) {
    if (auto* chart = std::get_if<PoseAndWrench>(&placement)) {
      chart->pose = pose(chart->pose);
      chart->wrench.head<3>() = axial.cwiseProduct(chart->wrench.head<3>());
      chart->wrench.tail<3>() = polar.cwiseProduct(chart->wrench.tail<3>());
    } else {
      auto& ends = std::get<GripperPoses>(placement);
      ends.first = pose(ends.first), ends.last = pose(ends.last);
    }
  };
  place(*mirror.start), place(mirror.goal->placement);
  return mirror;
}

TEST(Plan, SucceedsAlikeInAMirroredScene) {
  for (const char* name : {"double-funnel", "engine-assembly", "winding"}) {
    const Scenario s = mirrored(scenario(name, 20));
    const Solution solution = planned(s, "tendril");
    ASSERT_EQ(solution.status, PlanStatus::solved) << name;
    EXPECT_EQ(failures(verify(solution)), "") << name;
  }
}

TEST(Plan, PutsAHoseBackIntoTheEngineInTheRightShape) {
  Scenario s = scenario("engine-assembly", 20);
  const Solution solution = planned(s, "tendril");
  ASSERT_EQ(solution.status, PlanStatus::solved);
  EXPECT_EQ(failures(verify(solution)), "");
}

/// Leads the first end straight up, and counts how often it was asked.
class Upward : public ExtendStrategy {
 public:
  Steps begin(const RodProperties& rod, const RodShape&, const RodShape&, Random&) const override {
    ++begun;
    return [length = rod.length, done = false](const RodShape& now) mutable -> std::optional<Extension> {
      if (std::exchange(done, true)) return std::nullopt;
      Pose target = now.front();
      target.position.z() += 0.3 * length;
      return Extension{{{.moving = End::first, .hold_other = false, .target = target}}};
    };
  }
  mutable std::atomic<int> begun = 0;
};

TEST(Plan, TakesAThirdPartysStrategyInItsShare) {
  const Scenario s = scenario("double-funnel", 12);
  PlanRequest request;
  request.time_limit_s = 60;
  const auto upward = std::make_shared<Upward>();
  request.strategies = {{1.0, upward}};
  const Solution solution = plan(s, obstaclesOf(s), request);
  EXPECT_EQ(solution.status, PlanStatus::solved);
  EXPECT_GT(upward->begun, 0);
}

TEST(Plan, HoldsOnlyWhatTheScenariosGraspsAllow) {
  Scenario s = freeSpace();
  s.grippers.grasps = {Grasp::both};
  Solution solution = planned(s, "tendril");
  EXPECT_EQ(solution.status, PlanStatus::solved);
  for (const Control& control : solution.controls) EXPECT_EQ(control.held, (std::array{true, true}));
  s.grippers.grasps = {Grasp::first, Grasp::last};
  solution = planned(s, "tendril", 1, 2);
  for (const Control& control : solution.controls) EXPECT_NE(control.held[0], control.held[1]);
}

TEST(Plan, StartInsideTheGoalNeedsNoMotion) {
  Scenario s = freeSpace();
  s.goal->placement = *s.start;
  const Solution solution = planned(s, "tendril");
  EXPECT_EQ(solution.status, PlanStatus::solved);
  EXPECT_TRUE(solution.controls.empty());
  EXPECT_EQ(solution.trajectory.shapes.size(), 1U);
}

TEST(Plan, LimitsAndCancellationAreSaidAndTheMotionStaysValid) {
  Scenario s = scenario("double-funnel", 16);
  EXPECT_EQ(planned(s, "tendril", 1, 0).status, PlanStatus::time_limit);
  s.planner.extend_limit = 2;
  const Solution limited = planned(s, "tendril");
  EXPECT_EQ(limited.status, PlanStatus::iteration_limit);
  const VerificationReport report = verify(limited);
  for (const Check& check : report.checks)
    if (check.name != "goal") {
      EXPECT_TRUE(check.passed) << check.name << ": " << check.message;
    }

  const std::atomic<bool> cancel = true;
  PlanRequest request;
  request.cancel = &cancel;
  EXPECT_EQ(plan(s, obstaclesOf(s), request).status, PlanStatus::cancelled);
}

std::string messageOf(const Scenario& s) {
  try {
    (void)planned(s, "tendril", 1, 0);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Plan, BadStartSaysWhichConditionFailsAndWhere) {
  Scenario s = scenario("double-funnel", 20);
  auto& start = std::get<PoseAndWrench>(*s.start);
  const PoseAndWrench good = start;

  start.pose.position.x() = -1.3;  // across the funnel's wall
  EXPECT_NE(messageOf(s).find("start shape touches or penetrates meshes/double-funnel.obj by"),
            std::string::npos)
      << messageOf(s);
  EXPECT_NE(messageOf(s).find("at node"), std::string::npos);
  EXPECT_NE(messageOf(s).find("(face "), std::string::npos);

  start = good;
  start.pose.position.y() = 5;
  EXPECT_NE(messageOf(s).find("leaves environment.workspace_m at node 0"), std::string::npos) << messageOf(s);

  start = good;
  start.wrench[3] = -60 * s.rod.bendingStiffness();  // beyond Euler's load
  EXPECT_NE(messageOf(s).find("not a stable one"), std::string::npos) << messageOf(s);

  start.wrench[3] = -2 * s.rod.c[3];  // squeezed to nothing
  EXPECT_NE(messageOf(s).find("no static equilibrium"), std::string::npos) << messageOf(s);

  start = good;
  s.start.reset();
  EXPECT_NE(messageOf(s).find("start is missing"), std::string::npos) << messageOf(s);
}

TEST(Plan, UnknownPlannerIsRefusedWithTheNamesThatExist) {
  PlanRequest request;
  request.planner = "RTT";
  const Scenario s = freeSpace();
  try {
    (void)plan(s, obstaclesOf(s), request);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("tendril, paper, RRT, KPIECE1, EST, SST, PDST"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace tendril
