/// Continuous collision detection against exact arithmetic: what was missed, and how early it stopped. Build
/// with -DTENDRIL_BENCHMARKS=ON, run build/release/bench/bench_ccd [queries [seed [threads]]]; an interrupt
/// ends it with a report of what was done. The counts depend on the queries and the seed alone.
#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <mutex>
#include <thread>

#include "geometry/motion_queries.h"

namespace {

using namespace tendril;
using namespace tendril::motion_queries;

constexpr std::int64_t kChunk = 1 << 16;  // queries of one seed
constexpr std::int64_t kBoth = 32;        // one in so many is settled by the filter and exactly
constexpr std::int64_t kTimed = 4096;     // of one in so many the moment of contact is bracketed

std::atomic<bool> interrupted = false;

/// What is claimed of the time T at which the distance to keep is reached, by fractions of T.
constexpr std::array<double, 5> kShort = {1e-6, 1e-3, 1e-2, 0.1, 0.5};
struct Timing {
  std::int64_t no_gap = 0, free = 0, alarms = 0, tiny_gap = 0, contacts = 0, nothing = 0;
  std::array<std::int64_t, kShort.size() + 1> by_shortness{};

  void add(const Timing& other) {
    no_gap += other.no_gap, free += other.free, alarms += other.alarms, tiny_gap += other.tiny_gap;
    contacts += other.contacts, nothing += other.nothing;
    for (std::size_t i = 0; i < by_shortness.size(); ++i) by_shortness[i] += other.by_shortness[i];
  }
};

/// The sum of the two bodies' largest coordinates, motions included: the margin is 64 of its roundings.
double sizeOf(const exact::Motion& m) {
  const auto largest = [](const auto& x, const auto& dx, int corners) {
    double result = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(corners); ++i)
      result = std::max({result, x[i].cwiseAbs().maxCoeff(), dx[i].cwiseAbs().maxCoeff()});
    return result;
  };
  return largest(m.p, m.dp, m.np) + largest(m.q, m.dq, m.nq);
}

/// Compares f with T by exact decisions: f > (1 - x) T just if the distance is not kept up to f / (1 - x).
void time(const Query& query, double f, Timing& timing) {
  const auto kept = [&, distance = distanceToKeep(query)](double until) {
    return exact::decide(query.motion, until, distance) != exact::Verdict::hit;
  };
  const double margin = 66 * 0x1p-52 * sizeOf(query.motion) / (1 - query.keep);
  if (exact::decide(query.motion, 0, query.radius) == exact::Verdict::hit) {
    ++timing.no_gap;
  } else if (f == 0 && exact::decide(query.motion, 0, query.radius + margin) == exact::Verdict::hit) {
    ++timing.tiny_gap;
  } else if (kept(1)) {
    ++(f == 1 ? timing.free : timing.alarms);
  } else {
    ++timing.contacts;
    std::size_t i = 0;
    while (i < kShort.size() && f < 1 - kShort[i] && kept(f / (1 - kShort[i]))) ++i;
    ++(f == 0 ? timing.nothing : timing.by_shortness[i]);
  }
}

struct Counts {
  std::array<Tally, kKindNames.size()> kinds;
  std::array<Tally, kPairNames.size()> pairs;
  std::array<Timing, kKindNames.size()> timings;
};

Counts runChunk(std::uint64_t seed, std::int64_t queries) {
  Counts counts;
  Generator generate(seed);
  for (std::int64_t i = 0; i < queries; ++i) {
    const Query query = generate();
    const double f = ask(query);
    Tally tally;
    test(query, f, i % kBoth == 0, tally);
    const auto kind = static_cast<std::size_t>(query.kind);
    counts.kinds[kind].add(tally);
    counts.pairs[static_cast<std::size_t>(query.pair)].add(tally);
    if (i % kTimed == 0) time(query, f, counts.timings[kind]);
  }
  return counts;
}

void printTallies(const auto& names, const auto& tallies) {
  fmt::print("{:<17}{:>11}{:>11}{:>11}{:>9}{:>9}{:>8}{:>9}{:>10}{:>13}\n", "", "queries", "claims",
             "to the end", "exactly", "both", "missed", "not kept", "undecided", "filter wrong");
  Tally total;
  const auto print = [](const char* name, const Tally& t) {
    fmt::print("{:<17}{:>11}{:>11}{:>11}{:>9}{:>9}{:>8}{:>9}{:>10}{:>13}\n", name, t.queries, t.claims,
               t.to_the_end, t.exactly, t.both, t.missed + t.out_of_range, t.not_kept, t.undecided,
               t.filter_wrong);
  };
  for (std::size_t i = 0; i < names.size(); ++i) print(names[i], tallies[i]), total.add(tallies[i]);
  print("all", total);
}

