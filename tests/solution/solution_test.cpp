#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <bit>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "tendril/solution.h"

namespace tendril {
namespace {

namespace fs = std::filesystem;

constexpr const char* kScenario = R"(tendril_scenario: 1
name: example
rod: {length_m: 2.0, radius_m: 0.01, density_kg_m3: 1000, young_modulus_pa: 5.0e7, poisson_ratio: 0.4, elements: 40}
environment:
  meshes:
    - file: meshes/box.obj
  workspace_m: {min: [-2, -1, -1], max: [2, 1, 1]}
  friction: 0.2
  gravity_m_s2: [0, 0, -9.81]
grippers: {grasps: [both, first], max_speed_m_s: 1, max_turn_rad_s: 4}
start:
  pose: {position_m: [0, 0, 0], orientation_wxyz: [1, 0, 0, 0]}
  wrench: [0, 0, 0.1, 0, 0, 0]
)";

bool sameBits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

/// A double of any sign and magnitude that a length could have, down to subnormal numbers and zeros of both
/// signs.
double anyNumber(Random& random) {
  switch (random.bits() % 8) {
    case 0:
      return random.bits() % 2 == 0 ? 0.0 : -0.0;
    case 1:
      return std::ldexp(random.uniform(-1, 1), -1070);
    case 2:
      return std::ldexp(random.uniform(-1, 1), static_cast<int>(random.bits() % 200) - 100);
    case 3:
      return std::round(random.uniform(-100, 100));
    default:
      return random.uniform(-3, 3);
  }
}

RodShape anyShape(Random& random, int nodes) {
  RodShape shape;
  for (int i = 0; i < nodes; ++i)
    shape.push_back({random.rotation(), Vector3(anyNumber(random), anyNumber(random), anyNumber(random))});
  return shape;
}

class SolutionFile : public testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "scenarios/meshes");
    fs::create_directories(folder_ / "out");
    std::ofstream(folder_ / "scenarios/a.yaml") << kScenario;
    std::ofstream(folder_ / "scenarios/meshes/box.obj") << "v 0 0 0\n";
  }
  void TearDown() override { fs::remove_all(folder_); }

  Solution example(int states = 3) {
    Random random(5);
    Solution s;
    s.status = PlanStatus::solved;
    s.scenario = readScenario(folder_ / "scenarios/a.yaml");
    s.mesh_sha256 = meshHashes(s.scenario);
    s.run.version = "0.1.0";
    s.run.seed = 0xFFFFFFFFFFFFFFFF;
    s.run.threads = 2;
    s.run.planner = {{"name", "tendril"}, {"goal_bias", 0.2}};
    s.run.wall_time = 1.25;
    s.run.cpu_time = 1.0 / 3;
    s.run.iterations = 37, s.run.states = 12, s.run.steps = 1234567890123;
    s.run.simulated_time = 20.5;
    s.run.host = "a host";
    s.controls = {{0, 1.2, {true, true}, End::first, {random.rotation(), Vector3(0.1, 0.2, 0.3)}},
                  {1.2, 1.2 + 1.0 / 3, {true, false}, {}, {}}};
    for (int k = 0; k < states; ++k) {
      s.trajectory.time_s.push_back(k / 3.0);
      s.trajectory.held.push_back({true, k % 2 == 0});
      s.trajectory.shapes.push_back(anyShape(random, 41));
    }
    return s;
  }

  [[nodiscard]] std::string written() const { return readFile(file_); }
  /// The message for the written solution with `from` replaced by `to`, without the file's name in front.
  std::string messageFor(const std::string& from, const std::string& to) {
    std::string text = written();
    const std::size_t at = text.find(from);
    if (at == std::string::npos) return "the solution does not contain " + from;
    std::ofstream(folder_ / "out/damaged.json") << text.replace(at, from.size(), to);
    try {
      (void)readSolution(folder_ / "out/damaged.json");
      return "";
    } catch (const InputError& e) {
      return std::string(e.what()).substr((folder_ / "out/damaged.json").string().size());
    }
  }

  fs::path folder_ =
      fs::canonical(fs::temp_directory_path()) / ("tendril_solution_test." + std::to_string(::getpid()));
  fs::path file_ = folder_ / "out/solution.json";
};

