#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tendril/benchmark.h"

namespace tendril {
namespace {

BenchmarkRun run(const std::string& status, double wall_time, const std::string& planner = "p") {
  return {"s", planner, 0, 1, status, wall_time, 0, 0, 0, 0, 0, status == "solved"};
}

TEST(Describe, AgreesWithValuesWorkedOutByHand) {
  const std::vector<double> values = {10, 1, 4, 3, 2};
  const Sample sample = describe(values);
  EXPECT_DOUBLE_EQ(sample.mean, 4);
  EXPECT_DOUBLE_EQ(sample.deviation, std::sqrt(12.5));  // 9 + 4 + 1 + 0 + 36 over 4
  EXPECT_DOUBLE_EQ(sample.median, 3);
  EXPECT_DOUBLE_EQ(sample.percentile90, 7.6);  // place 3.6 of 0 ... 4: 4 + 0.6 (10 - 4)
  EXPECT_DOUBLE_EQ(sample.max, 10);
}

TEST(Describe, TheMedianOfAnEvenNumberIsTheMeanOfTheTwoInTheMiddle) {
  EXPECT_DOUBLE_EQ(describe(std::vector<double>{1, 2, 5, 100}).median, 3.5);
}

TEST(Describe, WhatThereAreTooFewValuesForIsNotANumber) {
  EXPECT_TRUE(std::isnan(describe({}).mean));
  EXPECT_TRUE(std::isnan(describe({}).percentile90));
  const Sample one = describe(std::vector<double>{7});
  EXPECT_DOUBLE_EQ(one.median, 7);
  EXPECT_TRUE(std::isnan(one.deviation));
}

TEST(WilsonInterval, ItsEndsAreTheProbabilitiesThatTheScoreTestJustAccepts) {
  for (const auto& [successes, trials] : {std::pair(31, 50), {47, 50}, {1, 3}, {250, 1000}}) {
    const Interval interval = wilsonInterval(successes, trials);
    const double share = static_cast<double>(successes) / trials;
    for (const double p : {interval.low, interval.high})
      EXPECT_NEAR(std::abs(share - p) / std::sqrt(p * (1 - p) / trials), 1.959963984540054, 1e-9);
    EXPECT_LT(interval.low, share);
    EXPECT_GT(interval.high, share);
  }
}

TEST(WilsonInterval, AllOfFiftyStillLeavesRoomForFailure) {
  EXPECT_NEAR(wilsonInterval(50, 50).low, 50 / (50 + 1.959963984540054 * 1.959963984540054), 1e-12);
  EXPECT_DOUBLE_EQ(wilsonInterval(50, 50).high, 1);
  EXPECT_NEAR(wilsonInterval(0, 50).low, 0, 1e-15);
}

TEST(Restart, TheExpectedTimeAgreesWithValuesWorkedOutByHand) {
  const std::vector<BenchmarkRun> runs = {run("solved", 10), run("solved", 1), run("time_limit", 20),
                                          run("solved", 2)};
  EXPECT_DOUBLE_EQ(expectedTime(runs, 1), 4);            // 1 + 1 + 1 + 1 over 1
  EXPECT_DOUBLE_EQ(expectedTime(runs, 2), 3.5);          // 1 + 2 + 2 + 2 over 2
  EXPECT_DOUBLE_EQ(expectedTime(runs, 10), 23.0 / 3);    // 1 + 2 + 10 + 10 over 3
  EXPECT_DOUBLE_EQ(expectedTime(runs, 1000), 33.0 / 3);  // the whole of each
  EXPECT_TRUE(std::isinf(expectedTime(runs, 0.5)));
  const std::optional<Restart> best = bestRestart(runs);
  ASSERT_TRUE(best);
  EXPECT_DOUBLE_EQ(best->cutoff, 2);
  EXPECT_DOUBLE_EQ(best->expected, 3.5);
}

TEST(Restart, AFailureThatEndsEarlyCostsOnlyItsOwnTime) {
  const std::vector<BenchmarkRun> runs = {run("solved", 4), run("signal SIGSEGV", 1)};
  EXPECT_DOUBLE_EQ(expectedTime(runs, 4), 5);
}

TEST(Restart, WithoutASuccessThereIsNone) {
  EXPECT_FALSE(bestRestart(std::vector<BenchmarkRun>{run("time_limit", 20)}));
}

TEST(Restart, TheExpectedTimeIsThatOfAProcessThatRestarts) {
  // Draws runs with replacement, restarting each that has not succeeded by the cutoff.
  const std::vector<BenchmarkRun> runs = {run("solved", 0.5), run("solved", 3), run("solved", 8),
                                          run("exit 2", 0.2), run("time_limit", 9)};
  Random random(1);
  for (const double cutoff : {0.6, 3.0, 8.5}) {
    double total = 0;
    const int repeats = 100000;
    for (int i = 0; i < repeats; ++i)
      for (bool done = false; !done;) {
        const BenchmarkRun& drawn = runs[static_cast<std::size_t>(random.uniform() * 5)];
        total += std::min(cutoff, drawn.wall_time);
        done = drawn.success() && drawn.wall_time <= cutoff;
      }
    EXPECT_NEAR(total / repeats, expectedTime(runs, cutoff), 0.03 * expectedTime(runs, cutoff));
  }
}

TEST(Statistics, OnlyRunsThatAreSolvedAndVerifiedCount) {
  std::vector<BenchmarkRun> runs = {run("solved", 1), run("unverified", 2), run("solved", 3),
                                    run("solved", 100)};
  runs[3].verified = false;
  const std::vector<BenchmarkStatistics> all = statistics(runs);
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].runs, 4);
  EXPECT_EQ(all[0].successes, 2);
  EXPECT_EQ(all[0].failures.size(), 2u);
  EXPECT_DOUBLE_EQ(all[0].wall_time.mean, 2);
  EXPECT_EQ(all[0].times, (std::vector<double>{1, 3}));
  EXPECT_DOUBLE_EQ(all[0].solvedBy(0.5), 0);
  EXPECT_DOUBLE_EQ(all[0].solvedBy(1), 0.25);
  EXPECT_DOUBLE_EQ(all[0].solvedBy(1000), 0.5);
}

TEST(Statistics, ThereIsOnePerScenarioAndPlannerInTheOrderOfTheRuns) {
  const std::vector<BenchmarkRun> runs = {run("solved", 1, "b"), run("solved", 2, "a"),
                                          run("solved", 4, "b")};
  const std::vector<BenchmarkStatistics> all = statistics(runs);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].planner, "b");
  EXPECT_EQ(all[0].runs, 2);
  EXPECT_EQ(all[1].planner, "a");
}

TEST(Statistics, WhatIsNotANumberIsNullInJson) {
  const auto json = toJson(statistics(std::vector<BenchmarkRun>{run("time_limit", 20)}).front());
  EXPECT_TRUE(json.at("wall_time_s").at("mean").is_null());
  EXPECT_TRUE(json.at("expected_time_s").is_null());
  EXPECT_TRUE(json.at("restart").is_null());
  EXPECT_EQ(json.at("success"), 0);
}

}  // namespace
}  // namespace tendril
