#include "heavy_reference.h"

#include <algorithm>

namespace tendril::reference {

HeavyRod::HeavyRod(const RodProperties& rod, const Vector3& gravity)
    : c(rod.c),
      length(rod.length),
      kappa0(rod.rest_curvature),
      weight(gravity * (rod.density * kPi * rod.radius * rod.radius)) {
  if (kappa0.empty()) kappa0.assign(1, Vector3::Zero());
}

const Vector3& HeavyRod::kappaAt(double s) const {
  const auto last = static_cast<double>(kappa0.size()) - 1;
  const double element = std::floor(s / length * static_cast<double>(kappa0.size()));
  return kappa0[static_cast<std::size_t>(std::clamp(element, 0.0, last))];
}

Vector6 Place::mu() const {
  Vector6 out;
  out << r.transpose() * m, r.transpose() * n;
  return out;
}

Place Place::operator+(const Place& d) const {
  return {r + d.r, p + d.p, m + d.m, n + d.n, energy + d.energy, weight_energy + d.weight_energy};
}

Place Place::operator*(double h) const { return {h * r, h * p, h * m, h * n, h * energy, h * weight_energy}; }

Place startOf(const Quaternion& base, const Vector6& wrench) {
  Place y;
  y.r = base.toRotationMatrix();
  y.m = y.r * wrench.head<3>(), y.n = y.r * wrench.tail<3>();
  return y;
}

Place rateOf(const HeavyRod& rod, const Vector3& kappa0, const Place& y) {
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

Place stepped(const HeavyRod& rod, const Place& y, double s, double h) {
  const Vector3& kappa0 = rod.kappaAt(s + h / 2);
  const Place k1 = rateOf(rod, kappa0, y), k2 = rateOf(rod, kappa0, y + k1 * (h / 2)),
              k3 = rateOf(rod, kappa0, y + k2 * (h / 2)), k4 = rateOf(rod, kappa0, y + k3 * h);
  return y + (k1 + (k2 + k3) * 2 + k4) * (h / 6);
}

Place walked(const HeavyRod& rod, Place y, double from, double to, int steps) {
  const double h = (to - from) / steps;
  for (int i = 0; i < steps; ++i) y = stepped(rod, y, from + i * h, h);
  return y;
}

std::vector<Place> nodesOf(const HeavyRod& rod, const Place& start, int elements, int steps_per_element) {
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

Place endOf(const HeavyRod& rod, const Place& start, int steps) {
  return walked(rod, start, 0, rod.length, 2 * steps) * (16.0 / 15) +
         walked(rod, start, 0, rod.length, steps) * (-1.0 / 15);
}

bool shoot(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& miss, double difference,
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

Vector6 cantileverWrench(const HeavyRod& rod, const Quaternion& base, int steps, int stages) {
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
