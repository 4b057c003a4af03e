/// What a simulated second costs: L = 1 m, r = 10 mm, 1000 kg/m^3, nu = 0.4; free, in tubes of a few and of a
/// hundred thousand faces. Build with -DTENDRIL_BENCHMARKS=ON, run build/release/bench/bench_dynamics.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "dynamics/scenes.h"

namespace {

using namespace tendril;
using namespace tendril::scenes;

/// A U in the xy plane: `kLeg` along x, a half circle of radius `kBend`, and back.
constexpr double kLeg = 0.7, kBend = 0.25, kWay = 2 * kLeg + std::numbers::pi * kBend;
Pose onU(double s) {
  if (s < kLeg) return {Quaternion::Identity(), {s, 0, 0}};
  const double angle = std::min((s - kLeg) / kBend, std::numbers::pi);
  const double beyond = std::max(0.0, s - kLeg - std::numbers::pi * kBend);
  return {expSO3({0, 0, angle}), {kLeg + kBend * std::sin(angle) - beyond, kBend * (1 - std::cos(angle)), 0}};
}

TriangleMesh uTube(double radius, int sides, int along) {
  TriangleMesh mesh;
  for (int i = 0; i <= along; ++i) {
    const Pose at = onU(kWay * i / along);
    for (int k = 0; k < sides; ++k) {
      const double angle = 2 * std::numbers::pi * k / sides;
      mesh.vertices.push_back(
          at * (radius / std::cos(std::numbers::pi / sides) * Vector3(0, std::cos(angle), std::sin(angle))));
    }
  }
  for (int i = 0; i < along; ++i)
    for (int k = 0; k < sides; ++k) {
      const int a = i * sides + k, b = i * sides + (k + 1) % sides;
      mesh.faces.push_back({a, a + sides, b});
      mesh.faces.push_back({b, a + sides, b + sides});
    }
  return mesh;
}

struct Count {
  std::int64_t steps = 0, iterations = 0, contacts = 0, stalled = 0;
  void add(const StepReport& report) {
    ++steps, iterations += report.iterations, contacts += report.contacts;
    stalled += report.status == StepReport::Status::stalled;
  }
};
void report(benchmark::State& state, const Count& count, double dt) {
  const auto steps = static_cast<double>(count.steps);
  state.counters["cpu_s_per_s"] =
      benchmark::Counter(steps * dt, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.counters["times_real"] = benchmark::Counter(steps * dt, benchmark::Counter::kIsRate);
  state.counters["newton_per_step"] = static_cast<double>(count.iterations) / steps;
  state.counters["us_per_newton"] =
      benchmark::Counter(1e-6 * static_cast<double>(count.iterations),
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.counters["contacts"] = static_cast<double>(count.contacts) / steps;
  state.counters["stalled"] = static_cast<double>(count.stalled);
}

Scenario scenarioOf(const benchmark::State& state) {
  Scenario s = rodScenario(static_cast<double>(state.range(1)), static_cast<int>(state.range(0)));
  s.simulation.time_step = 1e-3 * static_cast<double>(state.range(2));
  s.simulation.contact_distance = 0.1 * s.rod.radius;
  s.environment.friction = 0.2;
  return s;
}

/// Swings a rod held at one end about, for ever.
void swing(benchmark::State& state, const Obstacles& obstacles) {
  const Scenario s = scenarioOf(state);
  const RodModel model(s, obstacles);
  RodState rod = RodState::atRest(straight({Quaternion::Identity(), {-0.5, 0, 0.01}}, 1, s.rod.elements));
  RodWorkspace workspace;
  Control control;
  control.held = {true, false}, control.moving = End::first;
  const auto second = static_cast<std::int64_t>(std::lround(1 / s.simulation.time_step));
  Count count;
  for (auto _ : state) {
    const double side = count.steps / second % 2 == 0 ? 0.3 : -0.3;
    control.target.position = {-0.5, side, 0.02};
    ControlRunner runner(model, control, rod);
    count.add(runner.advance(rod, workspace));
  }
  report(state, count, s.simulation.time_step);
}

/// Pulls a rod by its tip through the U at 0.2 m/s, and again from the start.
void pull(benchmark::State& state, const Obstacles& obstacles) {
  const Scenario s = scenarioOf(state);
  const RodModel model(s, obstacles);
  const RodShape start = straight({Quaternion::Identity(), {-0.4, 0, 0}}, 1, s.rod.elements);
  RodState rod = RodState::atRest(start);
  RodWorkspace workspace;
  Control control;
  control.held = {false, true}, control.moving = End::last;
  Count count;
  double s_tip = 0.6;
  for (auto _ : state) {
    s_tip += 0.2 * s.simulation.time_step;
    if (s_tip > kWay + 0.3) rod = RodState::atRest(start), s_tip = 0.6;
    control.target = onU(s_tip);
    ControlRunner runner(model, control, rod);
    count.add(runner.advance(rod, workspace));
  }
  report(state, count, s.simulation.time_step);
}

void BM_Free(benchmark::State& state) { swing(state, nothing()); }
BENCHMARK(BM_Free)
    ->ArgNames({"elements", "young_modulus", "dt_ms"})
    ->ArgsProduct({{20, 40, 80}, {1'000'000, 100'000'000}, {10}});

void BM_InATubeOf400Faces(benchmark::State& state) {
  swing(state, obstaclesOf({tube(0.03, -0.3, 1.0, 200)}));
}
BENCHMARK(BM_InATubeOf400Faces)
    ->ArgNames({"elements", "young_modulus", "dt_ms"})
    ->ArgsProduct({{40}, {1'000'000, 100'000'000}, {10, 20}});

void BM_ThroughAUTubeOf408Faces(benchmark::State& state) { pull(state, obstaclesOf({uTube(0.03, 12, 17)})); }
BENCHMARK(BM_ThroughAUTubeOf408Faces)
    ->ArgNames({"elements", "young_modulus", "dt_ms"})
    ->ArgsProduct({{20, 40, 80}, {1'000'000, 50'000'000, 100'000'000}, {20}});

void BM_ThroughAUTubeOf100000Faces(benchmark::State& state) {
  pull(state, obstaclesOf({uTube(0.03, 100, 500)}));
}
BENCHMARK(BM_ThroughAUTubeOf100000Faces)
    ->ArgNames({"elements", "young_modulus", "dt_ms"})
    ->ArgsProduct({{40}, {1'000'000, 50'000'000, 100'000'000}, {20}});

void BM_ThroughAUTubeOf408FacesCutInto104448(benchmark::State& state) {
  pull(state, obstaclesOf({refined(uTube(0.03, 12, 17), 16)}));
}
BENCHMARK(BM_ThroughAUTubeOf408FacesCutInto104448)
    ->ArgNames({"elements", "young_modulus", "dt_ms"})
    ->ArgsProduct({{40}, {1'000'000, 50'000'000, 100'000'000}, {20}});

}  // namespace
