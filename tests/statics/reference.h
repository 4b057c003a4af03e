/// What the tests of the statics compare with: rods and loads, and the laws and Theorem 2 as the paper states
/// them, integrated with the classical Runge-Kutta method of order 4. No code in common with the chart.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tendril/statics.h"

namespace tendril::reference {

inline constexpr double kPi = std::numbers::pi;

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

/// A round rod of slenderness r / L with nu = 0.4 and EI = 1.
[[nodiscard]] Vector6 roundStiffness(double radius = 0.01);
/// Six different stiffnesses.
inline Vector6 unevenStiffness() { return vector6(0.6, 0.7, 1.3, 900, 300, 450); }
/// Rods so short and thick that they stretch and shear as easily as they bend.
inline Vector6 softStiffness() { return vector6(1, 1, 1, 10, 5, 5); }
inline Vector6 softestStiffness() { return vector6(1, 1, 1, 2, 1, 1); }

[[nodiscard]] Vector3 randomVector(Random& random, double half_width);
[[nodiscard]] Vector6 randomWrench(Random& random, double moment, double force);

/// The gravity [m/s^2] that gives a rod of rodOf() the weight `gamma` per length, in units of EI/L^3.
[[nodiscard]] Vector3 gravityFor(const RodProperties& rod, double gamma, const Vector3& direction);

[[nodiscard]] Equilibrium solvedAt(const RodProperties& rod, const Pose& base, const Vector6& wrench,
                                   const Vector3& gravity = Vector3::Zero());
[[nodiscard]] Equilibrium solved(const RodProperties& rod, const Vector6& wrench);

/// xi = (kappa; e1 + eps).
[[nodiscard]] Vector6 xiOf(const Vector6& mu, const Vector6& c, const Vector3& kappa0 = Vector3::Zero());

/// F, G, H of Theorem 2 in block form: M' = F M, J' = G M + H J, G = diag(1/c).
[[nodiscard]] Matrix6 matrixF(const Vector6& mu, const Vector6& c, const Vector3& kappa0 = Vector3::Zero());
[[nodiscard]] Matrix6 matrixH(const Vector6& mu, const Vector6& c, const Vector3& kappa0 = Vector3::Zero());

/// A weightless rod with M and J of Theorem 2 at one place.
struct State {
  Vector6 mu;
  Matrix3 r = Matrix3::Identity();
  Vector3 p = Vector3::Zero();
  Matrix6 m = Matrix6::Identity(), j = Matrix6::Zero();
  double energy = 0;
};

[[nodiscard]] State rateOf(const State& y, const Vector6& c, const Vector3& kappa0);

[[nodiscard]] State plus(const State& y, double h, const State& d);

/// (2), (4) and Theorem 2 from s = 0 to s = length, RK4.
[[nodiscard]] State integrate(const Vector6& a, const Vector6& c, double length, int steps,
                              const Vector3& kappa0 = Vector3::Zero());

}  // namespace tendril::reference