TEST_F(SolutionFile, KeepsARestCurvatureForEveryElement) {
  Solution s = example();
  for (int k = 0; k < s.scenario.rod.elements; ++k)
    s.scenario.rod.rest_curvature.emplace_back(k / 7.0, -1, 0.1);
  writeSolution(s, file_);
  EXPECT_EQ(readSolution(file_).scenario.rod.rest_curvature, s.scenario.rod.rest_curvature);
}

TEST_F(SolutionFile, WritingAndReadingAgainChangesNoBit) {
  const Solution a = example(50);
  writeSolution(a, file_);
  const Solution b = readSolution(file_);
  EXPECT_EQ(b.status, a.status);
  EXPECT_EQ(toJson(b.scenario).dump(), toJson(a.scenario).dump());
  EXPECT_EQ(b.scenario.file, a.scenario.file);
  EXPECT_EQ(b.scenario.sha256, a.scenario.sha256);
  EXPECT_EQ(b.mesh_sha256, a.mesh_sha256);
  EXPECT_EQ(b.run.version, a.run.version);
  EXPECT_EQ(b.run.seed, a.run.seed);
  EXPECT_EQ(b.run.threads, a.run.threads);
  EXPECT_EQ(b.run.planner, a.run.planner);
  EXPECT_EQ(b.run.wall_time, a.run.wall_time);
  EXPECT_EQ(b.run.cpu_time, a.run.cpu_time);
  EXPECT_EQ(b.run.iterations, a.run.iterations);
  EXPECT_EQ(b.run.states, a.run.states);
  EXPECT_EQ(b.run.steps, a.run.steps);
  EXPECT_EQ(b.run.simulated_time, a.run.simulated_time);
  EXPECT_EQ(b.run.host, a.run.host);
  ASSERT_EQ(b.controls.size(), a.controls.size());
  for (std::size_t i = 0; i < a.controls.size(); ++i) {
    EXPECT_TRUE(sameBits(b.controls[i].start_s, a.controls[i].start_s));
    EXPECT_TRUE(sameBits(b.controls[i].end_s, a.controls[i].end_s));
    EXPECT_EQ(b.controls[i].held, a.controls[i].held);
    EXPECT_EQ(b.controls[i].moving, a.controls[i].moving);
  }
  EXPECT_EQ(b.controls[0].target.position, a.controls[0].target.position);
  EXPECT_EQ(b.controls[0].target.rotation.coeffs(), a.controls[0].target.rotation.coeffs());
  ASSERT_EQ(b.trajectory.shapes.size(), a.trajectory.shapes.size());
  EXPECT_EQ(b.trajectory.held, a.trajectory.held);
  for (std::size_t k = 0; k < a.trajectory.shapes.size(); ++k) {
    EXPECT_TRUE(sameBits(b.trajectory.time_s[k], a.trajectory.time_s[k]));
    ASSERT_EQ(b.trajectory.shapes[k].size(), a.trajectory.shapes[k].size());
    for (std::size_t i = 0; i < a.trajectory.shapes[k].size(); ++i) {
      const Pose &pa = a.trajectory.shapes[k][i], &pb = b.trajectory.shapes[k][i];
      for (int j = 0; j < 3; ++j) ASSERT_TRUE(sameBits(pa.position[j], pb.position[j])) << pa.position[j];
      for (int j = 0; j < 4; ++j) ASSERT_TRUE(sameBits(pa.rotation.coeffs()[j], pb.rotation.coeffs()[j]));
    }
  }
  writeSolution(b, folder_ / "out/again.json");
  EXPECT_EQ(readFile(folder_ / "out/again.json"), written());
}

