/// axis.h: what tables and plots share.
#pragma once

#include "tendril/benchmark.h"

namespace tendril::benchmark {

/// Times 1, 2, 5 x 10^k [s], or 1, 3 x 10^k where that makes more than ten, from at most the shortest
/// successful run to at least the longest; two or more.
[[nodiscard]] std::vector<double> timeLadder(std::span<const BenchmarkStatistics> statistics);

/// The names in a field, each once, in the order in which they appear.
[[nodiscard]] std::vector<std::string> uniqueNames(std::span<const BenchmarkStatistics> statistics,
                                                   std::string BenchmarkStatistics::*field);

}  // namespace tendril::benchmark
