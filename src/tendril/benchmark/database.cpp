#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <cassert>
#include <map>
#include <memory>
#include <new>

#include "tendril/benchmark.h"

namespace tendril {
namespace {

// The schema that OMPL's ompl_benchmark_statistics.py writes and Planner Arena reads. Columns of `runs`
// beyond the keys are free: Planner Arena offers each for plotting. An ENUM's values are described in
// `enums`.
constexpr const char* kSchema = R"(
CREATE TABLE experiments (id INTEGER PRIMARY KEY AUTOINCREMENT, name VARCHAR(512), totaltime REAL, timelimit REAL,
  memorylimit REAL, runcount INTEGER, version VARCHAR(128), hostname VARCHAR(1024), cpuinfo TEXT, date DATETIME,
  seed VARCHAR(24), setup TEXT);
CREATE TABLE plannerConfigs (id INTEGER PRIMARY KEY AUTOINCREMENT, name VARCHAR(512) NOT NULL, settings TEXT);
CREATE TABLE enums (name VARCHAR(512), value INTEGER, description TEXT, PRIMARY KEY (name, value));
CREATE TABLE runs (id INTEGER PRIMARY KEY AUTOINCREMENT, experimentid INTEGER, plannerid INTEGER,
  time REAL, solved BOOLEAN, correct_solution BOOLEAN, status ENUM, iterations INTEGER, graph_states INTEGER,
  seed INTEGER, threads INTEGER, cpu_time REAL, simulation_steps INTEGER, simulated_time REAL,
  FOREIGN KEY (experimentid) REFERENCES experiments(id) ON DELETE CASCADE,
  FOREIGN KEY (plannerid) REFERENCES plannerConfigs(id) ON DELETE CASCADE);
CREATE TABLE progress (runid INTEGER, time REAL, PRIMARY KEY (runid, time),
  FOREIGN KEY (runid) REFERENCES runs(id) ON DELETE CASCADE);
)";

void bind(sqlite3_stmt* statement, int place, double value) { sqlite3_bind_double(statement, place, value); }
void bind(sqlite3_stmt* statement, int place, std::int64_t value) {
  sqlite3_bind_int64(statement, place, value);
}
void bind(sqlite3_stmt* statement, int place, const std::string& value) {
  sqlite3_bind_text(statement, place, value.c_str(), static_cast<int>(value.size()), SQLITE_TRANSIENT);
}

/// A database in memory. What fails here is memory or our own SQL.
class Database {
 public:
  Database() {
    sqlite3* connection = nullptr;
    const int status = sqlite3_open(":memory:", &connection);
    connection_.reset(connection);
    require(status);
  }
  void execute(const char* sql) { require(sqlite3_exec(connection_.get(), sql, nullptr, nullptr, nullptr)); }
  /// Inserts a row into a table and gives its id.
  template <class... Values>
  std::int64_t insert(const std::string& table, const std::string& columns, const Values&... values) {
    std::string marks;
    for (std::size_t i = 0; i < sizeof...(values); ++i) marks += i == 0 ? "?" : ",?";
    const std::string sql = fmt::format("INSERT INTO {} ({}) VALUES ({})", table, columns, marks);
    sqlite3_stmt* prepared = nullptr;
    require(sqlite3_prepare_v2(connection_.get(), sql.c_str(), -1, &prepared, nullptr));
    const std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)> statement(prepared, sqlite3_finalize);
    int place = 0;
    (bind(prepared, ++place, values), ...);
    require(sqlite3_step(prepared));
    return sqlite3_last_insert_rowid(connection_.get());
  }
  /// The bytes of a file that holds it.
  [[nodiscard]] std::string bytes() const {
    sqlite3_int64 size = 0;
    const std::unique_ptr<unsigned char, decltype(&sqlite3_free)> data(
        sqlite3_serialize(connection_.get(), "main", &size, 0), sqlite3_free);
    if (!data) throw std::bad_alloc();
    return {reinterpret_cast<const char*>(data.get()), static_cast<std::size_t>(size)};
  }

 private:
  void require(int status) const {
    if (status == SQLITE_NOMEM) throw std::bad_alloc();
    if (status != SQLITE_OK && status != SQLITE_DONE)
      throw std::logic_error(fmt::format("SQLite: {}", sqlite3_errmsg(connection_.get())));
  }

  std::unique_ptr<sqlite3, decltype(&sqlite3_close)> connection_{nullptr, sqlite3_close};
};

}  // namespace

std::string database(const Benchmark& benchmark, std::span<const BenchmarkRun> runs) {
  Database db;
  db.execute(kSchema);

  std::map<std::string, std::int64_t> statuses;
  for (const BenchmarkRun& run : runs) statuses.emplace(run.status, 0);
  std::int64_t next = 0;
  for (auto& [status, value] : statuses) {
    value = next++;
    db.insert("enums", "name, value, description", std::string("status"), value, status);
  }

  const std::string cpu = fmt::format("{}, {} processors, {:.0f} MHz", benchmark.machine.processor,
                                      benchmark.machine.processors, benchmark.machine.clock_mhz);
  std::map<std::pair<std::string, std::string>, std::int64_t> planner_ids;  // by name and settings
  for (const BenchmarkScenario& scenario : benchmark.scenarios) {
    std::vector<BenchmarkRun> own;
    for (const BenchmarkRun& run : runs)
      if (run.scenario == scenario.name) own.push_back(run);
    if (own.empty()) continue;
    double total = 0;
    std::map<std::string, std::int64_t> counts;
    for (const BenchmarkRun& run : own) total += run.wall_time, ++counts[run.planner];
    const auto most = std::max_element(counts.begin(), counts.end(),
                                       [](const auto& a, const auto& b) { return a.second < b.second; });
    const std::int64_t experiment = db.insert(
        "experiments",
        "name, totaltime, timelimit, memorylimit, runcount, version, hostname, cpuinfo, date, seed, setup",
        scenario.name, total, benchmark.time_limit, 0.0, most->second, "tendril " + benchmark.version,
        benchmark.machine.host, cpu, benchmark.started, std::to_string(own.front().seed),
        scenario.content.dump(1));
    const std::string settings = scenario.content.value("planner", nlohmann::ordered_json::object()).dump();
    for (const BenchmarkRun& run : own) {
      const std::pair config(run.planner, settings);
      if (!planner_ids.contains(config))
        planner_ids[config] = db.insert("plannerConfigs", "name, settings", run.planner, settings);
      db.insert(
          "runs",
          "experimentid, plannerid, time, solved, correct_solution, status, iterations, graph_states, seed, "
          "threads, cpu_time, simulation_steps, simulated_time",
          experiment, planner_ids[config], run.wall_time, std::int64_t{run.success()},
          std::int64_t{run.verified}, statuses.at(run.status), run.iterations, run.states,
          static_cast<std::int64_t>(run.seed), std::int64_t{run.threads}, run.cpu_time, run.steps,
          run.simulated_time);
    }
  }
  return db.bytes();
}

}  // namespace tendril
