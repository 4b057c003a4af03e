#include <fmt/format.h>

#include "commands.h"
#include "common.h"
#include "tendril/planner.h"

namespace tendril::app {
namespace {

struct Options {
  std::string scenario;
  int count = 0;
  std::uint64_t seed = 1;
  int threads = 1;
  bool nodes = false, json = false;
};

int run(const Options& options) {
  const Scenario scenario = readScenario(options.scenario);
  const World world = loadWorld(scenario);
  const std::vector<Equilibrium> samples =
      sampleRods(scenario.rod, samplingSpace(scenario, world.obstacles), options.seed,
                 static_cast<std::size_t>(options.count), options.threads);
  if (options.json) {
    nlohmann::json list = nlohmann::json::array();
    for (const Equilibrium& rod : samples) list.push_back(toJson(rod, options.nodes));
    printJson({{"samples", list}});
  } else {
    for (const Equilibrium& rod : samples) fmt::print("{}\n", describe(rod));
  }
  if (std::ssize(samples) == options.count) return 0;
  fmt::print(stderr,
             "tendril: {} of {} rods found; all further draws were unstable, left the workspace or touched a "
             "mesh.\n",
             samples.size(), options.count);
  return 1;
}

}  // namespace

void addSample(CLI::App& app, int& status) {
  CLI::App& command = *app.add_subcommand(
      "sample",
      "Draw stable static rods, clear of the meshes and inside the workspace: wrench, ends, energy");
  auto options = std::make_shared<Options>();
  command.add_option("scenario", options->scenario, "Scenario file")->required()->type_name("SCENARIO");
  command.add_option("--count", options->count, "How many")
      ->required()
      ->check(CLI::Range(1, 1000000))
      ->type_name("K");
  command.add_option("--seed", options->seed, "Seed of every random choice")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber)
      ->type_name("N");
  command
      .add_option("--threads", options->threads,
                  "Threads that draw; the samples are the same whatever their number")
      ->capture_default_str()
      ->check(CLI::Range(1, 1024))
      ->type_name("K");
  command.add_flag("--nodes", options->nodes, "With --json: every node's frame too");
  command.add_flag("--json", options->json, "Print one JSON object");
  command.footer("Example: tendril sample scenarios/double-funnel.yaml --count 10 --json");
  command.callback([options, &status] { status = run(*options); });
}

}  // namespace tendril::app
