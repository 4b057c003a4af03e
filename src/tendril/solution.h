/// tendril/solution.h: a plan as data, and its file format. See docs/solution.md.
#pragma once

#include <nlohmann/json.hpp>

#include "tendril/quantities.h"
#include "tendril/scenario.h"

namespace tendril {

enum class PlanStatus { solved, time_limit, iteration_limit, cancelled, simulated };
[[nodiscard]] const char* name(PlanStatus status);

/// How a solution came about.
struct Provenance {
  std::string version;
  std::uint64_t seed = 0;
  int threads = 1;
  nlohmann::json planner = nlohmann::json::object();  // {"name": ..., settings ...}
  double wall_time = 0, cpu_time = 0;                 // s
  std::int64_t iterations = 0, states = 0, steps = 0;
  double simulated_time = 0;  // s
  std::string host;
};

struct Solution {
  PlanStatus status = PlanStatus::simulated;
  Scenario scenario;                     // with scenario.file resolved to an absolute path
  std::vector<std::string> mesh_sha256;  // as recorded in the file
  Provenance run;
  std::vector<Control> controls;
  Trajectory trajectory;
  std::vector<Quantities> quantities;  // of every step if they were asked for, else empty: not in the file
};

/// Writes solution.json atomically; scenario.file is stored relative to its folder, numbers with 17
/// significant digits.
void writeSolution(const Solution& solution, const std::filesystem::path& file);
/// Reads and checks a solution. `scenario_override` replaces where the scenario (and so its meshes) is looked
/// for; its contents still come from the solution. Throws InputError with file, key and what is wrong.
[[nodiscard]] Solution readSolution(const std::filesystem::path& file,
                                    const std::optional<std::filesystem::path>& scenario_override = {});
/// sha256 of every mesh file of a scenario, in order. Throws InputError if one is missing.
[[nodiscard]] std::vector<std::string> meshHashes(const Scenario& scenario);

/// One array per quantity, named as in visitQuantities, with one element per step.
[[nodiscard]] nlohmann::ordered_json toJson(std::span<const Quantities> quantities);

/// One row x y z qw qx qy qz per node.
[[nodiscard]] nlohmann::ordered_json nodesToJson(const RodShape& shape);

}  // namespace tendril
