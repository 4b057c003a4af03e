/// Micro-benchmarks: one time step, free and in contact. Build with
/// -DTENDRIL_BENCHMARKS=ON, run build/release/bench/bench_micro.
#include <benchmark/benchmark.h>

#include "dynamics/scenes.h"

namespace {

using namespace tendril;
using namespace tendril::scenes;

/// Swings a rod held at one end about, for ever; counts steps and Newton iterations.
void swing(benchmark::State& state, const Obstacles& obstacles) {
  const int elements = static_cast<int>(state.range(0));
  Scenario s = rodScenario(5e7, elements);
  s.simulation.contact_distance = 0.1 * s.rod.radius;
  const RodModel model(s, obstacles);
  RodState rod = RodState::atRest(straight({Quaternion::Identity(), {-0.5, 0, 0.02}}, 1, elements));
  RodWorkspace workspace;
  Control control;
  control.held = {true, false}, control.moving = End::first;
  std::int64_t iterations = 0, contacts = 0, steps = 0;
  for (auto _ : state) {
    if (steps % 100 == 0) control.target.position = {-0.5, steps % 200 == 0 ? 0.3 : -0.3, 0.02};
    ControlRunner runner(model, control, rod);
    const StepReport report = runner.advance(rod, workspace);
    iterations += report.iterations, contacts += report.contacts, ++steps;
  }
  state.counters["newton_per_step"] = static_cast<double>(iterations) / static_cast<double>(steps);
  state.counters["contacts"] = static_cast<double>(contacts) / static_cast<double>(steps);
  state.counters["us_per_newton"] = benchmark::Counter(
      1e-6 * static_cast<double>(iterations), benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void BM_StepFree(benchmark::State& state) { swing(state, nothing()); }
BENCHMARK(BM_StepFree)->Arg(20)->Arg(40)->Arg(80);

void BM_StepInATube(benchmark::State& state) { swing(state, obstaclesOf({tube(0.03, -0.3, 1.0, 19)})); }
BENCHMARK(BM_StepInATube)->Arg(20)->Arg(40)->Arg(80);

}  // namespace