/// Quantities of any values, contacts included, with and without those that may be missing.
Quantities anyQuantities(Random& random, std::int64_t state, int elements) {
  const auto number = [&] { return anyNumber(random); };
  const auto vector = [&] { return Vector3(number(), number(), number()); };
  Quantities q;
  q.time = number(), q.state = state;
  for (int k = 0; k < elements; ++k) {
    q.curvature.push_back(vector()), q.strain.push_back(vector());
    q.internal_moment.push_back(vector()), q.internal_force.push_back(vector());
  }
  if (state % 2 == 0) {
    q.bend_radius = number(), q.bend_radius_s = number(), q.clearance = number();
    q.contacts = {{number(), vector(), vector()}, {number(), vector(), vector()}};
    q.friction = {{number(), vector(), vector()}};
    q.self_contacts = {{{number(), number()}, vector(), vector()}};
  }
  q.gripper_moment = {vector(), vector()}, q.gripper_force = {vector(), vector()};
  q.gripper_work = {number(), number()};
  for (double* energy : {&q.kinetic, &q.twist, &q.bending, &q.stretch, &q.shear, &q.gravity, &q.contact,
                         &q.total, &q.dissipated})
    *energy = number();
  return q;
}

TEST_F(SolutionFile, QuantitiesAreInTheFileOnlyIfThereAreAnyAndComeBackBitForBit) {
  Solution a = example();
  writeSolution(a, file_);
  const std::string without = written();
  EXPECT_EQ(without.find("quantities"), std::string::npos);
  EXPECT_TRUE(readSolution(file_).quantities.empty());

  Random random(11);
  for (int k = 0; k < 3; ++k) a.quantities.push_back(anyQuantities(random, k, a.scenario.rod.elements));
  writeSolution(a, file_);
  const std::string with = written();
  EXPECT_EQ(with.substr(0, without.size() - 3), without.substr(0, without.size() - 3));  // all but "\n}\n"
  const Solution b = readSolution(file_);
  writeSolution(b, folder_ / "out/again.json");
  EXPECT_EQ(readFile(folder_ / "out/again.json"), with);
  ASSERT_EQ(b.quantities.size(), 3U);
  for (std::size_t k = 0; k < 3; ++k) {
    const Quantities &p = a.quantities[k], &q = b.quantities[k];
    EXPECT_TRUE(sameBits(p.time, q.time));
    EXPECT_EQ(p.state, q.state);
    EXPECT_EQ(p.internal_force, q.internal_force);
    EXPECT_EQ(p.bend_radius, q.bend_radius);
    EXPECT_EQ(p.gripper_work, q.gripper_work);
    EXPECT_EQ(p.contacts.size(), q.contacts.size());
    EXPECT_EQ(p.clearance, q.clearance);
    EXPECT_TRUE(sameBits(p.dissipated, q.dissipated));
  }
  EXPECT_EQ(a.quantities[0].contacts[1].force, b.quantities[0].contacts[1].force);
  EXPECT_EQ(a.quantities[2].self_contacts[0].s, b.quantities[2].self_contacts[0].s);
}

TEST_F(SolutionFile, EveryErrorInTheQuantitiesNamesItsKey) {
  Solution s = example();
  s.quantities.resize(1);
  Quantities& q = s.quantities[0];
  q.time = 0.5, q.bend_radius = 0.25, q.total = 7;
  for (auto* list : {&q.curvature, &q.strain, &q.internal_moment, &q.internal_force})
    list->assign(40, Vector3(1, 2, 3));
  q.contacts = {{0.125, Vector3::Zero(), Vector3(0, 0, 8)}};
  writeSolution(s, file_);
  EXPECT_EQ(messageFor("\"clearance_m\"", "\"clearence_m\""),
            ": unknown key \"clearence_m\" in quantities; did you mean \"clearance_m\"?");
  EXPECT_EQ(messageFor("  \"friction\": [\n   []\n  ],\n", ""), ": quantities.friction is missing.");
  EXPECT_EQ(messageFor("\"bend_radius_m\": [0.25]", "\"bend_radius_m\": [\"no\"]"),
            ": quantities.bend_radius_m[0] is \"no\"; it must be a number or null.");
  EXPECT_EQ(
      messageFor("\"energy_total_j\": [7.0]", "\"energy_total_j\": [7.0, 8.0]"),
      ": quantities.energy_total_j has 2 values, quantities.time_s 1; there must be one of each per step.");
  EXPECT_EQ(messageFor("\"energy_total_j\": [7.0]", "\"energy_total_j\": [null]"),
            ": quantities.energy_total_j[0] is null; it must be a number.");
  EXPECT_EQ(messageFor("\"state\": [0]", "\"state\": [3]"),
            ": quantities.state[0] is 3; the trajectory has 3 states.");
  EXPECT_EQ(messageFor("\"state\": [0]", "\"state\": [-1]"),
            ": quantities.state[0] is -1; it must be a whole number >= 0.");
  EXPECT_EQ(
      messageFor("[[1.0,2.0,3.0],", "["),
      ": quantities.curvature_1_m[0] is a list; it must be a list of 40 lists of three numbers, one per "
      "element of the rod.");
  for (const char* wrong : {"\"s\":0.125", "\"s_m\":0.125,\"more\":1", "\"s_m\":[0.125]"})
    EXPECT_EQ(
        messageFor("\"s_m\":0.125", wrong),
        ": quantities.contacts[0] is a list; it must be a list of objects with s_m (a number), position_m "
        "and force_n (three numbers each).");
}

