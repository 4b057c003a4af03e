/// Rods that are curved and twisted at rest: against the closed form of helices, of relaxation and of a beam
/// that its weight straightens.
#include <gtest/gtest.h>

#include <cmath>

#include "dynamics/scenes.h"

namespace tendril {
namespace {

using scenes::nothing;
using scenes::rodScenario;
using scenes::straight;

/// The frame at arc length s of a rod of constant curvature k (twist, bending, bending [1/m]) from `base`: it
/// turns about the fixed axis k, and what of the tangent lies across that axis goes round.
Pose onHelix(const Pose& base, const Vector3& k, double s) {
  const double rate = k.norm(), angle = rate * s;
  if (rate == 0) return base * Pose{Quaternion::Identity(), s * Vector3::UnitX()};
  const Vector3 axis = k / rate, along = axis.x() * axis, across = Vector3::UnitX() - along;
  const Vector3 p =
      s * along + (std::sin(angle) * across + (1 - std::cos(angle)) * axis.cross(across)) / rate;
  return base * Pose{Quaternion(Eigen::AngleAxisd(angle, axis)), p};
}

/// The rod at ease: one curvature after the other, from `base`. `share` scales them all.
RodShape shapeAtRest(const RodProperties& rod, const Pose& base, double share = 1) {
  RodShape shape = {base};
  for (int k = 0; k < rod.elements; ++k)
    shape.push_back(onHelix(shape.back(), share * rod.restCurvature(k), rod.elementLength()));
  return shape;
}

double farthest(const RodShape& a, const RodShape& b) {
  double largest = a.size() == b.size() ? 0 : 1e9;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    largest = std::max(
        {largest, (a[i].position - b[i].position).norm(), angleBetween(a[i].rotation, b[i].rotation)});
  return largest;
}

/// A rod with a flat section, twice as stiff about y as about z, that is `curvature` at rest.
Scenario preformed(int elements, std::vector<Vector3> curvature) {
  Scenario s = rodScenario(5e7, elements);
  s.rod.c[1] *= 1.4, s.rod.c[2] *= 0.7;
  s.rod.rest_curvature = std::move(curvature);
  s.grippers.max_force = 1e6, s.grippers.max_torque = 1e6;  // a clamp
  return s;
}

/// A curvature for each element, of a hose with a bend and a twist here and there.
std::vector<Vector3> uneven(int elements) {
  std::vector<Vector3> curvature;
  for (int k = 0; k < elements; ++k) {
    const double t = (k + 0.5) / elements;
    curvature.emplace_back(2 * t, t < 0.4 ? 5 : -1, 4 * std::sin(6 * t));
  }
  return curvature;
}

const std::vector<std::vector<Vector3>>& kinds() {
  static const std::vector<std::vector<Vector3>> all = {
      {Vector3(0, 0, 2)}, {Vector3(0, -4, 0)}, {Vector3(3, 2, -5)}, {Vector3(9, 0, 0)}, uneven(40)};
  return all;
}

const Pose kSomewhere = {expSO3({0.3, -0.5, 0.9}), {0.4, 0.1, -0.2}};

TEST(RestCurvature, ARodOnItsHelixStaysThereHeldOrFree) {
  const Obstacles obstacles = nothing();
  for (const auto& curvature : kinds())
    for (const Scheme scheme : {Scheme::implicit_euler, Scheme::second_order})
      for (const bool held : {false, true}) {
        Scenario s = preformed(40, curvature);
        s.simulation.scheme = scheme;
        s.simulation.drag = 0;
        const RodModel model(s, obstacles);
        const RodShape helix = shapeAtRest(s.rod, kSomewhere);
        RodState state = RodState::atRest(helix);
        RodWorkspace workspace;
        Control control;
        control.held = {held, held};
        ControlRunner runner(model, control, state);
        for (int k = 0; k < 50; ++k) runner.advance(state, workspace);
        EXPECT_LT(farthest(state.nodes, helix), 1e-11) << curvature.front().transpose();
        for (const Vector6& v : state.velocities) EXPECT_LT(v.norm(), 1e-9);
      }
}

TEST(RestCurvature, AClampedRodWithoutInertiaRelaxesToItsHelixAtTheRateOfItsDamping) {
  // beta c du/dt + c (u - u_rest) = 0, so that implicit Euler leaves (1 + dt/beta)^-n of the difference after
  // n steps, in every element and every component alike. Where the elastic moment, which alone is not in
  // balance here, is not parallel to the curvature, the element takes the rod to bend within it: to order
  // h^2.
  const Obstacles obstacles = nothing();
  for (const auto& curvature : kinds()) {
    Scenario s = preformed(40, curvature);
    s.simulation.inertia = false;
    s.simulation.drag = 0;
    s.simulation.stiffness_damping = 0.1;
    RodModel model(s, obstacles);
    model.newton.tolerance = 1e-9;
    model.newton.max_iterations = 100;  // nothing slows the first steps down: a radian each
    RodState state = RodState::atRest(straight(kSomewhere, 1, 40));
    RodWorkspace workspace;
    Control clamp;
    clamp.held = {true, false};
    ControlRunner runner(model, clamp, state);
    for (int n = 1; n <= 40; ++n) {
      runner.advance(state, workspace);
      const double share = 1 - std::pow(1 + s.simulation.time_step / 0.1, -n);
      const bool one_axis = curvature.size() == 1 && (curvature[0].array() != 0).count() == 1;
      EXPECT_LT(farthest(state.nodes, shapeAtRest(s.rod, kSomewhere, share)), one_axis ? 1e-7 : 5e-4)
          << curvature.front().transpose() << " after " << n << " steps";
    }
  }
}

TEST(RestCurvature, ARodStartedStraightAndHeldAtEitherEndSwingsIntoItsHelix) {
  const Obstacles obstacles = nothing();
  for (const auto& curvature : kinds())
    for (const End end : kBothEnds) {
      Scenario s = preformed(40, curvature);
      s.simulation.stiffness_damping = 0.02;
      const RodModel model(s, obstacles);
      RodState state = RodState::atRest(straight(kSomewhere, 1, 40));
      const Pose clamped = endPose(state.nodes, end);
      RodWorkspace workspace;
      Control clamp;
      clamp.held[static_cast<std::size_t>(end)] = true;
      ControlRunner runner(model, clamp, state);
      for (int k = 0; k < 1000; ++k) runner.advance(state, workspace);
      // The helix that has the clamped end where it is.
      const Pose from_first = endPose(shapeAtRest(s.rod, {}), end);
      const RodShape helix = shapeAtRest(s.rod, clamped * from_first.inverse());
      EXPECT_LT(farthest(state.nodes, helix), 1e-4)
          << curvature.front().transpose() << " held at " << name(end);
    }
}

TEST(RestCurvature, ACantileverBentUpByWhatItsWeightBendsItDownHangsLevel) {
  // Level, the weight's moment x from the tip is q x^2/2 about +y, for gravity along -z. A rest curvature of
  // minus its mean over c2 in each element leaves every node level; within an element the shear force V bends
  // the rod about the mean, which lowers the next node by V h^3/12 c2, and by its shear.
  constexpr int kElements = 16;
  Scenario s = preformed(kElements, {});
  s.environment.gravity = {0, 0, -9.81};
  s.simulation.inertia = false;
  s.simulation.time_step = 0.5;
  s.simulation.drag = 0.1;
  s.simulation.stiffness_damping = 0;
  const double h = s.rod.elementLength(), q = 9.81 * s.rod.density * std::numbers::pi * 1e-4;
  RodShape level = {Pose{}};
  for (int k = 0; k < kElements; ++k) {
    const double x = (kElements - k - 0.5) * h;
    const double moment = q * (x * x + h * h / 12) / 2, force = q * x;
    s.rod.rest_curvature.emplace_back(0, -moment / s.rod.c[1], 0);
    const double lowered = h * force * (1 / s.rod.c[5] + h * h / (12 * s.rod.c[1]));
    level.push_back({Quaternion::Identity(), level.back().position + Vector3(h, 0, -lowered)});
  }
  ASSERT_GT(-s.rod.rest_curvature.front().y(), 1);  // not a small one
  const Obstacles obstacles = nothing();
  RodModel model(s, obstacles);
  model.newton.tolerance = 1e-10;
  RodState state = RodState::atRest(shapeAtRest(s.rod, {}));
  RodWorkspace workspace;
  Control clamp;
  clamp.held = {true, false};
  ControlRunner runner(model, clamp, state);
  for (int k = 0; k < 1000; ++k) runner.advance(state, workspace);
  EXPECT_LT(farthest(state.nodes, level), 2e-6);
}

/// Elastic and kinetic energy [J], from the definition.
double energyOf(const RodProperties& rod, const RodState& state) {
  const double h = rod.elementLength(), r = rod.radius;
  double sum = 0;
  for (std::size_t i = 0; i < state.nodes.size(); ++i) {
    const bool is_end = i == 0 || i + 1 == state.nodes.size();
    const double mass = rod.density * std::numbers::pi * r * r * h * (is_end ? 0.5 : 1);
    const Vector3 w = state.velocities[i].head<3>(), rotary = r * r / 4 * Vector3(2, 1, 1);
    const Vector3 inside = (i == 0 ? h / 6 : is_end ? -h / 6 : 0) * Vector3::UnitX();
    const Vector3 v = state.velocities[i].tail<3>() + state.nodes[i].rotation * w.cross(inside);
    sum += mass / 2 * (v.squaredNorm() + rotary.dot(w.cwiseAbs2()));
    if (i + 1 == state.nodes.size()) break;
    Vector6 u = logSE3(state.nodes[i].inverse() * state.nodes[i + 1]) / h;
    u[3] -= 1;
    u.head<3>() -= rod.restCurvature(static_cast<int>(i));
    Vector6 c = rod.c;
    c[4] = 1 / (1 / c[4] + h * h / (12 * c[2])), c[5] = 1 / (1 / c[5] + h * h / (12 * c[1]));
    sum += h / 2 * c.dot(u.cwiseAbs2());
  }
  return sum;
}

TEST(RestCurvature, EnergyOnlyDecaysBetweenClampedEnds) {
  const Obstacles obstacles = nothing();
  for (const auto& curvature : kinds()) {
    Scenario s = preformed(40, curvature);
    s.simulation.time_step = 0.002;
    RodModel model(s, obstacles);
    model.newton.tolerance = 1e-8;
    // Between the ends of half the curvature, in between pushed out of balance.
    RodState state = RodState::atRest(shapeAtRest(s.rod, {}, 0.5));
    for (std::size_t i = 12; i < 32; ++i) state.velocities[i].tail<3>() = Vector3(0, 0.5, -0.3);
    RodWorkspace workspace;
    Control clamp;
    clamp.held = {true, true};
    ControlRunner runner(model, clamp, state);
    const double first = energyOf(s.rod, state);
    double energy = first;
    for (int k = 0; k < 1000; ++k) {
      runner.advance(state, workspace);
      const double next = energyOf(s.rod, state);
      EXPECT_LT(next, energy + 1e-7 * first) << curvature.front().transpose() << " step " << k;
      energy = next;
    }
    EXPECT_LT(energy, 0.999 * first);
  }
}

}  // namespace
}  // namespace tendril
