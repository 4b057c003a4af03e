/// The meshes a scenario names, as the world a rod moves in.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <numbers>
#include <string>

#include "tendril/dynamics.h"

namespace tendril {
namespace {
namespace fs = std::filesystem;

class LoadMeshes : public testing::Test {
 protected:
  void SetUp() override { scenario_.file = folder_ / "scenario.yaml"; }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path folder_ =
      fs::temp_directory_path() / ("tendril-load-meshes-" + std::to_string(::getpid()) + "-" +
                                   testing::UnitTest::GetInstance()->current_test_info()->name());
  Scenario scenario_;
};

TEST_F(LoadMeshes, EveryMeshOfTheFolderIsScaledTurnedAndMovedInTheOrderOfTheScenario) {
  writeFileAtomically(folder_ / "meshes/one.obj", "v 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n");
  const Quaternion quarter(Eigen::AngleAxisd(std::numbers::pi / 2, Vector3::UnitZ()));
  scenario_.environment.meshes = {
      {.file = "meshes/one.obj", .scale = 0.5, .pose = {quarter, {10, 0, 0}}},
      {.file = "meshes/one.obj", .scale = 1, .pose = {}},
  };
  const std::vector<std::vector<Vector3>> expected = {
      {{10, 0, 0}, {10, 0.5, 0}, {9, 0, 0}},  // x to y, y to -x
      {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}},
  };
  const std::vector<TriangleMesh> meshes = loadMeshes(scenario_);
  ASSERT_EQ(meshes.size(), expected.size());
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    EXPECT_EQ(meshes[m].faces.size(), 1U);
    EXPECT_EQ(meshes[m].vertices.size(), 3U);
    for (const Vector3& v : expected[m])
      EXPECT_TRUE(std::any_of(meshes[m].vertices.begin(), meshes[m].vertices.end(),
                              [&](const Vector3& w) { return (v - w).norm() < 1e-12; }))
          << "mesh " << m << " has no vertex " << v.transpose();
  }
}

TEST_F(LoadMeshes, AFileThatIsMissingIsNamed) {
  scenario_.environment.meshes = {{.file = "meshes/none.obj", .scale = 1, .pose = {}}};
  try {
    static_cast<void>(loadMeshes(scenario_));
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find((folder_ / "meshes/none.obj").string()), std::string::npos)
        << error.what();
  }
}

TEST_F(LoadMeshes, FreeSpaceHasNone) { EXPECT_TRUE(loadMeshes(scenario_).empty()); }

}  // namespace
}  // namespace tendril
