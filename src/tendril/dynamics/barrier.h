/// What contact with obstacles and of the rod with itself share: the barrier, and the fading of nearly
/// parallel pairs.
#pragma once

#include <cmath>

#include "tendril/base.h"

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

}  // namespace tendril::contact
