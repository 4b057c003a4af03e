#include <fmt/format.h>

#include <cmath>

#include "commands.h"
#include "common.h"

namespace tendril::app {
namespace {

struct Options {
  std::string solution;
  std::optional<std::string> scenario;
  bool json = false;
};

int run(const Options& options) {
  const Solution solution = readSolution(options.solution, options.scenario);
  const VerificationReport report = verify(solution);
  if (options.json) {
    printJson(toJson(report));
  } else {
    for (const Check& check : report.checks)
      fmt::print("{:4} {}: {}\n", check.passed ? "ok" : "FAIL", check.name, check.message);
    fmt::print("{}\n", report.valid() ? "valid" : "not valid");
  }
  return report.valid() ? 0 : 1;
}

}  // namespace

void addVerify(CLI::App& app, int& status) {
  CLI::App& command = *app.add_subcommand(
      "verify",
      "Check a solution from its file and its meshes alone, sharing no code with simulator and planner");
  auto options = std::make_shared<Options>();
  command.add_option("solution", options->solution, "Solution file")->required()->type_name("SOLUTION");
  command.add_option("--scenario", options->scenario, "Where the scenario (and its meshes) is now")
      ->type_name("FILE");
  command.add_flag("--json", options->json, "Print one JSON object");
  command.footer("Example: tendril verify out/double-funnel/solution.json");
  command.callback([options, &status] { status = run(*options); });
}

}  // namespace tendril::app
