/// Distances of segments to triangles and to segments, written for the checker alone.
///
/// Each result is a pair of points that lie on the two bodies, so `distance` is attained: the true distance
/// is never larger. That it is never much smaller is not relied upon: a proof of clearance (motion.h) rests
/// on a plane, whose side every corner is on can be checked without any distance at all.
#pragma once

#include "tendril/base.h"

namespace tendril::verification {

struct ClosestPair {
  double distance;  // m, |a - b|
  Vector3 a;        // on the first body
  Vector3 b;        // on the second
};

/// Closest points of the segments p0 p1 and q0 q1, parallel and degenerate ones included.
[[nodiscard]] ClosestPair segmentToSegment(const Vector3& p0, const Vector3& p1, const Vector3& q0,
                                           const Vector3& q1);

/// Closest points of the segment p0 p1 and the triangle abc; distance 0 where they cross.
[[nodiscard]] ClosestPair segmentToTriangle(const Vector3& p0, const Vector3& p1, const Vector3& a,
                                            const Vector3& b, const Vector3& c);

}  // namespace tendril::verification
