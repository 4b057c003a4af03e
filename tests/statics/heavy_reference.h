/// The laws of a heavy, pre-formed rod in world axes, as a textbook has them: every cross-section carries a
/// moment m and a force n in world axes with n' = -w, m' = -p' x n, w the weight per length; integrated with
/// the classical Runge-Kutta method of order 4 and Richardson's extrapolation. Boundary value problems by
/// shooting with a Jacobian of finite differences. No code in common with the chart.
#pragma once

#include <functional>

#include "reference.h"

namespace tendril::reference {

struct HeavyRod {
  Vector6 c;
  double length;
  std::vector<Vector3> kappa0;  // one, or one per element
  Vector3 weight;               // N/m, world

  explicit HeavyRod(const RodProperties& rod, const Vector3& gravity = Vector3::Zero());
  /// The curvature at rest at s.
  [[nodiscard]] const Vector3& kappaAt(double s) const;
};

/// One cross-section in world axes, and the energies [J] of the rod up to there; that of the weight is
/// counted from the height of p = 0.
struct Place {
  Matrix3 r = Matrix3::Identity();
  Vector3 p = Vector3::Zero(), m = Vector3::Zero(), n = Vector3::Zero();
  double energy = 0, weight_energy = 0;

  [[nodiscard]] Vector6 mu() const;
  [[nodiscard]] Place operator+(const Place& d) const;
  [[nodiscard]] Place operator*(double h) const;
};

/// A rod's start: the first node's rotation and the wrench there in its axes, at the origin.
[[nodiscard]] Place startOf(const Quaternion& base, const Vector6& wrench);

[[nodiscard]] Place rateOf(const HeavyRod& rod, const Vector3& kappa0, const Place& y);

/// One step of RK4 of length h (which may be negative), with the curvature at rest of the step's middle.
[[nodiscard]] Place stepped(const HeavyRod& rod, const Place& y, double s, double h);

/// From s = from to s = to.
[[nodiscard]] Place walked(const HeavyRod& rod, Place y, double from, double to, int steps);

/// Sections at the rod's `elements` + 1 nodes; errors of order h^5, some 1e-12 at 100 steps per radian.
[[nodiscard]] std::vector<Place> nodesOf(const HeavyRod& rod, const Place& start, int elements,
                                         int steps_per_element);
[[nodiscard]] Place endOf(const HeavyRod& rod, const Place& start, int steps);

/// Newton's method with a Jacobian of central differences of that size, damped.
[[nodiscard]] bool shoot(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& miss,
                         double difference, double tolerance, Eigen::VectorXd& x);

/// The wrench at the base (in its axes) of a rod clamped there with the other end free. Shot from the free
/// end, where moment and force vanish, with its rotation unknown; the weight grows in `stages`.
[[nodiscard]] Vector6 cantileverWrench(const HeavyRod& rod, const Quaternion& base, int steps, int stages);

}  // namespace tendril::reference