TEST_F(SolutionFile, AShortfallIsInTheFileOnlyIfThereIsOneAndComesBackBitForBit) {
  Solution a = example();
  a.status = PlanStatus::time_limit;
  writeSolution(a, file_);
  EXPECT_EQ(written().find("shortfall"), std::string::npos);
  EXPECT_FALSE(readSolution(file_).shortfall);

  Random random(3);
  for (const Limit limit : kLimits) {
    Shortfall& s = a.shortfall.emplace();
    s.distance = anyNumber(random), s.largest_distance = anyNumber(random);
    s.end_distance = {0.1, 1.0 / 3}, s.end_angle = {anyNumber(random), 2};
    if (limit != Limit::time) {  // else what may be missing is
      s.limit = limit, s.gripper = End::last, s.position = Vector3(0.1, 0.2, 1.0 / 3);
      s.gripper_force = anyNumber(random), s.gripper_torque = anyNumber(random);
      s.contact = {
          .s = 0.1, .position = {1, 2, 1.0 / 3}, .force = {0, 0, -7}, .mesh = "meshes/box.obj", .face = 12};
      s.clearance = anyNumber(random), s.bend_radius = 0.7, s.bend_radius_s = anyNumber(random);
    }
    writeSolution(a, file_);
    const Solution b = readSolution(file_);
    ASSERT_TRUE(b.shortfall);
    EXPECT_EQ(b.shortfall->limit, s.limit);
    EXPECT_EQ(b.shortfall->gripper, s.gripper);
    EXPECT_EQ(b.shortfall->position, s.position);
    EXPECT_EQ(b.shortfall->end_distance, s.end_distance);
    EXPECT_EQ(b.shortfall->bend_radius, s.bend_radius);
    EXPECT_EQ(b.shortfall->contact.has_value(), s.contact.has_value());
    if (s.contact) {
      EXPECT_EQ(b.shortfall->contact->position, s.contact->position);
      EXPECT_EQ(b.shortfall->contact->mesh, s.contact->mesh);
      EXPECT_EQ(b.shortfall->contact->face, s.contact->face);
    }
    writeSolution(b, folder_ / "out/again.json");
    EXPECT_EQ(readFile(folder_ / "out/again.json"), written());
  }
}

TEST_F(SolutionFile, EveryErrorInTheShortfallNamesItsKey) {
  Solution s = example();
  s.shortfall.emplace();
  s.shortfall->limit = Limit::force, s.shortfall->gripper = End::first, s.shortfall->clearance = 0.5;
  writeSolution(s, file_);
  EXPECT_EQ(
      messageFor("\"force\"", "\"farce\""),
      ": shortfall.limit is \"farce\"; it must be one of force, torque, bend, clearance, workspace, shape, "
      "time, or null.");
  EXPECT_EQ(messageFor("\"gripper\": \"first\"", "\"gripper\": \"both\""),
            ": shortfall.gripper is \"both\"; it must be first, last or null.");
  EXPECT_EQ(messageFor("\"clearance_m\": 0.5", "\"clearance_m\": \"no\""),
            ": shortfall.clearance_m is \"no\"; it must be a number or null.");
  EXPECT_EQ(messageFor("\"contact\": null", "\"contact\": {\"s_m\": 1}").substr(0, 40),
            ": shortfall.contact is a mapping; it mus");
  EXPECT_EQ(messageFor("\"clearance_m\"", "\"clearence_m\""),
            ": unknown key \"clearence_m\" in shortfall; did you mean \"clearance_m\"?");
}

