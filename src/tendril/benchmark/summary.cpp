#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "axis.h"
#include "tendril/benchmark.h"

namespace tendril {
namespace {

constexpr const char* kNone = "–";

/// Decimals that show three significant digits of a value.
int decimals(double value) {
  return value == 0 ? 0 : std::clamp(2 - static_cast<int>(std::floor(std::log10(std::abs(value)))), 0, 6);
}

/// Without exponent; a dash for what is not a number.
std::string figure(double value) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, decimals(value)) : kNone;
}

std::string meanAndDeviation(const Sample& sample) {
  if (!std::isfinite(sample.deviation)) return figure(sample.mean);
  return fmt::format("{0:.{2}f} ± {1:.{2}f}", sample.mean, sample.deviation, decimals(sample.mean));
}

/// A cell of a Markdown table.
std::string cell(const std::string& text) {
  std::string out;
  for (const char letter : text) out += letter == '|' ? "\\|" : letter == '\n' ? " " : std::string(1, letter);
  return out;
}

class Table {
 public:
  explicit Table(const std::vector<std::string>& titles) {
    row(titles);
    text_ += '|';
    for (std::size_t i = 0; i < titles.size(); ++i) text_ += " --- |";
    text_ += '\n';
  }
  void row(const std::vector<std::string>& cells) {
    text_ += '|';
    for (const std::string& text : cells) text_ += ' ' + cell(text) + " |";
    text_ += '\n';
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_;
};

std::string percent(double share) { return fmt::format("{:.1f} %", 100 * share); }

std::string conditions(const Benchmark& benchmark, std::span<const BenchmarkRun> runs) {
  std::uint64_t first = runs.empty() ? 0 : runs[0].seed, last = first;
  for (const BenchmarkRun& run : runs) first = std::min(first, run.seed), last = std::max(last, run.seed);
  Table table({"what", "value"});
  table.row(
      {"program", fmt::format("tendril {}, SHA-256 {:.16}...", benchmark.version, benchmark.program_sha256)});
  table.row({"machine", fmt::format("{}, {} processors, {:.0f} MHz", benchmark.machine.processor,
                                    benchmark.machine.processors, benchmark.machine.clock_mhz)});
  table.row(
      {"runs", fmt::format("{}, seeds {} to {}, each a process of its own on one thread, {} at once, at most "
                           "{} s",
                           runs.size(), first, last, benchmark.at_once, benchmark.time_limit)});
  table.row({"begun", benchmark.started});
  for (const std::string& command : benchmark.commands) table.row({"command", "`" + command + "`"});
  return table.text();
}

std::string workTable(std::span<const BenchmarkStatistics> statistics) {
  Table table(
      {"scenario", "planner", "processor time [s]", "iterations", "states", "steps", "simulated time [s]"});
  for (const BenchmarkStatistics& s : statistics)
    table.row({s.scenario, s.planner, meanAndDeviation(s.cpu_time), meanAndDeviation(s.iterations),
               meanAndDeviation(s.states), meanAndDeviation(s.steps), meanAndDeviation(s.simulated_time)});
  return table.text();
}

std::string curveTable(std::span<const BenchmarkStatistics> statistics) {
  const std::vector<double> ladder = benchmark::timeLadder(statistics);
  std::vector<std::string> titles = {"scenario", "planner"};
  for (const double t : ladder) titles.push_back(fmt::format("{:g} s", t));
  Table table(titles);
  for (const BenchmarkStatistics& s : statistics) {
    std::vector<std::string> cells = {s.scenario, s.planner};
    for (const double t : ladder) cells.push_back(fmt::format("{:.0f} %", 100 * s.solvedBy(t)));
    table.row(cells);
  }
  return table.text();
}

std::string restartTable(std::span<const BenchmarkStatistics> statistics) {
  Table table({"scenario", "planner", "without restarts [s]", "best restart after [s]", "then [s]"});
  for (const BenchmarkStatistics& s : statistics) {
    const bool helps = s.restart && s.restart->expected < s.expected_time;
    table.row({s.scenario, s.planner, figure(s.expected_time),
               helps       ? figure(s.restart->cutoff)
               : s.restart ? "no restart helps"
                           : kNone,
               helps ? figure(s.restart->expected) : kNone});
  }
  return table.text();
}

std::string failureTable(std::span<const BenchmarkStatistics> statistics) {
  Table table({"scenario", "planner", "seed", "status", "wall time [s]"});
  for (const BenchmarkStatistics& s : statistics)
    for (const BenchmarkRun& run : s.failures)
      table.row({run.scenario, run.planner, std::to_string(run.seed), run.status, figure(run.wall_time)});
  return table.text();
}

}  // namespace

std::string successTable(std::span<const BenchmarkStatistics> statistics) {
  Table table({"scenario", "planner", "solved and verified", "95 % interval",
               "wall time [s], mean ± deviation", "median", "90th percentile", "slowest"});
  for (const BenchmarkStatistics& s : statistics) {
    const Interval interval = wilsonInterval(s.successes, s.runs);
    table.row({s.scenario, s.planner,
               fmt::format("{} of {} ({})", s.successes, s.runs,
                           percent(static_cast<double>(s.successes) / s.runs)),
               fmt::format("{} to {}", percent(interval.low), percent(interval.high)),
               meanAndDeviation(s.wall_time), figure(s.wall_time.median), figure(s.wall_time.percentile90),
               figure(s.wall_time.max)});
  }
  return table.text();
}

std::string summary(const Benchmark& benchmark, std::span<const BenchmarkRun> runs) {
  const std::vector<BenchmarkStatistics> all = statistics(runs);
  const bool failures =
      std::any_of(all.begin(), all.end(), [](const BenchmarkStatistics& s) { return !s.failures.empty(); });
  std::string text = "# Benchmark\n\n" + conditions(benchmark, runs);
  text +=
      "\nTimes and work are those of the runs that were solved and verified; wall time is that of loading "
      "and "
      "planning.\n";
  text += "\n## Success and time\n\n" + successTable(all) + "\n![The wall time of every run](times.svg)\n";
  text +=
      "\n## Share solved after a time\n\n" + curveTable(all) + "\n![Share solved over time](success.svg)\n";
  text +=
      "\n## Expected time until success\n\nWhere every run that fails, or has not succeeded by the restart, "
      "is "
      "followed by one with another seed.\n\n" +
      restartTable(all);
  text += "\n## Work, mean ± deviation\n\n" + workTable(all);
  if (failures) text += "\n## Failures\n\n" + failureTable(all);
  return text;
}

void writeReports(const BenchmarkResult& result, const std::filesystem::path& folder) {
  const std::vector<BenchmarkStatistics> all = statistics(result.runs);
  writeFileAtomically(folder / "summary.md", summary(result.benchmark, result.runs));
  writeFileAtomically(folder / "success.svg", successPlot(all));
  writeFileAtomically(folder / "times.svg", timesPlot(all));
  writeFileAtomically(folder / "benchmark.db", database(result.benchmark, result.runs));
}

}  // namespace tendril
