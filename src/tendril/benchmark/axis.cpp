#include "axis.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tendril::benchmark {

std::vector<double> timeLadder(std::span<const BenchmarkStatistics> statistics) {
  double low = std::numeric_limits<double>::infinity(), high = 0;
  for (const BenchmarkStatistics& s : statistics)
    for (const double t : s.times) low = std::min(low, t), high = std::max(high, t);
  if (high <= 0) low = 1, high = 2;
  low = std::max(low, 1e-6);
  std::vector<double> ladder;
  for (int decade = static_cast<int>(std::floor(std::log10(low))); ladder.size() < 2 || ladder.back() < high;
       ++decade)
    for (const double step : {1.0, 2.0, 5.0}) {
      if (ladder.size() >= 2 && ladder.back() >= high) break;
      const double rung = step * std::pow(10.0, decade);
      if (rung <= low) ladder.clear();
      ladder.push_back(rung);
    }
  return ladder;
}

std::vector<std::string> uniqueNames(std::span<const BenchmarkStatistics> statistics,
                                     std::string BenchmarkStatistics::*field) {
  std::vector<std::string> names;
  for (const BenchmarkStatistics& s : statistics)
    if (std::find(names.begin(), names.end(), s.*field) == names.end()) names.push_back(s.*field);
  return names;
}

}  // namespace tendril::benchmark
