/// The SE(3) beam element (Sonneville, Cardona, Brüls 2014): strain of the geodesic between two node frames,
/// its energy. The kernels (kernel.h) work on many at once. Private to dynamics; README.md derives it.
#pragma once

#include <cmath>

#include "tendril/base.h"

namespace tendril::beam {

/// A node frame with its rotation matrix, which everything below needs.
struct Node {
  Pose pose;
  Matrix3 rotation;  // = pose.rotation
};

/// psi = log(q_i^-1 q_j) = h (u + e4): the strain of the element times its rest length h, stretch counted
/// from zero.
[[nodiscard]] inline Vector6 relativeLog(const Node& i, const Node& j) {
  return logSE3({i.pose.rotation.conjugate() * j.pose.rotation,
                 i.rotation.transpose() * (j.pose.position - i.pose.position)});
}

/// An element's energy (h/2) sum c_k (u_k - reference_k)^2, with u = psi/h - e4; c already holds the Rayleigh
/// factor.
struct Element {
  double h;           // m
  Vector6 c;          // N m^2, N
  Vector6 reference;  // strain at which the element is at ease

  /// Wrench f = c (u - reference) [N m, N], conjugate to psi: the derivative of the energy by psi.
  [[nodiscard]] Vector6 wrench(const Vector6& psi) const {
    Vector6 u = psi / h;
    u[3] -= 1;
    return c.cwiseProduct(u - reference);
  }
  [[nodiscard]] double energy(const Vector6& wrench_) const {
    return 0.5 * h * wrench_.cwiseProduct(wrench_).cwiseQuotient(c).sum();
  }
};

}  // namespace tendril::beam
