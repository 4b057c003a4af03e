/// What the tests of the statics compare with: the laws as the paper states them, integrated with the
/// classical Runge-Kutta method of order 4, and the second variation of the energy on a grid. No code in
/// common with the chart.
#pragma once

#include <cmath>

#include "tendril/statics.h"

namespace tendril::reference {

/// A rod whose natural units are SI units: length 1 and mean bending stiffness 1 for the stiffnesses used
/// here.
inline RodProperties rodOf(const Vector6& c, int elements = 40, double length = 1.0) {
  RodProperties rod;
  rod.c = c;
  rod.elements = elements;
  rod.length = length;
  return rod;
}

inline Vector6 vector6(double a, double b, double c, double d, double e, double f) {
  Vector6 v;
  v << a, b, c, d, e, f;
  return v;
}

/// A round rod of slenderness r / L = 0.01 with nu = 0.4, and one with six different stiffnesses.
inline Vector6 roundStiffness() {
  return stiffnessOfRoundRod(4 / (M_PI * 1e-8), 4 / (2.8 * M_PI * 1e-8), 0.01);
}
inline Vector6 unevenStiffness() { return vector6(0.6, 0.7, 1.3, 900, 300, 450); }

inline Vector6 randomWrench(Random& random, double moment, double force) {
  Vector6 a;
  for (int i = 0; i < 3; ++i) a[i] = random.uniform(-moment, moment);
  for (int i = 3; i < 6; ++i) a[i] = random.uniform(-force, force);
  return a;
}

/// xi = (kappa; e1 + eps).
inline Vector6 xiOf(const Vector6& mu, const Vector6& c) {
  Vector6 xi = strain(mu, c);
  xi[3] += 1;
  return xi;
}

/// Right-hand side of eq. (2): m' = m x kappa + n x (e1 + eps), n' = n x kappa.
inline Vector6 wrenchRate(const Vector6& mu, const Vector6& c) {
  const Vector6 xi = xiOf(mu, c);
  const Vector3 m = mu.head<3>(), n = mu.tail<3>(), kappa = xi.head<3>(), r = xi.tail<3>();
  Vector6 rate;
  rate << m.cross(kappa) + n.cross(r), n.cross(kappa);
  return rate;
}

/// F, G, H of Theorem 2 in block form: M' = F M, J' = G M + H J.
inline Matrix6 matrixF(const Vector6& mu, const Vector6& c) {
  const Vector6 xi = xiOf(mu, c);
  const Matrix3 k = c.head<3>().cwiseInverse().asDiagonal(), s = c.tail<3>().cwiseInverse().asDiagonal();
  Matrix6 f;
  f << skew(mu.head<3>()) * k - skew(xi.head<3>()), skew(mu.tail<3>()) * s - skew(xi.tail<3>()),
      skew(mu.tail<3>()) * k, -skew(xi.head<3>());
  return f;
}
inline Matrix6 matrixH(const Vector6& mu, const Vector6& c) {
  const Vector6 xi = xiOf(mu, c);
  Matrix6 h;
  h << -skew(xi.head<3>()), Matrix3::Zero(), -skew(xi.tail<3>()), -skew(xi.head<3>());
  return h;
}

/// The rod with M and J of Theorem 2 at one place.
struct State {
  Vector6 mu;
  Matrix3 r = Matrix3::Identity();
  Vector3 p = Vector3::Zero();
  Matrix6 m = Matrix6::Identity(), j = Matrix6::Zero();
  double energy = 0;
};

inline State rateOf(const State& y, const Vector6& c) {
  const Vector6 xi = xiOf(y.mu, c);
  State d;
  d.mu = wrenchRate(y.mu, c);
  d.r = y.r * skew(xi.head<3>());
  d.p = y.r * xi.tail<3>();
  d.m = matrixF(y.mu, c) * y.m;
  d.j = c.cwiseInverse().asDiagonal() * y.m + matrixH(y.mu, c) * y.j;
  d.energy = 0.5 * y.mu.dot(strain(y.mu, c));
  return d;
}

inline State plus(const State& y, double h, const State& d) {
  State z;
  z.mu = y.mu + h * d.mu, z.r = y.r + h * d.r, z.p = y.p + h * d.p;
  z.m = y.m + h * d.m, z.j = y.j + h * d.j, z.energy = y.energy + h * d.energy;
  return z;
}

/// (2), (4) and Theorem 2 from s = 0 to s = length, RK4.
inline State integrate(const Vector6& a, const Vector6& c, double length, int steps) {
  State y;
  y.mu = a;
  const double h = length / steps;
  for (int i = 0; i < steps; ++i) {
    const State k1 = rateOf(y, c), k2 = rateOf(plus(y, h / 2, k1), c), k3 = rateOf(plus(y, h / 2, k2), c),
                k4 = rateOf(plus(y, h, k3), c);
    y = plus(plus(plus(plus(y, h / 6, k1), h / 3, k2), h / 3, k3), h / 6, k4);
  }
  return y;
}

/// The number of negative directions of the energy with both ends clamped, from the second variation
///   integral of zeta^T C zeta + mu^T [zeta, eta],   zeta = eta' + [xi, eta],   eta(0) = eta(length) = 0,
/// on `elements` linear elements with the integrand at their middles; eta is the variation of the frame in
/// its own axes. The matrix is block tridiagonal; its inertia is the sum of its pivot blocks' (Sylvester).
inline int negativeDirections(const Vector6& a, const Vector6& c, double length, int elements) {
  const double h = length / elements;
  const auto advance = [&](const Vector6& mu, double step) -> Vector6 {
    const Vector6 k1 = wrenchRate(mu, c), k2 = wrenchRate(mu + step / 2 * k1, c),
                  k3 = wrenchRate(mu + step / 2 * k2, c), k4 = wrenchRate(mu + step * k3, c);
    return mu + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  };
  Vector6 mu = advance(a, h / 2);
  Matrix6 diagonal = Matrix6::Zero(), coupling = Matrix6::Zero();
  int negative = 0;
  for (int i = 0; i < elements; ++i, mu = advance(mu, h)) {
    // mu^T [zeta, eta] = m . (w x w') + n . (v x w' + w x v') = zeta^T bracket eta for zeta = (w; v), eta =
    // (w'; v')
    const Vector3 m = mu.head<3>(), n = mu.tail<3>();
    Matrix6 bracket;
    bracket << -skew(m), -skew(n), -skew(n), Matrix3::Zero();
    const Matrix6 ad = smallAdjoint(xiOf(mu, c));
    const Matrix6 left = -Matrix6::Identity() / h + 0.5 * ad,
                  right = Matrix6::Identity() / h + 0.5 * ad;  // zeta
    const Matrix6 stiff = c.asDiagonal();
    const auto form = [&](const Matrix6& z1, const Matrix6& z2) -> Matrix6 {
      // eta in the middle is half the sum of the two nodes'; the second term is symmetrised
      return h * (z1.transpose() * stiff * z2 + 0.25 * (z1.transpose() * bracket + bracket.transpose() * z2));
    };
    // unknowns: eta at the inner nodes 1 .. elements - 1
    const Matrix6 a00 = form(left, left), a01 = form(left, right), a11 = form(right, right);
    if (i > 0) {
      diagonal += a00;
      const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(0.5 * (diagonal + diagonal.transpose()));
      negative += static_cast<int>((eigen.eigenvalues().array() < 0).count());
      coupling = a01;
      diagonal = a11 - coupling.transpose() * diagonal.inverse() * coupling;
    } else {
      diagonal = a11;
    }
  }
  return negative;
}

}  // namespace tendril::reference
