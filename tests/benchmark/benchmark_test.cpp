#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <fstream>

#include "tendril/benchmark.h"

namespace tendril {
namespace {
namespace fs = std::filesystem;

/// A program in place of tendril: a shell script that finds the seed in $seed and the run's folder in $4.
class Benchmarks : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "tendril test XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    root_ = pattern;
    request_.folder = root_ / "out";
    request_.runs = 4;
    asked_.program_sha256 = "program";
    asked_.machine.processor = "processor";
    asked_.time_limit = 20;
    asked_.planners = {"tendril"};
    asked_.commands = {"tendril benchmark"};
    asked_.scenarios = {{"a, \"b\"", "a.yaml", "sha", {{"name", "a"}}}};
    setProgram(kSolved);
  }
  void TearDown() override { fs::remove_all(root_); }

  void setProgram(const std::string& body) {
    request_.program = root_ / "program";
    std::ofstream(request_.program) << "#!/bin/sh\nseed=$6\n" << body;
    fs::permissions(request_.program, fs::perms::owner_all);
  }

  static std::string result(const std::string& status, const std::string& wall_time = "0.5",
                            const std::string& more = "\"verified\":true") {
    return "echo '{\"status\":\"" + status + "\",\"wall_time_s\":" + wall_time +
           ",\"cpu_time_s\":0.25,\"iterations\":3,\"states\":4,\"steps\":'$seed',\"simulated_time_s\":0.1," +
           more + "}'\n";
  }

  BenchmarkResult measure() { return runBenchmark(asked_, request_); }
  std::string csv() { return readFile(request_.folder / "runs.csv"); }

  const std::string kSolved = result("solved");
  fs::path root_;
  Benchmark asked_;
  BenchmarkRequest request_;
};

TEST_F(Benchmarks, ARowHoldsWhatTheRunPrinted) {
  request_.runs = 1;
  request_.first_seed = 7;
  const BenchmarkResult found = measure();
  EXPECT_FALSE(found.cancelled);
  ASSERT_EQ(found.runs.size(), 1u);
  EXPECT_TRUE(found.runs[0].success());
  EXPECT_EQ(
      csv(),
      "scenario,planner,seed,threads,status,wall_time_s,cpu_time_s,iterations,states,steps,simulated_time_s,"
      "verified\n\"a, \"\"b\"\"\",tendril,7,1,solved,0.5,0.25,3,4,7,0.1,true\n");
}

TEST_F(Benchmarks, RunsReadBackAsTheyWereWritten) {
  const BenchmarkResult found = measure();
  EXPECT_EQ(toCsv(readRuns(request_.folder / "runs.csv")), toCsv(found.runs));
}

TEST_F(Benchmarks, ARunThatGoesWrongIsAFailureThatSaysHow) {
  asked_.time_limit = 0.3;
  request_.grace = 0.2;
  request_.runs = 8;
  setProgram(
      "case $seed in\n1) kill -SEGV $$;;\n2) echo no >&2; exit 2;;\n3) echo nonsense;;\n4) sleep 100;;\n5) " +
      result("iteration_limit", "0.1", "\"verified\":false,\"verification\":{}") + ";;\n6) " +
      result("solved", "1.5") + ";;\n7) " + result("time_limit", "0.3", "\"verified\":false") + ";;\n8) " +
      result("solved", "1.2") + ";;\nesac\n");
  std::vector<std::string> messages;
  request_.on_progress = [&](const BenchmarkProgress& progress) { messages.push_back(progress.message); };
  const BenchmarkResult found = measure();
  std::vector<std::string> statuses;
  for (const BenchmarkRun& run : found.runs) {
    statuses.push_back(run.status);
    EXPECT_EQ(run.success(), run.seed == 8);
  }
  EXPECT_EQ(statuses, (std::vector<std::string>{"signal SIGSEGV", "exit 2", "exit 0", "overran", "unverified",
                                                "time_limit", "time_limit", "solved"}));
  EXPECT_EQ(messages[1], "no");
  EXPECT_GE(found.runs[3].wall_time, 0.5);
  EXPECT_LT(found.runs[3].wall_time, 50);
}

TEST_F(Benchmarks, AProgramThatCannotBeStartedIsAFailure) {
  request_.program = root_ / "missing";
  request_.runs = 1;
  EXPECT_EQ(measure().runs[0].status, "exit 127");
}

TEST_F(Benchmarks, TheRowsAreTheSameHoweverManyRunAtOnce) {
  setProgram("sleep 0.$((4 - seed))\n" + kSolved);
  asked_.planners = {"tendril", "paper"};
  measure();
  const std::string alone = csv();
  request_.folder = root_ / "many";
  asked_.at_once = 5;
  measure();
  EXPECT_EQ(csv(), alone);
}

