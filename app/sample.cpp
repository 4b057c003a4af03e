#include <fmt/format.h>

#include <cmath>

#include "commands.h"
#include "common.h"

namespace tendril::app {
namespace {

/// Draws in a row without one that fits, after which the workspace counts as full.
constexpr int kFruitlessDraws = 20000;

struct Options {
  std::string scenario;
  int count = 0;
  std::uint64_t seed = 1;
  bool nodes = false, json = false;
};

bool fits(const RodShape& nodes, const Scenario& scenario, const Obstacles& obstacles) {
  std::vector<Vector3> polyline;
  polyline.reserve(nodes.size());
  for (const Pose& node : nodes) {
    if (!scenario.environment.workspace.contains(node.position)) return false;
    polyline.push_back(node.position);
  }
  return std::isinf(obstacles.clearance(polyline, scenario.rod.radius).distance);
}

/// Up to `count` stable rods, clear of the obstacles and inside the workspace; fewer if there is no room for
/// more.
std::vector<Equilibrium> sample(const Scenario& scenario, const Obstacles& obstacles, int count,
                                std::uint64_t seed) {
  const Box& workspace = scenario.environment.workspace;
  const SamplingBox box{.moment = scenario.planner.sample_moment, .force = scenario.planner.sample_force};
  EquilibriumIntegrator integrator(scenario.rod);
  Random random(seed);
  std::vector<Equilibrium> samples;
  for (int fruitless = 0; std::ssize(samples) < count && fruitless < kFruitlessDraws; ++fruitless) {
    Equilibrium rod = sampleStable(integrator, scenario.rod, box, random);
    Pose base{.rotation = random.rotation()};
    for (int k = 0; k < 3; ++k) base.position[k] = random.uniform(workspace.min[k], workspace.max[k]);
    for (Pose& node : rod.nodes) node = base * node;
    rod.base = rod.nodes.front();
    if (!fits(rod.nodes, scenario, obstacles)) continue;
    samples.push_back(std::move(rod));
    fruitless = -1;
  }
  return samples;
}

int run(const Options& options) {
  const Scenario scenario = readScenario(options.scenario);
  requireNoGravity(scenario);
  const World world = loadWorld(scenario);
  const std::vector<Equilibrium> samples = sample(scenario, world.obstacles, options.count, options.seed);
  if (options.json) {
    nlohmann::json list = nlohmann::json::array();
    for (const Equilibrium& rod : samples) list.push_back(toJson(rod, options.nodes));
    printJson({{"samples", list}});
  } else {
    for (const Equilibrium& rod : samples) fmt::print("{}\n", describe(rod));
  }
  if (std::ssize(samples) == options.count) return 0;
  fmt::print(stderr,
             "tendril: {} of {} rods found; the last {} draws left the workspace or touched a mesh.\n",
             samples.size(), options.count, kFruitlessDraws);
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
  command.add_flag("--nodes", options->nodes, "With --json: every node's frame too");
  command.add_flag("--json", options->json, "Print one JSON object");
  command.footer("Example: tendril sample scenarios/double-funnel.yaml --count 10 --json");
  command.callback([options, &status] { status = run(*options); });
}

}  // namespace tendril::app
