// Theorem 2: conjugate points, exactly.
#include <gtest/gtest.h>

#include "reference.h"
#include "tendril/statics/conjugate_points.h"

namespace tendril {
namespace {

using namespace reference;

Equilibrium solved(const RodProperties& rod, const Vector6& wrench) {
  EquilibriumIntegrator integrator(rod);
  Equilibrium e;
  EXPECT_EQ(integrator.solve({}, wrench, e), ChartStatus::equilibrium);
  EXPECT_EQ(integrator.isStable(wrench), e.stability == Stability::stable);
  EXPECT_EQ(e.first_conjugate_t.has_value(), e.stability != Stability::stable);
  EXPECT_EQ(e.conjugate_points > 0, e.stability == Stability::unstable);
  return e;
}

/// K over [from, to] of the path, from K = 0, and the frame at `to`.
Matrix6 segment(const statics::Chart& chart, statics::PathState& at, double length, int steps) {
  statics::JointState y;
  y.head<8>() = at;
  y.tail<36>().setZero();
  statics::Stages<statics::JointState> stages;
  for (int i = 0; i < steps; ++i) chart.step(y, length / steps, stages);
  at = y.head<8>();
  return statics::kOf(y);
}

TEST(Statics, StraightUnloadedRodIsAStableEquilibrium) {
  for (const Vector6& c : {roundStiffness(), unevenStiffness()}) {
    const Equilibrium e = solved(rodOf(c), Vector6::Zero());
    EXPECT_EQ(e.stability, Stability::stable);
    EXPECT_EQ(e.energy, 0);
    EXPECT_LT((e.nodes.back().position - Vector3::UnitX()).norm(), 1e-14);
  }
}

TEST(Statics, PulledAndSlightlyTwistedRodsAreStable) {
  EXPECT_EQ(solved(rodOf(roundStiffness()), vector6(0, 0, 0, 500, 0, 0)).stability, Stability::stable);
  EXPECT_EQ(solved(rodOf(roundStiffness()), vector6(3, 0, 0, 0, 0, 0)).stability, Stability::stable);
}

TEST(Statics, DeterminantOfTheEndJacobianOfAnUnloadedRodIsTheClosedForm) {
  const Vector6 c = vector6(0.7, 1.3, 1.3, 400, 150, 150);
  for (const double t : {0.1, 0.5, 1.0, 2.0}) {
    EquilibriumIntegrator integrator(rodOf(c, 10, t));
    Pose end;
    Matrix6 jacobian;
    ASSERT_EQ(integrator.endPose(Vector6::Zero(), end, jacobian), ChartStatus::equilibrium);
    const double bending = std::pow(t, 4) / (12 * c[1] * c[1]) + t * t / (c[1] * c[4]);
    const double expected = (t / c[0]) * (t / c[3]) * bending * bending;
    EXPECT_NEAR(jacobian.determinant() / expected, 1, 1e-10) << t;
  }
}

TEST(Statics, StraightCompressedRodBucklesInBothPlanesAtTheClosedFormTimes) {
  // First conjugate time 2 pi / w, w^2 = P (1 - P/c4 + P/c5) / c2: double, since c2 = c3. The next pair, the
  // second root of tan(w t / 2) = (shear-corrected) w t / 2, lies at 0.79944.
  const Vector6 c = vector6(1, 1, 1, 100, 50, 50), a = vector6(0, 0, 0, -60, 0, 0);
  const Equilibrium e = solved(rodOf(c), a);
  EXPECT_EQ(e.stability, Stability::unstable);
  EXPECT_EQ(e.conjugate_points, 4);
  const double w = std::sqrt(60 * (1 - 60.0 / 100 + 60.0 / 50));
  EXPECT_NEAR(2 * M_PI / w, 0.6412749150809, 1e-12);
  EXPECT_NEAR(*e.first_conjugate_t, 2 * M_PI / w, 5e-10);
  EXPECT_EQ(solved(rodOf(c, 10, 0.6412), a).conjugate_points, 0);
  EXPECT_EQ(solved(rodOf(c, 10, 0.6413), a).conjugate_points, 2);
  EXPECT_EQ(solved(rodOf(c, 10, 0.7994), a).conjugate_points, 2);
  EXPECT_EQ(solved(rodOf(c, 10, 0.7995), a).conjugate_points, 4);
}

TEST(Statics, ASmallEndMomentSplitsTheDoubleRootInTwo) {
  const Vector6 c = vector6(1, 1, 1, 100, 50, 50), a = vector6(0, 0.3, 0, -60, 0, 0);
  const Equilibrium e = solved(rodOf(c), a);
  EXPECT_NEAR(*e.first_conjugate_t, 0.64136, 1e-5);
  EXPECT_EQ(e.conjugate_points, 4);
  EXPECT_EQ(solved(rodOf(c, 10, 0.64130), a).conjugate_points, 0);
  EXPECT_EQ(solved(rodOf(c, 10, 0.64181), a).conjugate_points, 1);
  EXPECT_EQ(solved(rodOf(c, 10, 0.64230), a).conjugate_points, 2);
}

TEST(Statics, PureTwistWithoutShearLosesStabilityAtTheClosedFormTime) {
  // a1 t = 2 x 4.4934..., the first positive root of tan x = x.
  double x = 4.4934;
  for (int i = 0; i < 20; ++i) x -= (std::tan(x) - x) / (std::tan(x) * std::tan(x));
  EXPECT_NEAR(2 * x, 8.9868, 1e-4);
  for (const double a1 : {10.0, 15.0, 20.0}) {
    const Equilibrium e = solved(rodOf(vector6(0.8, 1, 1, 1e9, 1e9, 1e9)), vector6(a1, 0, 0, 0, 0, 0));
    ASSERT_TRUE(e.first_conjugate_t);
    EXPECT_NEAR(*e.first_conjugate_t, 2 * x / a1, 1e-8) << a1;
    EXPECT_EQ(e.conjugate_points % 2, 0);
  }
  EXPECT_EQ(solved(rodOf(vector6(0.8, 1, 1, 1e9, 1e9, 1e9)), vector6(8.98, 0, 0, 0, 0, 0)).stability,
            Stability::stable);
}

TEST(Statics, PlanarCircleLosesStabilityAtOneFullTurn) {
  for (const Vector6& c : {vector6(0.7, 1, 1, 4e4, 1.5e4, 1.5e4), vector6(2, 1, 1, 1e3, 400, 400)}) {
    for (const double turns : {1.2, 1.5}) {
      const Equilibrium e = solved(rodOf(c), vector6(0, 2 * M_PI * turns, 0, 0, 0, 0));
      ASSERT_TRUE(e.first_conjugate_t);
      EXPECT_LE(*e.first_conjugate_t, 1 / turns + 1e-6);
    }
    EXPECT_EQ(solved(rodOf(c), vector6(0, 2 * M_PI * 0.99, 0, 0, 0, 0)).stability, Stability::stable);
  }
  const Equilibrium e =
      solved(rodOf(vector6(0.7, 1, 1, 4e4, 1.5e4, 1.5e4)), vector6(0, 2 * M_PI * 1.25, 0, 0, 0, 0));
  EXPECT_NEAR(*e.first_conjugate_t, 0.8, 1e-9);
}

TEST(Statics, AConjugatePointExactlyAtTheEndIsMarginal) {
  const Equilibrium circle =
      solved(rodOf(vector6(0.7, 1, 1, 4e4, 1.5e4, 1.5e4)), vector6(0, 2 * M_PI, 0, 0, 0, 0));
  EXPECT_EQ(circle.stability, Stability::marginal);
  // P (1 + P / 100) = 4 pi^2: the straight rod about to buckle
  const double force = 50 * (std::sqrt(1 + 4 * 4 * M_PI * M_PI / 100) - 1);
  const Vector6 c = vector6(1, 1, 1, 100, 50, 50);
  const Equilibrium strut = solved(rodOf(c), vector6(0, 0, 0, -force, 0, 0));
  EXPECT_EQ(strut.stability, Stability::marginal);
  for (const Equilibrium& e : {circle, strut}) {
    EXPECT_EQ(e.conjugate_points, 0);
    EXPECT_LE(*e.first_conjugate_t, 1);
    EXPECT_NEAR(*e.first_conjugate_t, 1, 1e-6);
  }
  EXPECT_EQ(solved(rodOf(c), vector6(0, 0, 0, -force * (1 - 1e-5), 0, 0)).stability, Stability::stable);
  const Equilibrium buckled = solved(rodOf(c), vector6(0, 0, 0, -force * (1 + 1e-5), 0, 0));
  EXPECT_EQ(buckled.stability, Stability::unstable);
  EXPECT_EQ(buckled.conjugate_points, 2);
}

TEST(Statics, StabilityVerdictDoesNotChangeWhenStiffnessAndWrenchAreScaled) {
  Random random(11);
  for (int trial = 0; trial < 30; ++trial) {
    const Vector6 c = trial % 2 ? roundStiffness() : unevenStiffness(), a = randomWrench(random, 6.283, 40);
    const Equilibrium one = solved(rodOf(c), a);
    for (double k = 1e-3; k < 2e6; k *= 10) {
      const Equilibrium scaled = solved(rodOf(k * c), k * a);
      EXPECT_EQ(scaled.stability, one.stability);
      EXPECT_EQ(scaled.conjugate_points, one.conjugate_points);
      EXPECT_NEAR(scaled.first_conjugate_t.value_or(2), one.first_conjugate_t.value_or(2), 1e-8);
      EXPECT_LT(maxNodeDistance(scaled.nodes, one.nodes), 1e-10);
      EXPECT_NEAR(scaled.energy / k, one.energy, 1e-9 * one.energy);
    }
  }
}

TEST(Statics, LengthIsAUnitToo) {
  Random random(12);
  for (int trial = 0; trial < 10; ++trial) {
    const Vector6 c = unevenStiffness(), a = randomWrench(random, 6.283, 40);
    const double l = 7.3;
    Vector6 c_long = c, a_long = a;
    c_long.tail<3>() /= l * l, a_long.head<3>() /= l, a_long.tail<3>() /= l * l;
    const Equilibrium one = solved(rodOf(c), a), longer = solved(rodOf(c_long, 40, l), a_long);
    EXPECT_EQ(longer.stability, one.stability);
    EXPECT_EQ(longer.conjugate_points, one.conjugate_points);
    EXPECT_LT((longer.nodes.back().position / l - one.nodes.back().position).norm(), 1e-10);
  }
}

TEST(Statics, YIsSymmetricAndComposedSegmentsEqualTheWholeRod) {
  Random random(13);
  for (const Vector6& c : {roundStiffness(), unevenStiffness()}) {
    for (int trial = 0; trial < 20; ++trial) {
      const statics::Chart chart(c, randomWrench(random, 6.283, 40));
      const Matrix6 b = chart.bracket();
      EXPECT_EQ(b, -b.transpose());
      statics::PathState at = statics::startOfPath();
      const Matrix6 x1 = segment(chart, at, 0.4, 40), x2 = segment(chart, at, 0.3, 40);
      statics::PathState start = statics::startOfPath();
      const Matrix6 whole = segment(chart, start, 0.7, 80);
      EXPECT_LT((x1 + x2 + x2 * b * x1 - whole).norm(), 1e-8 * whole.norm());
      // K - K^T = K^T B K: the symmetry of Y = K^-1 + B/2 without the inverse
      EXPECT_LT((whole - whole.transpose() - whole.transpose() * b * whole).norm(),
                1e-8 * whole.squaredNorm());
      const Matrix6 y = x1.inverse() + 0.5 * b, ys = x2.inverse() + 0.5 * b,
                    composed = whole.inverse() + 0.5 * b;
      const Matrix6 d = y + ys;
      EXPECT_LT((y - y.transpose()).norm(), 1e-7 * y.norm());
      const Matrix6 from_segments = 0.5 * b + (y - 0.5 * b) * d.inverse() * (ys - 0.5 * b);
      EXPECT_LT((from_segments - composed).norm(), 1e-6 * (y.norm() + ys.norm()));
      const Matrix6 p = x2 * d * x2.transpose();
      EXPECT_LT((x2 * y * x2.transpose() + 0.5 * (x2 + x2.transpose()) - p).norm(), 1e-7 * p.norm());
    }
  }
}

TEST(Statics, TimesToConjugatePointsPredictTheNextOneAndIgnoreUnits) {
  // A strut that buckles at t = 0.6412749: seen from t = 0.64 the next two conjugate points are 0.0012749
  // away.
  const Vector6 c = vector6(1, 1, 1, 100, 50, 50);
  const statics::Chart chart(c, vector6(0, 0, 0, -60, 0, 0));
  statics::PathState at = statics::startOfPath();
  statics::ConjugatePoints points;
  for (int i = 0; i < 4; ++i) {
    const Matrix6 x = segment(chart, at, 0.16, 8);
    if (i == 0) {
      points.start(x);
    } else if (i < 3) {
      ASSERT_TRUE(points.passIfFree(x));
    } else {
      const Vector6 times = points.timesToConjugatePoints(x, chart, at);
      EXPECT_NEAR(times[0], 0.0012749, 1e-5);
      EXPECT_NEAR(times[1], 0.0012749, 1e-5);
      EXPECT_GT(times[2], 0.01);
      ASSERT_TRUE(points.passIfFree(x));
      EXPECT_LT(points.timeLeft(chart, at), times[0]);
      EXPECT_GT(points.timeLeft(chart, at), times[0] / 6);
    }
  }
}

TEST(Statics, ConjugatePointsAreAsManyAsTheNegativeDirectionsOfTheSecondVariation) {
  Random random(14);
  int compared = 0, unresolved = 0, unstable = 0, several = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Vector6 c = trial % 3 ? roundStiffness() : unevenStiffness();
    const double scale = random.uniform(0.3, 1.4);
    const Vector6 a = randomWrench(random, scale * 6.283, scale * 40);
    EquilibriumIntegrator integrator(rodOf(c, 1));
    Equilibrium e;
    if (integrator.solve({}, a, e) == ChartStatus::inverted) continue;
    // The grid is of second order and misplaces conjugate points by up to 1e-3: one that near the end it
    // cannot tell.
    const int shorter = negativeDirections(a, c, 0.999, 160), longer = negativeDirections(a, c, 1.001, 160);
    if (shorter != longer) {
      ++unresolved;
      continue;
    }
    ++compared, unstable += longer > 0, several += longer > 1;
    EXPECT_EQ(e.conjugate_points, longer)
        << "wrench " << a.transpose() << " first " << e.first_conjugate_t.value_or(-1);
  }
  EXPECT_GT(compared, 280);
  EXPECT_LT(unresolved, 10);
  EXPECT_GT(unstable, 60);
  EXPECT_GT(several, 15);
}

TEST(Statics, ARodCutJustBeforeItsFirstConjugatePointIsStableAndJustAfterItIsNot) {
  Random random(15);
  int cut = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const Vector6 c = trial % 2 ? roundStiffness() : unevenStiffness(), a = randomWrench(random, 6.283, 40);
    EquilibriumIntegrator integrator(rodOf(c));
    Equilibrium e;
    if (integrator.solve({}, a, e) == ChartStatus::inverted || e.stability != Stability::unstable) continue;
    const double t = *e.first_conjugate_t;
    ASSERT_GT(t, 0);
    ASSERT_LE(t, 1);
    EXPECT_EQ(solved(rodOf(c, 4, t * (1 - 1e-4)), a).stability, Stability::stable);
    EXPECT_EQ(solved(rodOf(c, 4, std::min(1.0, t * (1 + 1e-4))), a).stability, Stability::unstable);
    ++cut;
  }
  EXPECT_GT(cut, 20);
}

TEST(Statics, HeavyLoadsGetMoreSegmentsAndKeepTheirCount) {
  // A straight inextensible strut under P: pairs of conjugate points at 2 pi k / w and at the roots of tan x
  // = x, x = w t / 2.
  const double force = 3000, w = std::sqrt(force);
  int expected = 2 * static_cast<int>(w / (2 * M_PI));
  for (int k = 1; k < 100; ++k) {
    double x = (k + 0.5) * M_PI - 1e-3;
    for (int i = 0; i < 50; ++i) x = k * M_PI + std::atan(x);
    expected += 2 * x / w < 1 ? 2 : 0;
  }
  const Equilibrium e = solved(rodOf(vector6(0.7, 1, 1, 1e9, 1e9, 1e9)), vector6(0, 0, 0, -force, 0, 0));
  EXPECT_EQ(e.conjugate_points, expected);
  EXPECT_NEAR(*e.first_conjugate_t, 2 * M_PI / w, 1e-8);
}

}  // namespace
}  // namespace tendril
