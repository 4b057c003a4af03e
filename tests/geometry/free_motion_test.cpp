#include <gtest/gtest.h>

#include <functional>

#include "reference.h"

namespace tendril {
namespace {

using namespace reference;

/// One motion, whatever the pair: how far it is free, and the distance at any time.
struct Motion {
  double radius, keep;
  std::function<double(double)> distance;  // at time t
  double free;                             // what the function under test says

  [[nodiscard]] double target() const { return radius + keep * (distance(0) - radius); }
};

struct Sizes {
  double radius, gap, speed;
};

/// Radii, gaps and speeds over all the orders of magnitude that occur.
Sizes anySizes(Random& random) { return {power(random, -3, 0), power(random, -9, 0), power(random, -6, 2)}; }

/// Moves `at` apart from `from` so that they are `distance` apart along the line through them.
Vector3 shift(const Vector3& at, const Vector3& from, double distance) {
  return (at - from).stableNormalized() * distance - (at - from);
}

Motion pointTriangleMotion(Random& random) {
  const Corners t = anyTriangle(random);
  const Sizes size = anySizes(random);
  Vector3 p = pointNear(random, t);
  p += shift(p, closestPointOnTriangle(p, t[0], t[1], t[2]).closest, size.radius + size.gap);
  const Vector3 d = size.speed * vectorIn(random, 1);
  const double keep = random.uniform(0.01, 0.9);
  return {size.radius, keep,
          [=](double time) { return closestPointOnTriangle(p + time * d, t[0], t[1], t[2]).distance; },
          freeMotionPointTriangle(p, d, t[0], t[1], t[2], size.radius, keep)};
}

struct MovingSegment {
  Vector3 p0, p1, d0, d1;
};

/// A segment at the size's distance from where `closest` says it is nearest, each end moving on its own.
MovingSegment movingSegment(Random& random, const Sizes& size,
                            const std::function<std::pair<Vector3, Vector3>(Vector3, Vector3)>& closest) {
  MovingSegment s;
  s.p0 = vectorIn(random, 1), s.p1 = vectorIn(random, 1);
  const auto [on_segment, on_other] = closest(s.p0, s.p1);
  const Vector3 away = shift(on_segment, on_other, size.radius + size.gap);
  s.p0 += away, s.p1 += away;
  s.d0 = size.speed * vectorIn(random, 1);
  s.d1 = random.bits() % 2 == 0 ? s.d0 : Vector3(size.speed * vectorIn(random, 1));
  return s;
}

Motion segmentEdgeMotion(Random& random) {
  const Vector3 a = vectorIn(random, 1), b = random.bits() % 4 == 0 ? a : vectorIn(random, 1);
  const Sizes size = anySizes(random);
  const auto [p0, p1, d0, d1] = movingSegment(random, size, [&](const Vector3& q0, const Vector3& q1) {
    const SegmentSegment r = closestPointsOfSegments(q0, q1, a, b);
    return std::pair<Vector3, Vector3>(q0 + r.s * (q1 - q0), a + r.t * (b - a));
  });
  const double keep = random.uniform(0.01, 0.9);
  return {size.radius, keep,
          [=, p0 = p0, p1 = p1, d0 = d0, d1 = d1](double t) {
            return closestPointsOfSegments(p0 + t * d0, p1 + t * d1, a, b).distance;
          },
          freeMotionSegmentEdge(p0, p1, d0, d1, a, b, size.radius, keep)};
}

Motion segmentTriangleMotion(Random& random) {
  const Corners c = anyTriangle(random);
  const Sizes size = anySizes(random);
  const auto [p0, p1, d0, d1] = movingSegment(random, size, [&](const Vector3& q0, const Vector3& q1) {
    const SegmentTriangle r = closestPointsOfSegmentAndTriangle(q0, q1, c[0], c[1], c[2]);
    return std::pair<Vector3, Vector3>(q0 + r.s * (q1 - q0), r.on_triangle);
  });
  const double keep = random.uniform(0.01, 0.9);
  return {size.radius, keep,
          [=, p0 = p0, p1 = p1, d0 = d0, d1 = d1](double t) {
            return closestPointsOfSegmentAndTriangle(p0 + t * d0, p1 + t * d1, c[0], c[1], c[2]).distance;
          },
          freeMotionSegmentTriangle(p0, p1, d0, d1, c[0], c[1], c[2], size.radius, keep)};
}

Motion segmentSegmentMotion(Random& random) {
  const Vector3 q0 = vectorIn(random, 1), q1 = vectorIn(random, 1);
  const Sizes size = anySizes(random);
  const Vector3 e0 = size.speed * vectorIn(random, 1), e1 = size.speed * vectorIn(random, 1);
  const auto [p0, p1, d0, d1] = movingSegment(random, size, [&](const Vector3& a, const Vector3& b) {
    const SegmentSegment r = closestPointsOfSegments(a, b, q0, q1);
    return std::pair<Vector3, Vector3>(a + r.s * (b - a), q0 + r.t * (q1 - q0));
  });
  const double keep = random.uniform(0.01, 0.9);
  return {size.radius, keep,
          [=, p0 = p0, p1 = p1, d0 = d0, d1 = d1](double t) {
            return closestPointsOfSegments(p0 + t * d0, p1 + t * d1, q0 + t * e0, q1 + t * e1).distance;
          },
          freeMotionSegmentSegment(p0, p1, d0, d1, q0, q1, e0, e1, size.radius, keep)};
}

using MakeMotion = Motion (*)(Random&);
class FreeMotion : public testing::TestWithParam<std::pair<const char*, MakeMotion>> {};
INSTANTIATE_TEST_SUITE_P(Pairs, FreeMotion,
                         testing::Values(std::pair("PointTriangle", &pointTriangleMotion),
                                         std::pair("SegmentEdge", &segmentEdgeMotion),
                                         std::pair("SegmentTriangle", &segmentTriangleMotion),
                                         std::pair("SegmentSegment", &segmentSegmentMotion)),
                         [](const auto& pair) { return pair.param.first; });

TEST_P(FreeMotion, KeepsTheDistanceAtEveryMomentOfWhatItCallsFree) {
  Random random(10);
  for (int i = 0; i < 4000; ++i) {
    const Motion motion = GetParam().second(random);
    if (!(motion.distance(0) > motion.radius)) continue;  // a cap thinner than its rounding
    ASSERT_TRUE(motion.free >= 0 && motion.free <= 1);
    const double target = motion.target();
    for (int k = 0; k <= 64; ++k)
      ASSERT_GE(motion.distance(motion.free * k / 64), target) << i << " at " << k;
    for (const double before_end : {1e-3, 1e-6, 1e-9})
      ASSERT_GE(motion.distance(motion.free * (1 - before_end)), target) << i;
  }
}

TEST_P(FreeMotion, StopsOnlyWhereTheDistanceIsNearlyUsedUp) {
  // The moment the distance first falls to the target, by dense sampling, against what is called free.
  Random random(11);
  int stopped_early = 0, count = 0;
  for (int i = 0; i < 1000; ++i) {
    const Motion motion = GetParam().second(random);
    const double gap = motion.distance(0) - motion.radius;
    if (gap < 1e-8 || motion.free == 1) continue;
    ++count;
    // by what is called free a good part of the gap is gone, or would be a little later
    double least = gap;
    for (int k = 0; k <= 200; ++k) {
      const double time = std::min(1.0, motion.free * (1 + 0.05 * k / 200));
      least = std::min(least, motion.distance(time) - motion.radius);
    }
    if (least > motion.keep * gap + 0.05 * gap) ++stopped_early;
  }
  EXPECT_GT(count, 200);
  // Two bodies that turn together by much more than their gap need many planes, for a plane does not turn
  // with them.
  const bool both_move = GetParam().second == &segmentSegmentMotion;
  EXPECT_LE(stopped_early, both_move ? count / 20 : count / 50);
}

TEST_P(FreeMotion, IsFreeToTheEndWhenNothingMoves) {
  Random random(12);
  const Corners t = anyTriangle(random);
  const Vector3 p(3, 0, 0), q(3, 1, 0), zero = Vector3::Zero();
  EXPECT_EQ(freeMotionPointTriangle(p, zero, t[0], t[1], t[2], 0.1, 0.1), 1);
  EXPECT_EQ(freeMotionSegmentEdge(p, q, zero, zero, t[0], t[1], 0.1, 0.1), 1);
  EXPECT_EQ(freeMotionSegmentTriangle(p, q, zero, zero, t[0], t[1], t[2], 0.1, 0.1), 1);
  EXPECT_EQ(freeMotionSegmentSegment(p, q, zero, zero, t[0], t[1], zero, zero, 0.1, 0.1), 1);
}

const Vector3 kA(-1, -1, 0), kB(1, -1, 0), kC(0, 1, 0);  // a triangle in z = 0

TEST(FreeMotionPointTriangle, HeadOnStopsWhereTheKeptGapBegins) {
  for (const double gap : {1.0, 1e-3, 1e-6, 1e-9})
    for (const double keep : {0.0, 0.1, 0.5}) {
      const double t = freeMotionPointTriangle({0, 0, 0.1 + gap}, {0, 0, -2}, kA, kB, kC, 0.1, keep);
      EXPECT_NEAR(t, (1 - keep) * gap / 2, 1e-13);
      EXPECT_LE(t, (1 - keep) * gap / 2);
    }
}

TEST(FreeMotionPointTriangle, DoesNotTunnelHoweverFast) {
  for (const double speed : {1e1, 1e3, 1e6}) {
    const double t = freeMotionPointTriangle({0, 0, 1}, {0, 0, -speed}, kA, kB, kC, 0.01, 0.1);
    EXPECT_NEAR(t * speed, 0.9 * 0.99, 1e-6);
  }
}

TEST(FreeMotionPointTriangle, SlidingAlongAFaceAtATinyGapIsFree) {
  for (const double gap : {1e-3, 1e-6, 1e-9, 1e-12}) {
    EXPECT_EQ(freeMotionPointTriangle({-0.5, -0.5, 0.1 + gap}, {1, 0, 0}, kA, kB, kC, 0.1, 0.1), 1);
    // up and over the edge, turning about nothing: it leaves the triangle at the same height
    EXPECT_EQ(freeMotionPointTriangle({-0.5, -0.5, 0.1 + gap}, {5, 0, 0}, kA, kB, kC, 0.1, 0.1), 1);
  }
}

TEST(FreeMotionPointTriangle, GrazingPastAVertexOrAnEdgeIsFree) {
  for (const double gap : {1e-2, 1e-3, 1e-5}) {
    EXPECT_GT(freeMotionPointTriangle({-3, 1.1 + gap, 0}, {6, 0, 0}, kA, kB, kC, 0.1, 0.0), 0.499 - gap);
    // passing the vertex C at y = 1, the nearest approach is in the middle of the way: keep a tenth of what
    // is left there
    const double initial = Vector3(-3, 0.1 + gap, 0).norm() - 0.1;
    EXPECT_EQ(freeMotionPointTriangle({-3, 1.1 + gap, 0}, {6, 0, 0}, kA, kB, kC, 0.1, 0.5 * gap / initial),
              1);
    EXPECT_LT(freeMotionPointTriangle({-3, 1.1 + gap, 0}, {6, 0, 0}, kA, kB, kC, 0.1, 2 * gap / initial),
              0.5);
  }
}

TEST(FreeMotionPointTriangle, NoInitialGapIsNoMotion) {
  EXPECT_EQ(freeMotionPointTriangle({0, 0, 0.1}, {0, 0, 1}, kA, kB, kC, 0.1, 0.1), 0);
  EXPECT_EQ(freeMotionPointTriangle({0, 0, 0.05}, {0, 0, 1}, kA, kB, kC, 0.1, 0.1), 0);
  EXPECT_EQ(freeMotionPointTriangle({0, 0, 0}, {0, 0, 1}, kA, kB, kC, 0.1, 0.1), 0);
}

TEST(FreeMotionSegmentEdge, TiltingOnAnEdgeStopsBeforeTheEdgeIsReached) {
  // A segment along x above an edge along y tilts: the end at x = 1 goes down, and with it the whole but for
  // x = -1.
  const double t = freeMotionSegmentEdge({-1, 0, 0.2}, {1, 0, 0.2}, {0, 0, 0}, {0, 0, -1}, {0, -1, 0},
                                         {0, 1, 0}, 0.1, 0.1);
  // distance of the origin to the line z = 0.2 - t/2 (x + 1): |0.2 - t/2| / sqrt(1 + t^2/4) = 0.11
  const double slope = t / 2;
  EXPECT_NEAR((0.2 - slope) / std::sqrt(1 + slope * slope), 0.11, 1e-3);
  EXPECT_GE((0.2 - slope) / std::sqrt(1 + slope * slope), 0.11);
}

TEST(FreeMotionSegmentEdge, ParallelToTheEdgeMeetsItAtOnce) {
  for (const double gap : {1e-1, 1e-9}) {
    const double t = freeMotionSegmentEdge({-1, 0, 0.1 + gap}, {1, 0, 0.1 + gap}, {0, 0, -1}, {0, 0, -1},
                                           {-2, 0, 0}, {2, 0, 0}, 0.1, 0.1);
    EXPECT_NEAR(t, 0.9 * gap, 1e-13);
    EXPECT_EQ(freeMotionSegmentEdge({-1, 0, 0.1 + gap}, {1, 0, 0.1 + gap}, {5, 0, 0}, {5, 0, 0}, {-2, 0, 0},
                                    {2, 0, 0}, 0.1, 0.1),
              1);
  }
}

TEST(FreeMotionSegmentTriangle, SeesTheFaceBetweenTheSegmentsEndsAndTheTrianglesEdges) {
  // The segment's middle passes the triangle's corner region only when it is low enough.
  const double t =
      freeMotionSegmentTriangle({-5, 0, 1}, {5, 0, 1}, {0, 0, -2}, {0, 0, -2}, kA, kB, kC, 0.1, 0.1);
  EXPECT_NEAR(t, 0.9 * 0.9 / 2, 1e-12);
  EXPECT_EQ(freeMotionSegmentTriangle({-0.1, 0, -1}, {0.1, 0, 1}, {0, 0, 1}, {0, 0, 1}, kA, kB, kC, 0.1, 0.1),
            0)
      << "it pierces the triangle from the start";
}

TEST(FreeMotionSegmentSegment, OnlyTheRelativeMotionCounts) {
  Random random(13);
  for (int i = 0; i < 500; ++i) {
    const Vector3 p0 = vectorIn(random, 1), p1 = vectorIn(random, 1), q0 = vectorIn(random, 1),
                  q1 = vectorIn(random, 1);
    const Vector3 d0 = vectorIn(random, 1), d1 = vectorIn(random, 1), both = vectorIn(random, 1);
    const Vector3 zero = Vector3::Zero();
    const double alone = freeMotionSegmentEdge(p0, p1, d0, d1, q0, q1, 0.01, 0.1);
    EXPECT_DOUBLE_EQ(freeMotionSegmentSegment(p0, p1, d0, d1, q0, q1, zero, zero, 0.01, 0.1), alone);
    EXPECT_NEAR(freeMotionSegmentSegment(p0, p1, d0 + both, d1 + both, q0, q1, both, both, 0.01, 0.1), alone,
                1e-9);
    if (closestPointsOfSegments(p0, p1, q0, q1).distance < 0.02) continue;
    EXPECT_EQ(freeMotionSegmentSegment(p0, p1, both, both, q0, q1, both, both, 0.01, 0.1), 1);
  }
}

}  // namespace
}  // namespace tendril
