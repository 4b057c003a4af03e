/// The dynamics against theory: docs/validation.md says what is done and what came out. Writes one table
/// (CSV) per experiment into the folder given first (default: bench/results/validation); names after it
/// choose experiments. Build with -DTENDRIL_BENCHMARKS=ON, run build/release/bench/bench_validation; some
/// minutes on one core. Then bench/plot_validation.py draws docs/images/validation/.
#include <fmt/format.h>

#include <chrono>

#include "dynamics/experiments.h"
#include "tendril/statics.h"

namespace {

using namespace tendril;
using namespace tendril::experiments;
using std::numbers::pi;

std::filesystem::path folder = "bench/results/validation";

/// A table that is printed as it grows and written when it is complete.
class Table {
 public:
  Table(const std::string& name, const std::string& header, bool quiet = false) : name_(name), quiet_(quiet) {
    row(header);
  }
  ~Table() { writeFileAtomically(folder / (name_ + ".csv"), text_); }
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;

  template <class... Values>
  void add(const std::string& format, const Values&... values) {
    row(fmt::format(fmt::runtime(format), values...));
  }

 private:
  void row(const std::string& line) {
    text_ += line + "\n";
    if (!quiet_) fmt::print("  {}\n", line);
    std::fflush(stdout);
  }
  std::string name_, text_;
  bool quiet_;
};

void addShape(Table& table, const std::string& what, const RodShape& shape) {
  for (std::size_t i = 0; i < shape.size(); ++i) {
    const Vector3& p = shape[i].position;
    table.add("{},{},{:.6f},{:.6f},{:.6f}", what, i, p.x(), p.y(), p.z());
  }
}

// ---------------------------------------------------------------------------------------------- cantilever

void cantilevers() {
  Table errors("cantilever", "gamma,elements,height_over_width,exact_height_over_width,max_node_error_L");
  Table shapes("cantilever_shapes", "shape,node,x,y,z", true);
  for (const double gamma : {0.1, 0.3, 1., 3., 10., 30., 100., 300., 1000.}) {
    Scenario s;
    const RodShape fine = cantilever(gamma, 160, &s);
    const reference::Rod rod = reference::rodOf(s.rod, s.environment.gravity);
    const auto exact = reference::solve(rod, Pose{}, std::nullopt, reference::guessFrom(s.rod, fine));
    if (exact.empty()) {
      fmt::print("  gamma {}: shooting does not arrive\n", gamma);
      continue;
    }
    const auto ratio = [](const RodShape& shape) {
      return -shape.back().position.z() / shape.back().position.x();
    };
    for (const int elements : {10, 20, 40, 80}) {
      const RodShape at_rest = cantilever(gamma, elements), wanted = reference::nodesOf(rod, exact, elements);
      errors.add("{},{},{:.6f},{:.6f},{:.3e}", gamma, elements, ratio(at_rest), ratio(wanted),
                 maxNodeDistance(at_rest, wanted));
    }
    addShape(shapes, fmt::format("simulated {:g}", gamma), cantilever(gamma, 20));
    addShape(shapes, fmt::format("exact {:g}", gamma), reference::nodesOf(rod, exact, 160));
  }
}

// ---------------------------------------------------------------------------------------------- swing

const char* name(Scheme scheme) { return scheme == Scheme::second_order ? "second_order" : "implicit_euler"; }

void swings() {
  const std::vector<double> times = {0.5, 1.0};
  const RodProperties round = undamped(Scheme::second_order, 1e-3, 40).rod;
  // Finite differences of second order in h, extrapolated; 4 us steps leave 1e-6.
  const auto coarse = reference::swingOfCantilever(round, 9.81, 160, 4e-6, times);
  const auto finer = reference::swingOfCantilever(round, 9.81, 320, 4e-6, times);
  std::vector<Vector3> exact;
  for (std::size_t k = 0; k < times.size(); ++k) exact.push_back((4 * finer[k] - coarse[k]) / 3);
  Table errors("swing", "scheme,dt_s,elements,error_at_0.5s_mm,error_at_1s_mm,newton_iterations");
  Table tips("swing_tips", "what,time_s,x,z", true);
  for (std::size_t k = 0; k < times.size(); ++k) {
    tips.add("explicit,{},{:.6f},{:.6f}", times[k], exact[k].x(), exact[k].z());
    fmt::print("  finite differences: tip at {} s: ({:.6f}, {:.6f}); 320 elements alone {:.1e} m off\n",
               times[k], exact[k].x(), exact[k].z(), (finer[k] - exact[k]).norm());
  }
  const auto run = [&](Scheme scheme, double dt, int elements, bool keep) {
    Scenario s = undamped(scheme, dt, elements);
    s.environment.gravity = {0, 0, -9.81};
    RodModel model(s, nothing());
    model.newton.tolerance = 1e-7;
    RodState state = RodState::atRest(scenes::straight({}, 1, elements));
    RodWorkspace workspace;
    std::array<double, 2> error{};
    long iterations = 0;
    const long steps = std::lround(1 / dt);
    for (long k = 1; k <= steps; ++k) {
      iterations += step(model, held(Pose{}, std::nullopt), state, workspace).iterations;
      const Vector3& tip = state.nodes.back().position;
      if (keep)
        tips.add("{} {:g} ms,{:.4f},{:.6f},{:.6f}", name(scheme), 1e3 * dt, static_cast<double>(k) * dt,
                 tip.x(), tip.z());
      if (2 * k == steps) error[0] = (tip - exact[0]).norm();
      if (k == steps) error[1] = (tip - exact[1]).norm();
    }
    errors.add("{},{},{},{:.4f},{:.4f},{:.1f}", name(scheme), dt, elements, 1e3 * error[0], 1e3 * error[1],
               static_cast<double>(iterations) / static_cast<double>(steps));
  };
  for (const Scheme scheme : {Scheme::implicit_euler, Scheme::second_order})
    for (const double dt : {0.02, 0.01, 0.005, 0.002, 0.001, 0.0005})
      run(scheme, dt, 40, dt == 0.01 || dt == 0.001);
  for (const int elements : {5, 10, 20, 40}) run(Scheme::second_order, 0.00025, elements, false);

  // A sudden load wakes waves of all lengths, the shortest of which no step resolves. The order in dt shows
  // where the weight comes smoothly, in 0.4 s; against the second-order scheme in steps of 0.1 ms.
  const auto smoothTip = [&](Scheme scheme, double dt) {
    const Scenario s = undamped(scheme, dt, 40);
    RodModel model(s, nothing());
    model.newton.tolerance = 1e-9;
    RodState state = RodState::atRest(scenes::straight({}, 1, 40));
    RodWorkspace workspace;
    for (long k = 1; k <= std::lround(1 / dt); ++k) {
      const double part = std::min(1.0, static_cast<double>(k) * dt / 0.4);
      model.gravity.z() = -9.81 * part * part * part * (10 - 15 * part + 6 * part * part);
      step(model, held(Pose{}, std::nullopt), state, workspace);
    }
    return state.nodes.back().position;
  };
  const Vector3 fine = smoothTip(Scheme::second_order, 1e-4);
  Table smooth("swing_smooth", "scheme,dt_s,error_at_1s_mm");
  for (const Scheme scheme : {Scheme::implicit_euler, Scheme::second_order})
    for (const double dt : {0.02, 0.01, 0.005, 0.0025, 0.00125})
      smooth.add("{},{},{:.4f}", name(scheme), dt, 1e3 * (smoothTip(scheme, dt) - fine).norm());
}

void energies() {
  // A cantilever let go, for ten seconds: its energy, by the largest that its weight has given it so far.
  Table energy("energy", "scheme,dt_s,time_s,energy_J,depth_J", true);
  for (const auto& [scheme, dt] :
       {std::pair(Scheme::second_order, 0.01), std::pair(Scheme::second_order, 0.005),
        std::pair(Scheme::second_order, 0.002), std::pair(Scheme::second_order, 0.001),
        std::pair(Scheme::implicit_euler, 0.002)}) {
    Scenario s = undamped(scheme, dt, 40);
    s.environment.gravity = {0, 0, -9.81};
    RodModel model(s, nothing());
    model.newton.tolerance = 1e-7;
    RodState state = RodState::atRest(scenes::straight({}, 1, 40));
    RodWorkspace workspace;
    const long steps = std::lround(10 / dt), every = std::lround(0.05 / dt);
    double least_depth = 0, largest = 0;
    for (long k = 1; k <= steps; ++k) {
      step(model, held(Pose{}, std::nullopt), state, workspace);
      double depth = 0;
      for (const Pose& q : state.nodes) depth += q.position.z() / 41;
      least_depth = std::min(least_depth, depth);
      largest = std::max(largest, energyOf(s, state));
      if (k % every == 0)
        energy.add("{},{},{:.3f},{:.6e},{:.6e}", name(scheme), dt, static_cast<double>(k) * dt,
                   energyOf(s, state), pi * 1e-4 * 1000 * 9.81 * depth);
    }
    const double scale = -least_depth * pi * 1e-4 * 1000 * 9.81;
    fmt::print(
        "  {} {:g} ms: energy after 10 s {:+.4f}, largest {:+.4f}, of the {:.3f} J that the weight turns "
        "over\n",
        name(scheme), 1e3 * dt, energyOf(s, state) / scale, largest / scale, scale);
  }
  // Free flight: a bent rod is thrown, turning.
  Table flight("flight", "scheme,dt_s,linear_momentum_error,angular_momentum_error,energy_change");
  for (const Scheme scheme : {Scheme::implicit_euler, Scheme::second_order})
    for (const double dt : {0.01, 0.005, 0.002, 0.001}) {
      const Scenario s = undamped(scheme, dt, 40);
      RodModel model(s, nothing());
      model.newton.tolerance = 1e-9;
      RodState state = RodState::atRest(scenes::straight({}, 1, 40));
      const Vector3 centre(0.5, 0, 0), turn(0.5, 1, 3);
      for (std::size_t i = 0; i < state.nodes.size(); ++i) {
        const double x = state.nodes[i].position.x();
        const Vector3 v = Vector3(0.3, -0.2, 0.5) + turn.cross(state.nodes[i].position - centre) +
                          Vector3(0, std::cos(2 * pi * x), 0);
        state.velocities[i] << turn, v;
      }
      const auto momenta = [&] {
        Vector6 sum = Vector6::Zero();  // about the origin; linear
        const double h = s.rod.elementLength();
        for (std::size_t i = 0; i < state.nodes.size(); ++i) {
          const bool is_end = i == 0 || i + 1 == state.nodes.size();
          const double mass = s.rod.density * pi * 1e-4 * h * (is_end ? 0.5 : 1);
          const Vector3 inside = (i == 0 ? h / 6 : is_end ? -h / 6 : 0) * Vector3::UnitX();
          const Vector3 w = state.velocities[i].head<3>();
          const Vector3 v = state.velocities[i].tail<3>() + state.nodes[i].rotation * w.cross(inside);
          const Vector3 rotary = 1e-4 / 4 * Vector3(2, 1, 1);
          sum.head<3>() +=
              mass * ((state.nodes[i] * inside).cross(v) + state.nodes[i].rotation * rotary.cwiseProduct(w));
          sum.tail<3>() += mass * v;
        }
        return sum;
      };
      const Vector6 before = momenta();
      const double energy_before = energyOf(s, state);
      RodWorkspace workspace;
      for (long k = 0; k < std::lround(1 / dt); ++k) step(model, {}, state, workspace);
      const Vector6 change = momenta() - before;
      flight.add("{},{},{:.2e},{:.2e},{:+.2e}", name(scheme), dt,
                 change.tail<3>().norm() / before.tail<3>().norm(),
                 change.head<3>().norm() / before.head<3>().norm(), energyOf(s, state) / energy_before - 1);
    }
}

// ---------------------------------------------------------------------------------------------- two ends

void twoEnds() {
  Table errors("two_ends",
               "young_modulus_Pa,elements,midpoint_error_mm,max_node_error_mm,statics_to_exact_mm,stable,"
               "found_by_fitEnds");
  Table shapes("two_ends_shapes", "shape,node,x,y,z", true);
  for (const double young : {1e6, 1e8}) {
    const RodShape fine = broughtTogether(young, 80);
    const Scenario s = scenes::rodScenario(young, 80);
    const Vector3 gravity(0, 0, -9.81);
    const reference::Rod rod = reference::rodOf(s.rod, gravity);
    const auto exact = reference::solve(rod, fine.front(), fine.back(), reference::guessFrom(s.rod, fine));
    if (exact.empty()) {
      fmt::print("  E = {:g}: shooting does not arrive\n", young);
      continue;
    }
    const RodShape wanted = reference::nodesOf(rod, exact, 80);
    const std::vector<Equilibrium> found = fitEnds(s.rod, {fine.front(), fine.back()}, gravity);
    EquilibriumIntegrator integrator(s.rod, gravity);
    Equilibrium chart;
    Vector6 a;
    a << exact.front().m, exact.front().n;
    (void)integrator.solve(fine.front(), a, chart);
    for (const int elements : {10, 20, 40, 80}) {
      const RodShape shape = broughtTogether(young, elements), same = thinned(wanted, elements);
      const auto middle = static_cast<std::size_t>(elements / 2);
      errors.add("{:g},{},{:.5f},{:.5f},{:.2e},{},{}", young, elements,
                 1e3 * (shape[middle].position - same[middle].position).norm(),
                 1e3 * maxNodeDistance(shape, same), 1e3 * maxNodeDistance(chart.nodes, wanted),
                 chart.stability == Stability::stable ? 1 : 0, found.size());
    }
    addShape(shapes, fmt::format("simulated {:g}", young), thinned(fine, 20));
    addShape(shapes, fmt::format("exact {:g}", young), wanted);
  }
}

// ---------------------------------------------------------------------------------------------- buckling

void buckling() {
  Table table("buckling", "what,method,elements,low,high,theory,middle_off_percent");
  const auto add = [&](const std::string& what, const std::string& method, int elements, double theory,
                       const std::function<bool(double)>& fails) {
    const auto [low, high] = bracket(0.93 * theory, 1.08 * theory, 3e-4, fails);
    table.add("{},{},{},{:.5f},{:.5f},{:.5f},{:+.3f}", what, method, elements, low, high, theory,
              100 * (0.5 * (low + high) / theory - 1));
  };
  const double ratio = 1.4;  // EI/GJ
  const double michell = 2 * pi * std::sqrt(3.0) * ratio, straight = 8.9868189 * ratio;
  for (const int elements : {10, 20, 40, 80})
    add("ring", "simulation", elements, michell, [&](double x) { return ringBuckles(x, elements); });
  const RodProperties thin = settling(1e8, 0.001, 40, 0).rod;
  EquilibriumIntegrator integrator(thin);
  Equilibrium out;
  add("ring", "statics", 0, michell, [&](double twist) {
    // Twist tau and curvature kappa throughout; the force GJ tau kappa is normal to the circle's plane.
    const double kappa = 2 * pi;
    Vector6 a;
    a << thin.c[0] * twist, 0, thin.c[2] * kappa, 0, 0, thin.c[0] * twist * kappa;
    (void)integrator.solve({}, a, out);
    return out.conjugate_points > 1;  // one at 1, or within its shear of 1, it always has
  });
  for (const int elements : {10, 20, 40, 80})
    add("straight", "simulation", elements, straight,
        [&](double x) { return straightRodBuckles(x, elements); });
  add("straight", "statics", 0, straight, [&](double twist) {
    return !integrator.isStable((Vector6() << thin.c[0] * twist, 0, 0, 0, 0, 0).finished());
  });
  for (const int elements : {10, 20, 40})
    add("uniform load", "simulation", elements, 12.85376,
        [&](double x) { return uniformLoadBuckles(x, elements); });
  for (const int elements : {10, 20, 40})
    add("tip load", "simulation", elements, 4.012600, [&](double x) { return tipLoadBuckles(x, elements); });
}

// ---------------------------------------------------------------------------------------------- curls

void curls() {
  Table table("curl", "curvature,elements,boundary,low,high,theory,middle_off_percent");
  for (const double curvature : {6.0, 2 * pi, 7.0}) {
    const std::vector<double> theory = reference::marginalWeights(curvature, 1 / 1.4, 80);
    if (theory.size() != 2) {
      fmt::print("  curvature {}: {} marginal weights\n", curvature, theory.size());
      continue;
    }
    for (const int elements : {20, 40}) {
      for (const bool upper : {false, true}) {
        const double expected = theory[upper ? 1 : 0];
        const auto [low, high] = bracket(0.93 * expected, 1.08 * expected, 5e-4, [&](double weight) {
          return curlLeavesItsPlane(curvature, weight, elements) != upper;
        });
        table.add("{:.5f},{},{},{:.4f},{:.4f},{:.4f},{:+.3f}", curvature, elements,
                  upper ? "to plane" : "from plane", low, high, expected,
                  100 * (0.5 * (low + high) / expected - 1));
      }
    }
  }
  Table rest("curl_rest",
             "curvature,weight,elements,max_node_error_L,statics_to_exact_L,distance_from_plane_L");
  Table shapes("curl_shapes", "shape,node,x,y,z", true);
  const double curvature = 2 * pi;
  for (const double weight : {5.0, 13.5, 25.0, 60.0}) {
    const auto atRest = [&](int elements) {
      Scenario s = curlScenario(curvature, weight, elements);
      s.simulation.drag = 1e-2;
      RodModel model(s, nothing());
      model.newton.tolerance = 1e-10;
      RodShape shape = disturbed(planarCurl(s), 1e-3);
      settle(model, held(curlClamp(), std::nullopt), shape, 5000);
      return shape;
    };
    const RodShape fine = atRest(80);
    const Scenario s = curlScenario(curvature, weight, 80);
    const reference::Rod rod = reference::rodOf(s.rod, s.environment.gravity);
    const auto exact = reference::solve(rod, curlClamp(), std::nullopt, reference::guessFrom(s.rod, fine));
    if (exact.empty()) {
      fmt::print("  weight {}: shooting does not arrive\n", weight);
      continue;
    }
    EquilibriumIntegrator integrator(s.rod, s.environment.gravity);
    Equilibrium chart;
    Vector6 a;
    a << exact.front().m, exact.front().n;
    (void)integrator.shape(curlClamp(), a, chart);
    const RodShape wanted = reference::nodesOf(rod, exact, 80);
    for (const int elements : {10, 20, 40, 80}) {
      RodShape shape = atRest(elements);
      if (shape.back().position.x() * wanted.back().position.x() < 0)  // its mirror image
        for (Pose& q : shape) q.position.x() *= -1;
      rest.add("{:.5f},{},{},{:.2e},{:.2e},{:.4f}", curvature, weight, elements,
               maxNodeDistance(shape, thinned(wanted, elements)), maxNodeDistance(chart.nodes, wanted),
               distanceFromPlane(wanted));
    }
    addShape(shapes, fmt::format("{:g}", weight), fine);
  }
}

// ---------------------------------------------------------------------------------------------- friction

void capstans() {
  Table table("capstan", "mu,wrap_rad,elements,sides,low_N,high_N,angle_rad,ratio,theory,off_percent");
  Table shapes("capstan_shapes", "shape,node,x,y,z", true);
  const auto add = [&](double mu, double wrap, int elements, int sides) {
    const Capstan c = capstan(mu, wrap, elements, sides);
    const double theory = std::exp(mu * c.angle), ratio = c.high / c.low;
    table.add("{},{:.4f},{},{},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:+.2f}", mu, wrap, elements, sides, c.low,
              c.high, c.angle, ratio, theory, 100 * (ratio / theory - 1));
    if (wrap > 3) addShape(shapes, fmt::format("{:g}", mu), c.shape);
  };
  for (const double mu : {0.0, 0.1, 0.2, 0.3, 0.4, 0.5})
    for (const double wrap : {pi / 4, pi / 2, pi}) add(mu, wrap, 100, 128);
  add(0.3, pi / 2, 100, 32), add(0.3, pi / 2, 100, 64), add(0.3, pi / 2, 50, 128), add(0.3, pi / 2, 200, 128);
}

void slopes() {
  Table table("slope", "mu,lies,tan_slope_over_mu,speed_after_1s_m_s,theory_m_s");
  for (const double mu : {0.2, 0.5, 1.0})
    for (const bool across : {false, true})
      for (const double over : {0.5, 0.8, 0.9, 0.95, 0.99, 1.01, 1.05, 1.1, 1.2, 1.5, 2.0}) {
        const double slope = std::atan(over * mu);
        const double speed = speedOnSlope(slope, mu, 1, across);
        const double theory = std::max(0.0, 9.81 * (std::sin(slope) - mu * std::cos(slope)));
        table.add("{},{},{},{:.5f},{:.5f}", mu, across ? "across" : "along", over, speed, theory);
      }
  Table threshold("slope_threshold", "mu,lies,dt_s,low_tan_over_mu,high_tan_over_mu");
  for (const double mu : {0.2, 0.5, 1.0})
    for (const double dt : {0.02, 0.01, 0.005}) {
      const auto [low, high] =
          bracket(0.95, 1.05, 2e-3, [&](double over) {  // 2 cm/s: twice the creep that is sticking
            return speedOnSlope(std::atan(over * mu), mu, 2, false, dt) > 0.02;
          });
      threshold.add("{},along,{},{:.4f},{:.4f}", mu, dt, low, high);
    }
}

// ---------------------------------------------------------------------------------------------- plectoneme

void plectonemes() {
  Table table("plectoneme", "turns,self_contact,elements,time_s,end_distance_L,self_distance_over_2r", true);
  Table shapes("plectoneme_shapes", "shape,node,x,y,z", true);
  fmt::print(
      "  turns,self_contact,elements,smallest self distance / 2r (all way points), at rest,contacts\n");
  for (const auto& [turns, self_contact, elements] :
       {std::tuple(3.0, true, 60), std::tuple(3.0, true, 100), std::tuple(5.0, true, 100),
        std::tuple(3.0, false, 100)}) {
    const RodProperties rod = scenes::rodScenario(5e7, elements).rod;
    double least = std::numeric_limits<double>::infinity(), now = 0;
    RodShape last;
    const StepReport report =
        twistAndSlacken(turns, self_contact, elements, [&](double time, const RodShape& shape) {
          now = selfDistance(shape, rod) / (2 * rod.radius);
          least = std::min(least, now);
          table.add("{},{},{},{:.2f},{:.3f},{:.4f}", turns, self_contact ? 1 : 0, elements, time,
                    (shape.back().position - shape.front().position).norm(), now);
          last = shape;
        });
    fmt::print("  {},{},{},{:.4f},{:.4f},{}\n", turns, self_contact, elements, least, now, report.contacts);
    addShape(shapes,
             fmt::format("{:g} turns{}{}", turns, elements == 60 ? " coarse" : "",
                         self_contact ? "" : " through itself"),
             last);
  }
}

// ---------------------------------------------------------------------------------------------- statics

void atRest() {
  Table table("rest", "kind,elements,median_L,largest_L,rods");
  constexpr int kRods = 20, kFine = 80;
  for (const bool heavy : {false, true})
    for (const bool curved : {false, true}) {
      Scenario s = settling(5e7, 0.01, kFine, heavy ? 9.81 : 0);
      if (curved) s.rod.rest_curvature = {{1, 2, -3}};
      SamplingSpace space;
      space.box = {.moment = 4, .force = 20};
      space.gravity = s.environment.gravity;
      RodSampler sampler(s.rod, space, 5);
      std::vector<RodShape> chart;
      for (int k = 0; k < kRods; ++k)
        if (const Equilibrium* rod = sampler.next()) chart.push_back(rod->nodes);
      for (const int elements : {10, 20, 40, 80}) {
        Scenario cut = s;
        cut.rod = withElements(s.rod, elements);
        RodModel model(cut, nothing());
        model.newton.tolerance = 1e-9;
        std::vector<double> errors;
        for (const RodShape& exact : chart) {
          const RodShape wanted = thinned(exact, elements);
          RodShape shape = wanted;
          settle(model, held(wanted.front(), wanted.back()), shape);
          errors.push_back(maxNodeDistance(shape, wanted));
        }
        std::sort(errors.begin(), errors.end());
        table.add("{}{},{},{:.2e},{:.2e},{}", heavy ? "heavy" : "weightless", curved ? " curved" : "",
                  elements, errors[errors.size() / 2], errors.back(), errors.size());
      }
    }
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::pair<std::string, void (*)()>> experiments = {
      {"cantilever", cantilevers}, {"swing", swings},   {"energy", energies},  {"two-ends", twoEnds},
      {"buckling", buckling},      {"curl", curls},     {"capstan", capstans}, {"slope", slopes},
      {"plectoneme", plectonemes}, {"statics", atRest},
  };
  if (argc > 1) folder = argv[1];
  for (const auto& [what, run] : experiments) {
    if (argc > 2 && std::find(argv + 2, argv + argc, what) == argv + argc) continue;
    fmt::print("{}\n", what);
    const auto start = std::chrono::steady_clock::now();
    run();
    fmt::print("  ({:.1f} s)\n",
               std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
}
