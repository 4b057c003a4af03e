#include "record.h"

#include <fmt/format.h>

#include <algorithm>

namespace tendril::benchmark {

Benchmark readRecord(const std::filesystem::path& file) {
  try {
    const auto json = nlohmann::ordered_json::parse(readFile(file));
    if (json.at("tendril_benchmark") != 1) throw InputError(file.string() + ": tendril_benchmark must be 1.");
    Benchmark benchmark;
    json.at("version").get_to(benchmark.version);
    json.at("program_sha256").get_to(benchmark.program_sha256);
    json.at("time_limit_s").get_to(benchmark.time_limit);
    json.at("started").get_to(benchmark.started);
    json.at("at_once").get_to(benchmark.at_once);
    json.at("commands").get_to(benchmark.commands);
    json.at("planners").get_to(benchmark.planners);
    const auto& machine = json.at("machine");
    machine.at("host").get_to(benchmark.machine.host);
    machine.at("processor").get_to(benchmark.machine.processor);
    machine.at("processors").get_to(benchmark.machine.processors);
    machine.at("clock_mhz").get_to(benchmark.machine.clock_mhz);
    for (const auto& scenario : json.at("scenarios"))
      benchmark.scenarios.push_back({scenario.at("name").get<std::string>(),
                                     scenario.at("file").get<std::string>(),
                                     scenario.at("sha256").get<std::string>(), scenario.at("content")});
    return benchmark;
  } catch (const nlohmann::json::exception& error) {
    throw InputError(
        fmt::format("{}: is not the record of a benchmark: {}; remove it and runs.csv, or name another "
                    "folder with -o.",
                    file.string(), error.what()));
  }
}

void writeRecord(const Benchmark& benchmark, const std::filesystem::path& file) {
  nlohmann::ordered_json scenarios = nlohmann::ordered_json::array();
  for (const BenchmarkScenario& scenario : benchmark.scenarios)
    scenarios.push_back({{"name", scenario.name},
                         {"file", scenario.file.string()},
                         {"sha256", scenario.sha256},
                         {"content", scenario.content}});
  const Machine& machine = benchmark.machine;
  const nlohmann::ordered_json json = {{"tendril_benchmark", 1},
                                       {"version", benchmark.version},
                                       {"program_sha256", benchmark.program_sha256},
                                       {"time_limit_s", benchmark.time_limit},
                                       {"machine",
                                        {{"host", machine.host},
                                         {"processor", machine.processor},
                                         {"processors", machine.processors},
                                         {"clock_mhz", machine.clock_mhz}}},
                                       {"started", benchmark.started},
                                       {"at_once", benchmark.at_once},
                                       {"commands", benchmark.commands},
                                       {"planners", benchmark.planners},
                                       {"scenarios", scenarios}};
  writeFileAtomically(file, json.dump(1) + '\n');
}

Benchmark merged(Benchmark record, const Benchmark& asked, const std::filesystem::path& file) {
  const auto refuse = [&](const std::string& what) {
    throw InputError(
        fmt::format("{}: the runs in this folder were made {}; name another folder with -o, or remove this "
                    "one to measure anew.",
                    file.string(), what));
  };
  if (record.program_sha256 != asked.program_sha256)
    refuse(fmt::format("by another build of the program ({}, sha256 {:.12}..., not {}, {:.12}...)",
                       record.version, record.program_sha256, asked.version, asked.program_sha256));
  if (record.time_limit != asked.time_limit)
    refuse(fmt::format("with --time-limit {}, not {}", record.time_limit, asked.time_limit));
  if (record.machine.processor != asked.machine.processor ||
      record.machine.processors != asked.machine.processors)
    refuse(fmt::format("on another machine ({}, {} processors)", record.machine.processor,
                       record.machine.processors));
  for (const BenchmarkScenario& scenario : asked.scenarios) {
    const auto same =
        std::find_if(record.scenarios.begin(), record.scenarios.end(),
                     [&](const BenchmarkScenario& other) { return other.name == scenario.name; });
    if (same == record.scenarios.end())
      record.scenarios.push_back(scenario);
    else if (same->sha256 != scenario.sha256)
      refuse(fmt::format("with another content of {} (or of its meshes)", scenario.file.string()));
  }
  const auto add = [](std::vector<std::string>& list, const std::vector<std::string>& more) {
    for (const std::string& item : more)
      if (std::find(list.begin(), list.end(), item) == list.end()) list.push_back(item);
  };
  add(record.planners, asked.planners);
  add(record.commands, asked.commands);
  record.at_once = std::max(record.at_once, asked.at_once);
  return record;
}

}  // namespace tendril::benchmark
