/// process.h: a child process whose output goes to two files, and which does not outlive this one.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <optional>

#include "tendril/base.h"

namespace tendril::benchmark {

/// How a process ended.
struct Ended {
  int status = 0;                      // as of wait(2)
  double wall_time = 0, cpu_time = 0;  // s, since it was started, of it and its own children
};

/// A running process; killed, if it still runs, and reaped when this goes.
class Process {
 public:
  /// Starts `program` with `arguments` (without argv[0]), standard output and error to files. Throws
  /// InputError.
  Process(const std::filesystem::path& program, const std::vector<std::string>& arguments,
          const std::filesystem::path& output, const std::filesystem::path& error);
  ~Process();
  Process(Process&& other) noexcept;
  Process& operator=(Process&& other) noexcept;
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// Seconds since it was started.
  [[nodiscard]] double elapsed() const;
  /// How it ended, once it has. Does not wait.
  [[nodiscard]] std::optional<Ended> ended();
  /// Kills it and waits for its end.
  Ended kill();

 private:
  std::optional<Ended> reap(int options);

  pid_t pid_ = 0;  // 0: reaped
  std::chrono::steady_clock::time_point started_;
};

}  // namespace tendril::benchmark
