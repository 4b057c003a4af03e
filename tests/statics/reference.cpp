#include "reference.h"

namespace tendril::reference {

Vector6 roundStiffness(double radius) {
  const double young = 4 / (kPi * std::pow(radius, 4));
  return stiffnessOfRoundRod(young, young / 2.8, radius);
}

Vector3 randomVector(Random& random, double half_width) {
  Vector3 v;
  for (int i = 0; i < 3; ++i) v[i] = random.uniform(-half_width, half_width);
  return v;
}

Vector6 randomWrench(Random& random, double moment, double force) {
  Vector6 a;
  a.head<3>() = randomVector(random, moment);
  a.tail<3>() = randomVector(random, force);
  return a;
}

Vector3 gravityFor(const RodProperties& rod, double gamma, const Vector3& direction) {
  const double mass_per_length = rod.density * kPi * rod.radius * rod.radius;
  return gamma * rod.bendingStiffness() / std::pow(rod.length, 3) / mass_per_length * direction.normalized();
}

Equilibrium solvedAt(const RodProperties& rod, const Pose& base, const Vector6& wrench,
                     const Vector3& gravity) {
  EquilibriumIntegrator integrator(rod, gravity);
  Equilibrium e;
  EXPECT_EQ(integrator.solve(base, wrench, e), ChartStatus::equilibrium) << wrench.transpose();
  EXPECT_EQ(integrator.isStable(base.rotation, wrench), e.stability == Stability::stable)
      << wrench.transpose();
  EXPECT_EQ(e.first_conjugate_t.has_value(), e.stability != Stability::stable);
  EXPECT_EQ(e.conjugate_points > 0, e.stability == Stability::unstable);
  return e;
}

Equilibrium solved(const RodProperties& rod, const Vector6& wrench) { return solvedAt(rod, {}, wrench); }

Vector6 xiOf(const Vector6& mu, const Vector6& c, const Vector3& kappa0) {
  Vector6 xi = strain(mu, c);
  xi.head<3>() += kappa0;
  xi[3] += 1;
  return xi;
}

Matrix6 matrixF(const Vector6& mu, const Vector6& c, const Vector3& kappa0) {
  const Vector6 xi = xiOf(mu, c, kappa0);
  const Matrix3 k = c.head<3>().cwiseInverse().asDiagonal(), s = c.tail<3>().cwiseInverse().asDiagonal();
  Matrix6 f;
  f << skew(mu.head<3>()) * k - skew(xi.head<3>()), skew(mu.tail<3>()) * s - skew(xi.tail<3>()),
      skew(mu.tail<3>()) * k, -skew(xi.head<3>());
  return f;
}

Matrix6 matrixH(const Vector6& mu, const Vector6& c, const Vector3& kappa0) {
  const Vector6 xi = xiOf(mu, c, kappa0);
  Matrix6 h;
  h << -skew(xi.head<3>()), Matrix3::Zero(), -skew(xi.tail<3>()), -skew(xi.head<3>());
  return h;
}

State rateOf(const State& y, const Vector6& c, const Vector3& kappa0) {
  const Vector6 xi = xiOf(y.mu, c, kappa0);
  const Vector3 m = y.mu.head<3>(), n = y.mu.tail<3>(), kappa = xi.head<3>(), v = xi.tail<3>();
  State d;
  d.mu << m.cross(kappa) + n.cross(v), n.cross(kappa);  // eq. (2)
  d.r = y.r * skew(kappa);
  d.p = y.r * v;
  d.m = matrixF(y.mu, c, kappa0) * y.m;
  d.j = c.cwiseInverse().asDiagonal() * y.m + matrixH(y.mu, c, kappa0) * y.j;
  d.energy = 0.5 * y.mu.dot(strain(y.mu, c));
  return d;
}

State plus(const State& y, double h, const State& d) {
  State z;
  z.mu = y.mu + h * d.mu, z.r = y.r + h * d.r, z.p = y.p + h * d.p;
  z.m = y.m + h * d.m, z.j = y.j + h * d.j, z.energy = y.energy + h * d.energy;
  return z;
}

State integrate(const Vector6& a, const Vector6& c, double length, int steps, const Vector3& kappa0) {
  State y;
  y.mu = a;
  const double h = length / steps;
  for (int i = 0; i < steps; ++i) {
    const State k1 = rateOf(y, c, kappa0), k2 = rateOf(plus(y, h / 2, k1), c, kappa0),
                k3 = rateOf(plus(y, h / 2, k2), c, kappa0), k4 = rateOf(plus(y, h, k3), c, kappa0);
    y = plus(plus(plus(plus(y, h / 6, k1), h / 3, k2), h / 3, k3), h / 6, k4);
  }
  return y;
}

}  // namespace tendril::reference
