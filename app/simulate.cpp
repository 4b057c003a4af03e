#include <fmt/format.h>

#include "commands.h"
#include "common.h"
#include "tendril/planner.h"

namespace tendril::app {
namespace {

struct Options {
  std::string scenario, controls, folder;
  bool quantities = false, json = false;
};

/// Drops what of the controls lies beyond the end of a simulation that was stopped.
void cutOff(std::vector<Control>& controls, double end_s) {
  std::erase_if(controls, [&](const Control& control) { return control.start_s >= end_s; });
  if (!controls.empty()) controls.back().end_s = std::min(controls.back().end_s, end_s);
}

int run(const Options& options) {
  const std::atomic<bool>& cancel = cancelFlag();
  Solution solution;
  solution.scenario = readScenario(options.scenario);
  solution.controls = readControls(options.controls, solution.scenario.grippers);
  const std::filesystem::path folder = outputFolder(options.folder, solution.scenario);
  const World world = loadWorld(solution.scenario);
  const RodShape start = startShape(solution.scenario, world.obstacles, /*any_shape=*/true);

  const RodModel model(solution.scenario, world.obstacles);
  SimulationResult result = simulate(model, start, solution.controls, &cancel, options.quantities);
  solution.trajectory = std::move(result.trajectory);
  solution.quantities = std::move(result.quantities);
  solution.status = result.cancelled ? PlanStatus::cancelled : PlanStatus::simulated;
  solution.run.steps = result.steps;
  solution.run.simulated_time = solution.trajectory.time_s.back();
  if (result.cancelled) cutOff(solution.controls, solution.run.simulated_time);
  solution.run.wall_time = secondsSinceStart();
  solution.run.cpu_time = cpuSeconds();
  stamp(solution);

  const Written written = writeSolutionAndPage(solution, world, folder);
  if (options.json) {
    nlohmann::json summary = {{"status", name(solution.status)},
                              {"solution", written.solution.string()},
                              {"page", written.page.string()},
                              {"wall_time_s", solution.run.wall_time},
                              {"cpu_time_s", solution.run.cpu_time},
                              {"steps", solution.run.steps},
                              {"simulated_time_s", solution.run.simulated_time}};
    addQuantities(summary, solution);
    printJson(summary);
  } else {
    fmt::print("{}: {:.2f} s in {} steps, computed in {:.2f} s\n", name(solution.status),
               solution.run.simulated_time, solution.run.steps, solution.run.wall_time);
    printExtremes(solution);
    fmt::print("{}\n{} (open it in a browser)\n", written.solution.string(), written.page.string());
  }
  return result.cancelled ? 1 : 0;
}

}  // namespace

void addSimulate(CLI::App& app, int& status) {
  CLI::App& command =
      *app.add_subcommand("simulate", "Run the simulator alone; write DIR/solution.json and DIR/view.html");
  auto options = std::make_shared<Options>();
  command.add_option("scenario", options->scenario, "Scenario file")->required()->type_name("SCENARIO");
  command.add_option("--controls", options->controls, "{\"controls\": [...]}, as in a solution")
      ->required()
      ->type_name("FILE");
  command.add_option("-o", options->folder, "Where to write (default: out/<the scenario's name>)")
      ->type_name("DIR");
  command.add_flag("--quantities", options->quantities,
                   "Measure every step too: strains, forces, contacts, clearance, energies");
  command.add_flag("--json", options->json, "Print one JSON object");
  command.footer(
      "Example: tendril simulate scenarios/free-space.yaml --controls controls.json -o out/free-space");
  command.callback([options, &status] { status = run(*options); });
}

}  // namespace tendril::app
