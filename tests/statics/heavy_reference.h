/// The laws of a heavy, pre-formed rod in world axes, as a textbook has them: every cross-section carries a
/// moment m and a force n in world axes with n' = -w, m' = -p' x n, w the weight per length; integrated with
/// the classical Runge-Kutta method of order 4 and Richardson's extrapolation. Boundary value problems by
/// shooting with a Jacobian of finite differences. No code in common with the chart.
#pragma once

#include <algorithm>
#include <functional>

#include "reference.h"

namespace tendril::reference {

struct HeavyRod {
  Vector6 c;
  double length;
  std::vector<Vector3> kappa0;  // one, or one per element
  Vector3 weight;               // N/m, world

  explicit HeavyRod(const RodProperties& rod, const Vector3& gravity = Vector3::Zero())
      : c(rod.c),
        length(rod.length),
        kappa0(rod.rest_curvature),
        weight(gravity * (rod.density * kPi * rod.radius * rod.radius)) {
    if (kappa0.empty()) kappa0.assign(1, Vector3::Zero());
  }
  /// The curvature at rest at s.
  [[nodiscard]] const Vector3& kappaAt(double s) const {
    const auto last = static_cast<double>(kappa0.size()) - 1;
    const double element = std::floor(s / length * static_cast<double>(kappa0.size()));
    return kappa0[static_cast<std::size_t>(std::clamp(element, 0.0, last))];
  }
};

/// One cross-section in world axes, and the energies [J] of the rod up to there; that of the weight is
/// counted from the height of p = 0.
struct Place {
  Matrix3 r = Matrix3::Identity();
  Vector3 p = Vector3::Zero(), m = Vector3::Zero(), n = Vector3::Zero();
  double energy = 0, weight_energy = 0;

  [[nodiscard]] Vector6 mu() const {
    Vector6 out;
    out << r.transpose() * m, r.transpose() * n;
    return out;
  }
  [[nodiscard]] Place operator+(const Place& d) const {
    return {r + d.r, p + d.p, m + d.m, n + d.n, energy + d.energy, weight_energy + d.weight_energy};
  }
  [[nodiscard]] Place operator*(double h) const {
    return {h * r, h * p, h * m, h * n, h * energy, h * weight_energy};
  }
};

/// A rod's start: the first node's rotation and the wrench there in its axes, at the origin.
inline Place startOf(const Quaternion& base, const Vector6& wrench) {
  Place y;
  y.r = base.toRotationMatrix();
  y.m = y.r * wrench.head<3>(), y.n = y.r * wrench.tail<3>();
  return y;
}

inline Place rateOf(const HeavyRod& rod, const Vector3& kappa0, const Place& y) {
  const Vector6 mu = y.mu(), xi = xiOf(mu, rod.c, kappa0);
  Place d;
  d.r = y.r * skew(xi.head<3>());
  d.p = y.r * xi.tail<3>();
  d.m = -d.p.cross(y.n);
  d.n = -rod.weight;
  d.energy = 0.5 * mu.dot(strain(mu, rod.c));
  d.weight_energy = -rod.weight.dot(y.p);
  return d;
}

/// One step of RK4 of length h (which may be negative), with the curvature at rest of the step's middle.
inline Place stepped(const HeavyRod& rod, const Place& y, double s, double h) {
  const Vector3& kappa0 = rod.kappaAt(s + h / 2);
  const Place k1 = rateOf(rod, kappa0, y), k2 = rateOf(rod, kappa0, y + k1 * (h / 2)),
              k3 = rateOf(rod, kappa0, y + k2 * (h / 2)), k4 = rateOf(rod, kappa0, y + k3 * h);
  return y + (k1 + (k2 + k3) * 2 + k4) * (h / 6);
}

/// From s = from to s = to.
inline Place walked(const HeavyRod& rod, Place y, double from, double to, int steps) {
  const double h = (to - from) / steps;
  for (int i = 0; i < steps; ++i) y = stepped(rod, y, from + i * h, h);
  return y;
}

/// Sections at the rod's `elements` + 1 nodes; errors of order h^5, some 1e-12 at 100 steps per radian.
inline std::vector<Place> nodesOf(const HeavyRod& rod, const Place& start, int elements,
                                  int steps_per_element) {
  std::vector<Place> nodes = {start};
  Place coarse = start, fine = start;
  const double h = rod.length / elements;
  for (int i = 0; i < elements; ++i) {
    coarse = walked(rod, coarse, i * h, (i + 1) * h, steps_per_element);
    fine = walked(rod, fine, i * h, (i + 1) * h, 2 * steps_per_element);
    nodes.push_back(fine * (16.0 / 15) + coarse * (-1.0 / 15));
  }
  return nodes;
}
inline Place endOf(const HeavyRod& rod, const Place& start, int steps) {
  return walked(rod, start, 0, rod.length, 2 * steps) * (16.0 / 15) +
         walked(rod, start, 0, rod.length, steps) * (-1.0 / 15);
}

/// Newton's method with a Jacobian of central differences of that size, damped.
inline bool shoot(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& miss, double difference,
                  double tolerance, Eigen::VectorXd& x) {
  Eigen::VectorXd f = miss(x);
  for (int iteration = 0; iteration < 60; ++iteration) {
    if (f.norm() <= tolerance) return true;
    Eigen::MatrixXd jacobian(f.size(), x.size());
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      Eigen::VectorXd plus = x, minus = x;
      plus[i] += difference, minus[i] -= difference;
      jacobian.col(i) = (miss(plus) - miss(minus)) / (2 * difference);
    }
    const Eigen::VectorXd step = jacobian.fullPivLu().solve(f);
    double damping = 1;
    for (; damping > 1e-3; damping /= 2) {
      const Eigen::VectorXd trial = x - damping * step, g = miss(trial);
      if (g.norm() < f.norm()) {
        x = trial, f = g;
        break;
      }
    }
    if (damping <= 1e-3) return f.norm() <= 100 * tolerance;
  }
  return false;
}

/// The wrench at the base (in its axes) of a rod clamped there with the other end free. Shot from the free
/// end, where moment and force vanish, with its rotation unknown; the weight grows in `stages`.
inline Vector6 cantileverWrench(const HeavyRod& rod, const Quaternion& base, int steps, int stages) {
  const Quaternion unloaded = [&] {
    HeavyRod light = rod;
    light.weight.setZero();
    return Quaternion(walked(light, startOf(base, Vector6::Zero()), 0, rod.length, steps).r);
  }();
  Eigen::VectorXd turn = Eigen::VectorXd::Zero(3);
  Place at_base;
  for (int stage = 1; stage <= stages; ++stage) {
    HeavyRod loaded = rod;
    loaded.weight *= static_cast<double>(stage) / stages;
    const auto miss = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
      Place tip;
      tip.r = (expSO3(x) * unloaded).toRotationMatrix();
      at_base = walked(loaded, tip, rod.length, 0, 2 * steps) * (16.0 / 15) +
                walked(loaded, tip, rod.length, 0, steps) * (-1.0 / 15);
      return logSO3(base.conjugate() * Quaternion(at_base.r).normalized());
    };
    EXPECT_TRUE(shoot(miss, 1e-8, 1e-11, turn)) << stage;
    (void)miss(turn);
  }
  return at_base.mu();
}

}  // namespace tendril::reference
