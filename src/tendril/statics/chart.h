/// The chart of Theorem 1 in the rod's own units: lengths by L, moments by EI/L, forces by EI/L^2 (README.md,
/// 1-3). Private to the statics.
#pragma once

#include "tendril/base.h"
#include "tendril/rod.h"
#include "tendril/statics/dormand_prince8.h"

namespace tendril::statics {

/// The rod's units, to convert at the door.
struct Units {
  double length;  // L, m
  double moment;  // EI / L, N m
  double force;   // EI / L^2, N
  double energy;  // EI / L, J

  explicit Units(const RodProperties& rod);
  [[nodiscard]] Vector6 wrenchToNatural(const Vector6& wrench) const;
  [[nodiscard]] Vector6 wrenchToSi(const Vector6& wrench) const;
};

/// c in the rod's own units: (c1 c2 c3) / EI, (c4 c5 c6) L^2 / EI. Throws InputError unless length and every
/// c_i are finite and > 0.
[[nodiscard]] Vector6 naturalStiffness(const RodProperties& rod);

/// q(t) and the elastic energy of [0, t]: (x y z w of the unit quaternion | position | energy). q(0) is the
/// identity.
using PathState = Eigen::Array<double, 8, 1>;
/// PathState, then the rows of K (6 x 6): K = Ad_q dq/da, a twist of the base frame per unit of a.
using JointState = Eigen::Array<double, 44, 1>;
using RowMatrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

inline Eigen::Map<RowMatrix6> kOf(JointState& y) { return Eigen::Map<RowMatrix6>(y.data() + 8); }
inline PathState startOfPath() { return (PathState() << 0, 0, 0, 1, 0, 0, 0, 0).finished(); }
inline Pose poseOf(const PathState& y) {
  return {Quaternion(y[3], y[0], y[1], y[2]), Vector3(y[4], y[5], y[6])};
}

/// One rod of the chart: compliance and the wrench at its first node, both constant along it.
struct Chart {
  Vector3 compliance_m, compliance_n;  // 1/c
  Vector3 m0, n0;                      // a

  Chart(const Vector6& c, const Vector6& a)
      : compliance_m(c.head<3>().cwiseInverse()),
        compliance_n(c.tail<3>().cwiseInverse()),
        m0(a.head<3>()),
        n0(a.tail<3>()) {}

  /// mu = Ad_q^T a at a frame of the path.
  [[nodiscard]] Vector6 wrench(const PathState& y) const;
  /// B, the antisymmetric matrix with B eta = ad_eta^T a.
  [[nodiscard]] Matrix6 bracket() const;

  /// One step of length h of q' = q (kappa; e1 + eps) and of the energy; k[0] becomes the rate at the step's
  /// start.
  void step(PathState& y, double h, Stages<PathState>& k) const;
  /// The same with K' = S (I + B K), S = Ad_q diag(1/c) Ad_q^T.
  void step(JointState& y, double h, Stages<JointState>& k) const;
  [[nodiscard]] PathState rate(const PathState& y) const;
  /// The second derivative of the path (quaternion and position; the energy's is left 0).
  [[nodiscard]] PathState secondRate(const PathState& y, const PathState& dy) const;
  /// The stretch of the tangent, 1 + u4, and its derivative along the rod.
  [[nodiscard]] double stretch(const PathState& y) const;
  [[nodiscard]] double stretchRate(const PathState& y) const;
  /// Whether 1 + u4 can come down to `limit` anywhere: |n| is the same all along the rod.
  [[nodiscard]] bool mayInvert(double limit) const { return 1 - compliance_n.x() * n0.norm() <= limit; }
};

/// A bound, radians over the rod, of the rates at which the rod and its small deflections turn: |m| / c_min,
/// since sum m_i^2 / c_i <= 2 (H + |n|) with H = sum mu_i^2 / 2c_i + mu_4 and |n| constant along it, and (|n|
/// / c_min)^(1/2).
[[nodiscard]] double rateBound(const Vector6& c, const Vector6& a);

/// Steps of the integrator for c and a: 16, or as many more, in eights, as rateBound asks for.
/// Throws InputError for a wrench that is not finite or too large to integrate.
[[nodiscard]] int stepCount(const Vector6& c, const Vector6& a);

}  // namespace tendril::statics
