#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "tendril/benchmark.h"

namespace tendril {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::vector<double> sorted(std::span<const double> values) {
  std::vector<double> ascending(values.begin(), values.end());
  std::sort(ascending.begin(), ascending.end());
  return ascending;
}

BenchmarkStatistics statisticsOf(std::span<const BenchmarkRun> runs) {
  BenchmarkStatistics result;
  result.scenario = runs.front().scenario;
  result.planner = runs.front().planner;
  result.runs = static_cast<int>(runs.size());
  std::vector<BenchmarkRun> good;
  for (const BenchmarkRun& run : runs) (run.success() ? good : result.failures).push_back(run);
  result.successes = static_cast<int>(good.size());
  const auto values = [&](auto field) {
    std::vector<double> list;
    for (const BenchmarkRun& run : good) list.push_back(static_cast<double>(run.*field));
    return list;
  };
  result.times = sorted(values(&BenchmarkRun::wall_time));
  result.wall_time = describe(result.times);
  result.cpu_time = describe(values(&BenchmarkRun::cpu_time));
  result.iterations = describe(values(&BenchmarkRun::iterations));
  result.states = describe(values(&BenchmarkRun::states));
  result.steps = describe(values(&BenchmarkRun::steps));
  result.simulated_time = describe(values(&BenchmarkRun::simulated_time));
  result.expected_time = expectedTime(runs, std::numeric_limits<double>::infinity());
  result.restart = bestRestart(runs);
  return result;
}

/// NaN and infinity as null.
nlohmann::ordered_json number(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
}

nlohmann::ordered_json toJson(const Sample& sample) {
  return {{"mean", number(sample.mean)},
          {"standard_deviation", number(sample.deviation)},
          {"median", number(sample.median)},
          {"percentile_90", number(sample.percentile90)},
          {"max", number(sample.max)}};
}

}  // namespace

double quantile(std::span<const double> ascending, double p) {
  if (ascending.empty()) return kNaN;
  const double place = p * static_cast<double>(ascending.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, ascending.size() - 1);
  return std::lerp(ascending[below], ascending[above], place - static_cast<double>(below));
}

Sample describe(std::span<const double> values) {
  if (values.empty()) return {kNaN, kNaN, kNaN, kNaN, kNaN};
  const std::vector<double> ascending = sorted(values);
  const auto n = static_cast<double>(ascending.size());
  const double mean = std::accumulate(ascending.begin(), ascending.end(), 0.0) / n;
  double squares = 0;
  for (const double value : ascending) squares += (value - mean) * (value - mean);
  const double deviation = n > 1 ? std::sqrt(squares / (n - 1)) : kNaN;
  return {mean, deviation, quantile(ascending, 0.5), quantile(ascending, 0.9), ascending.back()};
}

Interval wilsonInterval(int successes, int trials) {
  if (trials == 0) return {};
  const double z = 1.959963984540054;  // the normal distribution's 97.5 % quantile
  const double n = trials, p = successes / n;
  const double centre = p + z * z / (2 * n);
  const double half = z * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n));
  const double scale = 1 / (1 + z * z / n);
  return {std::max(0.0, scale * (centre - half)), std::min(1.0, scale * (centre + half))};
}

double expectedTime(std::span<const BenchmarkRun> runs, double cutoff) {
  double spent = 0, successes = 0;
  for (const BenchmarkRun& run : runs) {
    spent += std::min(run.wall_time, cutoff);
    if (run.success() && run.wall_time <= cutoff) ++successes;
  }
  return successes > 0 ? spent / successes : std::numeric_limits<double>::infinity();
}

std::optional<Restart> bestRestart(std::span<const BenchmarkRun> runs) {
  // Between two successes the expected time only grows with the cutoff, so the best is one of their times.
  std::optional<Restart> best;
  for (const BenchmarkRun& run : runs) {
    if (!run.success()) continue;
    const Restart restart{run.wall_time, expectedTime(runs, run.wall_time)};
    if (!best || restart.expected < best->expected ||
        (restart.expected == best->expected && restart.cutoff < best->cutoff))
      best = restart;
  }
  return best;
}

double BenchmarkStatistics::solvedBy(double t) const {
  const auto count = std::upper_bound(times.begin(), times.end(), t) - times.begin();
  return static_cast<double>(count) / runs;
}

std::vector<BenchmarkStatistics> statistics(std::span<const BenchmarkRun> runs) {
  std::vector<std::vector<BenchmarkRun>> groups;
  for (const BenchmarkRun& run : runs) {
    const auto same = [&](const std::vector<BenchmarkRun>& group) {
      return group.front().scenario == run.scenario && group.front().planner == run.planner;
    };
    const auto group = std::find_if(groups.begin(), groups.end(), same);
    if (group == groups.end())
      groups.push_back({run});
    else
      group->push_back(run);
  }
  std::vector<BenchmarkStatistics> result;
  for (const std::vector<BenchmarkRun>& group : groups) result.push_back(statisticsOf(group));
  return result;
}

nlohmann::ordered_json toJson(const BenchmarkStatistics& s) {
  const Interval interval = wilsonInterval(s.successes, s.runs);
  nlohmann::ordered_json json = {{"scenario", s.scenario},
                                 {"planner", s.planner},
                                 {"runs", s.runs},
                                 {"solved", s.successes},
                                 {"success", static_cast<double>(s.successes) / s.runs},
                                 {"success_interval_95", {interval.low, interval.high}},
                                 {"wall_time_s", toJson(s.wall_time)},
                                 {"cpu_time_s", toJson(s.cpu_time)},
                                 {"iterations", toJson(s.iterations)},
                                 {"states", toJson(s.states)},
                                 {"steps", toJson(s.steps)},
                                 {"simulated_time_s", toJson(s.simulated_time)},
                                 {"expected_time_s", number(s.expected_time)},
                                 {"restart", nullptr}};
  if (s.restart) json["restart"] = {{"after_s", s.restart->cutoff}, {"expected_time_s", s.restart->expected}};
  return json;
}

}  // namespace tendril
