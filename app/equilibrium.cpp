#include <fmt/format.h>

#include <cmath>

#include "commands.h"
#include "common.h"

namespace tendril::app {
namespace {

struct Options {
  std::string scenario;
  std::vector<double> wrench, ends;
  bool json = false;
};

void requireFinite(const std::vector<double>& numbers, const char* option) {
  for (const double number : numbers)
    if (!std::isfinite(number))
      throw InputError(fmt::format("{}: {} is not a finite number.", option, number));
}

/// x y z qw qx qy qz, as in a scenario: the quaternion may be off by 1e-3 from unit length.
Pose poseFrom(const double* numbers, const char* end) {
  const Quaternion rotation(numbers[3], numbers[4], numbers[5], numbers[6]);
  if (std::abs(rotation.norm() - 1) > 1e-3)
    throw InputError(
        fmt::format("--ends: the {} end's quaternion qw qx qy qz has length {:.6g}; it must be 1.", end,
                    rotation.norm()));
  return {rotation.normalized(), Vector3(numbers[0], numbers[1], numbers[2])};
}

std::vector<Equilibrium> find(const Scenario& scenario, const Options& options) {
  if (!options.ends.empty())
    return fitEnds(scenario.rod,
                   {poseFrom(options.ends.data(), "first"), poseFrom(options.ends.data() + 7, "last")},
                   scenario.environment.gravity);
  Equilibrium equilibrium;
  EquilibriumIntegrator integrator(scenario.rod, scenario.environment.gravity);
  const Vector6 wrench = Vector6::Map(options.wrench.data());
  if (integrator.solve(scenario.start_pose.value_or(Pose{}), wrench, equilibrium) == ChartStatus::inverted)
    return {};
  return {equilibrium};
}

int run(const Options& options) {
  requireFinite(options.wrench, "--wrench");
  requireFinite(options.ends, "--ends");
  const Scenario scenario = readScenario(options.scenario);
  const std::vector<Equilibrium> found = find(scenario, options);
  if (options.json) {
    nlohmann::json list = nlohmann::json::array();
    for (const Equilibrium& equilibrium : found) list.push_back(toJson(equilibrium, /*with_nodes=*/true));
    printJson({{"samples", list}});
  } else {
    for (const Equilibrium& equilibrium : found) fmt::print("{}\n", describe(equilibrium));
    if (found.empty())
      fmt::print("no equilibrium: {}\n", options.ends.empty() ? "this wrench compresses the rod to nothing"
                                                              : "no stable rod was found between these ends");
  }
  return found.empty() ? 1 : 0;
}

}  // namespace

void addEquilibrium(CLI::App& app, int& status) {
  CLI::App& command = *app.add_subcommand(
      "equilibrium",
      "The rod's shape for a wrench at its first node, or every stable shape found between two ends");
  auto options = std::make_shared<Options>();
  command
      .add_option("scenario", options->scenario,
                  "Scenario file; start.pose, if given, is where the rod begins")
      ->required()
      ->type_name("SCENARIO");
  CLI::Option_group& which = *command.add_option_group("which", "One of");
  which.add_option("--wrench", options->wrench, "m1 m2 m3 [N m] n1 n2 n3 [N], in the first node's frame")
      ->expected(6)
      ->type_name("W");
  which
      .add_option("--ends", options->ends, "x y z qw qx qy qz of the first node's frame, then of the last's")
      ->expected(14)
      ->type_name("P");
  which.require_option(1);
  command.add_flag("--json", options->json, "Print one JSON object");
  command.footer(
      "Examples: tendril equilibrium scenarios/free-space.yaml --wrench 0 0 0.6 0 0 0\n"
      "          tendril equilibrium scenarios/free-space.yaml --ends 0 0 0 1 0 0 0  0.8 0.2 0 1 0 0 0 "
      "--json");
  command.callback([options, &status] { status = run(*options); });
}

}  // namespace tendril::app
