#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "tendril/solution.h"

namespace tendril {
namespace {

/// Every key of an object, and of what it holds.
void collectKeys(const nlohmann::json& json, std::vector<std::string>& keys) {
  if (!json.is_structured()) return;
  for (const auto& [key, value] : json.items()) {
    if (json.is_object()) keys.push_back(key);
    collectKeys(value, keys);
  }
}

TEST(SolutionDocumentation, ItsExampleHasTheKeysTheProgramWrites) {
  Solution solution;
  solution.scenario.file = "/scenarios/a.yaml";
  solution.run.planner = {{"name", "tendril"}};
  solution.controls = {{0, 1, {true, false}, End::first, {}}};
  solution.trajectory = {{0}, {{true, false}}, {RodShape(solution.scenario.rod.elements + 1)}};
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / ("tendril_docs_test." + std::to_string(::getpid()) + ".json");
  writeSolution(solution, file);
  nlohmann::json written = nlohmann::json::parse(readFile(file));
  std::filesystem::remove(file);
  written["scenario"] = {{"file", ""}, {"sha256", ""}, {"mesh_sha256", ""}};  // the rest is in scenario.md
  std::vector<std::string> keys;
  collectKeys(written, keys);

  const std::string docs = readFile(TENDRIL_SOURCE_DIR "/docs/solution.md");
  const std::size_t begin = docs.find("```json\n") + 8;
  const nlohmann::json example = nlohmann::json::parse(docs.substr(begin, docs.find("```", begin) - begin));
  std::vector<std::string> documented;
  collectKeys(example, documented);
  for (const std::string& key : keys)
    EXPECT_NE(std::find(documented.begin(), documented.end(), key), documented.end()) << key;
}

TEST(SolutionDocumentation, HasARowForEveryQuantity) {
  const std::string docs = readFile(TENDRIL_SOURCE_DIR "/docs/solution.md");
  visitQuantities(
      [&](const std::string& key, auto) { EXPECT_NE(docs.find("`" + key + "`"), std::string::npos) << key; });
}

TEST(SolutionDocumentation, HasARowForEveryPartOfAShortfallAndForEveryLimit) {
  const std::string docs = readFile(TENDRIL_SOURCE_DIR "/docs/solution.md");
  const std::string part = docs.substr(docs.find("## Shortfall"));
  visitShortfall(
      [&](const std::string& key, auto) { EXPECT_NE(part.find("`" + key + "`"), std::string::npos) << key; });
  for (const Limit limit : kLimits)
    EXPECT_NE(part.find(std::string("| `") + name(limit) + "` |"), std::string::npos) << name(limit);
}

TEST(SolutionDocumentation, NamesEveryStatus) {
  const std::string docs = readFile(TENDRIL_SOURCE_DIR "/docs/solution.md");
  for (const PlanStatus status : {PlanStatus::solved, PlanStatus::time_limit, PlanStatus::iteration_limit,
                                  PlanStatus::cancelled, PlanStatus::simulated})
    EXPECT_NE(docs.find(std::string("`") + name(status) + "`"), std::string::npos) << name(status);
}

}  // namespace
}  // namespace tendril
