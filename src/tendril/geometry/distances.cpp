#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tendril/geometry.h"

namespace tendril {
namespace {

/// The parameter in [0, 1] of the point of a + t d that is nearest to a + w; 0 for a segment without length.
double nearestParameter(const Vector3& w, const Vector3& d) {
  const double length2 = d.squaredNorm();
  return length2 > 0 ? std::clamp(w.dot(d) / length2, 0.0, 1.0) : 0.0;
}

/// a + t (b - a), exactly b at t = 1.
Vector3 pointAt(const Vector3& a, const Vector3& b, double t) {
  return t == 1 ? b : Vector3(a + t * (b - a));
}

/// Below this sine of its angle at vertex a, squared, a triangle counts as thin: the projection on its plane
/// is rounded by more than about 100 ulp, and is no longer trusted alone.
constexpr double kThinSine2 = 1e-4;

struct FaceProjection {
  bool inside = false;
  bool thin = true;
  Vector3 point;  // a convex combination of the vertices, whatever the rounding
};

/// Where p projects inside triangle abc. Each weight is computed on its own, so that none comes from a
/// cancellation among the others.
FaceProjection projectOntoFace(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c) {
  const Vector3 ab = b - a, ac = c - a, ap = p - a, bp = p - b;
  const Vector3 n = ab.cross(ac);
  const double weight_c = n.dot(ab.cross(ap));
  const double weight_b = n.dot(ap.cross(ac));
  const double weight_a = n.dot((c - b).cross(bp));
  const double ab2 = ab.squaredNorm(), ac2 = ac.squaredNorm(), n2 = n.squaredNorm();
  FaceProjection result;
  result.inside = weight_a >= 0 && weight_b >= 0 && weight_c >= 0 && n2 > 0;
  result.thin = !(n2 > kThinSine2 * ab2 * ac2);
  if (result.inside) {
    double v = std::min(weight_b / n2, 1.0), w = std::min(weight_c / n2, 1.0);
    if (v + w > 1) (ab2 < ac2 ? v = 1 - w : w = 1 - v);  // rounding: correct it where it moves the point less
    result.point = a + v * ab + w * ac;
  }
  return result;
}

/// The same for a thin triangle, from the vertex opposite to the longest edge, where the angle is best
/// conditioned.
FaceProjection projectOntoThinFace(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c) {
  const double ab2 = (b - a).squaredNorm(), bc2 = (c - b).squaredNorm(), ca2 = (a - c).squaredNorm();
  if (bc2 >= ab2 && bc2 >= ca2) return projectOntoFace(p, a, b, c);
  return ca2 >= ab2 ? projectOntoFace(p, b, c, a) : projectOntoFace(p, c, a, b);
}

}  // namespace

PointSegment closestPointOnSegment(const Vector3& p, const Vector3& a, const Vector3& b) {
  const double t = nearestParameter(p - a, b - a);
  return {(p - pointAt(a, b, t)).norm(), t};
}

PointTriangle closestPointOnTriangle(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c) {
  // Every candidate below is a point of the triangle, so its distance bounds the answer from above whatever
  // the rounding; the smallest wins. A thin triangle's interior is within its height of an edge, so that a
  // bad projection cannot cost more than that.
  FaceProjection face = projectOntoFace(p, a, b, c);
  if (face.inside && !face.thin) return {(p - face.point).norm(), face.point, Feature::face};

  static constexpr Feature kVertex[3] = {Feature::vertex0, Feature::vertex1, Feature::vertex2};
  static constexpr Feature kEdge[3] = {Feature::edge01, Feature::edge12, Feature::edge20};
  const Vector3* const v[3] = {&a, &b, &c};
  PointTriangle best{std::numeric_limits<double>::infinity(), a,
                     Feature::vertex0};  // distance squared until the end
  for (int k = 0; k < 3; ++k) {
    const int next = k == 2 ? 0 : k + 1;
    const double t = nearestParameter(p - *v[k], *v[next] - *v[k]);
    const Vector3 point = pointAt(*v[k], *v[next], t);
    const double distance2 = (p - point).squaredNorm();
    if (distance2 < best.distance)
      best = {distance2, point, t == 0 ? kVertex[k] : t == 1 ? kVertex[next] : kEdge[k]};
  }
  if (face.thin) {
    face = projectOntoThinFace(p, a, b, c);
    if (face.inside && (p - face.point).squaredNorm() < best.distance)
      best = {(p - face.point).squaredNorm(), face.point, Feature::face};
  }
  best.distance = std::sqrt(best.distance);
  return best;
}

SegmentSegment closestPointsOfSegments(const Vector3& p0, const Vector3& p1, const Vector3& q0,
                                       const Vector3& q1) {
  const Vector3 d = p1 - p0, e = q1 - q0, w = q0 - p0, u = d.cross(e);
  // Nearest points of the two lines by cross products: their rounding grows with 1/sin of the angle between
  // the lines, which leaves the distance exact to rounding at every angle. (Ericson's determinant, 1/sin^2,
  // does not.) Parallel lines: any start will do, the two projections below find a nearest pair.
  const double u2 = u.squaredNorm();
  double s = u2 > 0 ? std::clamp(w.cross(e).dot(u) / u2, 0.0, 1.0) : 0.0;
  const double e2 = e.squaredNorm();
  const double t_line = e2 > 0 ? (s * d - w).dot(e) / e2 : 0.0;
  const double t = std::clamp(t_line, 0.0, 1.0);
  if (t != t_line || u2 == 0) s = nearestParameter(pointAt(q0, q1, t) - p0, d);
  return {(pointAt(p0, p1, s) - pointAt(q0, q1, t)).norm(), s, t};
}

SegmentTriangle closestPointsOfSegmentAndTriangle(const Vector3& p0, const Vector3& p1, const Vector3& a,
                                                  const Vector3& b, const Vector3& c) {
  // Apart, the nearest points lie on an end of the segment or on an edge of the triangle.
  const PointTriangle start = closestPointOnTriangle(p0, a, b, c), end = closestPointOnTriangle(p1, a, b, c);
  SegmentTriangle best{start.distance, 0.0, start.closest};
  if (end.distance < best.distance) best = {end.distance, 1.0, end.closest};
  for (const auto& [from, to] : {std::pair{&a, &b}, std::pair{&b, &c}, std::pair{&c, &a}}) {
    const SegmentSegment edge = closestPointsOfSegments(p0, p1, *from, *to);
    if (edge.distance < best.distance) best = {edge.distance, edge.s, pointAt(*from, *to, edge.t)};
  }

  // With its ends on different sides of the plane the segment may pass through the triangle: then the point
  // in the plane is nearest. (A wrong side, which takes a thin triangle, costs no more than the triangle's
  // height.)
  const Vector3 ab = b - a, ac = c - a, n = ab.cross(ac);
  const double side0 = n.dot(p0 - a), side1 = n.dot(p1 - a);
  if ((side0 < 0) != (side1 < 0)) {
    const double s = side0 / (side0 - side1);
    const PointTriangle crossing = closestPointOnTriangle(pointAt(p0, p1, s), a, b, c);
    if (crossing.distance < best.distance) best = {crossing.distance, s, crossing.closest};
  }
  constexpr double kRounding = 16 * std::numeric_limits<double>::epsilon();
  if (best.distance <= kRounding * ((p1 - p0).norm() + ab.norm() + ac.norm())) best.distance = 0;
  return best;
}

}  // namespace tendril
