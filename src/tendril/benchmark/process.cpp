#include "process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

namespace tendril::benchmark {
namespace {

/// In the child: becomes the program, or ends with status 127. Calls only what is safe after fork.
[[noreturn]] void become(const char* program, char* const* arguments, const char* output, const char* error,
                         pid_t parent) {
  setpgid(0, 0);  // Ctrl-C of the terminal reaches the parent alone, which then ends this process
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(127);
  const int in = open("/dev/null", O_RDONLY);
  const int out = open(output, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  const int err = open(error, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (in < 0 || out < 0 || err < 0) _exit(127);
  dup2(in, STDIN_FILENO);
  dup2(out, STDOUT_FILENO);
  dup2(err, STDERR_FILENO);
  execv(program, arguments);
  _exit(127);
}

}  // namespace

Process::Process(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                 const std::filesystem::path& output, const std::filesystem::path& error) {
  std::vector<std::string> texts = {program.string()};
  texts.insert(texts.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (std::string& text : texts) pointers.push_back(text.data());
  pointers.push_back(nullptr);
  started_ = std::chrono::steady_clock::now();
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ == 0) become(program.c_str(), pointers.data(), output.c_str(), error.c_str(), parent);
  if (pid_ < 0)
    throw InputError(fmt::format("a process for a run cannot be started: {}.", std::strerror(errno)));
}

Process::~Process() {
  if (pid_ > 0) kill();
}

Process::Process(Process&& other) noexcept : pid_(std::exchange(other.pid_, 0)), started_(other.started_) {}

Process& Process::operator=(Process&& other) noexcept {
  std::swap(pid_, other.pid_);
  std::swap(started_, other.started_);
  return *this;
}

double Process::elapsed() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - started_).count();
}

std::optional<Ended> Process::ended() { return reap(WNOHANG); }

Ended Process::kill() {
  ::kill(pid_, SIGKILL);
  return reap(0).value_or(Ended{});
}

std::optional<Ended> Process::reap(int options) {
  int status = 0;
  rusage usage{};
  pid_t found = 0;
  do {
    found = wait4(pid_, &status, options, &usage);
  } while (found < 0 && errno == EINTR);
  if (found != pid_) return std::nullopt;
  pid_ = 0;
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return Ended{status, elapsed(), seconds(usage.ru_utime) + seconds(usage.ru_stime)};
}

}  // namespace tendril::benchmark
