#include <gtest/gtest.h>

#include "geometry/motion_queries.h"

namespace tendril {
namespace {

using namespace motion_queries;
using exact::Verdict;

// ----------------------------------------------------------------------------------------------- the claim

TEST(ContinuousCollision, MissesNothingInAHundredThousandQueriesAgainstExactArithmetic) {
  Generator generate(1);
  Tally tally;
  for (int i = 0; i < 100000; ++i) {
    const Query query = generate();
    test(query, ask(query), i % 64 == 0, tally);
    ASSERT_EQ(tally.missed + tally.not_kept + tally.undecided + tally.filter_wrong + tally.out_of_range, 0)
        << "query " << i << ": " << kKindNames[static_cast<std::size_t>(query.kind)] << ", "
        << kPairNames[static_cast<std::size_t>(query.pair)];
  }
  EXPECT_GT(tally.claims, 75000);
  EXPECT_GT(tally.claims - tally.to_the_end, 20000) << "claims that end at a contact";
  EXPECT_GT(tally.exactly + tally.both, 1000);
}

TEST(ContinuousCollision, KeepsTheRadiusAtTheRoundedPositionsWhereAClaimEnds) {
  Generator generate(5);
  for (int i = 0; i < 50000; ++i) {
    const Query query = generate();
    const double f = ask(query);
    if (f == 0) continue;
    exact::Motion end{query.motion.np, query.motion.nq};
    for (std::size_t k = 0; k < 2; ++k) end.p[k] = query.motion.p[k] + f * query.motion.dp[k];
    for (std::size_t k = 0; k < 3; ++k) end.q[k] = query.motion.q[k] + f * query.motion.dq[k];
    ASSERT_EQ(judge(end, 1, query.radius).verdict, Verdict::free) << i;
  }
}

TEST(ContinuousCollision, ProvesNothingFromWhatIsNotANumber) {
  const double nan = std::numeric_limits<double>::quiet_NaN(),
               infinite = std::numeric_limits<double>::infinity();
  for (const double x : {nan, infinite, -infinite})
    for (int place = 0; place < 21; ++place)
      for (const Pair pair :
           {Pair::point_triangle, Pair::segment_edge, Pair::segment_triangle, Pair::segment_segment}) {
        Query query{pair, Kind::extreme, {2, 3}, 0.1, 0};
        auto& [np, nq, p, dp, q, dq] = query.motion;
        p = {Vector3(0, 0, 1), Vector3(1, 0, 1)}, dp.fill(Vector3(0, 0, -0.5));
        q = {Vector3(-1, -1, 0), Vector3(1, -1, 0), Vector3(0, 1, 0)}, dq.fill(Vector3::Zero());
        const std::array<std::pair<Vector3*, bool>, 7> corners = {
            {{&p[0], true},
             {&dp[0], true},
             {&q[0], true},
             {&q[1], true},
             {&p[1], pair != Pair::point_triangle},
             {&dp[1], pair != Pair::point_triangle},
             {&q[2], pair == Pair::point_triangle || pair == Pair::segment_triangle}}};
        const auto& [corner, used] = corners[static_cast<std::size_t>(place / 3)];
        EXPECT_EQ(ask(query), 1);
        (*corner)[place % 3] = x;
        EXPECT_EQ(ask(query), used ? 0 : 1) << x << " at " << place;
      }
}

// ------------------------------------------------------------------------------ is the exact decision right?

exact::Motion pointOverTriangle(const Vector3& p, const Vector3& d) {
  exact::Motion motion{1, 3};
  motion.p[0] = p, motion.dp[0] = d;
  motion.q = {Vector3(-1, -1, 0), Vector3(1, -1, 0), Vector3(0, 1, 0)};
  return motion;
}

exact::Motion segments(const Vector3& p0, const Vector3& p1, const Vector3& d0, const Vector3& d1,
                       const Vector3& q0, const Vector3& q1, const Vector3& e0 = Vector3::Zero(),
                       const Vector3& e1 = Vector3::Zero()) {
  return {2, 2, {p0, p1}, {d0, d1}, {q0, q1, q1}, {e0, e1, e1}};
}

constexpr double kUlp = 0x1p-52;

TEST(ExactDecision, KnowsTouchingFromFallingBelowByTheLastBit) {
  // onto the face, the edge y = -1, the vertex (0, 1, 0)
  const std::pair<exact::Motion, double> cases[] = {{pointOverTriangle({0, 0, 1}, {0, 0, -1}), 0.25},
                                                    {pointOverTriangle({0, -3, 0}, {0, 2, 0}), 0.5},
                                                    {pointOverTriangle({0, 1, 2}, {0, 0, -2}), 0.5}};
  for (const auto& [motion, r] : cases) {
    EXPECT_EQ(exact::decide(motion, 0.75, r), Verdict::free);
    EXPECT_EQ(exact::decide(motion, 0.75 * (1 + kUlp), r), Verdict::hit);
    EXPECT_EQ(exact::decide(motion, 0.75, r * (1 + kUlp)), Verdict::hit);
  }
}

TEST(ExactDecision, KnowsGrazingFromHitting) {
  // past the vertex (0, 1, 0), along the face, and across the edge of another segment
  for (const double z : {1., 1e-9, 1e6}) {
    const exact::Motion past = pointOverTriangle({-8, 1, z}, {16, 0, 0});
    EXPECT_NE(exact::decide(past, 1, z), Verdict::hit);
    EXPECT_EQ(exact::decide(past, 1, z * (1 - kUlp)), Verdict::free);
    EXPECT_EQ(exact::decide(past, 1, z * (1 + kUlp)), Verdict::hit);
    EXPECT_EQ(exact::decide(past, 0.4375, z * (1 + kUlp)), Verdict::free);
    const exact::Motion over =
        segments({-8, 0, z}, {-7, 0, z}, {16, 0, 0}, {16, 0, 0}, {0, -1, 0}, {0, 1, 0});
    EXPECT_EQ(exact::decide(over, 1, z), Verdict::free);
    EXPECT_EQ(exact::decide(over, 1, z * (1 + kUlp)), Verdict::hit);
  }
}

TEST(ExactDecision, SettlesSegmentsThatAreParallelOrPointsForAMoment) {
  // At t = 1/3 the first is parallel to the second, at distance 1; or a point.
  const exact::Motion parallel =
      segments({-1, -0.5, 1}, {1, 0.5, 1}, {0, 1.5, 0}, {0, -1.5, 0}, {-1, 0, 0}, {1, 0, 0});
  const exact::Motion point =
      segments({-1, 0, 1}, {1, 0.5, 1}, {3, 0, 0}, {-3, -1.5, 0}, {-2, -1, 0}, {3, 1, 0});
  for (const exact::Motion& motion : {parallel, point}) {
    EXPECT_EQ(exact::decide(motion, 1, 1 - kUlp), Verdict::free);
    EXPECT_EQ(exact::decide(motion, 1, 1 + kUlp), Verdict::hit);
  }
  // Lines that meet there, and segments apart.
  const exact::Motion apart =
      segments({2, -0.5, 0}, {3, 0.5, 0}, {0, 1.5, 0}, {0, -1.5, 0}, {-1, 0, 0}, {1, 0, 0});
  EXPECT_EQ(exact::decide(apart, 1, 1 - kUlp), Verdict::free);
  EXPECT_EQ(exact::decide(apart, 1, 1 + kUlp), Verdict::hit);
}

TEST(ExactDecision, SeesASegmentThatPiercesTheTriangleFromTheStart) {
  exact::Motion motion = pointOverTriangle({0, 0, -8}, {0, 0, 0});
  motion.np = 2, motion.p[1] = {0, 0, 8};
  EXPECT_EQ(exact::decide(motion, 0.5, 1e-3), Verdict::hit);
  motion.p[0].x() = motion.p[1].x() = 2;
  EXPECT_EQ(exact::decide(motion, 0.5, 1e-3), Verdict::free);
}

double distanceAt(const Query& query, double t) {
  std::array<Vector3, 2> p;
  std::array<Vector3, 3> q;
  for (std::size_t i = 0; i < 2; ++i) p[i] = query.motion.p[i] + t * query.motion.dp[i];
  for (std::size_t i = 0; i < 3; ++i) q[i] = query.motion.q[i] + t * query.motion.dq[i];
  if (query.motion.np == 1) return closestPointOnTriangle(p[0], q[0], q[1], q[2]).distance;
  if (query.motion.nq == 2) return closestPointsOfSegments(p[0], p[1], q[0], q[1]).distance;
  return closestPointsOfSegmentAndTriangle(p[0], p[1], q[0], q[1], q[2]).distance;
}

TEST(ExactDecision, AgreesWithTheDistanceAtManyMoments) {
  // The least distance lies between the least sampled and that less half of the way between two samples.
  constexpr int kSamples = 256;
  Generator generate(2);
  int hits = 0, free = 0;
  for (int i = 0; i < 3000; ++i) {
    const Query query = generate();
    if (query.kind == Kind::extreme || query.kind == Kind::far || query.kind == Kind::mixed) continue;
    double least = std::numeric_limits<double>::infinity(), fastest = 0;
    for (int k = 0; k <= kSamples; ++k) least = std::min(least, distanceAt(query, double(k) / kSamples));
    for (std::size_t k = 0; k < static_cast<std::size_t>(query.motion.np); ++k)
      for (std::size_t j = 0; j < static_cast<std::size_t>(query.motion.nq); ++j)
        fastest = std::max(fastest, (query.motion.dp[k] - query.motion.dq[j]).norm());
    const double above = least * (1 + 1e-6), below = least * (1 - 1e-6) - fastest / (2 * kSamples);
    if (least > 0) {
      ++hits;
      EXPECT_EQ(exact::decide(query.motion, 1, above), Verdict::hit) << i;
    }
    if (below > 0) {
      ++free;
      EXPECT_EQ(exact::decide(query.motion, 1, below), Verdict::free) << i;
    }
  }
  EXPECT_GT(hits, 1500);
  EXPECT_GT(free, 1000);
}

// --------------------------------------------------------------------------------------- is the filter
// right?

TEST(Filter, ConfirmsNothingThatExactArithmeticDenies) {
  // Claims as near to wrong as they get: at the returned time, for radii about the distance there.
  Generator generate(3);
  Random random(4);
  int confirmed = 0, denied = 0;
  for (int i = 0; i < 4000; ++i) {
    const Query query = generate();
    const double f = ask(query);
    if (f == 0) continue;
    const auto distance = static_cast<double>(Moment(query.motion, f).apart().norm());
    const double r = distance * (1 + random.uniform(-1, 1) * std::pow(10., random.uniform(-17, -13)));
    const Verdict verdict = exact::decide(query.motion, f, r);
    const bool by_filter = Filter(query.motion).confirms(f, r);
    ASSERT_FALSE(by_filter && verdict == Verdict::hit) << i;
    confirmed += by_filter, denied += verdict == Verdict::hit;
  }
  EXPECT_GT(confirmed, 500);
  EXPECT_GT(denied, 500);
}

}  // namespace
}  // namespace tendril
