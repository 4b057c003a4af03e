#include "tendril/verification.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <numbers>

#include "tendril/statics.h"
#include "tendril/verification/trajectory_checks.h"

namespace tendril {
namespace {

namespace fs = std::filesystem;

const Quaternion kAlongX = Quaternion::Identity();

Quaternion turn(double angle, const Vector3& axis) { return Quaternion(Eigen::AngleAxisd(angle, axis)); }

/// A folder of this process for the meshes, removed at the end.
class Scratch {
 public:
  Scratch() : folder_(fs::temp_directory_path() / ("tendril_verify_" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  ~Scratch() { fs::remove_all(folder_); }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  [[nodiscard]] const fs::path& folder() const { return folder_; }

 private:
  fs::path folder_;
};

/// Quads as the text of an OBJ file.
std::string objOf(const std::vector<std::array<Vector3, 4>>& quads) {
  std::string text;
  int vertices = 0;
  for (const auto& quad : quads) {
    for (const Vector3& v : quad)
      text += "v " + std::to_string(v.x()) + " " + std::to_string(v.y()) + " " + std::to_string(v.z()) + "\n";
    const auto n = [&](int k) { return std::to_string(vertices + k); };
    text += "f " + n(1) + " " + n(2) + " " + n(3) + "\nf " + n(1) + " " + n(3) + " " + n(4) + "\n";
    vertices += 4;
  }
  return text;
}

/// A square tube from x = 1.2 to 1.8, 80 mm wide inside, with a plate in front of it that leaves its mouth
/// open.
std::string tube() {
  const double w = 0.04, a = 1.2, b = 1.8, wide = 0.3;
  return objOf({{{{a, -w, -w}, {b, -w, -w}, {b, w, -w}, {a, w, -w}}},
                {{{a, -w, w}, {b, -w, w}, {b, w, w}, {a, w, w}}},
                {{{a, -w, -w}, {b, -w, -w}, {b, -w, w}, {a, -w, w}}},
                {{{a, w, -w}, {b, w, -w}, {b, w, w}, {a, w, w}}},
                {{{a, -wide, w}, {a, wide, w}, {a, wide, wide}, {a, -wide, wide}}},
                {{{a, -wide, -wide}, {a, wide, -wide}, {a, wide, -w}, {a, -wide, -w}}},
                {{{a, -wide, -w}, {a, -w, -w}, {a, -w, w}, {a, -wide, w}}},
                {{{a, w, -w}, {a, wide, -w}, {a, wide, w}, {a, w, w}}}});
}

class Verification : public ::testing::Test {
 protected:
  static constexpr int kElements = 20;
  static constexpr double kStep = 0.02;  // s

  [[nodiscard]] static RodShape straight(const Vector3& first, const Quaternion& rotation = kAlongX) {
    RodShape shape;
    for (int i = 0; i <= kElements; ++i)
      shape.push_back({rotation, first + rotation * Vector3(static_cast<double>(i) / kElements, 0, 0)});
    return shape;
  }

  /// L = 1 m, r = 10 mm, at rest straight along x from `first`; no gravity; `obj` is the only mesh.
  [[nodiscard]] Solution atRest(const Vector3& first, const std::string& obj) const {
    Solution solution;
    solution.status = PlanStatus::solved;
    Scenario& scenario = solution.scenario;
    scenario.rod.elements = kElements;
    scenario.rod.c = stiffnessOfRoundRod(5e7, 2e7, 0.01);
    writeFileAtomically(scratch_.folder() / "meshes" / "tube.obj", obj);
    scenario.file = scratch_.folder() / "scenario.yaml";
    scenario.environment.meshes = {{"meshes/tube.obj", 1.0, {}}};
    scenario.environment.workspace = {Vector3(-1, -1, -1), Vector3(3, 1, 1)};
    scenario.grippers.max_speed = 0.5;
    scenario.grippers.max_turn = 4;
    scenario.start = PoseAndWrench{{kAlongX, first}, Vector6::Zero()};
    solution.mesh_sha256 = {sha256Hex(obj)};
    return solution;
  }

  static void add(Solution& solution, const RodShape& shape, const std::array<bool, 2>& held) {
    Trajectory& trajectory = solution.trajectory;
    trajectory.time_s.push_back(kStep * static_cast<double>(trajectory.time_s.size()));
    trajectory.held.push_back(held);
    trajectory.shapes.push_back(shape);
  }

  /// The rod is pulled by its first end through the tube, 1 m in 2 s, and then held still by both ends for
  /// 0.2 s.
  [[nodiscard]] Solution throughTheTube() const {
    Solution solution = atRest(Vector3::Zero(), tube());
    for (int k = 0; k <= 100; ++k) add(solution, straight({0.01 * k, 0, 0}), {true, false});
    for (int k = 0; k < 10; ++k) add(solution, straight({1, 0, 0}), {true, true});
    const Pose target{kAlongX, {1, 0, 0}};
    solution.controls = {{0, 2, {true, false}, End::first, target}, {2, 2.2, {true, true}, {}, {}}};
    solution.scenario.goal = Goal{GripperPoses{target, {kAlongX, {2, 0, 0}}}, 0.05, {}, {}};
    return solution;
  }

  /// The rod goes sideways through the points (y, z), 0.2 s from each to the next.
  [[nodiscard]] Solution sideways(const std::vector<Vector3>& points, const std::string& obj) const {
    Solution solution = atRest(points.front(), obj);
    for (const Vector3& p : points) add(solution, straight(p), {true, false});
    for (double& t : solution.trajectory.time_s) t *= 10;
    const Pose target{kAlongX, points.back()};
    solution.controls = {{0, solution.trajectory.time_s.back(), {true, false}, End::first, target}};
    solution.scenario.goal = Goal{PoseAndWrench{target, Vector6::Zero()}, 0.05, {}, {}};
    return solution;
  }

  /// Lowers the middle of state k by `depth` in half a sine wave, its ends where they were, its frames along
  /// it.
  static void sag(Solution& solution, std::size_t k, double depth) {
    RodShape& shape = solution.trajectory.shapes[k];
    for (std::size_t i = 0; i < shape.size(); ++i)
      shape[i].position.z() -= depth * std::sin(std::numbers::pi * static_cast<double>(i) / kElements);
  }

  static std::string failures(const VerificationReport& report) {
    std::string names;
    for (const Check& check : report.checks)
      if (!check.passed) names += (names.empty() ? "" : " ") + check.name;
    return names;
  }
  static std::string text(const VerificationReport& report) {
    std::string all;
    for (const Check& check : report.checks)
      all += (check.passed ? "ok   " : "FAIL ") + check.name + ": " + check.message + "\n";
    return all;
  }
  static std::string messageOf(const VerificationReport& report, const std::string& name) {
    for (const Check& check : report.checks)
      if (check.name == name) return check.message;
    return "";
  }
  /// Expects exactly the check `name` to fail, with `words` in its message.
  static void expectOnlyFailure(const Solution& solution, const std::string& name, const std::string& words) {
    const VerificationReport report = verify(solution);
    EXPECT_EQ(failures(report), name) << text(report);
    EXPECT_FALSE(report.valid());
    EXPECT_NE(messageOf(report, name).find(words), std::string::npos) << messageOf(report, name);
  }

  Scratch scratch_;
};

TEST_F(Verification, AMotionThatKeepsEveryClaimIsValidAndItsClearanceIsBounded) {
  const VerificationReport report = verify(throughTheTube());
  EXPECT_TRUE(report.valid()) << text(report);
  EXPECT_LE(report.smallest_clearance, 0.03);  // 40 mm to the walls less the radius
  EXPECT_GE(report.smallest_clearance, 0.95 * 0.03);
}

// ---------------------------------------------------------------------------------------------- clearance

TEST_F(Verification, AStateThatReachesIntoAFaceIsFoundWithElementStateFaceAndMillimetres) {
  Solution solution = throughTheTube();
  sag(solution, 95, 0.035);  // 5 mm left of the 10 mm of its radius
  expectOnlyFailure(solution, "clearance", "of meshes/tube.obj; the radius is 10 mm (too near by ");
  const VerificationReport report = verify(solution);
  // the deepest moment of the first step that fails, at its end: 39.999 - 35 mm, at an element beside the
  // middle
  EXPECT_NE(messageOf(report, "clearance").find("at state 95 (t = 1.9 s) comes within 5 mm of face "),
            std::string::npos)
      << text(report);
  EXPECT_NEAR(report.smallest_clearance, -0.005, 1e-9);
}

TEST_F(Verification, AStateThatCutsThroughAFaceIsFound) {
  Solution solution = throughTheTube();
  sag(solution, 95, 0.06);
  expectOnlyFailure(solution, "clearance", "cuts through face ");
}

TEST_F(Verification, TouchingIsAllowedUpToAHundredMillionthOfTheLength) {
  Solution solution = throughTheTube();
  const Vector3 down(0, 0, -1);
  for (RodShape& shape : solution.trajectory.shapes)
    for (Pose& node : shape) node.position += (0.03 + 0.8e-8) * down;
  std::get<PoseAndWrench>(*solution.scenario.start).pose.position += 0.03 * down;
  const VerificationReport report = verify(solution);
  EXPECT_TRUE(report.valid()) << text(report);
  EXPECT_GE(report.smallest_clearance, -1e-8);
  EXPECT_LE(report.smallest_clearance, -0.8e-8);
  for (RodShape& shape : solution.trajectory.shapes)
    for (Pose& node : shape) node.position += 0.3e-8 * down;
  expectOnlyFailure(solution, "clearance", "meshes/tube.obj");
}

TEST_F(Verification, AWallThinnerThanAStepIsNotSkipped) {
  const std::string wall =
      objOf({{{{0.3, 0.075, -0.2}, {0.7, 0.075, -0.2}, {0.7, 0.075, 0.2}, {0.3, 0.075, 0.2}}}});
  expectOnlyFailure(sideways({{0, 0, 0}, {0, 0.05, 0}, {0, 0.10, 0}, {0, 0.15, 0}}, wall), "clearance",
                    "between states 1 and 2");
}

TEST_F(Verification, ACornerCutBetweenTwoFreeStatesIsFound) {
  const std::string block = objOf({{{{0, 0.03, -0.2}, {1, 0.03, -0.2}, {1, 0.03, 0.07}, {0, 0.03, 0.07}}},
                                   {{{0, 0.03, 0.07}, {1, 0.03, 0.07}, {1, 0.2, 0.07}, {0, 0.2, 0.07}}}});
  const VerificationReport around = verify(sideways({{0, 0, 0}, {0, 0, 0.1}, {0, 0.1, 0.1}}, block));
  EXPECT_TRUE(around.valid()) << text(around);
  EXPECT_NEAR(around.smallest_clearance, 0.0195, 0.0006);  // 30 mm of both faces, less the radius
  Solution cut = sideways({{0, 0, 0}, {0, 0.1, 0.1}}, block);
  for (const auto& shape : cut.trajectory.shapes) {
    Solution alone = cut;
    alone.trajectory.shapes = {shape, shape};
    const VerificationReport report = verify(alone);
    EXPECT_EQ(failures(report).find("clearance"), std::string::npos) << text(report);
  }
  expectOnlyFailure(cut, "clearance", "between states 0 and 1");
}

TEST_F(Verification, ARodThatPassesThroughItselfIsFoundOnlyWhenTheScenarioForbidsIt) {
  Solution solution = throughTheTube();
  solution.scenario.rod.self_contact = true;
  EXPECT_TRUE(verify(solution).valid());
  solution.status = PlanStatus::simulated;
  // a circle of 0.9 turns wound down to 1.1 turns: the ends pass each other
  const auto arc = [](double turns) {
    RodShape shape;
    const double angle = 2 * std::numbers::pi * turns, radius = 1 / angle;
    for (int i = 0; i <= kElements; ++i) {
      const double a = angle * i / kElements;
      shape.push_back({turn(a, Vector3::UnitZ()), {radius * std::sin(a), radius * (1 - std::cos(a)), 0}});
    }
    return shape;
  };
  solution.trajectory = {};
  for (const double turns : {0.9, 1.1}) add(solution, arc(turns), {true, false});
  solution.trajectory.time_s = {0, 2};
  solution.scenario.environment.meshes.clear();
  solution.mesh_sha256.clear();
  solution.controls = {{0, 2, {true, false}, {}, {}}};
  expectOnlyFailure(solution, "self_contact", "twice the radius is 20 mm");
  solution.scenario.rod.self_contact = false;
  EXPECT_TRUE(verify(solution).valid()) << text(verify(solution));
}

// ---------------------------------------------------------------------------------------------- the motion

TEST_F(Verification, AStateThatIsNotOneIsAFailureOfStructureAndNothingElseIsJudged) {
  Solution solution = throughTheTube();
  solution.trajectory.shapes[3].pop_back();
  expectOnlyFailure(solution, "structure", "state 3 (t = 0.06 s) has 20 nodes; 20 elements need 21");
  solution = throughTheTube();
  solution.trajectory.shapes[3][4].position.y() = std::numeric_limits<double>::quiet_NaN();
  expectOnlyFailure(solution, "structure", "node 4 of state 3 (t = 0.06 s) is not finite");
  solution = throughTheTube();
  solution.trajectory.held.pop_back();
  expectOnlyFailure(solution, "structure", "111 states, but 111 times and 110 lists of held ends");
  solution.trajectory = {};
  expectOnlyFailure(solution, "structure", "no state");
}

TEST_F(Verification, TimesThatDoNotIncreaseAreFound) {
  Solution solution = throughTheTube();
  solution.trajectory.time_s[50] = solution.trajectory.time_s[49];
  expectOnlyFailure(solution, "times", "the time of state 50, ");
  solution = throughTheTube();
  solution.trajectory.time_s[0] = 1e-3;
  expectOnlyFailure(solution, "times", "the first time is 0.001 s and must be 0");
}

TEST_F(Verification, AQuaternionOfAnotherNormIsFound) {
  Solution solution = throughTheTube();
  solution.trajectory.shapes[7][3].rotation.coeffs() *= 1 + 1e-8;
  expectOnlyFailure(solution, "quaternions", "node 3 of state 7 (t = 0.14 s) has norm 1 +1e-08");
}

TEST_F(Verification, AFrameAcrossTheRodIsFound) {
  Solution solution = throughTheTube();
  solution.trajectory.shapes[7][10].rotation = turn(1.2, Vector3::UnitZ());
  expectOnlyFailure(solution, "frames", "element 9 of state 7");
  solution.trajectory.shapes[7][10].rotation = turn(1.2, Vector3::UnitX());  // twist is the rod's own affair
  EXPECT_TRUE(verify(solution).valid());
}

TEST_F(Verification, AStretchedOrCompressedElementIsFound) {
  for (const double change : {0.27, -0.22}) {
    Solution solution = throughTheTube();
    solution.trajectory.shapes[30].back().position.x() += change / kElements;  // the free end
    expectOnlyFailure(solution, "stretch",
                      "element 19 of state 30 (t = 0.6 s) is " + std::string(change > 0 ? "1.27" : "0.78"));
  }
}

TEST_F(Verification, AnElementThatIsTooShortOnlyBetweenStatesIsFound) {
  RodProperties rod;
  rod.elements = 1;
  Trajectory trajectory{{0, 1}, {{true, false}, {true, false}}, {}};
  trajectory.shapes = {{Pose{kAlongX, {0, 0, 0}}, Pose{kAlongX, {1, 0, 0}}},
                       {Pose{kAlongX, {0, 0, 0}}, Pose{kAlongX, {0, 1, 0}}}};
  const Check check = verification::checkStretch(trajectory, rod);
  EXPECT_FALSE(check.passed);
  EXPECT_NE(check.message.find("is 0.707107 of its rest length"), std::string::npos) << check.message;
}

TEST_F(Verification, ANodeThatJumpsIsFound) {
  Solution solution = throughTheTube();
  solution.scenario.grippers.max_turn = 100;
  // the rod turned about its first end, for one state: its last node 0.3 m away
  solution.trajectory.shapes[5] = straight({0.05, 0, 0}, turn(0.3, Vector3::UnitZ()));
  expectOnlyFailure(solution, "steps", "node 17 moves 25");
}

TEST_F(Verification, ANodeOutsideTheWorkspaceIsFound) {
  Solution solution = throughTheTube();
  solution.scenario.environment.workspace.max.x() = 1.995;
  expectOnlyFailure(solution, "workspace",
                    "node 20 of state 100 (t = 2 s) is 5 mm outside the workspace along x");
}

// ---------------------------------------------------------------------------------------------- grippers

TEST_F(Verification, AnEndThatIsTooFastIsFound) {
  Solution solution = throughTheTube();
  solution.trajectory.time_s[40] += 0.008;  // 10 mm in 12 ms
  expectOnlyFailure(solution, "speed", "the held first end moves at 0.833333 m/s between states 40 and 41");
  solution = throughTheTube();
  solution.trajectory.shapes[40][0].rotation = turn(0.13, Vector3::UnitX());  // 6.5 rad/s
  expectOnlyFailure(solution, "speed", "the held first end turns at 6.5 rad/s between states 39 and 40");
}

TEST_F(Verification, AFreeEndMayBeFasterThanTheGrippers) {
  Solution solution = throughTheTube();
  solution.trajectory.shapes[40].back().rotation = turn(0.4, Vector3::UnitX());
  EXPECT_TRUE(verify(solution).valid());
}

TEST_F(Verification, HeldEndsThatAreNotTheControlsAreFound) {
  Solution solution = throughTheTube();
  solution.trajectory.held[30] = {true, true};
  expectOnlyFailure(solution, "held",
                    "state 30 (t = 0.6 s) says that [first, last] are held, its control holds [first]");
  solution = throughTheTube();
  solution.trajectory.held[0] = {false, true};
  expectOnlyFailure(solution, "held", "state 0 (t = 0 s) says that [last] are held");
}

TEST_F(Verification, AHeldEndThatDoesNotMoveKeepsItsPose) {
  Solution solution = throughTheTube();
  for (int j = 1; j <= 10; ++j)
    solution.trajectory.shapes[static_cast<std::size_t>(100 + j)] = straight({1 + 0.0024 * j, 0, 0});
  expectOnlyFailure(solution, "held", "the first end is held still, but at state 109");
  solution = throughTheTube();
  for (std::size_t j = 1; j <= 10; ++j)
    solution.trajectory.shapes[100 + j].back().rotation =
        turn(0.011 * static_cast<double>(j), Vector3::UnitX());
  expectOnlyFailure(solution, "held", "the last end is held still, but at state 110");
}

TEST_F(Verification, ControlsThatDoNotCoverTheTrajectoryAreFound) {
  Solution solution = throughTheTube();
  solution.controls[1].start_s = 2.02;
  expectOnlyFailure(solution, "controls",
                    "control 1 starts at 2.02 s; it must start where the one before ends, at 2 s");
  solution = throughTheTube();
  solution.controls[0].end_s = solution.controls[1].start_s = 1.99;
  expectOnlyFailure(solution, "controls", "no single control covers the motion between states 99 and 100");
  solution = throughTheTube();
  solution.controls.back().end_s = 2.18;
  expectOnlyFailure(solution, "controls", "the controls end at 2.18");
  solution.controls.back().end_s = 2.4;
  expectOnlyFailure(solution, "controls", "the controls go on to 2.4");
  solution = throughTheTube();
  solution.controls[0].end_s = 0;
  expectOnlyFailure(solution, "controls", "control 0 ends at 0 s, not after its start");
}

TEST_F(Verification, AGraspTheScenarioDoesNotAllowIsFound) {
  Solution solution = throughTheTube();
  solution.scenario.grippers.grasps = {Grasp::first, Grasp::last};
  expectOnlyFailure(solution, "controls",
                    "control 1 holds [first, last], which is not among the scenario's grasps");
  solution = throughTheTube();
  for (auto& held : solution.trajectory.held) held = {false, false};
  for (Control& control : solution.controls) control.held = {false, false}, control.moving = {};
  expectOnlyFailure(solution, "controls", "control 0 holds []");
}

TEST_F(Verification, AnEndThatMovesIsHeldAndItsTargetIsAPose) {
  Solution solution = throughTheTube();
  solution.controls[0].moving = End::last;
  // and the first, now held still, does move
  const VerificationReport report = verify(solution);
  EXPECT_EQ(failures(report), "controls held") << text(report);
  EXPECT_NE(messageOf(report, "controls").find("control 0 moves the last end but holds [first]"),
            std::string::npos);
  solution = throughTheTube();
  solution.controls[0].target.rotation.coeffs() *= 1.001;
  expectOnlyFailure(solution, "controls", "the target of control 0 is no pose");
}

// ---------------------------------------------------------------------------------------------- start and
// goal

TEST_F(Verification, AStartThatIsNotTheScenariosIsFound) {
  for (const double off : {1.9e-3, 2.1e-3}) {
    Solution solution = throughTheTube();
    std::get<PoseAndWrench>(*solution.scenario.start).pose.position.y() += off;
    if (off < 2e-3)
      EXPECT_TRUE(verify(solution).valid());
    else
      expectOnlyFailure(solution, "start", "by at most 2.1 mm (node ");
  }
  Solution solution = throughTheTube();
  std::get<PoseAndWrench>(*solution.scenario.start).pose.rotation = turn(0.021, Vector3::UnitX());
  expectOnlyFailure(solution, "start", "0.021 rad (node ");
  solution = throughTheTube();
  sag(solution, 0, 0.003);  // the right place, another shape
  expectOnlyFailure(solution, "start", "by at most 3 mm (node 10)");
  solution.scenario.start.reset();
  expectOnlyFailure(solution, "start", "the scenario has no start");
}

TEST_F(Verification, UnderGravityTheStartIsTheEquilibriumUnderIt) {
  Solution solution = throughTheTube();
  ASSERT_TRUE(verify(solution).valid());
  solution.scenario.environment.gravity = {0, 0, -9.81};  // the weightless rod is not at rest any more
  const VerificationReport report = verify(solution);
  EXPECT_NE(failures(report).find("start"), std::string::npos) << text(report);
}

TEST_F(Verification, OfASimulationOnlyTheFramesTheStartGivesAreCompared) {
  Solution solution = throughTheTube();
  sag(solution, 0, 0.003);
  solution.status = PlanStatus::simulated;
  EXPECT_NE(messageOf(verify(solution), "start").find("frames given by the scenario's start"),
            std::string::npos);
  std::get<PoseAndWrench>(*solution.scenario.start).pose.position.x() += 0.0021;
  expectOnlyFailure(solution, "start", "by at most 2.1 mm (first node)");
  solution.scenario.start = GripperPoses{{kAlongX, {0, 0, 0}}, {kAlongX, {1, 0.0021, 0}}};
  expectOnlyFailure(solution, "start", "by at most 2.1 mm (last node)");
  solution.scenario.environment.gravity.setZero();
  solution.status = PlanStatus::simulated;
  expectOnlyFailure(solution, "start", "by at most 2.1 mm (last node)");
  solution.scenario.start.reset();
  solution.scenario.start_pose = Pose{kAlongX, {0, 0.001, 0}};
  EXPECT_TRUE(verify(solution).valid()) << text(verify(solution));
}

/// A plate 0.1 m square across x, its middle at p.
std::string plateAcrossX(const Vector3& p) {
  const double w = 0.05;
  return objOf({{{{p.x(), p.y() - w, p.z() - w},
                  {p.x(), p.y() + w, p.z() - w},
                  {p.x(), p.y() + w, p.z() + w},
                  {p.x(), p.y() - w, p.z() + w}}}});
}

TEST_F(Verification, AStartByGripperPosesIsTheClearEquilibriumOfLeastEnergyAndMirrorImagesAreEqual) {
  const auto waiting = [&](const GripperPoses& ends, const RodShape& shape, const std::string& obj) {
    Solution solution = atRest(Vector3::Zero(), obj);
    solution.scenario.start = ends;
    solution.scenario.goal = Goal{ends, 0.01, 0.1, 0.01};
    add(solution, shape, {true, true});
    add(solution, shape, {true, true});
    solution.controls = {{0, kStep, {true, true}, {}, {}}};
    return solution;
  };
  const std::string far_away = plateAcrossX({-0.9, 0, 0});
  // twisted by 2.5 rad: a bow to one side, and another of more energy to the other side
  GripperPoses ends{{kAlongX, {0, 0, 0}}, {turn(2.5, Vector3::UnitX()), {0.9, 0.1, 0}}};
  const auto twisted = equilibriaOf(atRest(Vector3::Zero(), far_away).scenario.rod, ends);
  ASSERT_GE(twisted.size(), 2u);
  const RodShape &low = twisted[0].nodes, &high = twisted[1].nodes;
  EXPECT_EQ(failures(verify(waiting(ends, low, far_away))), "");
  EXPECT_EQ(failures(verify(waiting(ends, high, far_away))), "start goal");
  const std::string in_the_way = plateAcrossX(low[10].position);  // of the bow of least energy only
  EXPECT_EQ(failures(verify(waiting(ends, high, in_the_way))), "");
  EXPECT_EQ(failures(verify(waiting(ends, low, in_the_way))), "clearance start goal");

  // without the twist the two are mirror images
  ends.last = {kAlongX, {0.7, 0.1, 0}};
  const auto mirrored = equilibriaOf(atRest(Vector3::Zero(), far_away).scenario.rod, ends);
  ASSERT_GE(mirrored.size(), 2u);
  ASSERT_GT(maxNodeDistance(mirrored[0].nodes, mirrored[1].nodes), 0.1);
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_EQ(failures(verify(waiting(ends, mirrored[i].nodes, far_away))), "");
}

TEST_F(Verification, AGripperPoseNoRodReachesIsSaidToHaveNoEquilibrium) {
  Solution solution = throughTheTube();
  solution.scenario.start = GripperPoses{{kAlongX, {0, 0, 0}}, {kAlongX, {2, 0, 0}}};
  expectOnlyFailure(solution, "start", "it has no stable equilibrium");
}

TEST_F(Verification, AGoalThatIsMissedIsFound) {
  Solution solution = throughTheTube();
  std::get<GripperPoses>(solution.scenario.goal->placement).last.position.x() += 0.051;
  expectOnlyFailure(solution, "goal", "51 mm (last node)");
  solution.scenario.goal->position_tolerance = 0.052;
  EXPECT_TRUE(verify(solution).valid());

  solution = throughTheTube();
  std::get<GripperPoses>(solution.scenario.goal->placement).first.rotation = turn(0.6, Vector3::UnitX());
  EXPECT_TRUE(verify(solution).valid()) << "without a tolerance any angle will do";
  solution.scenario.goal->angle_tolerance = 0.5;
  expectOnlyFailure(solution, "goal", "0.6 rad (first node)");

  solution.scenario.goal.reset();
  expectOnlyFailure(solution, "goal", "the scenario has no goal");
}

TEST_F(Verification, AGoalInAnotherShapeIsFoundWhenTheShapeIsAskedFor) {
  Solution solution = throughTheTube();
  solution.scenario.goal->placement = PoseAndWrench{{kAlongX, {1, 0, 0}}, Vector6::Zero()};
  for (std::size_t k = 105; k < solution.trajectory.shapes.size(); ++k) sag(solution, k, 0.02);
  EXPECT_TRUE(verify(solution).valid()) << text(verify(solution));
  solution.scenario.goal->shape_tolerance = 0.019;
  expectOnlyFailure(solution, "goal", "its shape by at most 20 mm (node 10), 19 mm is allowed");
}

TEST_F(Verification, APlanThatDidNotArriveIsCheckedAllTheSameAndItsGoalIsNotReached) {
  Solution solution = throughTheTube();
  for (const PlanStatus status :
       {PlanStatus::time_limit, PlanStatus::iteration_limit, PlanStatus::cancelled}) {
    solution.status = status;
    expectOnlyFailure(solution, "goal", std::string("not reached: the plan ended with ") + name(status));
  }
  solution.status = PlanStatus::simulated;
  const VerificationReport report = verify(solution);
  EXPECT_TRUE(report.valid()) << text(report);
  EXPECT_EQ(messageOf(report, "goal"), "");
}

TEST_F(Verification, ASingleStateIsAMotionThatStandsStill) {
  Solution solution = throughTheTube();
  solution.status = PlanStatus::cancelled;
  solution.trajectory.time_s.resize(1);
  solution.trajectory.held.resize(1);
  solution.trajectory.shapes.resize(1);
  solution.controls.clear();
  expectOnlyFailure(solution, "goal", "not reached");
}

// ---------------------------------------------------------------------------------------------- meshes

TEST_F(Verification, AMeshThatIsNotTheRecordedOneIsBadInput) {
  Solution solution = throughTheTube();
  const auto messageOfError = [&] {
    try {
      (void)verify(solution);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  solution.mesh_sha256[0][5] ^= 1;
  EXPECT_NE(messageOfError().find("tube.obj: the mesh has changed since the solution was made"),
            std::string::npos);
  solution.mesh_sha256 = {"", ""};
  EXPECT_NE(messageOfError().find("records the sha256 of 2 meshes"), std::string::npos);
  solution.mesh_sha256.clear();
  EXPECT_TRUE(verify(solution).valid());
  fs::remove(scratch_.folder() / "meshes" / "tube.obj");
  EXPECT_NE(messageOfError().find("tube.obj"), std::string::npos);
}

}  // namespace
}  // namespace tendril
