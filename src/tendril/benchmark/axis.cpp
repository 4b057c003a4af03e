#include "axis.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace tendril::benchmark {

namespace {

/// steps x 10^k from the last that is at most `low` to the first that is at least `high`; two or more.
std::vector<double> ladder(std::span<const double> steps, double low, double high) {
  std::vector<double> rungs;
  for (int decade = static_cast<int>(std::floor(std::log10(low)));; ++decade)
    for (const double step : steps) {
      if (rungs.size() >= 2 && rungs.back() >= high) return rungs;
      const double rung = step * std::pow(10.0, decade);
      if (rung <= low) rungs.clear();
      rungs.push_back(rung);
    }
}

}  // namespace

std::vector<double> timeLadder(std::span<const BenchmarkStatistics> statistics) {
  double low = std::numeric_limits<double>::infinity(), high = 0;
  for (const BenchmarkStatistics& s : statistics)
    for (const double t : s.times) low = std::min(low, t), high = std::max(high, t);
  if (high <= 0) low = high = 1;
  low = std::max(low, 1e-6);
  const std::vector<double> rungs = ladder(std::array{1.0, 2.0, 5.0}, low, high);
  return rungs.size() <= 10 ? rungs : ladder(std::array{1.0, 3.0}, low, high);
}

std::vector<std::string> uniqueNames(std::span<const BenchmarkStatistics> statistics,
                                     std::string BenchmarkStatistics::*field) {
  std::vector<std::string> names;
  for (const BenchmarkStatistics& s : statistics)
    if (std::find(names.begin(), names.end(), s.*field) == names.end()) names.push_back(s.*field);
  return names;
}

}  // namespace tendril::benchmark
