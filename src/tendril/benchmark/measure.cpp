#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <list>
#include <set>
#include <thread>
#include <tuple>

#include "process.h"
#include "record.h"
#include "tendril/benchmark.h"

namespace tendril {
namespace fs = std::filesystem;
namespace {

using benchmark::Ended;
using benchmark::Process;

/// Seconds by which a plan may exceed its time limit and still count.
constexpr double kTimeLimitSlack = 1;

struct Task {
  const BenchmarkScenario* scenario = nullptr;
  std::string planner;
  std::uint64_t seed = 0;
};

/// Holds a folder against a second benchmark in it.
class FolderLock {
 public:
  FolderLock() = default;
  ~FolderLock() {
    if (file_ >= 0) close(file_);
  }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

  /// Does nothing if it is held already, or there is no such folder.
  void acquire(const fs::path& folder) {
    if (file_ >= 0) return;
    file_ = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (file_ >= 0 && flock(file_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
      throw InputError(
          fmt::format("{}: another benchmark is writing there; wait for it or name another folder with -o.",
                      folder.string()));
  }

 private:
  int file_ = -1;
};

/// Where the runs' solutions go: removed at the end unless they are to be kept.
class Scratch {
 public:
  Scratch(const fs::path& folder, bool keep)
      : keep_(keep), folder_(folder / (keep ? "solutions" : ".scratch")) {
    clear();  // what a benchmark that was killed has left
  }
  ~Scratch() { clear(); }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

  /// The folder of one run, made and empty.
  [[nodiscard]] fs::path make(const Task& task) const {
    std::string name = task.scenario->name;
    std::replace(name.begin(), name.end(), '/', '-');
    if (name.empty() || name.front() == '.') name.insert(0, "-");
    const fs::path folder = folder_ / name / task.planner / std::to_string(task.seed);
    std::error_code error;
    fs::remove_all(folder, error);
    fs::create_directories(folder, error);
    if (error) throw InputError(fmt::format("{}: cannot be made: {}.", folder.string(), error.message()));
    return folder;
  }
  void done(const fs::path& folder) const {
    std::error_code error;
    if (!keep_) fs::remove_all(folder, error);
  }

 private:
  void clear() const {
    std::error_code error;
    if (!keep_) fs::remove_all(folder_, error);
  }

  bool keep_;
  fs::path folder_;
};

/// What a process said before it ended without a result.
std::string messageOf(const fs::path& error_file) {
  std::string text = readFile(error_file);
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.pop_back();
  return text;
}

/// The status of a process that gave no result.
std::string statusOf(int wait_status) {
  if (!WIFSIGNALED(wait_status)) return fmt::format("exit {}", WEXITSTATUS(wait_status));
  const char* name = sigabbrev_np(WTERMSIG(wait_status));
  return name != nullptr ? fmt::format("signal SIG{}", name)
                         : fmt::format("signal {}", WTERMSIG(wait_status));
}

/// Fills in what `plan --json` printed; false if that is no result.
bool readResult(const fs::path& output_file, BenchmarkRun& run) {
  const nlohmann::json json = nlohmann::json::parse(readFile(output_file), nullptr, false);
  if (!json.is_object()) return false;
  try {
    BenchmarkRun found = run;
    found.status = json.at("status").get<std::string>();
    found.wall_time = json.at("wall_time_s").get<double>();
    found.cpu_time = json.at("cpu_time_s").get<double>();
    found.iterations = json.at("iterations").get<std::int64_t>();
    found.states = json.at("states").get<std::int64_t>();
    found.steps = json.at("steps").get<std::int64_t>();
    found.simulated_time = json.at("simulated_time_s").get<double>();
    found.verified = json.at("verified").get<bool>();
    if (json.contains("verification") && !found.verified) found.status = "unverified";
    run = std::move(found);
    return true;
  } catch (const nlohmann::json::exception&) {
    return false;
  }
}

BenchmarkRun runOf(const Task& task, const Ended& end, bool overran, const fs::path& output_file,
                   double time_limit) {
  BenchmarkRun run;
  run.scenario = task.scenario->name;
  run.planner = task.planner;
  run.seed = task.seed;
  const bool exited = WIFEXITED(end.status) && WEXITSTATUS(end.status) <= 1;
  if (overran || !exited || !readResult(output_file, run)) {
    run.status = overran ? "overran" : statusOf(end.status);
    run.wall_time = end.wall_time;
    run.cpu_time = end.cpu_time;
  } else if (run.status == "solved" && run.wall_time > time_limit + kTimeLimitSlack) {
    run.status = "time_limit";
  }
  return run;
}

/// Several runs at once.
class Runner {
 public:
  Runner(const BenchmarkRequest& request, double time_limit)
      : request_(request), time_limit_(time_limit), scratch_(request.folder, request.keep) {}

  /// Calls finished(run, message) after each; stops, dropping what is under way, when the request's cancel is
  /// set, and then gives false.
  template <class Finished>
  bool run(const std::vector<Task>& tasks, int at_once, Finished&& finished) {
    std::size_t next = 0;
    while (next < tasks.size() || !active_.empty()) {
      if (request_.cancel != nullptr && request_.cancel->load()) {
        active_.clear();
        return false;
      }
      while (next < tasks.size() && active_.size() < static_cast<std::size_t>(at_once)) start(tasks[next++]);
      for (auto active = active_.begin(); active != active_.end();) {
        bool overran = false;
        std::optional<Ended> end = active->process.ended();
        if (!end && active->process.elapsed() > time_limit_ + request_.grace) {
          overran = true;
          end = active->process.kill();
        }
        if (end) {
          const BenchmarkRun run = runOf(active->task, *end, overran, active->folder / "stdout", time_limit_);
          const std::string message = messageOf(active->folder / "stderr");
          scratch_.done(active->folder);
          active = active_.erase(active);
          finished(run, message);
        } else {
          ++active;
        }
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return true;
  }

 private:
  struct Active {
    Task task;
    fs::path folder;
    Process process;
  };

  void start(const Task& task) {
    const fs::path folder = scratch_.make(task);
    const std::vector<std::string> arguments = {
        "plan",         task.scenario->file.string(),   "-o",        folder.string(),
        "--seed",       std::to_string(task.seed),      "--planner", task.planner,
        "--time-limit", fmt::format("{}", time_limit_), "--threads", "1",
        "--json"};
    active_.push_back(
        {task, folder, Process(request_.program, arguments, folder / "stdout", folder / "stderr")});
  }

  const BenchmarkRequest& request_;
  double time_limit_;
  Scratch scratch_;
  std::list<Active> active_;  // after scratch_: ended before the scratch folder is removed
};

std::size_t placeOf(const std::string& name, const std::vector<std::string>& names) {
  const auto found = std::find(names.begin(), names.end(), name);
  return static_cast<std::size_t>(found - names.begin());
}

/// Rows in the order of the benchmark's scenarios and planners, then of the seeds.
void sortRuns(std::vector<BenchmarkRun>& runs, const Benchmark& benchmark) {
  std::vector<std::string> scenarios;
  for (const BenchmarkScenario& scenario : benchmark.scenarios) scenarios.push_back(scenario.name);
  const auto key = [&](const BenchmarkRun& run) {
    return std::tuple(placeOf(run.scenario, scenarios), placeOf(run.planner, benchmark.planners), run.seed);
  };
  std::sort(runs.begin(), runs.end(),
            [&](const BenchmarkRun& a, const BenchmarkRun& b) { return key(a) < key(b); });
}

}  // namespace

BenchmarkResult runBenchmark(const Benchmark& asked, const BenchmarkRequest& request) {
  const fs::path csv = request.folder / "runs.csv", record = request.folder / "benchmark.json";
  FolderLock lock;
  lock.acquire(request.folder);
  BenchmarkResult result;
  Benchmark extended = asked;
  if (fs::exists(record)) {
    result.benchmark = benchmark::readRecord(record);
    extended = benchmark::merged(result.benchmark, asked, record);
    if (fs::exists(csv)) result.runs = readRuns(csv);
  } else if (fs::exists(csv)) {
    throw InputError(
        fmt::format("{}: there is no benchmark.json beside it that says how these runs were made; move it "
                    "away or name another "
                    "folder with -o.",
                    csv.string()));
  }

  std::set<std::tuple<std::string, std::string, std::uint64_t>> present;
  for (const BenchmarkRun& run : result.runs) present.emplace(run.scenario, run.planner, run.seed);
  std::vector<Task> missing;
  for (const BenchmarkScenario& scenario : asked.scenarios)
    for (const std::string& planner : asked.planners)
      for (int i = 0; i < request.runs; ++i) {
        const std::uint64_t seed = request.first_seed + static_cast<std::uint64_t>(i);
        if (!present.contains({scenario.name, planner, seed})) missing.push_back({&scenario, planner, seed});
      }
  if (missing.empty()) return result;
  result.benchmark = extended;

  std::error_code error;
  fs::create_directories(request.folder, error);
  lock.acquire(request.folder);
  Runner runner(request, asked.time_limit);
  benchmark::writeRecord(result.benchmark, record);
  BenchmarkProgress progress;
  progress.total = missing.size();
  const bool complete =
      runner.run(missing, asked.at_once, [&](const BenchmarkRun& run, const std::string& message) {
        result.runs.push_back(run);
        sortRuns(result.runs, result.benchmark);
        writeFileAtomically(csv, toCsv(result.runs));
        ++progress.done;
        progress.last = &run;
        progress.message = message;
        if (request.on_progress) request.on_progress(progress);
      });
  result.cancelled = !complete;
  return result;
}

}  // namespace tendril
