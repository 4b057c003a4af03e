/// Slow distances in long double, by nested golden-section search over convex functions: nothing in common
/// with the code under test but the definition.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "tendril/geometry.h"

namespace tendril::reference {

using Real = long double;
using V = Eigen::Matrix<Real, 3, 1>;

inline V wide(const Vector3& v) { return v.cast<Real>(); }

/// The least value of a convex function on [0, 1], by golden sections down to 1e-19.
template <class Function>
Real leastValue(const Function& f) {
  static const Real kGolden = (std::sqrt(Real(5)) - 1) / 2;
  Real low = 0, high = 1, left = 1 - kGolden, right = kGolden, at_left = f(left), at_right = f(right);
  for (int i = 0; i < 90; ++i) {
    if (at_left < at_right) {
      high = right, right = left, at_right = at_left;
      left = high - kGolden * (high - low), at_left = f(left);
    } else {
      low = left, left = right, at_left = at_right;
      right = low + kGolden * (high - low), at_right = f(right);
    }
  }
  return std::min({at_left, at_right, f(Real(0)), f(Real(1))});
}

/// Squared distance of p to the segment from a to b: a quadratic in one variable.
inline Real pointSegment2(const V& p, const V& a, const V& b) {
  const V d = b - a;
  const Real length2 = d.dot(d);
  const Real t = length2 > 0 ? std::clamp<Real>((p - a).dot(d) / length2, 0, 1) : 0;
  return (p - a - t * d).squaredNorm();
}

inline Real pointTriangle2(const V& p, const V& a, const V& b, const V& c) {
  // the triangle as the union of the segments parallel to bc
  return leastValue([&](Real x) { return pointSegment2(p, a + x * (b - a), a + x * (c - a)); });
}

inline double pointTriangle(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c) {
  return static_cast<double>(std::sqrt(pointTriangle2(wide(p), wide(a), wide(b), wide(c))));
}

inline double segmentSegment(const Vector3& p0, const Vector3& p1, const Vector3& q0, const Vector3& q1) {
  const V a = wide(p0), b = wide(p1), c = wide(q0), d = wide(q1);
  return static_cast<double>(
      std::sqrt(leastValue([&](Real s) { return pointSegment2(a + s * (b - a), c, d); })));
}

inline double segmentTriangle(const Vector3& p0, const Vector3& p1, const Vector3& a, const Vector3& b,
                              const Vector3& c) {
  const V start = wide(p0), end = wide(p1), va = wide(a), vb = wide(b), vc = wide(c);
  return static_cast<double>(
      std::sqrt(leastValue([&](Real s) { return pointTriangle2(start + s * (end - start), va, vb, vc); })));
}

// ------------------------------------------------------------------------------------------------ random
// shapes

inline Vector3 vectorIn(Random& random, double size) {
  return {random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)};
}

/// 10^x with x uniform in [low, high].
inline double power(Random& random, double low, double high) {
  return std::pow(10., random.uniform(low, high));
}

using Corners = std::array<Vector3, 3>;

/// A triangle about 1 in size, of any shape: even, needle, cap; thin ones down to `thinnest` of their length.
inline Corners anyTriangle(Random& random, double thinnest_exponent = -9) {
  Corners t = {vectorIn(random, 1), vectorIn(random, 1), vectorIn(random, 1)};
  const int kind = static_cast<int>(random.bits() % 4);
  if (kind == 1) t[2] = t[1] + power(random, thinnest_exponent, 0) * vectorIn(random, 1);  // needle
  if (kind == 2) {                                                                         // cap
    const double x = random.uniform();
    t[2] = t[0] + x * (t[1] - t[0]) + power(random, thinnest_exponent, 0) * vectorIn(random, 1);
  }
  std::rotate(t.begin(), t.begin() + static_cast<std::ptrdiff_t>(random.bits() % 3), t.end());
  return t;
}

/// The least height of a triangle.
inline double height(const Corners& t) {
  const double area2 = (wide(t[1]) - wide(t[0])).cross(wide(t[2]) - wide(t[0])).norm();
  return area2 / std::max({(t[1] - t[0]).norm(), (t[2] - t[1]).norm(), (t[0] - t[2]).norm()});
}

/// A point over a random part of the triangle (vertex, edge or face, or 1e-12 beside it), at any height.
inline Vector3 pointNear(Random& random, const Corners& t) {
  double w[3] = {random.uniform(), random.uniform(), random.uniform()};
  for (double& x : w)
    if (random.uniform() < 0.35) x = 0;
  const double sum = std::max(w[0] + w[1] + w[2], 1e-3);
  Vector3 p = (w[0] * t[0] + w[1] * t[1] + w[2] * t[2]) / sum;
  const Vector3 normal = (t[1] - t[0]).cross(t[2] - t[0]).stableNormalized();
  p += random.uniform(-1, 1) * power(random, -9, 1) * normal;
  p += power(random, -13, 0) * vectorIn(random, 1);
  return p;
}

}  // namespace tendril::reference
