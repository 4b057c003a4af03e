/// The SE(3) beam element (Sonneville, Cardona, Brüls 2014): strain of the geodesic between two node frames,
/// and the first and second derivatives of its energy. Private to dynamics; README.md derives the formulas.
#pragma once

#include <algorithm>
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

/// The stiffness of an element of length h [m] of a rod with stiffness c: to its shear force it gives way by
/// the bending that the force makes within it, too; the less, the tauter it is (README.md, section 2).
///   `axial_force` in N; only tension counts.
[[nodiscard]] inline Vector6 elementStiffness(const Vector6& c, double h, double axial_force = 0) {
  const double tension = 1.2 * h * h * std::max(0.0, axial_force);
  Vector6 k = c;
  k[4] = 1 / (1 / c[4] + h * h / (12 * c[2] + tension));
  k[5] = 1 / (1 / c[5] + h * h / (12 * c[1] + tension));
  return k;
}

/// What else the change of strain along an element does, to order h^2, as a change of the strain at which the
/// element is at ease. With U = psi/h the strain changes by u' = c^-1 ad_U^T f along the rod, the mean strain
/// gains h^2/12 ad_U u' (elementStiffness says part of it) and the conjugate wrench h^2/12 ad_u'^T f
/// (README.md, section 2).
///   c is the rod's stiffness, `f` the element's elastic wrench, `psi` as above.
[[nodiscard]] inline Vector6 restStrainShift(const Vector6& c, double h, const Vector6& psi,
                                             const Vector6& f) {
  const auto bracket = [](const Vector6& a, const Vector6& b) {  // ad_a b
    Vector6 x;
    x << a.head<3>().cross(b.head<3>()), a.head<3>().cross(b.tail<3>()) + a.tail<3>().cross(b.head<3>());
    return x;
  };
  const auto dualBracket = [](const Vector6& a, const Vector6& wrench) {  // ad_a^T wrench
    Vector6 x;
    x << wrench.head<3>().cross(a.head<3>()) + wrench.tail<3>().cross(a.tail<3>()),
        wrench.tail<3>().cross(a.head<3>());
    return x;
  };
  // The series in h has no meaning for an element that turns by a radian, or that its force could buckle.
  const double coarseness = psi.head<3>().squaredNorm() + h * h * f.tail<3>().norm() / std::min(c[1], c[2]);
  if (coarseness >= 1) return Vector6::Zero();
  const Vector6 rate = dualBracket(psi / h, f).cwiseQuotient(c), stiffness = elementStiffness(c, h, f[3]);
  return (1 - coarseness * coarseness) * (h / 12 * bracket(psi, rate) + f.cwiseQuotient(c) -
                                          (f + h * h / 12 * dualBracket(rate, f)).cwiseQuotient(stiffness));
}

/// Gradient and Hessian blocks of one element's energy by the body increments (w, y) of its nodes i and j,
/// where a node moves to (R exp(w), p + R y).
struct ElementDerivatives {
  Vector6 gradient_i, gradient_j;
  Matrix6 hessian_ii, hessian_ij, hessian_jj;
};

/// Gauss-Newton blocks, and with `geometric` the first-order geometric stiffness of the element's wrench.
inline void derivatives(const Element& element, const Vector6& psi, const Vector6& f, bool geometric,
                        ElementDerivatives& out) {
  // d psi = A eta_j - B eta_i with A = Jr^-1(psi) = [a 0; q a], B = Jr^-1(-psi) = [b 0; p b]; the blocks are
  // multiplied out.
  const Matrix6 jacobian_j = rightJacobianInverseSE3(psi), jacobian_i = rightJacobianInverseSE3(-psi);
  const Matrix3 a = jacobian_j.topLeftCorner<3, 3>(), q = jacobian_j.bottomLeftCorner<3, 3>();
  const Matrix3 b = jacobian_i.topLeftCorner<3, 3>(), p = jacobian_i.bottomLeftCorner<3, 3>();
  const Vector3 m = f.head<3>(), n = f.tail<3>();
  out.gradient_j << a.transpose() * m + q.transpose() * n, a.transpose() * n;
  out.gradient_i << -(b.transpose() * m + p.transpose() * n), -(b.transpose() * n);
  const Vector3 km = element.c.head<3>() / element.h, kn = element.c.tail<3>() / element.h;
  const Matrix3 ma = km.asDiagonal() * a, na = kn.asDiagonal() * a, nq = kn.asDiagonal() * q;
  const Matrix3 mb = km.asDiagonal() * b, nb = kn.asDiagonal() * b, np = kn.asDiagonal() * p;
  const auto fill = [](Matrix6& h, const Matrix3& ww, const Matrix3& wy, const Matrix3& yw,
                       const Matrix3& yy) {
    h.topLeftCorner<3, 3>() = ww, h.topRightCorner<3, 3>() = wy;
    h.bottomLeftCorner<3, 3>() = yw, h.bottomRightCorner<3, 3>() = yy;
  };
  const Matrix3 qna = q.transpose() * na, pnb = p.transpose() * nb;
  fill(out.hessian_jj, a.transpose() * ma + q.transpose() * nq, qna, qna.transpose(), a.transpose() * na);
  fill(out.hessian_ii, b.transpose() * mb + p.transpose() * np, pnb, pnb.transpose(), b.transpose() * nb);
  fill(out.hessian_ij, -(b.transpose() * ma + p.transpose() * nq), -(p.transpose() * na),
       -(b.transpose() * nq), -(b.transpose() * na));
  if (geometric) {
    // f . psi'' = f . [eta_j, eta_i] to first order in h: antisymmetric coupling of the two nodes ...
    const Matrix3 half_n = 0.5 * skew(n);
    out.hessian_ij.topLeftCorner<3, 3>() += 0.5 * skew(m);
    out.hessian_ij.topRightCorner<3, 3>() += half_n;
    out.hessian_ij.bottomLeftCorner<3, 3>() += half_n;
    // ... and to first order in psi = (k; d) the symmetric S = sym([m^ n^; n^ 0] ad_psi), 1/6 on either node
    // and 1/3 between.
    const Matrix3 ks = skew(psi.head<3>()), ns = skew(n);
    const Matrix3 ww = skew(m) * ks + ns * skew(psi.tail<3>());
    const Matrix3 nk = ns * ks;
    Matrix6 sym = Matrix6::Zero();
    sym.topLeftCorner<3, 3>() = (ww + ww.transpose()) / 12;
    sym.topRightCorner<3, 3>() = sym.bottomLeftCorner<3, 3>() = (nk + nk.transpose()) / 12;
    out.hessian_ii += sym, out.hessian_jj += sym, out.hessian_ij += 2 * sym;
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
