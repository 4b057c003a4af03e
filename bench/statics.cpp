/// Time and accuracy of the statics, in one program: errors against an integration in eight times as many
/// steps (its own error is 8^-8 of those measured), verdicts against the fine walk, then the times. Round
/// rod, r/L = 0.01, nu = 0.4; wrenches uniform in m +-6 EI/L, n +-40 EI/L^2; one core. Build with
/// -DTENDRIL_BENCHMARKS=ON, run build/release/bench/bench_statics.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>

#include "tendril/statics.h"
#include "tendril/statics/batch.h"

namespace {

using namespace tendril;
using namespace tendril::statics;

constexpr std::size_t kRods = 4096;
constexpr Accuracy kReference{8, 1e-6};

RodProperties roundRod(double radius) {
  RodProperties rod;
  const double young = 4 / (M_PI * std::pow(radius, 4));  // EI = 1
  rod.c = stiffnessOfRoundRod(young, young / 2.8, radius);
  rod.radius = radius;
  return rod;
}
RodProperties unevenRod() {
  RodProperties rod;
  rod.c << 0.6, 0.7, 1.3, 900, 300, 450;
  return rod;
}
const RodProperties& rod() {
  static const RodProperties round = roundRod(0.01);
  return round;
}

std::vector<Vector6> wrenchesOf(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<Vector6> wrenches(count);
  for (Vector6& a : wrenches) {
    for (int i = 0; i < 3; ++i) a[i] = random.uniform(-6, 6);
    for (int i = 3; i < 6; ++i) a[i] = random.uniform(-40, 40);
  }
  return wrenches;
}
const std::vector<Vector6>& wrenches() {
  static const std::vector<Vector6> all = wrenchesOf(kRods, 1);
  return all;
}

// ------------------------------------------------------------------------------------------------ accuracy

void printQuantiles(const char* what, std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto at = [&](double p) {
    return values[static_cast<std::size_t>(p * static_cast<double>(values.size() - 1))];
  };
  fmt::print("  {:<42} median {:8.1e}   p99 {:8.1e}   largest {:8.1e}\n", what, at(0.5), at(0.99), at(1));
}

void reportErrors() {
  constexpr std::size_t kCount = 20000;
  const std::vector<Vector6> all = wrenchesOf(kCount, 2);
  const NaturalRod natural(rod(), Vector3::Zero());
  Integrator reference(natural);
  Batch batch(natural);
  std::vector<NaturalEnd> exact(kCount);
  for (std::size_t i = 0; i < kCount; ++i)
    if (reference.end(all[i], Vector3::Zero(), kReference, exact[i]) == ChartStatus::inverted) std::abort();
  for (const auto& [name, accuracy] : {std::pair("quick", kQuick), std::pair("fine", kFine)}) {
    std::vector<double> position(kCount), angle(kCount), jacobian(kCount);
    batch.ends(all, accuracy, false, [&](std::size_t i, const NaturalEnd& end) {
      position[i] = (end.end.position - exact[i].end.position).norm();
      angle[i] = angleBetween(end.end.rotation, exact[i].end.rotation);
      jacobian[i] = (end.jacobian - exact[i].jacobian).norm() / exact[i].jacobian.norm();
    });
    fmt::print("errors, {} ({} rods)\n", name, kCount);
    printQuantiles("end position, L", position);
    printQuantiles("end rotation, rad", angle);
    printQuantiles("J(1), relative", jacobian);
  }
}

void reportVerdicts() {
  constexpr std::size_t kCount = 30000;
  fmt::print("verdicts of the batches against the fine walk ({} rods each)\n", kCount);
  for (const auto& [name, properties] :
       {std::pair("round, r/L = 0.01", rod()), std::pair("round, r/L = 0.001", roundRod(0.001)),
        std::pair("six stiffnesses", unevenRod())}) {
    const std::vector<Vector6> all = wrenchesOf(kCount, 3);
    const NaturalRod natural(properties, Vector3::Zero());
    Integrator single(natural);
    Batch batch(natural);
    std::vector<char> truth(kCount);
    std::size_t stable = 0, wrong = 0;
    for (std::size_t i = 0; i < kCount; ++i) {
      Verdict verdict;
      truth[i] = single.integrate(all[i], Vector3::Zero(), kFine, &verdict) == ChartStatus::equilibrium &&
                 verdict.stability == Stability::stable;
      stable += truth[i] ? 1 : 0;
    }
    batch.verdicts(all, [&](std::size_t i, bool v) { wrong += v != static_cast<bool>(truth[i]); });
    batch.ends(all, kQuick, true,
               [&](std::size_t i, const NaturalEnd& e) { wrong += e.stable != static_cast<bool>(truth[i]); });
    fmt::print("  {:<42} stable {:5.2f} %   disagreements {}\n", name,
               100.0 * static_cast<double>(stable) / kCount, wrong);
  }
}

// ------------------------------------------------------------------------------------------------ time

void countRods(benchmark::State& state, std::size_t per_iteration) {
  state.counters["us_per_rod"] =
      benchmark::Counter(1e-6 * static_cast<double>(state.iterations()) * static_cast<double>(per_iteration),
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void BM_BatchShape(benchmark::State& state) {
  EquilibriumBatch batch(rod());
  std::vector<EquilibriumEnd> ends(kRods);
  for (auto _ : state) batch.shapes(wrenches(), ends);
  countRods(state, kRods);
}
BENCHMARK(BM_BatchShape);

/// Shape, J and stability; unstable rods are given up when found out.
void BM_BatchEnds(benchmark::State& state) {
  EquilibriumBatch batch(rod());
  std::vector<EquilibriumEnd> ends(kRods);
  for (auto _ : state) batch.ends(wrenches(), ends);
  countRods(state, kRods);
}
BENCHMARK(BM_BatchEnds);

/// The same with every rod to its end.
void BM_BatchEndsOfAll(benchmark::State& state) {
  Batch batch(NaturalRod(rod(), Vector3::Zero()));
  for (auto _ : state)
    batch.ends(wrenches(), kQuick, false,
               [](std::size_t, const NaturalEnd& end) { benchmark::DoNotOptimize(&end); });
  countRods(state, kRods);
}
BENCHMARK(BM_BatchEndsOfAll);

void BM_BatchVerdicts(benchmark::State& state) {
  EquilibriumBatch batch(rod());
  const std::unique_ptr<bool[]> stable(new bool[kRods]);
  for (auto _ : state) batch.areStable(wrenches(), {stable.get(), kRods});
  countRods(state, kRods);
}
BENCHMARK(BM_BatchVerdicts);

/// `run(integrator, a)` for one rod after the other.
template <class Run>
void oneByOne(benchmark::State& state, const Run& run) {
  EquilibriumIntegrator integrator(rod());
  std::size_t k = 0;
  for (auto _ : state) run(integrator, wrenches()[k++ % kRods]);
  countRods(state, 1);
}

void BM_SingleShape(benchmark::State& state) {  // nodes, fine
  Equilibrium out;
  oneByOne(state, [&](auto& integrator, const Vector6& a) {
    benchmark::DoNotOptimize(integrator.shape({}, a, out));
  });
}
BENCHMARK(BM_SingleShape);

void BM_SingleEnd(benchmark::State& state) {  // shape, J, stability
  EquilibriumEnd out;
  oneByOne(state,
           [&](auto& integrator, const Vector6& a) { benchmark::DoNotOptimize(integrator.end(a, out)); });
}
BENCHMARK(BM_SingleEnd);

void BM_SingleVerdict(benchmark::State& state) {
  oneByOne(state,
           [](auto& integrator, const Vector6& a) { benchmark::DoNotOptimize(integrator.isStable(a)); });
}
BENCHMARK(BM_SingleVerdict);

void BM_SingleSolve(benchmark::State& state) {  // nodes, fine verdict, first conjugate time
  Equilibrium out;
  oneByOne(state, [&](auto& integrator, const Vector6& a) {
    benchmark::DoNotOptimize(integrator.solve({}, a, out));
  });
}
BENCHMARK(BM_SingleSolve);

void BM_Sample(benchmark::State& state) {
  RodSampler sampler(rod(), {}, 1);
  for (auto _ : state) benchmark::DoNotOptimize(sampler.next());
}
BENCHMARK(BM_Sample)->Unit(benchmark::kMicrosecond);

/// Both ends given: the ends of 1000 stable rods. Argument: the stiffness.
void fit(benchmark::State& state, Wanted wanted) {
  const RodProperties properties =
      std::vector{rod(), unevenRod(), roundRod(0.002)}[static_cast<std::size_t>(state.range(0))];
  constexpr std::size_t kPoses = 1000;
  RodSampler sampler(properties, {}, 5);
  std::vector<GripperPoses> poses;
  for (std::size_t i = 0; i < kPoses; ++i) {
    const Equilibrium* e = sampler.next();
    poses.push_back({e->nodes.front(), e->nodes.back()});
  }
  benchmark::DoNotOptimize(fitEnds(properties, poses[0]));  // builds the library
  Integrator reference(NaturalRod(properties, Vector3::Zero()));
  std::size_t asked = 0, found = 0, equilibria = 0;
  double miss = 0;
  for (auto _ : state) {
    for (const GripperPoses& ends : poses) {
      const std::vector<Equilibrium> fitted = fitEnds(properties, ends, Vector3::Zero(), wanted);
      ++asked, found += !fitted.empty(), equilibria += fitted.size();
      state.PauseTiming();
      for (const Equilibrium& e : fitted) {
        NaturalEnd end;
        benchmark::DoNotOptimize(
            reference.end(reference.rod().units.wrenchToNatural(e.wrench), Vector3::Zero(), kReference, end));
        end.end.position *= properties.length;
        miss = std::max(miss, logSE3((ends.first * end.end).inverse() * ends.last).norm());
      }
      state.ResumeTiming();
    }
  }
  state.counters["found_%"] = 100.0 * static_cast<double>(found) / static_cast<double>(asked);
  state.counters["each"] = static_cast<double>(equilibria) / static_cast<double>(asked);
  state.counters["largest_miss"] = miss;
  state.counters["us_per_pose"] = benchmark::Counter(
      1e-6 * static_cast<double>(asked), benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
void BM_FitOne(benchmark::State& state) { fit(state, Wanted::one); }
BENCHMARK(BM_FitOne)->DenseRange(0, 2)->Unit(benchmark::kMillisecond);
void BM_FitAll(benchmark::State& state) { fit(state, Wanted::all); }
BENCHMARK(BM_FitAll)->DenseRange(0, 2)->Unit(benchmark::kMillisecond);

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  fmt::print("kernel {}, {} lanes\n", kernel().name, kernel().lanes);
  reportErrors();
  reportVerdicts();
  benchmark::RunSpecifiedBenchmarks();
}
