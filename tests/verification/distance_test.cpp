#include "tendril/verification/distance.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tendril/verification/motion.h"

namespace tendril::verification {
namespace {

Vector3 randomPoint(Random& random) {
  return {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
}

/// The smallest of samples x grid distances over the segment and the triangle: never below the true distance,
/// and above it by at most the spacing.
double sampledDistance(const Vector3& p0, const Vector3& p1, const Vector3& a, const Vector3& b,
                       const Vector3& c, int grid) {
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k <= grid; ++k) {
    const Vector3 p = p0 + static_cast<double>(k) / grid * (p1 - p0);
    for (int i = 0; i <= grid; ++i)
      for (int j = 0; i + j <= grid; ++j)
        least = std::min(
            least, (p - a - static_cast<double>(i) / grid * (b - a) - static_cast<double>(j) / grid * (c - a))
                       .squaredNorm());
  }
  return std::sqrt(least);
}

bool onSegment(const Vector3& x, const Vector3& p0, const Vector3& p1) {
  return std::abs((x - p0).norm() + (x - p1).norm() - (p1 - p0).norm()) < 1e-12;
}

bool onTriangle(const Vector3& x, const Vector3& a, const Vector3& b, const Vector3& c) {
  const auto area = [](const Vector3& u, const Vector3& v, const Vector3& w) {
    return (v - u).cross(w - u).norm();
  };
  return std::abs(area(x, a, b) + area(x, b, c) + area(x, c, a) - area(a, b, c)) < 1e-12;
}

TEST(VerificationDistance, SegmentToTriangleIsTheSmallestOfAllSampledDistances) {
  Random random(1);
  for (int trial = 0; trial < 300; ++trial) {
    const double size =
        trial % 3 == 0 ? 0.1 : 1.0;  // short segments meet faces, long ones edges and crossings
    const Vector3 p0 = randomPoint(random), p1 = p0 + size * randomPoint(random);
    const Vector3 a = randomPoint(random), b = randomPoint(random), c = randomPoint(random);
    const ClosestPair pair = segmentToTriangle(p0, p1, a, b, c);
    EXPECT_TRUE(onSegment(pair.a, p0, p1));
    EXPECT_TRUE(onTriangle(pair.b, a, b, c));
    EXPECT_NEAR((pair.a - pair.b).norm(), pair.distance, 1e-14);
    constexpr int kGrid = 24;
    const double sampled = sampledDistance(p0, p1, a, b, c, kGrid);
    const double spacing = ((p1 - p0).norm() + (b - a).norm() + (c - a).norm()) / kGrid;
    EXPECT_LE(pair.distance, sampled + 1e-12);
    EXPECT_GE(pair.distance, sampled - spacing);
  }
}

TEST(VerificationDistance, ThePlaneThroughTheClosestPointsSeparatesTheBodiesByTheirDistance) {
  // For convex bodies this is the same as being closest: an exact test, to rounding.
  Random random(2);
  for (int trial = 0; trial < 20000; ++trial) {
    const Vector3 p0 = randomPoint(random), p1 = randomPoint(random);
    const Vector3 a = randomPoint(random), b = randomPoint(random), c = randomPoint(random);
    const ClosestPair to_triangle = segmentToTriangle(p0, p1, a, b, c),
                      to_segment = segmentToSegment(p0, p1, a, b);
    for (const auto& [pair, corners] :
         {std::pair(to_triangle, std::vector{a, b, c}), std::pair(to_segment, std::vector{a, b})}) {
      if (pair.distance < 1e-6) continue;
      const Vector3 n = (pair.a - pair.b) / pair.distance;
      double least = std::min(n.dot(p0), n.dot(p1)), most = -10;
      for (const Vector3& corner : corners) most = std::max(most, n.dot(corner));
      EXPECT_NEAR(least - most, pair.distance, 1e-9);
    }
  }
}

TEST(VerificationDistance, ASegmentThatCrossesATriangleIsAtDistanceZeroAndOneThatPassesBesideItIsNot) {
  const Vector3 a(0, 0, 0), b(1, 0, 0), c(0, 1, 0);
  EXPECT_EQ(segmentToTriangle({0.2, 0.2, -1}, {0.2, 0.2, 1}, a, b, c).distance, 0);
  EXPECT_NEAR(segmentToTriangle({0.8, 0.8, -1}, {0.8, 0.8, 1}, a, b, c).distance, 0.6 / std::sqrt(2.0),
              1e-15);
  EXPECT_EQ(segmentToTriangle({-1, 0.5, 0}, {1, 0.5, 0}, a, b, c).distance, 0);  // in its plane
  EXPECT_NEAR(segmentToTriangle({0.1, 0.1, 0.3}, {0.4, 0.4, 0.3}, a, b, c).distance, 0.3, 1e-15);
  EXPECT_NEAR(segmentToTriangle({0.2, 0.2, 0.1}, {0.2, 0.2, 5}, a, b, c).distance, 0.1, 1e-15);
}

TEST(VerificationDistance, DegenerateAndParallelSegmentsAndSliversHaveDistancesToo) {
  const Vector3 x(1, 0, 0), y(0, 1, 0), zero = Vector3::Zero();
  EXPECT_NEAR(segmentToSegment(zero, zero, x, x).distance, 1, 1e-15);
  EXPECT_NEAR(segmentToSegment(zero, zero, x - y, x + y).distance, 1, 1e-15);
  EXPECT_NEAR(segmentToSegment(zero, x, y, x + y).distance, 1, 1e-15);
  EXPECT_NEAR(segmentToSegment(zero, x, 3 * x, 2 * x).distance, 1, 1e-15);
  EXPECT_NEAR(segmentToSegment(-x, x, Vector3(0, -1e-9, 1), Vector3(1e-7, 1e-9, 1)).distance, 1, 1e-15);
  // nearly parallel lines that cross in the middle of both: where is known to 2^-53 / angle^2 of the length
  EXPECT_LT(segmentToSegment(-x - 1e-6 * y, x + 1e-6 * y, -x + 1e-6 * y, x - 1e-6 * y).distance, 1e-9);
  // a triangle whose corners are in line, and one that is a point
  EXPECT_NEAR(segmentToTriangle(y, y + x, zero, x, 2 * x).distance, 1, 1e-15);
  EXPECT_NEAR(segmentToTriangle(y, y + x, zero, zero, zero).distance, 1, 1e-15);
  EXPECT_NEAR(segmentToTriangle({0.5, -1, 0.25}, {0.5, 1, 0.25}, zero, x, x + 1e-13 * y).distance, 0.25,
              1e-12);
}

// ---------------------------------------------------------------------------------------------- motion

PairMotion randomMotion(Random& random, int corners) {
  PairMotion pair;
  const Vector3 away = 0.6 * randomPoint(random);
  for (std::size_t i = 0; i < 2; ++i) {
    pair.rod_t0[i] = away + 0.3 * randomPoint(random);
    pair.rod_t1[i] = pair.rod_t0[i] + 0.6 * randomPoint(random);
  }
  for (std::size_t j = 0; j < 3; ++j) {
    pair.other_t0[j] = (corners == 3 ? 1.0 : 0.3) * randomPoint(random);
    pair.other_t1[j] = pair.other_t0[j];
    if (corners == 2) pair.other_t1[j] += 0.5 * randomPoint(random);
  }
  pair.corners = corners;
  return pair;
}

TEST(VerificationMotion, WhatIsProvedHoldsAtEverySampleAndWhatIsViolatedIsViolated) {
  Random random(3);
  int proved = 0, violated = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const PairMotion pair = randomMotion(random, 2 + trial % 2);
    const double radius = 0.02;
    DistanceToProve goal(radius, 1);
    const Proof proof = prove(pair, goal, [](double, double) {});
    double sampled = std::numeric_limits<double>::infinity();
    for (int k = 0; k <= 200; ++k) sampled = std::min(sampled, pair.closestAt(k / 200.0).distance);
    switch (proof.status) {
      case Proof::Status::proved:
        ++proved;
        EXPECT_GE(sampled, goal.value() - 1e-12);
        EXPECT_GE(sampled, goal.required());
        if (goal.isMeasured()) {  // and the bound is no more than 5 % of the gap below what is attained
          EXPECT_LE(goal.gap(), goal.measuredGap());
          EXPECT_GE(goal.gap(), 0.95 * goal.measuredGap() - 1e-8);
        } else {
          EXPECT_EQ(goal.gap(), 0.1);
        }
        break;
      case Proof::Status::violated:
        ++violated;
        EXPECT_LT(proof.distance, goal.required());
        EXPECT_EQ(pair.closestAt(proof.t).distance, proof.distance);
        EXPECT_LE(deepest(pair, proof).distance, sampled + 5e-3);
        break;
      case Proof::Status::undecided:
        ADD_FAILURE() << "trial " << trial << " at t = " << proof.t;
    }
  }
  EXPECT_GT(proved, 500);
  EXPECT_GT(violated, 300);
}

/// An element that turns about a ball's width above an edge: nearest in the middle of the step, by `lift` -
/// radius.
PairMotion dipOverAnEdge(double lift) {
  PairMotion pair;
  pair.rod_t0 = {Vector3(-0.5, 0, lift + 0.3), Vector3(0.5, 0, lift - 0.3)};
  pair.rod_t1 = {Vector3(-0.5, 0, lift - 0.3), Vector3(0.5, 0, lift + 0.3)};
  pair.other_t0 = pair.other_t1 = {Vector3(0, -1, 0), Vector3(0, 1, 0), Vector3(0, 0, -1)};
  pair.corners = 3;
  return pair;
}

TEST(VerificationMotion, TheRequirementIsHeldToItsToleranceOfAHundredMillionthOfTheLength) {
  // The element's height above the edge is `lift` throughout, its distance lift cos(angle): largest in the
  // middle.
  const double radius = 0.01, nearest_at_ends = 1 / std::sqrt(1 + 0.36);
  const auto verdict = [&](double distance) {
    DistanceToProve goal(radius, 1);
    return prove(dipOverAnEdge(distance / nearest_at_ends), goal, [](double, double) {}).status;
  };
  EXPECT_EQ(verdict(radius + 1e-3), Proof::Status::proved);
  EXPECT_EQ(verdict(radius), Proof::Status::proved);
  EXPECT_EQ(verdict(radius - 0.9e-8), Proof::Status::proved);
  EXPECT_NE(verdict(radius - 1.1e-8), Proof::Status::proved);
  EXPECT_NE(verdict(radius - 1e-6), Proof::Status::proved);
}

TEST(VerificationMotion, ASwingThatGrazesACornerForAnInstantIsProvedWithFewEvaluationsOrFound) {
  // A point-like element passes a corner; its distance to it falls to `gap` + radius at one moment only.
  const double radius = 0.01;
  for (const double gap : {1e-3, 1e-5, 1e-7, 1e-9, -2e-8, -1e-6}) {
    PairMotion pair;
    pair.rod_t0 = {Vector3(-0.31, 0, radius + gap), Vector3(-0.31, 0.02, radius + gap)};
    pair.rod_t1 = {Vector3(0.17, 0, radius + gap), Vector3(0.17, 0.02, radius + gap)};
    pair.other_t0 = pair.other_t1 = {Vector3(0, 0.01, 0), Vector3(0.1, 0.3, -0.5), Vector3(-0.1, 0.2, -0.5)};
    pair.corners = 3;
    DistanceToProve goal(radius, 1);
    const Proof proof = prove(pair, goal, [](double, double) {});
    EXPECT_EQ(proof.status == Proof::Status::proved, gap > -1e-8) << gap;
    if (gap > 0) {
      EXPECT_LE(goal.gap(), gap);
      EXPECT_GE(goal.gap(), 0.95 * gap - 1.001e-8);
    }
  }
}

TEST(VerificationMotion, AProofIsTheSameAnywhereInSpace) {
  Random random(8);
  const double grid = std::ldexp(1, -30);  // coordinates that survive the shift without rounding
  const Vector3 shift = std::ldexp(1, 20) * Vector3(1, -3, 0.5);
  const auto place = [&](Vector3& near, Vector3& far) {
    near = grid * (near / grid).array().round().matrix();
    far = near + shift;
  };
  for (int trial = 0; trial < 2000; ++trial) {
    PairMotion here = randomMotion(random, 2 + trial % 2), there = here;
    for (auto corners : {&PairMotion::other_t0, &PairMotion::other_t1})
      for (std::size_t j = 0; j < 3; ++j) place((here.*corners)[j], (there.*corners)[j]);
    for (auto ends : {&PairMotion::rod_t0, &PairMotion::rod_t1})
      for (std::size_t i = 0; i < 2; ++i) place((here.*ends)[i], (there.*ends)[i]);
    DistanceToProve goal_here(0.02, 1), goal_there(0.02, 1);
    const Proof proof_here = prove(here, goal_here, [](double, double) {});
    const Proof proof_there = prove(there, goal_there, [](double, double) {});
    EXPECT_EQ(proof_here.status, proof_there.status);
    EXPECT_EQ(proof_here.distance, proof_there.distance);
    EXPECT_EQ(goal_here.gap(), goal_there.gap());
  }
}

TEST(VerificationMotion, AnElementOverAnEdgeHundredsOfKilometresAwayIsProvedNotLeftUndecided) {
  // A motion of a simulated rod: nearest to the edge five millionths of the element before its end, by 2e-12
  // m nearer than there, where coordinates are rounded to 6e-11 m; across the way from the end to the edge
  // the other end is nearer by 6e-7 m.
  PairMotion pair;
  pair.rod_t0 = {Vector3(49306.435837225887, -345879.58134913928, 29194.280912401657),
                 Vector3(49306.427257450814, -345879.52130722953, 29194.291160327852)};
  pair.rod_t1 = {Vector3(49306.433772622171, -345879.58154753502, 29194.28042606376),
                 Vector3(49306.427257452437, -345879.52130723069, 29194.291160231965)};
  pair.other_t0 = pair.other_t1 = {Vector3(49306.426958179458, -345879.54965837026, 29194.278244761412),
                                   Vector3(49306.427076057291, -345879.54904078657, 29194.277070808759),
                                   Vector3(49306.423831225911, -345879.51778629364, 29194.293187108153)};
  pair.corners = 3;
  DistanceToProve goal(0.003044429635002266, 1);
  EXPECT_EQ(prove(pair, goal, [](double, double) {}).status, Proof::Status::proved);
}

}  // namespace
}  // namespace tendril::verification