TEST_F(SolutionFile, IsJsonWhoseKeysStandInTheDocumentedOrder) {
  writeSolution(example(), file_);
  const auto json = nlohmann::ordered_json::parse(written());
  const auto keys = [](const nlohmann::ordered_json& object) {
    std::string out;
    for (const auto& [key, value] : object.items()) out += key + " ";
    return out;
  };
  EXPECT_EQ(keys(json), "tendril_solution status scenario run controls trajectory ");
  EXPECT_EQ(keys(json["scenario"]),
            "tendril_scenario name summary rod environment grippers start simulation planner file sha256 "
            "mesh_sha256 ");
  EXPECT_EQ(
      keys(json["run"]),
      "version seed threads planner wall_time_s cpu_time_s iterations states steps simulated_time_s host ");
  EXPECT_EQ(keys(json["controls"][0]), "start_s end_s moving held target ");
  EXPECT_EQ(keys(json["trajectory"]), "time_s held nodes ");
  EXPECT_EQ(json["trajectory"]["nodes"][0][0].size(), 7u);
  EXPECT_EQ(json["controls"][1]["moving"], nullptr);
  EXPECT_EQ(json["scenario"]["sha256"], sha256Hex(kScenario));
  EXPECT_EQ(json["scenario"]["mesh_sha256"][0], sha256Hex("v 0 0 0\n"));
}

TEST_F(SolutionFile, NodesAreWrittenWithSeventeenSignificantDigitsPositionFirstThenQuaternionWxyz) {
  Solution s = example(1);
  s.trajectory.shapes[0][0] = {Quaternion(0.5, -0.5, 0.5, -0.5), Vector3(0.1, -0.0, 1e-300)};
  writeSolution(s, file_);
  EXPECT_NE(written().find("[0.10000000000000001,-0.0,1e-300,0.5,-0.5,0.5,-0.5]"), std::string::npos)
      << written().substr(written().find("\"nodes\""), 200);
}

TEST_F(SolutionFile, NamesItsScenarioFromItsOwnFolderWhereverItIsMoved) {
  writeSolution(example(), file_);
  EXPECT_NE(written().find(R"("file": "../scenarios/a.yaml")"), std::string::npos);
  fs::rename(folder_, folder_.string() + "_moved");
  const Solution moved = readSolution(folder_.string() + "_moved/out/solution.json");
  EXPECT_EQ(moved.scenario.file, folder_.string() + "_moved/scenarios/a.yaml");
  EXPECT_EQ(meshHashes(moved.scenario), moved.mesh_sha256);
  fs::rename(folder_.string() + "_moved", folder_);

  // a relative name, from another working directory
  const fs::path before = fs::current_path();
  fs::current_path(folder_ / "out");
  writeSolution(example(), "deeper/solution.json");
  EXPECT_EQ(readSolution("deeper/solution.json").scenario.file, folder_ / "scenarios/a.yaml");
  fs::current_path(before);
  EXPECT_NE(readFile(folder_ / "out/deeper/solution.json").find(R"("../../scenarios/a.yaml")"),
            std::string::npos);
}

TEST_F(SolutionFile, ALinkedFolderIsFollowedBeforeStepsUpAreCounted) {
  fs::create_directories(folder_ / "far/away/disk");
  fs::create_directory_symlink(folder_ / "far/away/disk", folder_ / "link");
  writeSolution(example(), folder_ / "link/solution.json");
  EXPECT_EQ(readSolution(folder_ / "link/solution.json").scenario.file, folder_ / "scenarios/a.yaml");
  EXPECT_EQ(readSolution(folder_ / "far/away/disk/solution.json").scenario.file,
            folder_ / "scenarios/a.yaml");
}

