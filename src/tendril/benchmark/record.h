/// record.h: benchmark.json, what the runs of one folder have in common.
#pragma once

#include "tendril/benchmark.h"

namespace tendril::benchmark {

[[nodiscard]] Benchmark readRecord(const std::filesystem::path& file);
void writeRecord(const Benchmark& benchmark, const std::filesystem::path& file);
/// The record with the scenarios, planners and command of `asked` added. Throws InputError if runs of the two
/// must not stand in one table; `file` is what the message names.
[[nodiscard]] Benchmark merged(Benchmark record, const Benchmark& asked, const std::filesystem::path& file);

}  // namespace tendril::benchmark
