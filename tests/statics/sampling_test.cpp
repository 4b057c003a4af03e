// Sampling the chart, self-distance, fitting both ends.
#include <gtest/gtest.h>

#include "reference.h"
#include "tendril/geometry.h"

namespace tendril {
namespace {

using namespace reference;

double selfDistanceOfAllPairs(const RodShape& shape, const RodProperties& rod) {
  double smallest = std::numeric_limits<double>::infinity();
  const std::size_t elements = shape.size() - 1;
  const double h = rod.length / static_cast<double>(elements);
  for (std::size_t i = 0; i < elements; ++i)
    for (std::size_t j = i + 1; j < elements; ++j)
      if (static_cast<double>(j - i - 1) * h > M_PI * rod.radius)
        smallest = std::min(smallest, closestPointsOfSegments(shape[i].position, shape[i + 1].position,
                                                              shape[j].position, shape[j + 1].position)
                                          .distance);
  return smallest;
}

TEST(Statics, SelfDistanceIsTheSmallestOverAllPairsFartherApartThanPiR) {
  Random random(21);
  RodProperties rod = rodOf(roundStiffness(), 60);
  EquilibriumIntegrator integrator(rod);
  Equilibrium e;
  for (int trial = 0; trial < 100; ++trial) {
    rod.radius = random.uniform(0.001, 0.05);
    (void)integrator.shape({}, randomWrench(random, 20, 40), e);
    EXPECT_EQ(selfDistance(e.nodes, rod), selfDistanceOfAllPairs(e.nodes, rod));
  }
}

TEST(Statics, SelfDistanceOfATooShortRodIsInfiniteAndOfACircleItsGap) {
  RodProperties rod = rodOf(roundStiffness(), 100);
  EquilibriumIntegrator integrator(rod);
  Equilibrium e;
  (void)integrator.shape({}, vector6(0, 2 * M_PI, 0, 0, 0, 0), e);
  rod.radius = 0.01;
  EXPECT_LT(selfDistance(e.nodes, rod), 1e-7);
  rod.radius = 1;
  EXPECT_EQ(selfDistance(e.nodes, rod), std::numeric_limits<double>::infinity());
}

TEST(Statics, SampledRodsAreStableClearOfThemselvesInTheBoxAndReproducible) {
  RodProperties rod = rodOf(7 * roundStiffness(), 40, 2);
  rod.radius = 0.02;
  EquilibriumIntegrator integrator(rod);
  Random random(22), again(22);
  const double ei = rod.bendingStiffness();
  const SamplingBox box{.moment = 5, .force = 30};
  for (int trial = 0; trial < 30; ++trial) {
    const Equilibrium e = sampleStable(integrator, rod, box, random);
    EXPECT_EQ(e.stability, Stability::stable);
    EXPECT_FALSE(e.first_conjugate_t);
    EXPECT_GT(selfDistance(e.nodes, rod), 2 * rod.radius);
    EXPECT_LE(e.wrench.head<3>().cwiseAbs().maxCoeff(), 5 * ei / 2);
    EXPECT_LE(e.wrench.tail<3>().cwiseAbs().maxCoeff(), 30 * ei / 4);
    EquilibriumIntegrator fresh(rod);
    const Equilibrium same = sampleStable(fresh, rod, box, again);
    EXPECT_EQ(e.wrench, same.wrench);
    EXPECT_EQ(e.nodes.back().position, same.nodes.back().position);
  }
}

TEST(Statics, AboutThreeInTenWrenchesOfTheDefaultBoxAreStable) {
  EquilibriumIntegrator integrator(rodOf(roundStiffness()));
  Random random(23);
  int stable = 0;
  for (int trial = 0; trial < 2000; ++trial)
    stable += integrator.isStable(randomWrench(random, 2 * M_PI, 40));
  EXPECT_NEAR(stable / 2000.0, 0.28, 0.05);
}

#ifdef NDEBUG
constexpr int kPoses = 60;
#else
constexpr int kPoses = 8;  // a fit takes a second under the sanitizers, ten milliseconds without
#endif

TEST(Statics, FitEndsFindsAStableRodForEveryReachablePairOfPoses) {
  for (const Vector6& natural : {roundStiffness(), unevenStiffness()}) {
    // Half a metre long and 128 times softer, in its own units the same rod.
    Vector6 c = natural / 128;
    c.tail<3>() *= 4;
    RodProperties rod = rodOf(c, 20, 0.5);
    rod.radius = 0.005;
    EquilibriumIntegrator integrator(rod);
    Random random(24);
    int found_again = 0;
    for (int trial = 0; trial < kPoses; ++trial) {
      const Equilibrium drawn = sampleStable(integrator, rod, {}, random);
      const Pose base{random.rotation(), {random.uniform(), random.uniform(), random.uniform()}};
      const GripperPoses ends{base, base * drawn.nodes.back()};
      const std::vector<Equilibrium> fitted = fitEnds(rod, ends);
      ASSERT_FALSE(fitted.empty()) << trial;
      bool again = false;
      for (std::size_t i = 0; i < fitted.size(); ++i) {
        const Equilibrium& e = fitted[i];
        EXPECT_EQ(e.stability, Stability::stable);
        EXPECT_EQ(e.nodes.front().position, ends.first.position);
        EXPECT_LT((e.nodes.back().position - ends.last.position).norm(), 1e-9);
        EXPECT_LT(angleBetween(e.nodes.back().rotation, ends.last.rotation), 1e-9);
        EXPECT_LE(fitted[i > 0 ? i - 1 : 0].energy, e.energy);
        for (std::size_t j = 0; j < i; ++j)
          EXPECT_GT((e.wrench - fitted[j].wrench).norm(), 1e-7 * e.wrench.norm());
        again = again || (e.wrench - drawn.wrench).norm() < 1e-6 * drawn.wrench.norm();
      }
      found_again += again;
    }
    // The drawn rod itself is among the solutions 96 and 82 times in 100, measured over 200 draws.
    EXPECT_GE(found_again, kPoses * 6 / 10);
  }
}

TEST(Statics, FitEndsFindsTheStraightUnloadedRodFirst) {
  const RodProperties rod = rodOf(roundStiffness(), 10, 1);
  const Pose base{Quaternion(Eigen::AngleAxisd(1, Vector3(1, 2, 3).normalized())), {3, 2, 1}};
  const std::vector<Equilibrium> fitted =
      fitEnds(rod, {base, base * Pose{Quaternion::Identity(), Vector3::UnitX()}});
  ASSERT_FALSE(fitted.empty());
  EXPECT_LT(fitted[0].energy, 1e-12);
  EXPECT_LT(fitted[0].wrench.norm(), 1e-8);
}

TEST(Statics, FitEndsFindsBothMirrorImagesOfABuckledStrut) {
  // Ends half a length apart on one axis: the elastica, bent to any side; the least energy is the same for
  // all.
  const std::vector<Equilibrium> fitted =
      fitEnds(rodOf(unevenStiffness(), 10), {{}, {Quaternion::Identity(), {0.6, 0, 0}}});
  ASSERT_GE(fitted.size(), 2U);
  EXPECT_NEAR(fitted[0].energy, fitted[1].energy, 1e-6 * fitted[0].energy);
  EXPECT_GT((fitted[0].wrench - fitted[1].wrench).norm(), 1);
}

TEST(Statics, CoaxialEndsOfARodThatBendsAlikeAllRoundHoldACircleOfMarginalRods) {
  // Turned about the axis, a buckled strut with c2 = c3, c5 = c6 is another one between the same ends: a
  // conjugate point at 1, where Theorem 2 says nothing. A tilted end, however little, singles one out.
  const RodProperties rod = rodOf(roundStiffness(), 10);
  EXPECT_TRUE(fitEnds(rod, {{}, {Quaternion::Identity(), {0.9, 0, 0}}}).empty());
  EXPECT_FALSE(fitEnds(rod, {{}, {expSO3({0, 0, 0.01}), {0.9, 0, 0}}}).empty());
}

TEST(Statics, FitEndsFindsTheLeastEnergyOfACompressedRodWithItsEndsOffset) {
  // The rod bows out of the plane of its offset ends, to either side alike, at 1.483 J; twisted ones hold 6.8
  // J and more.
  RodProperties rod;
  rod.c = stiffnessOfRoundRod(5e7, 2e7, 0.01);
  rod.elements = 20;
  const std::vector<Equilibrium> found = fitEnds(rod, {{}, {Quaternion::Identity(), {0.9, 0.1, 0}}});
  ASSERT_GE(found.size(), 2U);
  EXPECT_NEAR(found[0].energy, 1.483, 1e-3);
  EXPECT_NEAR(found[1].energy, found[0].energy, 1e-6);
  EXPECT_NEAR(found[0].nodes[10].position.z(), -found[1].nodes[10].position.z(), 1e-6);
  EXPECT_GT(std::abs(found[0].nodes[10].position.z()), 0.01);
}

TEST(Statics, FitEndsGivesTheSameBytesEveryTime) {
  const RodProperties rod = rodOf(roundStiffness(), 10);
  const GripperPoses ends{{}, {expSO3({0.3, -0.8, 0.9}), {0.5, 0.3, -0.2}}};
  const auto one = fitEnds(rod, ends), two = fitEnds(rod, ends);
  ASSERT_EQ(one.size(), two.size());
  ASSERT_FALSE(one.empty());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].wrench, two[i].wrench);
    EXPECT_EQ(one[i].nodes.back().position, two[i].nodes.back().position);
  }
}

TEST(Statics, EndsOutOfReachHaveNoEquilibrium) {
  EXPECT_TRUE(fitEnds(rodOf(roundStiffness()), {{}, {Quaternion::Identity(), {3, 0, 0}}}).empty());
}

TEST(Statics, APlacementByPoseAndWrenchIsOneStableRodOrNone) {
  const RodProperties rod = rodOf(roundStiffness());
  EXPECT_EQ(equilibriaOf(rod, PoseAndWrench{{}, vector6(0, 1, 0, 0, 0, 0)}).size(), 1U);
  EXPECT_TRUE(equilibriaOf(rod, PoseAndWrench{{}, vector6(0, 0, 0, -60, 0, 0)}).empty());
  EXPECT_TRUE(equilibriaOf(rod, PoseAndWrench{{}, vector6(0, 0, 0, -1e5, 0, 0)}).empty());
  EXPECT_FALSE(equilibriaOf(rod, GripperPoses{{}, {Quaternion::Identity(), {0.9, 0.1, 0}}}).empty());
}

}  // namespace
}  // namespace tendril
