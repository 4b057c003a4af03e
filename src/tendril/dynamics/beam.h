/// The SE(3) beam element (Sonneville, Cardona, Brüls 2014): strain of the geodesic between two node frames, and the
/// first and second derivatives of its energy. Private to dynamics; README.md derives the formulas.
#pragma once

#include <cmath>

#include "tendril/base.h"

namespace tendril::beam {

/// A node frame with its rotation matrix, which everything below needs.
struct Node {
  Pose pose;
  Matrix3 rotation;  // = pose.rotation
};

/// psi = log(q_i^-1 q_j) = h (u + e4): the strain of the element times its rest length h, stretch counted from zero.
[[nodiscard]] inline Vector6 relativeLog(const Node& i, const Node& j) {
  return logSE3({i.pose.rotation.conjugate() * j.pose.rotation,
                 i.rotation.transpose() * (j.pose.position - i.pose.position)});
}

/// An element's energy (h/2) sum c_k (u_k - reference_k)^2, with u = psi/h - e4; c already holds the Rayleigh factor.
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

/// Gradient and Hessian blocks of one element's energy by the body increments (w, y) of its nodes i and j, where a node
/// moves to (R exp(w), p + R y).
struct ElementDerivatives {
  Vector6 gradient_i, gradient_j;
  Matrix6 hessian_ii, hessian_ij, hessian_jj;
};

/// Gauss-Newton blocks, and with `geometric` the first-order geometric stiffness of the element's wrench.
inline void derivatives(const Element& element, const Vector6& psi, const Vector6& f, bool geometric,
                        ElementDerivatives& out) {
  const Matrix6 a = rightJacobianInverseSE3(psi), b = rightJacobianInverseSE3(-psi);
  out.gradient_j.noalias() = a.transpose() * f;
  out.gradient_i.noalias() = -(b.transpose() * f);
  const Vector6 k = element.c / element.h;
  const Matrix6 ka = k.asDiagonal() * a, kb = k.asDiagonal() * b;
  out.hessian_jj.noalias() = a.transpose() * ka;
  out.hessian_ii.noalias() = b.transpose() * kb;
  out.hessian_ij.noalias() = -(b.transpose() * ka);
  if (geometric) {
    // f . psi'' = f . [eta_j, eta_i] to first order in h: antisymmetric coupling of the two nodes ...
    const Matrix3 m = 0.5 * skew(f.head<3>()), n = 0.5 * skew(f.tail<3>());
    out.hessian_ij.topLeftCorner<3, 3>() += m;
    out.hessian_ij.topRightCorner<3, 3>() += n;
    out.hessian_ij.bottomLeftCorner<3, 3>() += n;
    // ... and, because positions move straight while the frame turns, -g . (w x y) at each node.
    for (auto [gradient, hessian] :
         {std::pair(&out.gradient_i, &out.hessian_ii), std::pair(&out.gradient_j, &out.hessian_jj)}) {
      const Matrix3 g = 0.5 * skew(gradient->tail<3>());
      hessian->topRightCorner<3, 3>() += g;
      hessian->bottomLeftCorner<3, 3>() -= g;
    }
  }
}

}  // namespace tendril::beam
