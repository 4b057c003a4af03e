#include <fmt/format.h>

#include <cstring>

#include "commands.h"
#include "common.h"
#include "tendril/dynamics.h"

namespace tendril::app {
namespace {

struct Options {
  std::string solution;
  std::optional<std::string> scenario;
  bool json = false;
};

bool sameBits(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

bool sameBits(const Pose& a, const Pose& b) {
  for (int k = 0; k < 3; ++k)
    if (!sameBits(a.position[k], b.position[k])) return false;
  for (int k = 0; k < 4; ++k)
    if (!sameBits(a.rotation.coeffs()[k], b.rotation.coeffs()[k])) return false;
  return true;
}

/// Where and how `replayed` first departs from `stored`; empty if every number is the same bit for bit.
std::string firstDifference(const Trajectory& stored, const Trajectory& replayed) {
  const std::size_t states = std::min(stored.shapes.size(), replayed.shapes.size());
  for (std::size_t k = 0; k < states; ++k) {
    if (!sameBits(stored.time_s[k], replayed.time_s[k]))
      return fmt::format("state {} is at {} s in the file and at {} s when replayed", k, stored.time_s[k],
                         replayed.time_s[k]);
    if (stored.held[k] != replayed.held[k]) return fmt::format("state {}: other ends are held", k);
    for (std::size_t i = 0; i < stored.shapes[k].size(); ++i) {
      const Pose &a = stored.shapes[k][i], &b = replayed.shapes[k][i];
      if (!sameBits(a, b))
        return fmt::format("state {} (t = {} s), node {}: {:.3g} m and {:.3g} rad apart", k, stored.time_s[k],
                           i, (a.position - b.position).norm(), angleBetween(a.rotation, b.rotation));
    }
  }
  if (stored.shapes.size() != replayed.shapes.size())
    return fmt::format("the file has {} states, the replay {}", stored.shapes.size(), replayed.shapes.size());
  return {};
}

int run(const Options& options) {
  const Solution solution = readSolution(options.solution, options.scenario);
  const World world = loadWorld(solution);
  const RodModel model(solution.scenario, world.obstacles);
  const SimulationResult result = simulate(model, solution.trajectory.shapes.front(), solution.controls);
  const std::string difference = firstDifference(solution.trajectory, result.trajectory);
  if (options.json) {
    nlohmann::json json = {{"reproduced", difference.empty()}, {"states", solution.trajectory.shapes.size()}};
    if (!difference.empty()) json["first_difference"] = difference;
    printJson(json);
  } else if (difference.empty()) {
    fmt::print("reproduced: all {} states, bit for bit\n", solution.trajectory.shapes.size());
  } else {
    fmt::print("not reproduced: {}\n", difference);
  }
  return difference.empty() ? 0 : 1;
}

}  // namespace

void addReplay(CLI::App& app, int& status) {
  CLI::App& command = *app.add_subcommand(
      "replay", "Simulate a solution's controls again; say whether every state is reproduced bit for bit");
  auto options = std::make_shared<Options>();
  command.add_option("solution", options->solution, "Solution file")->required()->type_name("SOLUTION");
  command.add_option("--scenario", options->scenario, "Where the scenario (and its meshes) is now")
      ->type_name("FILE");
  command.add_flag("--json", options->json, "Print one JSON object");
  command.footer("Example: tendril replay out/double-funnel/solution.json");
  command.callback([options, &status] { status = run(*options); });
}

}  // namespace tendril::app