TEST_F(Benchmarks, WhatStandsInTheFolderIsNotRunAgain) {
  setProgram("echo $seed >> '" + (root_ / "log").string() + "'\n" + kSolved);
  request_.runs = 2;
  measure();
  request_.runs = 4;
  asked_.planners = {"tendril", "paper"};
  const BenchmarkResult found = measure();
  EXPECT_EQ(readFile(root_ / "log"), "1\n2\n3\n4\n1\n2\n3\n4\n");
  ASSERT_EQ(found.runs.size(), 8u);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(found.runs[i].planner, i < 4 ? "tendril" : "paper");
    EXPECT_EQ(found.runs[i].seed, i % 4 + 1);
  }
  const std::string before = csv();
  measure();
  EXPECT_EQ(csv(), before);
}

TEST_F(Benchmarks, RunsThatWereMadeOtherwiseAreNotMixedIn) {
  measure();
  const std::string before = csv(), record = readFile(request_.folder / "benchmark.json");
  const Benchmark same = asked_;
  const auto refused = [&](const char* what) {
    try {
      measure();
      ADD_FAILURE() << what;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
    }
    asked_ = same;
  };
  asked_.program_sha256 = "other";
  refused("another build");
  asked_.time_limit = 21;
  refused("--time-limit 20, not 21");
  asked_.machine.processors = 99;
  refused("another machine");
  asked_.scenarios[0].sha256 = "other";
  refused("a.yaml");
  EXPECT_EQ(csv(), before);
  EXPECT_EQ(readFile(request_.folder / "benchmark.json"), record);
}

TEST_F(Benchmarks, RunsOfUnknownOriginAreNotMixedIn) {
  measure();
  fs::remove(request_.folder / "benchmark.json");
  EXPECT_THROW(measure(), InputError);
}

TEST_F(Benchmarks, AFolderTakesOneBenchmarkAtATime) {
  fs::create_directories(request_.folder);
  const int held = open(request_.folder.c_str(), O_RDONLY | O_DIRECTORY);
  ASSERT_EQ(flock(held, LOCK_EX), 0);
  EXPECT_THROW(measure(), InputError);
  close(held);
  EXPECT_EQ(measure().runs.size(), 4u);
}

TEST_F(Benchmarks, CancellingKeepsWhatIsDoneAndEndsWhatIsUnderWay) {
  setProgram("echo $$ > '" + root_.string() + "/'$seed\n[ $seed -gt 2 ] && sleep 100\n" + kSolved);
  std::atomic<bool> cancel = false;
  request_.cancel = &cancel;
  asked_.at_once = 3;
  request_.on_progress = [&](const BenchmarkProgress& progress) {
    if (progress.done < 2) return;
    while (!fs::exists(root_ / "3") || fs::file_size(root_ / "3") == 0) usleep(1000);
    cancel = true;
  };
  const BenchmarkResult found = measure();
  EXPECT_TRUE(found.cancelled);
  EXPECT_EQ(found.runs.size(), 2u);
  EXPECT_EQ(readRuns(request_.folder / "runs.csv").size(), 2u);
  EXPECT_NE(kill(std::stoi(readFile(root_ / "3")), 0), 0);
  EXPECT_FALSE(fs::exists(request_.folder / ".scratch"));
}

TEST_F(Benchmarks, SolutionsAreKeptOnlyOnRequest) {
  setProgram("echo $seed > \"$4/solution.json\"\n" + kSolved);
  measure();
  std::vector<std::string> files;
  for (const auto& entry : fs::directory_iterator(request_.folder)) files.push_back(entry.path().filename());
  std::sort(files.begin(), files.end());
  EXPECT_EQ(files, (std::vector<std::string>{"benchmark.json", "runs.csv"}));
  request_.folder = root_ / "kept";
  request_.keep = true;
  measure();
  EXPECT_EQ(readFile(request_.folder / "solutions" / "a, \"b\"" / "tendril" / "3" / "solution.json"), "3\n");
}

TEST_F(Benchmarks, ADamagedTableIsNamedWithItsLine) {
  measure();
  std::ofstream(request_.folder / "runs.csv", std::ios::app) << "a,tendril,x,1,solved,1,1,1,1,1,1,true\n";
  try {
    measure();
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("runs.csv:6: seed"), std::string::npos) << error.what();
  }
}

TEST_F(Benchmarks, TheSummaryTellsHowTheRunsWereMadeAndWhichFailed) {
  setProgram("[ $seed = 3 ] && exit 2\n" + kSolved);
  const BenchmarkResult found = measure();
  writeReports(found, request_.folder);
  const std::string text = readFile(request_.folder / "summary.md");
  for (const char* part :
       {"`tendril benchmark`", "4, seeds 1 to 4, each a process of its own on one thread, 1 at once",
        "| a, \"b\" | tendril | 3 of 4 (75.0 %) |", "| a, \"b\" | tendril | 3 | exit 2 |", "0.500 ± 0.000",
        "(success.svg)", "(times.svg)"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
}

}  // namespace
}  // namespace tendril
