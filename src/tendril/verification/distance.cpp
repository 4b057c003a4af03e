#include "tendril/verification/distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tendril::verification {
namespace {

/// Keeps the nearer of the pairs it is shown.
struct Nearest {
  double squared = std::numeric_limits<double>::infinity();
  Vector3 a = Vector3::Zero(), b = Vector3::Zero();

  void offer(const Vector3& on_a, const Vector3& on_b) {
    const double d2 = (on_a - on_b).squaredNorm();
    if (d2 < squared) squared = d2, a = on_a, b = on_b;
  }
  [[nodiscard]] ClosestPair result() const { return {std::sqrt(squared), a, b}; }
};

/// The point of the segment q0 + [0, 1] d nearest to p; d may be zero.
Vector3 onSegment(const Vector3& p, const Vector3& q0, const Vector3& d) {
  const double d2 = d.squaredNorm();
  return d2 > 0 ? Vector3(q0 + std::clamp(d.dot(p - q0) / d2, 0.0, 1.0) * d) : q0;
}

/// Offers the points where the lines p0 + s d, q0 + t e are nearest, moved into both segments. Whatever
/// rounding does to nearly parallel lines, the points offered lie on the segments.
void offerInterior(const Vector3& p0, const Vector3& d, const Vector3& q0, const Vector3& e,
                   Nearest& nearest) {
  const Vector3 w = p0 - q0;
  const double dd = d.squaredNorm(), de = d.dot(e), ee = e.squaredNorm();
  const double determinant = dd * ee - de * de;
  if (!(determinant > 0)) return;
  const double s = std::clamp((de * e.dot(w) - ee * d.dot(w)) / determinant, 0.0, 1.0);
  const Vector3 on_q = onSegment(p0 + s * d, q0, e);
  nearest.offer(onSegment(on_q, p0, d), on_q);
}

/// Whether p, projected along `normal`, falls inside triangle abc.
bool projectsInside(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c,
                    const Vector3& normal) {
  return normal.dot((b - a).cross(p - a)) >= 0 && normal.dot((c - b).cross(p - b)) >= 0 &&
         normal.dot((a - c).cross(p - c)) >= 0;
}

}  // namespace

ClosestPair segmentToSegment(const Vector3& p0, const Vector3& p1, const Vector3& q0, const Vector3& q1) {
  const Vector3 d = p1 - p0, e = q1 - q0;
  Nearest nearest;
  nearest.offer(p0, onSegment(p0, q0, e));
  nearest.offer(p1, onSegment(p1, q0, e));
  nearest.offer(onSegment(q0, p0, d), q0);
  nearest.offer(onSegment(q1, p0, d), q1);
  offerInterior(p0, d, q0, e, nearest);
  return nearest.result();
}

ClosestPair segmentToTriangle(const Vector3& p0, const Vector3& p1, const Vector3& a, const Vector3& b,
                              const Vector3& c) {
  // Unless they cross, the nearest pair has a point on the triangle's border (an end or an inner point of the
  // segment to an edge, or a point of the segment to a corner), or an end of the segment above the triangle's
  // inside.
  const Vector3 d = p1 - p0, ab = b - a, bc = c - b, ca = a - c;
  Nearest nearest;
  for (const Vector3* p : {&p0, &p1}) {
    nearest.offer(*p, onSegment(*p, a, ab));
    nearest.offer(*p, onSegment(*p, b, bc));
    nearest.offer(*p, onSegment(*p, c, ca));
  }
  for (const Vector3* corner : {&a, &b, &c}) nearest.offer(onSegment(*corner, p0, d), *corner);
  offerInterior(p0, d, a, ab, nearest);
  offerInterior(p0, d, b, bc, nearest);
  offerInterior(p0, d, c, ca, nearest);

  const Vector3 normal = ab.cross(c - a);
  const double n2 = normal.squaredNorm();
  if (!(n2 > 0)) return nearest.result();
  const double h0 = normal.dot(p0 - a), h1 = normal.dot(p1 - a);  // heights above the plane, times |normal|
  if (projectsInside(p0, a, b, c, normal)) nearest.offer(p0, p0 - h0 / n2 * normal);
  if (projectsInside(p1, a, b, c, normal)) nearest.offer(p1, p1 - h1 / n2 * normal);
  if ((h0 < 0) != (h1 < 0)) {
    const Vector3 crossing = p0 + h0 / (h0 - h1) * d;
    if (projectsInside(crossing, a, b, c, normal)) nearest.offer(crossing, crossing);
  }
  return nearest.result();
}

}  // namespace tendril::verification
