/// What contact with obstacles and of the rod with itself share: the barrier, and the fading of nearly
/// parallel pairs, the tilting of a segment.
#pragma once

#include <cmath>
#include <vector>

#include "tendril/base.h"
#include "tendril/dynamics/beam.h"
#include "tendril/dynamics/block_tridiagonal.h"

namespace tendril::contact {

/// b(g) = -kappa (g - dhat)^2 ln(g/dhat) for a gap 0 < g < dhat, 0 beyond: C2, infinite at contact.
struct Barrier {
  double dhat = 0;   // m
  double kappa = 0;  // J/m^2

  struct Value {
    double energy, slope, curvature;  // b, b', b''
  };
  [[nodiscard]] Value operator()(double gap) const {
    const double x = gap - dhat, logarithm = std::log(gap / dhat), ratio = x / gap;
    return {-kappa * x * x * logarithm, -kappa * x * (2 * logarithm + ratio),
            -kappa * (2 * logarithm + 4 * ratio - ratio * ratio)};
  }
};

/// Two segments with directions u and v that are nearly parallel: their closest points jump along them, so
/// the pair's weight fades as m = x (2 - x), x = sin^2/kParallel (Li et al. 2020, eq. 24, made scale-free),
/// and their ends, each a smooth distance, take over with 1 - m.
struct Mollifier {
  static constexpr double kParallel = 1e-3;  // squared sine of the angle below which a pair fades

  double weight = 1;               // m; 1 for pairs that are not nearly parallel
  Vector3 by_u = Vector3::Zero();  // dm/du, 1/m
  Vector3 by_v = Vector3::Zero();

  Mollifier(const Vector3& u, const Vector3& v) {
    const double u2 = u.squaredNorm(), v2 = v.squaredNorm(), uv = u.dot(v);
    const double x = std::max(0.0, 1 - uv * uv / (u2 * v2)) / kParallel;
    if (x >= 1) return;
    weight = x * (2 - x);
    const double slope = (2 - 2 * x) / kParallel * -2 * uv / (u2 * v2);
    by_u = slope * (v - uv / u2 * u);
    by_v = slope * (u - uv / v2 * v);
  }
  [[nodiscard]] bool fades() const { return weight < 1; }
};

/// Adds `force` d'' of a distance d between the segment of the nodes i and i + 1, at s of it, and something
/// that stays: b' d'' = |b'| (2 alpha beta + d alpha^2), tilting the segment about the contact, alpha = |e*|
/// n . (v1 - v0), and sliding along it, beta = e*/|e*| . ((1-s) v0 + s v1). Only its positive eigenvalue is
/// kept (README.md, section 6). `dual` is e* [1/m].
inline void addTilt(BlockTridiagonal& system, const std::vector<beam::Node>& nodes, std::size_t i,
                    double force, double distance, double s, const Vector3& normal, const Vector3& dual) {
  const double length = dual.norm(), s0 = 1 - s, s1 = s;
  const double a_norm = length * std::sqrt(2.0), b_norm = std::sqrt(s0 * s0 + s1 * s1);
  const double m = distance * a_norm * a_norm, k = a_norm * b_norm;
  const double eigenvalue = 0.5 * (m + std::sqrt(m * m + 4 * k * k));
  const double norm = std::sqrt(eigenvalue * eigenvalue + k * k);
  const double ca = eigenvalue / norm * std::sqrt(0.5), cb = k / norm / (b_norm * length);
  const Vector3 v0 = -ca * normal + cb * s0 * dual, v1 = ca * normal + cb * s1 * dual;
  addRankOne(system, i, force * eigenvalue, nodes[i].rotation.transpose() * v0,
             nodes[i + 1].rotation.transpose() * v1);
}

}  // namespace tendril::contact