TEST_F(SolutionFile, NamesItsScenarioAbsolutelyAcrossFileSystems) {
  const fs::path other = "/dev/shm/tendril_solution_test." + std::to_string(::getpid());
  struct stat here {
  }, there{};
  ASSERT_EQ(::stat("/dev/shm", &there), 0);
  ASSERT_EQ(::stat(folder_.c_str(), &here), 0);
  ASSERT_NE(here.st_dev, there.st_dev) << "give this test a file system other than that of " << folder_;
  writeSolution(example(), other / "solution.json");
  const std::string text = readFile(other / "solution.json");
  fs::remove_all(other);
  EXPECT_NE(text.find("\"file\": \"" + (folder_ / "scenarios/a.yaml").string() + "\""), std::string::npos);
}

TEST_F(SolutionFile, AnotherScenarioFileMayBeNamedWhereTheMeshesAre) {
  writeSolution(example(), file_);
  fs::create_directories(folder_ / "elsewhere");
  std::ofstream(folder_ / "elsewhere/b.yaml") << "not read";
  const Solution s = readSolution(file_, folder_ / "elsewhere/b.yaml");
  EXPECT_EQ(s.scenario.file, folder_ / "elsewhere/b.yaml");
  EXPECT_EQ(s.scenario.name, "example");
  EXPECT_THROW((void)meshHashes(s.scenario), InputError);
  EXPECT_THROW((void)readSolution(file_, folder_ / "elsewhere/c.yaml"), InputError);
}

TEST_F(SolutionFile, AMissingMeshIsNamedWithItsKey) {
  const Solution s = example();
  fs::remove(folder_ / "scenarios/meshes/box.obj");
  try {
    (void)meshHashes(s.scenario);
    FAIL();
  } catch (const InputError& e) {
    const std::string scenarios = (folder_ / "scenarios").string();
    EXPECT_EQ(e.what(), scenarios + "/a.yaml: environment.meshes[0].file is \"meshes/box.obj\"; " +
                            scenarios + "/meshes/box.obj: no such file.");
  }
}

TEST_F(SolutionFile, EveryErrorNamesFileAndKey) {
  writeSolution(example(), file_);
  EXPECT_EQ(
      messageFor("\"solved\"", "\"sovled\""),
      ": status is \"sovled\"; it must be one of solved, time_limit, iteration_limit, cancelled, simulated.");
  EXPECT_EQ(messageFor("\"tendril_solution\": 1", "\"tendril_solution\": 2"),
            ": tendril_solution is 2; this program reads version 1.");
  EXPECT_EQ(messageFor("\"tendril_solution\": 1", "\"tendril_scenario\": 1"),
            ": this is a scenario; a solution is needed here.");
  EXPECT_EQ(messageFor("\"controls\"", "\"control\""),
            ": unknown key \"control\"; did you mean \"controls\"?");
  EXPECT_EQ(messageFor("\"threads\": 2", "\"threads\": 2, \"threads\": 2"),
            ": the key \"threads\" appears twice in one object; keep one.");
  EXPECT_EQ(messageFor("\"threads\": 2,", ""), ": run.threads is missing.");
  EXPECT_EQ(messageFor("\"threads\": 2", "\"threads\": 0"), ": run.threads is 0; it must be at least 1.");
  EXPECT_EQ(messageFor("\"iterations\": 37", "\"iterations\": -37"),
            ": run.iterations is -37; it must be a whole number >= 0.");
  EXPECT_EQ(messageFor("\"radius_m\": 0.01", "\"radius_m\": -1.0"),
            ": scenario.rod.radius_m is -1.0; a radius must be > 0.");
  EXPECT_EQ(messageFor("\"radius_m\": 0.01", "\"radius\": 0.01"),
            ": unknown key \"radius\" in scenario.rod; did you mean \"radius_m\"?");
  EXPECT_EQ(messageFor("\"sha256\": \"", "\"sha256\": \"0\", \"not\": \""),
            ": unknown key \"not\" in scenario; did you mean \"rod\"?");
  EXPECT_EQ(messageFor("\"mesh_sha256\": [", "\"mesh_sha256\": [], \"planner\": ["),
            ": the key \"planner\" appears twice in one object; keep one.");
  EXPECT_EQ(messageFor("\"end_s\": 1.2", "\"end_s\": \"1.2\""),
            ": controls[0].end_s is \"1.2\"; it must be a number.");
  EXPECT_EQ(messageFor("\"time_s\": [0, ", "\"time_s\": ["),
            ": trajectory has 2 times, 3 held and 3 nodes; there must be one of each per state.");
  EXPECT_EQ(messageFor("\"held\": [[\"first\", \"last\"], [\"first\"]",
                       "\"held\": [[\"first\", \"first\"], [\"first\"]"),
            ": trajectory.held[0][1] is \"first\"; it must be first or last, each at most once.");
  const std::string damaged = messageFor("\"status\"", "status");
  EXPECT_TRUE(damaged.starts_with(": this is not JSON: parse error at line 3, column 2: ")) << damaged;

  Solution s = example(1);
  s.trajectory.shapes[0].pop_back();
  writeSolution(s, file_);
  EXPECT_EQ(messageFor("", ""), ": trajectory.nodes[0] has 40 nodes; the rod has 41 (rod.elements + 1).");
  s = example(2);
  s.trajectory.shapes[1][3].position = Vector3(777, 0, 0);
  writeSolution(s, file_);
  EXPECT_EQ(messageFor("[777,0,0,", "[777,0,"),
            ": trajectory.nodes[1][3] is a list; it must be a list of seven numbers, x y z qw qx qy qz.");
  EXPECT_EQ(messageFor("[777,0,0,", "[777,0,null,"),
            ": trajectory.nodes[1][3][2] is null; it must be a number.");
  EXPECT_EQ(messageFor("[777,0,0,", "[1e999,0,0,").substr(0, 20), ": this is not JSON: ");
}

