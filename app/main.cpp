/// tendril: the command line. Parses arguments, calls the library, prints, and turns outcomes into exit
/// statuses.
#include <fmt/format.h>

#include "commands.h"
#include "tendril/base.h"

namespace {

constexpr int kBadInput = 2;

}  // namespace

int main(int argc, char** argv) {
  using namespace tendril;
  CLI::App app("Plans the motion of an elastic rod, held by its ends, through obstacles it may touch.",
               "tendril");
  app.set_version_flag("--version", "tendril " TENDRIL_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Exit status: 0 done; 1 no (no path, invalid, not reproduced, no equilibrium, cancelled); 2 bad "
      "input.\n"
      "Example: tendril plan scenarios/double-funnel.yaml --seed 1");
  int status = 0;
  app::addPlan(app, status);
  app::addVerify(app, status);
  app::addReplay(app, status);
  app::addView(app, status);
  app::addSample(app, status);
  app::addEquilibrium(app, status);
  app::addSimulate(app, status);
  app::addBenchmark(app, status);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kBadInput;
  } catch (const InputError& error) {
    fmt::print(stderr, "tendril: {}\n", error.what());
    return kBadInput;
  } catch (const std::exception& error) {  // of a library: a path or a device it cannot handle
    fmt::print(stderr, "tendril: unexpected: {}\n", error.what());
    return kBadInput;
  }
  return status;
}
