// Pre-formed rods: a curvature at rest, the same all along the rod or one per element.
#include "second_variation.h"
#include "tendril/statics/integrator.h"

namespace tendril {
namespace {

using namespace reference;

RodProperties randomlyBent(const Vector6& c, int elements, Random& random, double largest) {
  RodProperties rod = rodOf(c, elements);
  for (int i = 0; i < elements; ++i) rod.rest_curvature.push_back(randomVector(random, largest));
  return rod;
}

TEST(RestCurvature, AnUnloadedPreformedRodIsAHelix) {
  RodProperties rod = rodOf(unevenStiffness());
  const Vector3 kappa(2, 1, 4);
  rod.rest_curvature = {kappa};
  const Equilibrium e = solved(rod, Vector6::Zero());
  EXPECT_EQ(e.stability, Stability::stable);
  EXPECT_EQ(e.energy, 0);
  Vector6 xi;
  xi << kappa, 1, 0, 0;
  for (int i = 0; i <= rod.elements; ++i) {
    const Pose expected = expSE3(static_cast<double>(i) / rod.elements * xi);
    const Pose& node = e.nodes[static_cast<std::size_t>(i)];
    EXPECT_LT((node.position - expected.position).norm(), 1e-8);
    EXPECT_LT(angleBetween(node.rotation, expected.rotation), 1e-7);
  }
}

TEST(RestCurvature, AnUnloadedRodOfOnePerElementIsAChainOfArcs) {
  Random random(61);
  const RodProperties rod = randomlyBent(roundStiffness(), 12, random, 5);
  const Equilibrium e = solved(rod, Vector6::Zero());
  Pose expected;
  for (int i = 0; i < rod.elements; ++i) {
    Vector6 xi;
    xi << rod.restCurvature(i), 1, 0, 0;
    expected = expected * expSE3(rod.elementLength() * xi);
    const Pose& node = e.nodes[static_cast<std::size_t>(i) + 1];
    EXPECT_LT((node.position - expected.position).norm(), 1e-9);
    EXPECT_LT(angleBetween(node.rotation, expected.rotation), 1e-8);
  }
}

TEST(RestCurvature, AMomentThatUndoesItStraightensTheRod) {
  RodProperties rod = rodOf(vector6(0.6, 0.7, 1.3, 900, 300, 450));
  rod.rest_curvature = {Vector3(0, 0, 4)};
  const Equilibrium e = solved(rod, vector6(0, 0, -1.3 * 4, 0, 0, 0));
  EXPECT_LT((e.nodes.back().position - Vector3::UnitX()).norm(), 1e-10);
  EXPECT_NEAR(e.energy, 0.5 * 1.3 * 16, 1e-10);
}

TEST(RestCurvature, OnePerElementAllAlikeIsTheConstantOne) {
  Random random(62);
  RodProperties constant = rodOf(unevenStiffness(), 16), each = constant, nearly = constant;
  constant.rest_curvature = {Vector3(0.7, -1.1, 2)};
  each.rest_curvature.assign(16, Vector3(0.7, -1.1, 2));
  nearly.rest_curvature = each.rest_curvature;
  nearly.rest_curvature[3].x() += 1e-13;  // not alike to the code, and to nobody else
  EquilibriumBatch batch(constant), of_nearly(nearly);
  for (int trial = 0; trial < 20; ++trial) {
    const Vector6 a = randomWrench(random, 6.283, 40);
    const Equilibrium one = solved(constant, a), same = solved(each, a), other = solved(nearly, a);
    EXPECT_EQ(maxNodeDistance(one.nodes, same.nodes), 0);
    EXPECT_EQ(one.conjugate_points, same.conjugate_points);
    EXPECT_EQ(one.conjugate_points, other.conjugate_points);
    EXPECT_LT(maxNodeDistance(one.nodes, other.nodes), 1e-7);
    EXPECT_NEAR(one.first_conjugate_t.value_or(2), other.first_conjugate_t.value_or(2), 1e-8);
    EXPECT_NEAR(one.energy, other.energy, 1e-7 * (1 + one.energy));
    EquilibriumEnd end, end_of_nearly;
    batch.ends({&a, 1}, {&end, 1});
    of_nearly.ends({&a, 1}, {&end_of_nearly, 1});
    EXPECT_EQ(end.stable, end_of_nearly.stable);
    if (!end.stable) continue;
    EXPECT_LT((end.jacobian - end_of_nearly.jacobian).norm(), 1e-4 * end.jacobian.norm());
  }
}

TEST(RestCurvature, ShapeEnergyAndJacobianEqualTheLawsAndTheorem2IntegratedAsPrinted) {
  Random random(63);
  for (const Vector6& c : {roundStiffness(), unevenStiffness()}) {
    for (int trial = 0; trial < 10; ++trial) {
      RodProperties rod = rodOf(c);
      rod.rest_curvature = {randomVector(random, 6)};
      const Vector6 a = randomWrench(random, 6.283, 40);
      const State expected = integrate(a, c, 1, 2500, rod.rest_curvature[0]);
      const Equilibrium e = solved(rod, a);
      EXPECT_LT((e.nodes.back().position - expected.p).norm(), 1e-7);
      EXPECT_LT((e.nodes.back().rotation.toRotationMatrix() - expected.r).norm(), 1e-6);
      EXPECT_NEAR(e.energy, expected.energy, 1e-7 * (1 + expected.energy));
      EquilibriumIntegrator integrator(rod);
      EquilibriumEnd end;
      ASSERT_EQ(integrator.end(a, end), ChartStatus::equilibrium);
      EXPECT_LT((end.end_in_base.position - expected.p).norm(), 5e-6);
      EXPECT_LT((end.jacobian - expected.j).norm(), 1e-4 * expected.j.norm());
    }
  }
}

TEST(RestCurvature, OnePerElementEqualsTheLawsInWorldAxesLightAndHeavy) {
  Random random(64);
  for (int trial = 0; trial < 16; ++trial) {
    RodProperties rod = randomlyBent(trial % 2 ? roundStiffness() : unevenStiffness(), 10, random, 6);
    const Vector3 gravity = trial % 4 < 2 ? Vector3(0, 0, 0) : gravityFor(rod, 20, randomVector(random, 1));
    const Quaternion base = random.rotation();
    const Vector6 a = randomWrench(random, 6.283, 40);
    const Equilibrium e = solvedAt(rod, {base, Vector3::Zero()}, a, gravity);
    const auto expected = nodesOf(HeavyRod(rod, gravity), startOf(base, a), 10, 150);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      EXPECT_LT((e.nodes[i].position - expected[i].p).norm(), 1e-7);
      EXPECT_LT((e.nodes[i].rotation.toRotationMatrix() - expected[i].r).norm(), 1e-6);
    }
    EXPECT_NEAR(e.energy, expected.back().energy, 1e-7 * (1 + e.energy));
    EXPECT_NEAR(e.weight_energy, expected.back().weight_energy, 1e-7 * (1 + std::abs(e.weight_energy)));
  }
}

TEST(RestCurvature, EndJacobianIsTheDerivativeOfTheEndFrame) {
  Random random(65);
  for (int trial = 0; trial < 6; ++trial) {
    const RodProperties rod = randomlyBent(trial % 2 ? roundStiffness() : unevenStiffness(), 8, random, 5);
    EquilibriumIntegrator integrator(rod);
    const Vector6 a = randomWrench(random, 6.283, 40);
    EquilibriumEnd end;
    ASSERT_EQ(integrator.end(a, end), ChartStatus::equilibrium);
    const auto moved = [&](const Vector6& wrench) {
      const Place y = endOf(HeavyRod(rod), startOf(Quaternion::Identity(), wrench), 800);
      return Pose{Quaternion(y.r).normalized(), y.p};
    };
    for (int i = 0; i < 6; ++i) {
      const double d = 1e-3;
      const Vector6 u = d * Vector6::Unit(i);
      const Vector6 difference = (8 * logSE3(moved(a - u).inverse() * moved(a + u)) -
                                  logSE3(moved(a - 2 * u).inverse() * moved(a + 2 * u))) /
                                 (12 * d);
      EXPECT_LT((difference - end.jacobian.col(i)).norm(), 1e-6 * end.jacobian.norm()) << trial << " " << i;
    }
  }
}

TEST(RestCurvature, OnePerElementChangesTheConjugatePointsAsTheSecondVariationSays) {
  Random random(66);
  int compared = 0, unstable = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const RodProperties rod = randomlyBent(trial % 2 ? roundStiffness() : unevenStiffness(), 8, random, 6);
    const Vector6 a = randomWrench(random, 6.283, 40);
    const Equilibrium e = solved(rod, a);
    const int shorter = negativeDirections(HeavyRod(rod), Quaternion::Identity(), a, 0.999, 320),
              longer = negativeDirections(HeavyRod(rod), Quaternion::Identity(), a, 1.001, 320);
    if (shorter != longer) continue;
    ++compared, unstable += longer > 0;
    EXPECT_EQ(e.conjugate_points, longer) << trial << " " << e.first_conjugate_t.value_or(-1);
  }
  EXPECT_GT(compared, 36);
  EXPECT_GT(unstable, 8);
}

TEST(RestCurvature, FitEndsFindsPreformedRods) {
  Random random(67);
  RodProperties rod = rodOf(unevenStiffness(), 8);
  rod.rest_curvature = {Vector3(0.5, -1, 2)};
  RodSampler sampler(rod, {}, 3);
  for (int trial = 0; trial < 20; ++trial) {
    const Equilibrium* drawn = sampler.next();
    ASSERT_TRUE(drawn);
    const GripperPoses ends{drawn->base, drawn->nodes.back()};
    const std::vector<Equilibrium> found = fitEnds(rod, ends);
    EXPECT_FALSE(found.empty()) << trial;
    for (const Equilibrium& e : found) {
      EXPECT_EQ(e.stability, Stability::stable);
      EXPECT_LT((e.nodes.back().position - ends.last.position).norm(), 1e-9);
      EXPECT_LT(angleBetween(e.nodes.back().rotation, ends.last.rotation), 1e-9);
    }
  }
}

}  // namespace
}  // namespace tendril