void printTimings(const auto& timings) {
  fmt::print("{:<17}{:>7}{:>9}{:>7}{:>8}{:>10}", "", "no gap", "tiny gap", "free", "alarms", "contacts");
  for (const double x : kShort) fmt::print("{:>9}", fmt::format("<={:g}", x));
  fmt::print("{:>9}{:>9}\n", "more", "nothing");
  Timing total;
  const auto print = [](const char* name, const Timing& t) {
    fmt::print("{:<17}{:>7}{:>9}{:>7}{:>8}{:>10}", name, t.no_gap, t.tiny_gap, t.free, t.alarms, t.contacts);
    for (const std::int64_t count : t.by_shortness) fmt::print("{:>9}", count);
    fmt::print("{:>9}\n", t.nothing);
  };
  for (std::size_t i = 0; i < kKindNames.size(); ++i) print(kKindNames[i], timings[i]), total.add(timings[i]);
  print("all", total);
}

/// Nanoseconds for a query of one kind and pair, the best of several rounds over the same queries.
void printSpeed() {
  fmt::print("\nns per query\n{:<17}", "");
  for (const char* name : kPairNames) fmt::print("{:>17}", name);
  for (std::size_t kind = 0; kind < kKindNames.size(); ++kind) {
    std::array<std::vector<Query>, kPairNames.size()> queries;
    Generator generate(7);
    for (int i = 0; i < 100000; ++i)
      if (const Query query = generate(); static_cast<std::size_t>(query.kind) == kind)
        queries[static_cast<std::size_t>(query.pair)].push_back(query);
    fmt::print("\n{:<17}", kKindNames[kind]);
    for (const auto& of_pair : queries) {
      double best = std::numeric_limits<double>::infinity(), sum = 0;
      for (int round = 0; round < 10; ++round) {
        const auto start = std::chrono::steady_clock::now();
        for (const Query& query : of_pair) sum += ask(query);
        const std::chrono::duration<double, std::nano> took = std::chrono::steady_clock::now() - start;
        best = std::min(best, took.count() / static_cast<double>(of_pair.size()));
      }
      fmt::print("{:>17.0f}", sum >= 0 ? best : 0);
    }
  }
  fmt::print("\n");
}

}  // namespace

int main(int argc, char** argv) {
  const std::int64_t queries = argc > 1 ? std::atoll(argv[1]) : 1000000;
  const std::uint64_t seed = argc > 2 ? static_cast<std::uint64_t>(std::atoll(argv[2])) : 1;
  const int threads = argc > 3 ? std::atoi(argv[3]) : 1;
  std::signal(SIGINT, [](int) { interrupted = true; });

  Counts counts;
  std::mutex mutex;
  std::atomic<std::int64_t> next = 0;
  const auto start = std::chrono::steady_clock::now();
  const auto work = [&] {
    for (std::int64_t chunk = next++; chunk * kChunk < queries && !interrupted; chunk = next++) {
      const Counts more = runChunk((seed << 32) + static_cast<std::uint64_t>(chunk),
                                   std::min(kChunk, queries - chunk * kChunk));
      const std::lock_guard lock(mutex);
      for (std::size_t i = 0; i < kKindNames.size(); ++i) {
        counts.kinds[i].add(more.kinds[i]);
        counts.timings[i].add(more.timings[i]);
      }
      for (std::size_t i = 0; i < kPairNames.size(); ++i) counts.pairs[i].add(more.pairs[i]);
    }
  };
  std::vector<std::jthread> pool;
  for (int i = 0; i < threads; ++i) pool.emplace_back(work);
  pool.clear();
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;

  fmt::print("seed {}, {} threads, {:.0f} s\n\n", seed, threads, took.count());
  printTallies(kKindNames, counts.kinds);
  fmt::print("\n");
  printTallies(kPairNames, counts.pairs);
  fmt::print("\nof one query in {}: free or not, and what of the free time is not claimed\n", kTimed);
  printTimings(counts.timings);
  printSpeed();
  std::int64_t wrong = 0;
  for (const Tally& t : counts.kinds) wrong += t.missed + t.out_of_range + t.undecided + t.filter_wrong;
  return wrong == 0 ? 0 : 1;
}
