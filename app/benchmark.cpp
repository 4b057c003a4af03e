#include "tendril/benchmark.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <ctime>

#include "commands.h"
#include "common.h"
#include "tendril/planner.h"

namespace tendril::app {
namespace {

struct Options {
  std::vector<std::string> scenarios, planners = {"tendril"};
  std::string folder = "out/benchmark";
  int runs = 50, threads = 1;
  std::uint64_t first_seed = 1;
  double time_limit_s = 1200;
  bool keep = false, json = false;
};

/// The scenario, if it can be planned at all. Throws InputError otherwise, as `plan` would.
BenchmarkScenario checkedScenario(const std::string& file) {
  const Scenario scenario = readScenario(file);
  const World world = loadWorld(scenario);
  static_cast<void>(startShape(scenario, world.obstacles));
  static_cast<void>(goalShape(scenario, world.obstacles));
  std::string hashes = scenario.sha256;
  for (const std::string& hash : meshHashes(scenario)) hashes += hash;
  return {scenario.name, file, sha256Hex(hashes), tendril::toJson(scenario)};
}

/// The command this process was given, as a shell takes it.
std::string commandLine() {
  const std::string arguments = readFile("/proc/self/cmdline");
  std::vector<std::string> words;
  for (std::size_t begin = 0; begin < arguments.size();) {
    const std::size_t end = std::min(arguments.find('\0', begin), arguments.size());
    std::string word = begin == 0 ? "tendril" : arguments.substr(begin, end - begin);
    begin = end + 1;
    const bool plain =
        !word.empty() && word.find_first_of(" \t\n\"'\\$`*?[](){}<>|&;#~!") == std::string::npos;
    for (std::size_t i = 0; !plain && (i = word.find('\'', i)) != std::string::npos; i += 4)
      word.replace(i, 1, "'\\''");
    words.push_back(plain ? word : fmt::format("'{}'", word));
  }
  return fmt::format("{}", fmt::join(words, " "));
}

Benchmark asked(const Options& options) {
  if (!std::isfinite(options.time_limit_s) || options.time_limit_s <= 0)
    throw InputError(
        fmt::format("--time-limit {}: is not a positive number of seconds.", options.time_limit_s));
  Benchmark benchmark;
  benchmark.version = TENDRIL_VERSION;
  benchmark.time_limit = options.time_limit_s;
  benchmark.machine = thisMachine();
  benchmark.started = fmt::format("{:%Y-%m-%d %H:%M:%S} UTC", fmt::gmtime(std::time(nullptr)));
  benchmark.at_once = options.threads;
  benchmark.commands = {commandLine()};
  for (const std::string& planner : options.planners) {
    const std::vector<std::string>& names = plannerNames();
    if (std::find(names.begin(), names.end(), planner) == names.end())
      throw InputError(fmt::format("--planner {}: is none of {}.", planner, fmt::join(names, ", ")));
    if (std::find(benchmark.planners.begin(), benchmark.planners.end(), planner) == benchmark.planners.end())
      benchmark.planners.push_back(planner);
  }
  for (const std::string& file : options.scenarios) {
    BenchmarkScenario scenario = checkedScenario(file);
    for (const BenchmarkScenario& other : benchmark.scenarios)
      if (other.name == scenario.name)
        throw InputError(
            fmt::format("{}: has the name \"{}\", which {} has, too; the tables go by names, so give it "
                        "another.",
                        file, scenario.name, other.file.string()));
    benchmark.scenarios.push_back(std::move(scenario));
  }
  benchmark.program_sha256 = sha256Hex(readFile("/proc/self/exe"));
  return benchmark;
}

/// A line for a run that went wrong, always; one for any other, rewritten in place, to terminals only.
void report(const BenchmarkProgress& progress) {
  static const bool terminal = isatty(STDERR_FILENO) != 0;
  const BenchmarkRun& run = *progress.last;
  const std::string name = fmt::format("{}, {}, seed {}", run.scenario, run.planner, run.seed);
  if (terminal) fmt::print(stderr, "\r\x1b[K");
  if (!progress.message.empty())
    fmt::print(stderr, "tendril: {}: {}: {}\n", name, run.status, progress.message);
  if (terminal && progress.done < progress.total) {
    fmt::print(stderr, "{} of {}: {}: {}, {:.2f} s", progress.done, progress.total, name, run.status,
               run.wall_time);
    std::fflush(stderr);
  }
}

int run(const Options& options) {
  BenchmarkRequest request;
  request.cancel = &cancelFlag();
  request.program = "/proc/self/exe";  // the very program that runs, whatever becomes of its file
  request.folder = options.folder;
  requireWritable(request.folder);
  request.runs = options.runs;
  request.first_seed = options.first_seed;
  request.keep = options.keep;
  request.on_progress = report;
  const BenchmarkResult result = runBenchmark(asked(options), request);
  writeReports(result, request.folder);

  const std::vector<BenchmarkStatistics> all = statistics(result.runs);
  if (options.json) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const BenchmarkStatistics& s : all) list.push_back(tendril::toJson(s));
    printJson({{"status", result.cancelled ? "cancelled" : "done"},
               {"folder", request.folder.string()},
               {"runs", result.runs.size()},
               {"statistics", list}});
  } else {
    fmt::print("{}\n{}\n", successTable(all), (request.folder / "summary.md").string());
    if (result.cancelled) fmt::print("cancelled; the same command goes on from here\n");
  }
  return result.cancelled ? 1 : 0;
}

}  // namespace

void addBenchmark(CLI::App& app, int& status) {
  CLI::App& command = *app.add_subcommand(
      "benchmark",
      "Plan scenarios with many seeds, verify every plan; write DIR/runs.csv, summary.md, benchmark.db");
  auto options = std::make_shared<Options>();
  command.add_option("scenario", options->scenarios, "Scenario files")->required()->type_name("SCENARIO");
  command.add_option("--runs", options->runs, "Runs of each planner on each scenario, with one seed each")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000))
      ->type_name("N");
  command.add_option("--first-seed", options->first_seed, "The first of the seeds")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber)
      ->type_name("N");
  command
      .add_option("--time-limit", options->time_limit_s, "Limit on loading and planning of a run, in seconds")
      ->capture_default_str()
      ->type_name("S");
  command.add_option("--threads", options->threads, "Runs at once; each takes one thread")
      ->capture_default_str()
      ->check(CLI::Range(1, 1024))
      ->type_name("K");
  command
      .add_option(
          "--planner", options->planners,
          "One of: " + fmt::format("{}", fmt::join(plannerNames(), ", ")) + "; may be given several times")
      ->capture_default_str()
      ->allow_extra_args(false)
      ->type_name("P");
  command.add_option("-o", options->folder, "Where to write; what stands there already is not run again")
      ->capture_default_str()
      ->type_name("DIR");
  command.add_flag("--keep", options->keep, "Keep every run's solution and page in DIR/solutions");
  command.add_flag("--json", options->json, "Print one JSON object");
  command.footer(
      "Example: tendril benchmark scenarios/double-funnel.yaml --planner tendril --planner paper -o "
      "out/benchmark");
  command.callback([options, &status] { status = run(*options); });
}

}  // namespace tendril::app
