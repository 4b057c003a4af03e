// Theorem 2: conjugate points, exactly.
#include "second_variation.h"

namespace tendril {
namespace {

using namespace reference;

/// Everything that gives a verdict must give this one, the Jacobian's end included.
void expectVerdict(const RodProperties& rod, const Vector6& a, bool stable) {
  EquilibriumIntegrator integrator(rod);
  EquilibriumBatch batch(rod);
  EXPECT_EQ(integrator.isStable(a), stable) << a.transpose();
  EquilibriumEnd end, batch_end;
  EXPECT_EQ(integrator.end(a, end), ChartStatus::equilibrium);
  EXPECT_EQ(end.stable, stable) << a.transpose();
  batch.ends({&a, 1}, {&batch_end, 1});
  EXPECT_EQ(batch_end.stable, stable) << a.transpose();
  bool verdict = !stable;
  batch.areStable({&a, 1}, {&verdict, 1});
  EXPECT_EQ(verdict, stable) << a.transpose();
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
    EquilibriumEnd end;
    ASSERT_EQ(integrator.end(Vector6::Zero(), end), ChartStatus::equilibrium);
    const double bending = std::pow(t, 4) / (12 * c[1] * c[1]) + t * t / (c[1] * c[4]);
    const double expected = (t / c[0]) * (t / c[3]) * bending * bending;
    EXPECT_NEAR(end.jacobian.determinant() / expected, 1, 1e-10) << t;
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
  EXPECT_NEAR(2 * kPi / w, 0.6412749150809, 1e-12);
  EXPECT_NEAR(*e.first_conjugate_t, 2 * kPi / w, 1e-9);
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
      const Equilibrium e = solved(rodOf(c), vector6(0, 2 * kPi * turns, 0, 0, 0, 0));
      ASSERT_TRUE(e.first_conjugate_t);
      EXPECT_LE(*e.first_conjugate_t, 1 / turns + 1e-6);
    }
    EXPECT_EQ(solved(rodOf(c), vector6(0, 2 * kPi * 0.99, 0, 0, 0, 0)).stability, Stability::stable);
  }
  const Equilibrium e =
      solved(rodOf(vector6(0.7, 1, 1, 4e4, 1.5e4, 1.5e4)), vector6(0, 2 * kPi * 1.25, 0, 0, 0, 0));
  EXPECT_NEAR(*e.first_conjugate_t, 0.8, 1e-9);
}

