#include <gtest/gtest.h>

#include "reference.h"

namespace tendril {
namespace {

using namespace reference;

TEST(PointTriangle, DistanceEqualsASlowSearchInEveryRegion) {
  Random random(1);
  for (int i = 0; i < 5000; ++i) {
    const Corners t = {vectorIn(random, 1), vectorIn(random, 1), vectorIn(random, 1)};
    if (height(t) < 0.01) continue;
    const Vector3 p = pointNear(random, t);
    const double expected = pointTriangle(p, t[0], t[1], t[2]);
    EXPECT_NEAR(closestPointOnTriangle(p, t[0], t[1], t[2]).distance, expected, 2e-14 * (1 + expected)) << i;
  }
}

TEST(PointTriangle, DistanceToAThinTriangleIsWithinWhatItsHeightAllows) {
  // Nearest edge and nearest interior point are at most the height h apart, so that they differ by h^2 / 2D.
  Random random(2);
  for (int i = 0; i < 8000; ++i) {
    const Corners t = anyTriangle(random);
    const Vector3 p = pointNear(random, t);
    const double expected = pointTriangle(p, t[0], t[1], t[2]), h = height(t);
    const double allowed = h > 1e-4 ? 0 : std::min(h, h * h / (2 * expected));
    const double rounding = 2e-14 * (1 + expected) * std::max(1., std::min(1e-2 / h, 1e2));
    const double found = closestPointOnTriangle(p, t[0], t[1], t[2]).distance;
    EXPECT_LE(found, expected + allowed + rounding) << i << " height " << h;
    EXPECT_GE(found, expected - 2e-15 * (1 + expected))
        << i << ": no point of a triangle is nearer than the nearest";
  }
}

TEST(PointTriangle, ClosestPointLiesAtTheDistanceAndInsideTheTriangle) {
  Random random(3);
  for (int i = 0; i < 4000; ++i) {
    const Corners t = anyTriangle(random);
    const Vector3 p = pointNear(random, t);
    const PointTriangle r = closestPointOnTriangle(p, t[0], t[1], t[2]);
    EXPECT_NEAR((p - r.closest).norm(), r.distance, 1e-15 * (1 + r.distance));
    EXPECT_LT(pointTriangle(r.closest, t[0], t[1], t[2]), 1e-15);
  }
}

TEST(PointTriangle, NamesTheFeatureOfEachRegion) {
  const Vector3 a(0, 0, 0), b(4, 0, 0), c(0, 3, 0);
  const auto feature = [&](double x, double y) {
    return closestPointOnTriangle(Vector3(x, y, 0.5), a, b, c).feature;
  };
  EXPECT_EQ(feature(-1, -1), Feature::vertex0);
  EXPECT_EQ(feature(6, -1), Feature::vertex1);
  EXPECT_EQ(feature(-1, 6), Feature::vertex2);
  EXPECT_EQ(feature(2, -1), Feature::edge01);
  EXPECT_EQ(feature(3, 3), Feature::edge12);
  EXPECT_EQ(feature(-1, 1), Feature::edge20);
  EXPECT_EQ(feature(1, 1), Feature::face);
}

TEST(PointTriangle, TrianglesWithoutAreaAreSegmentsAndPoints) {
  Random random(4);
  for (int i = 0; i < 2000; ++i) {
    const Vector3 a = vectorIn(random, 1), b = vectorIn(random, 1), p = vectorIn(random, 2);
    const double segment = closestPointOnSegment(p, a, b).distance;
    EXPECT_NEAR(closestPointOnTriangle(p, a, b, b).distance, segment, 1e-14);
    EXPECT_NEAR(closestPointOnTriangle(p, a, a, b).distance, segment, 1e-14);
    EXPECT_NEAR(closestPointOnTriangle(p, a, b, 0.5 * (a + b)).distance, segment, 1e-14);
    EXPECT_DOUBLE_EQ(closestPointOnTriangle(p, a, a, a).distance, (p - a).norm());
  }
}

TEST(PointSegment, DistanceAndParameterFitTogether) {
  Random random(5);
  for (int i = 0; i < 5000; ++i) {
    const Vector3 a = vectorIn(random, 1), b = a + power(random, -9, 0) * vectorIn(random, 1);
    const Vector3 p = a + power(random, -9, 1) * vectorIn(random, 1);
    const PointSegment r = closestPointOnSegment(p, a, b);
    EXPECT_NEAR(r.distance, std::sqrt(static_cast<double>(pointSegment2(wide(p), wide(a), wide(b)))),
                1e-15 * (1 + r.distance));
    EXPECT_NEAR((p - (a + r.t * (b - a))).norm(), r.distance, 1e-15 * (1 + r.distance));
    EXPECT_TRUE(r.t >= 0 && r.t <= 1);
  }
  EXPECT_DOUBLE_EQ(closestPointOnSegment({3, 4, 0}, {0, 0, 0}, {0, 0, 0}).distance, 5);
}

/// Two segments: skew, nearly parallel down to an angle of 1e-16, parallel, collinear, crossing, without
/// length.
std::array<Vector3, 4> anySegments(Random& random) {
  const Vector3 p0 = vectorIn(random, 1), p1 = vectorIn(random, 1);
  Vector3 q0 = vectorIn(random, 1), q1 = vectorIn(random, 1);
  switch (random.bits() % 6) {
    case 0:
      break;
    case 1:
      q1 = q0 + random.uniform(-2, 2) * (p1 - p0) + power(random, -16, -1) * vectorIn(random, 1);
      break;
    case 2:
      q1 = q0 + random.uniform(-2, 2) * (p1 - p0);
      break;
    case 3:
      q0 = p0 + random.uniform(-2, 2) * (p1 - p0) + power(random, -16, 0) * vectorIn(random, 1);
      q1 = p0 + random.uniform(-2, 2) * (p1 - p0) + power(random, -16, 0) * vectorIn(random, 1);
      break;
    case 4: {
      const Vector3 crossing = p0 + random.uniform() * (p1 - p0);
      q1 = crossing + random.uniform() * (crossing - q0) + power(random, -16, 0) * vectorIn(random, 1);
      break;
    }
    default:
      q1 = q0 + (random.bits() % 2 == 0 ? 0 : power(random, -16, -3)) * vectorIn(random, 1);
  }
  return {p0, p1, q0, q1};
}

TEST(SegmentSegment, DistanceEqualsASlowSearchDownToParallelAndDegenerate) {
  Random random(6);
  for (int i = 0; i < 15000; ++i) {
    const auto [p0, p1, q0, q1] = anySegments(random);
    const SegmentSegment r = closestPointsOfSegments(p0, p1, q0, q1);
    EXPECT_NEAR(r.distance, segmentSegment(p0, p1, q0, q1), 4e-15) << i;
    EXPECT_TRUE(r.s >= 0 && r.s <= 1 && r.t >= 0 && r.t <= 1);
    EXPECT_NEAR((p0 + r.s * (p1 - p0) - q0 - r.t * (q1 - q0)).norm(), r.distance, 2e-15);
  }
}

TEST(SegmentSegment, IsSymmetricUpToRounding) {
  Random random(7);
  for (int i = 0; i < 10000; ++i) {
    const auto [p0, p1, q0, q1] = anySegments(random);
    const double distance = closestPointsOfSegments(p0, p1, q0, q1).distance;
    EXPECT_NEAR(closestPointsOfSegments(q0, q1, p0, p1).distance, distance, 4e-15);
    EXPECT_NEAR(closestPointsOfSegments(p1, p0, q0, q1).distance, distance, 4e-15);
  }
}

TEST(SegmentTriangle, DistanceEqualsASlowSearch) {
  Random random(8);
  int crossing = 0;
  for (int i = 0; i < 300; ++i) {
    const Corners t = {vectorIn(random, 1), vectorIn(random, 1), vectorIn(random, 1)};
    if (height(t) < 0.01) continue;
    const Vector3 p0 = pointNear(random, t), p1 = pointNear(random, t);
    const SegmentTriangle r = closestPointsOfSegmentAndTriangle(p0, p1, t[0], t[1], t[2]);
    EXPECT_NEAR(r.distance, segmentTriangle(p0, p1, t[0], t[1], t[2]), 1e-13) << i;
    EXPECT_NEAR((p0 + r.s * (p1 - p0) - r.on_triangle).norm(), r.distance, 1e-13);
    crossing += r.distance == 0 ? 1 : 0;
  }
  EXPECT_GT(crossing, 25);
}

TEST(SegmentTriangle, DistanceToAThinTriangleIsWithinItsHeight) {
  Random random(9);
  for (int i = 0; i < 300; ++i) {
    const Corners t = anyTriangle(random);
    const Vector3 p0 = pointNear(random, t), p1 = pointNear(random, t);
    const double found = closestPointsOfSegmentAndTriangle(p0, p1, t[0], t[1], t[2]).distance;
    const double h = height(t);
    EXPECT_NEAR(found, segmentTriangle(p0, p1, t[0], t[1], t[2]), 1e-12 + (h < 1e-4 ? h : 0))
        << i << " height " << h;
  }
}

TEST(SegmentTriangle, PassingThroughIsZeroAndJustBesideIsNot) {
  const Vector3 a(0, 0, 0), b(1, 0, 0), c(0, 1, 0);
  const auto distance = [&](const Vector3& p0, const Vector3& p1) {
    return closestPointsOfSegmentAndTriangle(p0, p1, a, b, c).distance;
  };
  EXPECT_EQ(distance({0.2, 0.2, -1}, {0.3, 0.3, 1}), 0);
  EXPECT_EQ(distance({0.2, 0.2, -1}, {0.2, 0.2, 0}), 0) << "ends on the face";
  EXPECT_NEAR(distance({0.2, 0.2, 1e-9}, {0.3, 0.3, 1}), 1e-9, 1e-20);
  EXPECT_NEAR(distance({-1e-9, 0.2, -1}, {-1e-9, 0.2, 1}), 1e-9, 1e-20);
  EXPECT_EQ(distance({-1, 0.2, 0}, {1, 0.2, 0}), 0) << "in the triangle's plane, across it";
  EXPECT_NEAR(distance({-1, 0.2, 0.25}, {1, 0.2, 0.25}), 0.25, 1e-15) << "parallel above it";
  EXPECT_EQ(distance({0.2, 0.2, 0}, {0.2, 0.2, 0}), 0) << "a point on it";
}

}  // namespace
}  // namespace tendril
