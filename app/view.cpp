#include <fmt/format.h>

#include "commands.h"
#include "common.h"

namespace tendril::app {
namespace {

struct Options {
  std::string solution, page;
  std::optional<std::string> scenario;
  bool json = false;
};

int run(const Options& options) {
  namespace fs = std::filesystem;
  const fs::path page =
      options.page.empty() ? fs::path(options.solution).parent_path() / "view.html" : fs::path(options.page);
  if (fs::is_directory(page))
    throw InputError(fmt::format("{}: is a folder; name a file with -o.", page.string()));
  const Solution solution = readSolution(options.solution, options.scenario);
  const World world = loadWorld(solution);
  writePageOf(solution, world, page);
  if (options.json)
    printJson({{"page", page.string()}});
  else
    fmt::print("{} (open it in a browser)\n", page.string());
  return 0;
}

}  // namespace

void addView(CLI::App& app, int& status) {
  CLI::App& command = *app.add_subcommand(
      "view", "Write a solution as one self-contained page, which opens without a server");
  auto options = std::make_shared<Options>();
  command.add_option("solution", options->solution, "Solution file")->required()->type_name("SOLUTION");
  command.add_option("-o", options->page, "Page to write (default: view.html next to the solution)")
      ->type_name("FILE.html");
  command.add_option("--scenario", options->scenario, "Where the scenario (and its meshes) is now")
      ->type_name("FILE");
  command.add_flag("--json", options->json, "Print one JSON object");
  command.footer("Example: tendril view out/double-funnel/solution.json -o double-funnel.html");
  command.callback([options, &status] { status = run(*options); });
}

}  // namespace tendril::app