TEST(Statics, AConjugatePointExactlyAtTheEndIsMarginal) {
  const Equilibrium circle =
      solved(rodOf(vector6(0.7, 1, 1, 4e4, 1.5e4, 1.5e4)), vector6(0, 2 * kPi, 0, 0, 0, 0));
  EXPECT_EQ(circle.stability, Stability::marginal);
  // P (1 + P / 100) = 4 pi^2: the straight rod about to buckle
  const double force = 50 * (std::sqrt(1 + 4 * 4 * kPi * kPi / 100) - 1);
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

struct Kind {
  const char* name;
  Vector6 c;
  Vector3 kappa0;
  double moment, force;
};
std::vector<Kind> kinds() {
  return {{"round", roundStiffness(), Vector3::Zero(), 6.283, 40},
          {"uneven", unevenStiffness(), Vector3::Zero(), 6.283, 40},
          {"soft", softStiffness(), Vector3::Zero(), 6.283, 6},
          {"softest", softestStiffness(), Vector3::Zero(), 5, 1.2},
          {"bent", unevenStiffness(), Vector3(0.7, -1.1, 2), 6.283, 40},
          {"coiled", roundStiffness(), Vector3(1, 0, 6), 6.283, 30}};
}
RodProperties rodOfKind(const Kind& kind, double length = 1) {
  RodProperties rod = rodOf(kind.c, 4, length);
  rod.rest_curvature.assign(1, kind.kappa0);
  return rod;
}

#ifdef NDEBUG
constexpr int kCasesOfAKind = 110, kCutsOfAKind = 8;
#else
constexpr int kCasesOfAKind = 12, kCutsOfAKind = 1;  // the sanitizers are slow
#endif

TEST(Statics, ConjugatePointsAreAsManyAsTheNegativeDirectionsOfTheSecondVariation) {
  Random random(14);
  int compared = 0, unresolved = 0, unstable = 0, several = 0;
  for (const Kind& kind : kinds()) {
    SCOPED_TRACE(kind.name);
    const RodProperties rod = rodOfKind(kind);
    EquilibriumIntegrator integrator(rod);
    for (int trial = 0; trial < kCasesOfAKind; ++trial) {
      const double scale = random.uniform(0.3, 1.4);
      const Vector6 a = randomWrench(random, scale * kind.moment, scale * kind.force);
      Equilibrium e;
      if (integrator.solve({}, a, e) == ChartStatus::inverted) continue;
      // The grid is of second order and misplaces conjugate points: one that near the end it cannot tell, and
      // a finer grid is asked.
      int shorter = 0, longer = 1;
      for (const int elements : {160, 1280}) {
        const double band = 1e-3 * std::pow(160.0 / elements, 2);
        shorter = negativeDirections(HeavyRod(rod), Quaternion::Identity(), a, 1 - band, elements);
        longer = negativeDirections(HeavyRod(rod), Quaternion::Identity(), a, 1 + band, elements);
        if (shorter == longer) break;
      }
      if (shorter != longer) {
        ++unresolved;
        continue;
      }
      ++compared, unstable += longer > 0, several += longer > 1;
      EXPECT_EQ(e.conjugate_points, longer)
          << "wrench " << a.transpose() << " first " << e.first_conjugate_t.value_or(-1);
      EXPECT_EQ(e.stability, longer > 0 ? Stability::unstable : Stability::stable) << a.transpose();
      expectVerdict(rod, a, longer == 0);
    }
  }
  EXPECT_GT(compared, 5 * kCasesOfAKind);
  EXPECT_LE(unresolved, 1);
  EXPECT_GT(unstable, compared / 4);
  EXPECT_GT(several, compared / 20);
}

TEST(Statics, ARodCutJustBeforeItsFirstConjugatePointIsStableAndJustAfterItIsNot) {
  // The second variation on a grid fine enough to tell the first conjugate time to 1e-4, and less.
  Random random(15);
  int cut = 0;
  for (const Kind& kind : kinds()) {
    SCOPED_TRACE(kind.name);
    EquilibriumIntegrator integrator(rodOfKind(kind));
    for (int found = 0; found < kCutsOfAKind;) {
      const Vector6 a = randomWrench(random, kind.moment, kind.force);
      Equilibrium e;
      if (integrator.solve({}, a, e) == ChartStatus::inverted || e.stability != Stability::unstable) continue;
      const double t = *e.first_conjugate_t;
      ASSERT_GT(t, 0);
      ASSERT_LE(t, 1);
      ++found;
      for (const double off : {-1e-3, -1e-4, 1e-4, 1e-3}) {
        const RodProperties part = rodOfKind(kind, t * (1 + off));
        const int negative = negativeDirections(HeavyRod(part), Quaternion::Identity(), a, part.length,
                                                std::abs(off) < 5e-4 ? 1500 : 600);
        EXPECT_EQ(negative > 0, off > 0) << a.transpose();
        const Equilibrium p = solved(part, a);
        EXPECT_EQ(p.conjugate_points, negative) << a.transpose();
        EXPECT_EQ(p.stability, off > 0 ? Stability::unstable : Stability::stable) << a.transpose();
        expectVerdict(part, a, off < 0);
        ++cut;
      }
      for (const double off : {-1e-5, 1e-5}) {
        const RodProperties part = rodOfKind(kind, t * (1 + off));
        EXPECT_EQ(solved(part, a).stability, off > 0 ? Stability::unstable : Stability::stable);
        expectVerdict(part, a, off < 0);
      }
    }
  }
  EXPECT_GE(cut, 24 * kCutsOfAKind);
}

TEST(Statics, FirstConjugateTimesOfSlenderRodsAreExact) {
  // Straight struts, stiff in stretch and shear: 2 pi / w, w^2 = P (1 - P/c4 + P/c5). And circles, one turn.
  for (const double radius : {0.01, 0.002, 0.0005}) {
    const Vector6 c = roundStiffness(radius);
    for (const double force : {45.0, 70.0, 140.0}) {
      const double w = std::sqrt(force * (1 - force / c[3] + force / c[4]));
      const Equilibrium e = solved(rodOf(c), vector6(0, 0, 0, -force, 0, 0));
      EXPECT_NEAR(*e.first_conjugate_t, 2 * kPi / w, 2e-8) << radius << " " << force;
    }
    for (const double turns : {1.1, 1.4}) {
      const Equilibrium e = solved(rodOf(c), vector6(0, 2 * kPi * turns, 0, 0, 0, 0));
      EXPECT_LE(*e.first_conjugate_t, 1 / turns + 1e-6);
    }
  }
}

TEST(Statics, DoubleRootsOfStraightAndTwistedRoundRodsAreFoundHoweverNear) {
  // Pairs of conjugate points at one time: det J does not change its sign.
  const Vector6 c = roundStiffness();
  // axial force P < 0: first time 2 pi / w, w^2 = -P (1 + P/c4 - P/c5)
  for (const double force : {-45.0, -60.0, -80.0}) {
    const double w = std::sqrt(-force * (1 + force / c[3] - force / c[4]));
    const Vector6 a = vector6(0, 0, 0, force, 0, 0);
    for (const double off : {-1e-3, -1e-4, -1e-5, 1e-5, 1e-4, 1e-3}) {
      const RodProperties part = rodOf(c, 4, 2 * kPi / w * (1 + off));
      expectVerdict(part, a, off < 0);
      EXPECT_EQ(solved(part, a).conjugate_points, off < 0 ? 0 : 2);
      if (std::abs(off) < 5e-4) continue;
      EXPECT_EQ(negativeDirections(a, c, part.length, 600), off < 0 ? 0 : 2);
    }
  }
  // pure twist: the time found by solve(), against the second variation
  for (const double twist : {9.5, 12.0, 15.0}) {
    const Vector6 a = vector6(twist, 0, 0, 0, 0, 0);
    const double t = *solved(rodOf(c), a).first_conjugate_t;
    for (const double off : {-1e-3, -1e-4, -1e-5, 1e-5, 1e-4, 1e-3}) {
      const RodProperties part = rodOf(c, 4, t * (1 + off));
      expectVerdict(part, a, off < 0);
      EXPECT_EQ(solved(part, a).conjugate_points, off < 0 ? 0 : 2);
      if (std::abs(off) < 5e-4) continue;
      EXPECT_EQ(negativeDirections(a, c, part.length, 1200), off < 0 ? 0 : 2);
    }
  }
}

TEST(Statics, SoftRodsNearCollapseAreRodsOrInvertedByTheirLeastStretch) {
  // 1 + u4 > 0.05 all along the rod, by the laws in world axes: this and nothing else is a rod.
  Random random(16);
  int rods = 0, inverted = 0;
  for (const Vector6& c : {softStiffness(), softestStiffness()}) {
    const RodProperties rod = rodOf(c, 10);
    EquilibriumIntegrator integrator(rod);
    EquilibriumBatch batch(rod);
    for (int trial = 0; trial < 150; ++trial) {
      const Vector6 a = randomWrench(random, 5, 1.3 * c[3]);
      double least = 1;
      for (const Place& y : nodesOf(HeavyRod(rod), startOf(Quaternion::Identity(), a), 60, 3))
        least = std::min(least, 1 + y.mu()[3] / c[3]);
      if (std::abs(least - 0.05) < 0.01) continue;  // between the places looked at
      Equilibrium e;
      EquilibriumEnd end, of_batch;
      const ChartStatus expected = least > 0.05 ? ChartStatus::equilibrium : ChartStatus::inverted;
      EXPECT_EQ(integrator.shape({}, a, e), expected) << a.transpose() << " least " << least;
      EXPECT_EQ(integrator.solve({}, a, e), expected);
      EXPECT_EQ(integrator.end(a, end), expected);
      batch.shapes({&a, 1}, {&of_batch, 1});
      EXPECT_EQ(std::isfinite(of_batch.energy), expected == ChartStatus::equilibrium);
      if (expected == ChartStatus::inverted)
        EXPECT_FALSE(integrator.isStable(a));
      else
        EXPECT_EQ(integrator.isStable(a), e.stability == Stability::stable);
      ++(least > 0.05 ? rods : inverted);
    }
  }
  EXPECT_GT(rods, 40);
  EXPECT_GT(inverted, 40);
}

TEST(Statics, AStrutUnderAHugeForceHasAsManyConjugatePointsAsTheClosedForm) {
  // A straight inextensible strut under P: pairs of conjugate points at 2 pi k / w and at the roots of tan x
  // = x, x = w t / 2.
  const double force = 3000, w = std::sqrt(force);
  int expected = 2 * static_cast<int>(w / (2 * kPi));
  for (int k = 1; k < 100; ++k) {
    double x = (k + 0.5) * kPi - 1e-3;
    for (int i = 0; i < 50; ++i) x = k * kPi + std::atan(x);
    expected += 2 * x / w < 1 ? 2 : 0;
  }
  const Equilibrium e = solved(rodOf(vector6(0.7, 1, 1, 1e9, 1e9, 1e9)), vector6(0, 0, 0, -force, 0, 0));
  EXPECT_EQ(e.conjugate_points, expected);
  EXPECT_NEAR(*e.first_conjugate_t, 2 * kPi / w, 1e-8);
}

}  // namespace
}  // namespace tendril