TEST_F(SolutionFile, WhatVerificationJudgesIsReadAsItStands) {
  Solution s = example();
  s.trajectory.time_s = {0, 2, 1};                              // not increasing
  s.trajectory.shapes[1][5].rotation = Quaternion(2, 0, 0, 0);  // not unit
  s.controls[1].start_s = 7;                                    // a gap
  s.controls[0].held = {false, true};                           // the first end moves though nothing holds it
  writeSolution(s, file_);
  const Solution read = readSolution(file_);
  EXPECT_EQ(read.trajectory.time_s, s.trajectory.time_s);
  EXPECT_EQ(read.trajectory.shapes[1][5].rotation.w(), 2);
  EXPECT_EQ(read.controls[1].start_s, 7);
  EXPECT_EQ(read.controls[0].held, s.controls[0].held);
}

TEST_F(SolutionFile, AFailedWriteLeavesTheOldFileAndNoTemporary) {
  writeSolution(example(), file_);
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(folder_ / "out")) files += entry.is_regular_file() ? 1 : 0;
  EXPECT_EQ(files, 1u);
  EXPECT_THROW(writeSolution(example(), file_ / "below-a-file.json"), InputError);
  EXPECT_EQ(readSolution(file_).status, PlanStatus::solved);
}

TEST_F(SolutionFile, TwentyMegabytesAreWrittenAndReadWithinSeconds) {
  const Solution s = example(3300);
  const auto start = std::chrono::steady_clock::now();
  writeSolution(s, file_);
  const auto middle = std::chrono::steady_clock::now();
  (void)readSolution(file_);
  const auto end = std::chrono::steady_clock::now();
  const auto seconds = [](auto duration) { return std::chrono::duration<double>(duration).count(); };
  RecordProperty("megabytes", std::to_string(static_cast<double>(fs::file_size(file_)) * 1e-6));
  RecordProperty("write_s", std::to_string(seconds(middle - start)));
  RecordProperty("read_s", std::to_string(seconds(end - middle)));
  EXPECT_GT(fs::file_size(file_), 18'000'000u);
  EXPECT_LT(seconds(end - start), 20);  // tenths of a second each when optimised; the sanitizers are slower
}

}  // namespace
}  // namespace tendril
