#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tendril/geometry.h"

namespace tendril {
namespace {

/// The corners of a convex body (a point, a segment, a triangle) and their motions over the whole step.
template <std::size_t N>
struct Body {
  std::array<Vector3, N> corners;
  std::array<Vector3, N> motions;

  [[nodiscard]] std::array<Vector3, N> at(double t) const {
    std::array<Vector3, N> result;
    for (std::size_t i = 0; i < N; ++i) result[i] = corners[i] + t * motions[i];
    return result;
  }
  [[nodiscard]] double largestCoordinate() const {
    double largest = 0;
    for (std::size_t i = 0; i < N; ++i)
      largest = std::max({largest, corners[i].cwiseAbs().maxCoeff(), motions[i].cwiseAbs().maxCoeff()});
    return largest;
  }
};

template <std::size_t N>
Body<N> atRest(const std::array<Vector3, N>& corners) {
  Body<N> body{corners, {}};
  body.motions.fill(Vector3::Zero());
  return body;
}

/// Conservative advancement (Mirtich 1996) with the separating plane at the closest points.
///
/// At time t let n be the unit vector between the closest points, from Q to P. For corners p_i of P and q_j
/// of Q the number n . (p_i - q_j), linear in time, bounds the distance from below: every point of either
/// body is a convex combination of its corners. So the motion is safe while all these numbers stay above the
/// target, which takes no more than a division each, and holds whatever error is in n. If the plane that is
/// reached then gives no more time, or too little to be worth another, what has been proven is returned.
///
/// Rounding: let u = eps/2, and X be the sum of the largest coordinates of P and of Q, motions included, so
/// that coordinates of p_i - q_j are at most 2X at any time and those of their motions at most X. In units of
/// sqrt(3) uX, a slack is off by at most 5 + 6 + 2 (corners and their differences, products, the difference
/// from the target), an approach by 4 over the whole time, the step, its product and the two sums of times
/// cost 2 + 1 + 1 + 1. The target is at most the initial distance, hence at most sqrt(3) X, and is off by 3;
/// that |n| <= 1 + 10u, which is tested, costs 10. That makes 35 units or 61 uX; whoever rounds p + t d moves
/// corners by another 6 uX. The margin is 64 eps X = 128 uX. Where something underflows it is off by less
/// than the smallest normal number or X times that; below kLargest no square overflows. Comparisons are
/// written so that a NaN proves nothing.
///
/// `between(p, q)` returns the vector from the closest point of Q to that of P, for the corners p, q.
template <std::size_t NP, std::size_t NQ, class Between>
double freeMotion(const Body<NP>& p, const Body<NQ>& q, double radius, KeptGap keep, const Between& between) {
  constexpr int kPlanes = 64;
  constexpr double kWorthwhile = 1e-4;  // stop when a plane adds less than this fraction of the time so far
  constexpr double kLargest = 1e150;    // coordinates whose squares could overflow
  constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

  Vector3 apart = between(p.corners, q.corners);
  double distance = apart.norm();
  const double gap = distance - radius;
  const double size = p.largestCoordinate() + q.largestCoordinate();
  if (!(gap > 0 && size < kLargest)) return 0;
  const double rounding = 64 * kEpsilon * size + std::numeric_limits<double>::min();
  const double target = radius + keep.of(gap) + rounding;

  double t = 0;
  std::array<Vector3, NP> at_p = p.corners;
  std::array<Vector3, NQ> at_q = q.corners;
  for (int plane = 0; plane < kPlanes; ++plane) {
    const Vector3 n = apart / distance;
    if (!(n.squaredNorm() <= 1 + 8 * kEpsilon)) return t;  // the squares underflowed
    double step = 1 - t;
    bool to_the_end = true;
    for (std::size_t i = 0; i < NP; ++i)
      for (std::size_t j = 0; j < NQ; ++j) {
        const double slack = n.dot(at_p[i] - at_q[j]) - target;
        const double approach = -n.dot(p.motions[i] - q.motions[j]);
        if (!(slack >= 0)) return t;
        if (!(approach * step <= slack)) {
          step = slack / approach, to_the_end = false;
          if (!(step >= 0)) return t;
        }
      }
    if (to_the_end) return 1;
    t += step;
    if (step <= kWorthwhile * t) return t;
    at_p = p.at(t), at_q = q.at(t);
    apart = between(at_p, at_q);
    distance = apart.norm();
    if (!(distance > 0)) return t;
  }
  return t;
}

Vector3 pointFromTriangle(const Vector3& p, const std::array<Vector3, 3>& q) {
  return p - closestPointOnTriangle(p, q[0], q[1], q[2]).closest;
}

Vector3 segmentFromSegment(const std::array<Vector3, 2>& p, const std::array<Vector3, 2>& q) {
  const SegmentSegment pair = closestPointsOfSegments(p[0], p[1], q[0], q[1]);
  return (p[0] - q[0]) + pair.s * (p[1] - p[0]) - pair.t * (q[1] - q[0]);
}

Vector3 segmentFromTriangle(const std::array<Vector3, 2>& p, const std::array<Vector3, 3>& q) {
  const SegmentTriangle pair = closestPointsOfSegmentAndTriangle(p[0], p[1], q[0], q[1], q[2]);
  if (pair.distance == 0) return Vector3::Zero();
  return (p[0] - pair.on_triangle) + pair.s * (p[1] - p[0]);
}

}  // namespace

double freeMotionPointTriangle(const Vector3& p, const Vector3& d, const Vector3& a, const Vector3& b,
                               const Vector3& c, double radius, KeptGap keep) {
  return freeMotion(Body<1>{{p}, {d}}, atRest<3>({a, b, c}), radius, keep,
                    [](const auto& at_p, const auto& at_q) { return pointFromTriangle(at_p[0], at_q); });
}

double freeMotionSegmentEdge(const Vector3& p0, const Vector3& p1, const Vector3& d0, const Vector3& d1,
                             const Vector3& a, const Vector3& b, double radius, KeptGap keep) {
  return freeMotion(Body<2>{{p0, p1}, {d0, d1}}, atRest<2>({a, b}), radius, keep, segmentFromSegment);
}

double freeMotionSegmentTriangle(const Vector3& p0, const Vector3& p1, const Vector3& d0, const Vector3& d1,
                                 const Vector3& a, const Vector3& b, const Vector3& c, double radius,
                                 KeptGap keep) {
  return freeMotion(Body<2>{{p0, p1}, {d0, d1}}, atRest<3>({a, b, c}), radius, keep, segmentFromTriangle);
}

double freeMotionSegmentSegment(const Vector3& p0, const Vector3& p1, const Vector3& dp0, const Vector3& dp1,
                                const Vector3& q0, const Vector3& q1, const Vector3& dq0, const Vector3& dq1,
                                double radius, KeptGap keep) {
  return freeMotion(Body<2>{{p0, p1}, {dp0, dp1}}, Body<2>{{q0, q1}, {dq0, dq1}}, radius, keep,
                    segmentFromSegment);
}

}  // namespace tendril
