/// tendril/benchmark.h: many runs of the planner, each a process of its own, and what they amount to. See
/// docs/benchmark.md.
#pragma once

#include <atomic>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "tendril/base.h"

namespace tendril {

// ---------------------------------------------------------------------------------------------- runs

/// One run: a row of runs.csv.
struct BenchmarkRun {
  std::string scenario, planner;
  std::uint64_t seed = 0;
  int threads = 1;       // of the planner
  std::string status;    // of the plan, or what became of the process, see docs/benchmark.md
  double wall_time = 0;  // of loading and planning, s
  double cpu_time = 0;   // of planning, s
  std::int64_t iterations = 0, states = 0, steps = 0;
  double simulated_time = 0;  // s
  bool verified = false;
  /// What counts as success: solved, and verified.
  [[nodiscard]] bool success() const { return status == "solved" && verified; }
};

/// The text of runs.csv, numbers as short as reads back the same.
[[nodiscard]] std::string toCsv(std::span<const BenchmarkRun> runs);
/// Reads runs.csv. Throws InputError naming file and line.
[[nodiscard]] std::vector<BenchmarkRun> readRuns(const std::filesystem::path& file);

/// The computer the runs are made on.
struct Machine {
  std::string host, processor;  // the processor's model
  int processors = 0;           // hardware threads
  double clock_mhz = 0;         // at the moment of asking
};
[[nodiscard]] Machine thisMachine();

struct BenchmarkScenario {
  std::string name;
  std::filesystem::path file;      // as given to `plan`
  std::string sha256;              // of the scenario file and its meshes
  nlohmann::ordered_json content;  // the scenario, every default filled in
};

/// What the runs of one folder have in common: its benchmark.json.
struct Benchmark {
  std::string version, program_sha256;
  double time_limit = 1200;  // s, of each run
  Machine machine;
  std::string started;  // UTC, ISO 8601
  int at_once = 1;      // the most runs side by side
  std::vector<std::string> commands, planners;
  std::vector<BenchmarkScenario> scenarios;
};

struct BenchmarkProgress {
  std::size_t done = 0, total = 0;  // of the runs that were missing
  const BenchmarkRun* last = nullptr;
  std::string message;  // what the last run's process said on standard error
};

struct BenchmarkRequest {
  std::filesystem::path program;  // run as `program plan SCENARIO -o DIR --seed ... --json`
  std::filesystem::path folder;
  int runs = 50;  // seeds first_seed, first_seed + 1, ...
  std::uint64_t first_seed = 1;
  bool keep = false;                          // keep each run's solution and page in `folder`/solutions
  double grace = 30;                          // s beyond the time limit after which a process is killed
  const std::atomic<bool>* cancel = nullptr;  // set by Ctrl-C: the runs under way are dropped
  std::function<void(const BenchmarkProgress&)> on_progress;  // may be empty; called after each run
};

struct BenchmarkResult {
  Benchmark benchmark;             // of all the runs in the folder
  std::vector<BenchmarkRun> runs;  // by scenario, planner, seed; the earlier ones too
  bool cancelled = false;
};

/// Makes the runs of `asked` (scenario x planner x seed) that the folder does not hold yet, at most
/// asked.at_once side by side; rewrites runs.csv after each. Throws InputError, having written nothing, if
/// the folder holds runs of another build, machine, time limit or scenario content, or is in use.
[[nodiscard]] BenchmarkResult runBenchmark(const Benchmark& asked, const BenchmarkRequest& request);

// ---------------------------------------------------------------------------------------------- statistics

/// Of some values; all NaN where there are too few (one for the deviation, none for the rest).
struct Sample {
  double mean = 0;
  double deviation = 0;  // standard deviation, n - 1 in the denominator
  double median = 0;
  double percentile90 = 0;
  double max = 0;
};
[[nodiscard]] Sample describe(std::span<const double> values);
/// The quantile p in [0, 1] of ascending values, linear between order statistics: p = 0 the first, 1 the
/// last. Hyndman and Fan (1996), definition 7. NaN if there are none.
[[nodiscard]] double quantile(std::span<const double> ascending, double p);

struct Interval {
  double low = 0, high = 1;
};
/// Wilson's 95 % interval of a probability from `successes` of `trials` (Wilson 1927).
[[nodiscard]] Interval wilsonInterval(int successes, int trials);

/// To start again with another seed whenever a run has not succeeded after `cutoff` [s] takes `expected` [s]
/// until success.
struct Restart {
  double cutoff = 0, expected = 0;
};
/// E[T](cutoff) = E[min(t, cutoff)] / P(success by cutoff) over the empirical distribution (Luby, Sinclair,
/// Zuckerman 1993); a failed run takes its own time and does not succeed. Infinite if none succeeds by then.
[[nodiscard]] double expectedTime(std::span<const BenchmarkRun> runs, double cutoff);
/// The cutoff of least expected time; nothing if no run succeeded.
[[nodiscard]] std::optional<Restart> bestRestart(std::span<const BenchmarkRun> runs);

/// The runs of one planner on one scenario. Samples are over the successful runs.
struct BenchmarkStatistics {
  std::string scenario, planner;
  int runs = 0, successes = 0;
  Sample wall_time, cpu_time, iterations, states, steps, simulated_time;
  std::vector<double> times;       // wall times of the successful runs, ascending
  double expected_time = 0;        // without restarts: the time of all runs over the successes
  std::optional<Restart> restart;  // the best
  std::vector<BenchmarkRun> failures;
  /// Fraction of all runs that had succeeded by `t` [s].
  [[nodiscard]] double solvedBy(double t) const;
};
/// One per scenario and planner, in the order in which they appear.
[[nodiscard]] std::vector<BenchmarkStatistics> statistics(std::span<const BenchmarkRun> runs);
[[nodiscard]] nlohmann::ordered_json toJson(const BenchmarkStatistics& statistics);

// ---------------------------------------------------------------------------------------------- reports

/// success.svg: share solved over time, a panel per scenario, a line per planner.
[[nodiscard]] std::string successPlot(std::span<const BenchmarkStatistics> statistics);
/// times.svg: every successful run's wall time, with quartiles, a row per scenario and planner.
[[nodiscard]] std::string timesPlot(std::span<const BenchmarkStatistics> statistics);
/// The main table of summary.md.
[[nodiscard]] std::string successTable(std::span<const BenchmarkStatistics> statistics);
/// summary.md, which shows both plots.
[[nodiscard]] std::string summary(const Benchmark& benchmark, std::span<const BenchmarkRun> runs);
/// benchmark.db: the bytes of an SQLite database in the schema of OMPL's Planner Arena (Moll, Sucan, Kavraki
/// 2015).
[[nodiscard]] std::string database(const Benchmark& benchmark, std::span<const BenchmarkRun> runs);
/// Writes all of these into `folder`.
void writeReports(const BenchmarkResult& result, const std::filesystem::path& folder);

}  // namespace tendril
