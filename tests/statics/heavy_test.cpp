// Heavy rods: against the laws in world axes, boundary value problems solved by shooting, and the second
// variation of elastic and weight energy.
#include "second_variation.h"
#include "tendril/statics/integrator.h"

namespace tendril {
namespace {

using namespace reference;

const Vector3 kDown(0, 0, -1);

/// L = 1 m, r = 0.01 m, 1000 kg/m^3, nu = 0.4.
RodProperties rodOfModulus(double young_modulus, int elements = 40) {
  RodProperties rod;
  rod.length = 1, rod.radius = 0.01, rod.density = 1000, rod.elements = elements;
  rod.c = stiffnessOfRoundRod(young_modulus, young_modulus / 2.8, rod.radius);
  return rod;
}

void expectSameRod(const Equilibrium& e, const std::vector<Place>& expected, double tolerance) {
  ASSERT_EQ(e.nodes.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const Vector3 position = e.base.position + expected[i].p;
    EXPECT_LT((e.nodes[i].position - position).norm(), tolerance) << i;
    EXPECT_LT((e.nodes[i].rotation.toRotationMatrix() - expected[i].r).norm(), 20 * tolerance) << i;
  }
}

TEST(HeavyRods, WithoutGravityTheyAreTheWeightlessOnes) {
  Random random(51);
  for (const Vector6& c : {roundStiffness(), unevenStiffness()}) {
    const RodProperties rod = rodOf(c);
    EquilibriumIntegrator light(rod), zero(rod, Vector3::Zero());
    // as good as nothing, but not zero: the other code
    EquilibriumIntegrator heavy(rod, gravityFor(rod, 1e-14, {1, 2, 3}));
    for (int trial = 0; trial < 20; ++trial) {
      const Pose base{random.rotation(), randomVector(random, 3)};
      const Vector6 a = randomWrench(random, 6.283, 40);
      Equilibrium one, same, other;
      ASSERT_EQ(light.solve(base, a, one), ChartStatus::equilibrium);
      ASSERT_EQ(zero.solve(base, a, same), ChartStatus::equilibrium);
      ASSERT_EQ(heavy.solve(base, a, other), ChartStatus::equilibrium);
      EXPECT_EQ(maxNodeDistance(one.nodes, same.nodes), 0);
      EXPECT_EQ(one.energy, same.energy);
      EXPECT_EQ(same.weight_energy, 0);
      EXPECT_EQ(one.conjugate_points, other.conjugate_points);
      EXPECT_EQ(one.stability, other.stability);
      EXPECT_EQ(heavy.isStable(base.rotation, a), light.isStable(a));
      EXPECT_LT(maxNodeDistance(one.nodes, other.nodes), 1e-7);  // other steps: base axes are not aligned
      EXPECT_NEAR(one.first_conjugate_t.value_or(2), other.first_conjugate_t.value_or(2), 1e-8);
      EquilibriumEnd light_end, heavy_end;
      ASSERT_EQ(light.end(base.rotation, a, light_end), ChartStatus::equilibrium);
      ASSERT_EQ(heavy.end(base.rotation, a, heavy_end), ChartStatus::equilibrium);
      EXPECT_LT((light_end.jacobian - heavy_end.jacobian).norm(), 1e-4 * light_end.jacobian.norm());
    }
  }
}

TEST(HeavyRods, EveryNodeAndBothEnergiesEqualTheLawsInWorldAxes) {
  Random random(52);
  for (const Vector6& c : {roundStiffness(), unevenStiffness()}) {
    const RodProperties rod = rodOf(c, 20);
    for (int trial = 0; trial < 12; ++trial) {
      const Vector3 gravity = gravityFor(rod, random.uniform(0, 40), randomVector(random, 1));
      const Pose base{random.rotation(), randomVector(random, 3)};
      const Vector6 a = randomWrench(random, 6.283, 30);
      const Equilibrium e = solvedAt(rod, base, a, gravity);
      const auto expected = nodesOf(HeavyRod(rod, gravity), startOf(base.rotation, a), 20, 60);
      expectSameRod(e, expected, 1e-7);
      EXPECT_NEAR(e.energy, expected.back().energy, 1e-7 * (1 + e.energy));
      EXPECT_NEAR(e.weight_energy, expected.back().weight_energy, 1e-7 * (1 + std::abs(e.weight_energy)));
    }
  }
}

TEST(HeavyRods, EndJacobianIsTheDerivativeOfTheEndFrame) {
  Random random(53);
  for (int trial = 0; trial < 10; ++trial) {
    RodProperties rod = rodOf(trial % 2 ? roundStiffness() : unevenStiffness(), 10);
    if (trial % 3 == 0) rod.rest_curvature.assign(1, Vector3(0.7, -1.1, 2));
    const Vector3 gravity = gravityFor(rod, random.uniform(0, 40), randomVector(random, 1));
    const Quaternion base = random.rotation();
    const Vector6 a = randomWrench(random, 6.283, 30);
    EquilibriumIntegrator integrator(rod, gravity);
    EquilibriumEnd end;
    ASSERT_EQ(integrator.end(base, a, end), ChartStatus::equilibrium);
    const auto moved = [&](const Vector6& wrench) {
      const Place y = endOf(HeavyRod(rod, gravity), startOf(base, wrench), 600);
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

TEST(HeavyRods, HorizontalCantileversHangAsShootingSays) {
  const struct {
    double young_modulus, x, z;
    int stages;
    double tolerance;
  } cases[] = {{1e8, 0.893350, -0.419313, 4, 1e-7}, {1e6, 0.074541, -0.975029, 25, 1e-7}};
  for (const auto& expected : cases) {
    const RodProperties rod = rodOfModulus(expected.young_modulus);
    const Vector3 gravity = 9.81 * kDown;
    const HeavyRod heavy(rod, gravity);
    const Vector6 a = cantileverWrench(heavy, Quaternion::Identity(), 800, expected.stages);
    // the base carries the whole weight
    EXPECT_NEAR(a[5], heavy.weight.z(), 1e-9 * heavy.weight.norm());
    const Equilibrium e = solvedAt(rod, {}, a, gravity);
    expectSameRod(e, nodesOf(heavy, startOf(Quaternion::Identity(), a), 40, 100), expected.tolerance);
    EXPECT_NEAR(e.nodes.back().position.x(), expected.x, 2e-6);
    EXPECT_NEAR(e.nodes.back().position.z(), expected.z, 2e-6);
    EXPECT_NEAR(e.nodes.back().position.y(), 0, 1e-9);
    EXPECT_EQ(e.stability, Stability::stable);  // free at its end it would be; held there all the more
  }
}

TEST(HeavyRods, InextensibleCantileversHaveTheKnownRatioOfDropToReach) {
  // Height over width against weight L^3 / EI (Romero et al., Physical validation of simulators in computer
  // graphics, 2021, the cantilever test).
  const struct {
    double gamma, ratio;
    int stages;
  } cases[] = {{1, 0.1246, 1}, {10, 1.067, 4}, {100, 5.888, 30}};
  for (const auto& known : cases) {
    const RodProperties rod = rodOf(vector6(0.7, 1, 1, 1e8, 1e8, 1e8));
    const Vector3 gravity = gravityFor(rod, known.gamma, kDown);
    const Vector6 a = cantileverWrench(HeavyRod(rod, gravity), Quaternion::Identity(), 250, known.stages);
    const Vector3 tip = solvedAt(rod, {}, a, gravity).nodes.back().position;
    EXPECT_NEAR(-tip.z() / tip.x(), known.ratio, 2e-3 * known.ratio) << known.gamma;
  }
}

TEST(HeavyRods, AHangingRodStretchesByHalfItsWeight) {
  const RodProperties rod = rodOf(vector6(0.7, 1, 1, 50, 40, 40));
  const double gamma = 5;
  const Pose base{expSO3({0, kPi / 2, 0}), {1, 2, 3}};  // its x axis points down
  const Equilibrium e = solvedAt(rod, base, vector6(0, 0, 0, gamma, 0, 0), gravityFor(rod, gamma, kDown));
  EXPECT_LT((e.nodes.back().position - Vector3(1, 2, 3 - (1 + gamma / (2 * 50)))).norm(), 1e-12);
  EXPECT_NEAR(e.energy, gamma * gamma / (6 * 50), 1e-12);
  EXPECT_NEAR(e.weight_energy, -gamma * (0.5 + gamma / (3 * 50)), 1e-12);
  EXPECT_EQ(e.stability, Stability::stable);
}

TEST(HeavyRods, ATiltedBaseLetsThemHangInSpaceAsShootingSays) {
  Random random(54);
  for (int trial = 0; trial < 4; ++trial) {
    RodProperties rod = rodOf(unevenStiffness(), 20);
    rod.rest_curvature.assign(1, randomVector(random, 2));
    const Vector3 gravity = gravityFor(rod, 6, kDown);  // less than what buckles a mast
    const Quaternion base = random.rotation();
    const Vector6 a = cantileverWrench(HeavyRod(rod, gravity), base, 400, 8);
    const Equilibrium e = solvedAt(rod, {base, Vector3::Zero()}, a, gravity);
    expectSameRod(e, nodesOf(HeavyRod(rod, gravity), startOf(base, a), 20, 60), 1e-7);
    // the tip carries nothing: by balance about the base
    const Vector3 force = HeavyRod(rod, gravity).weight;
    EXPECT_LT((base * Vector3(a.tail<3>()) - force).norm(), 1e-8);
  }
}

/// The wrench of the rod that comes from a weightless one with wrench `a` as its weight grows between fixed
/// ends, by shooting.
Vector6 shotUnderWeight(const RodProperties& rod, const Pose& base, const Vector6& a, const Pose& last,
                        const Vector3& gravity, int stages) {
  Eigen::VectorXd wrench = a;
  for (int stage = 1; stage <= stages; ++stage) {
    HeavyRod heavy(rod, gravity);
    heavy.weight *= static_cast<double>(stage) / stages;
    const auto miss = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
      const Place y = endOf(heavy, startOf(base.rotation, x), 200);
      return logSE3(Pose{Quaternion(y.r).normalized(), base.position + y.p}.inverse() * last);
    };
    EXPECT_TRUE(shoot(miss, 1e-5, 1e-10, wrench)) << stage;
  }
  return wrench;
}

TEST(HeavyRods, FitEndsFindsTheSaggingRodThatShootingFinds) {
  const struct {
    Vector6 c, a;
    double gamma;
  } cases[] = {{unevenStiffness(), vector6(0.5, 1, -2, 3, 4, -5), 10},
               {roundStiffness(), vector6(-1, 3, 1, -6, 5, 8), 15},
               {roundStiffness(), vector6(0.3, -2, 0.5, 2, -3, 6), 30},
               {unevenStiffness(), vector6(1, 1, 1.5, 5, -4, 4), 20},
               {softStiffness(), vector6(1, -1, 2, 0.5, 1, -1), 2}};
  int trial = 0;
  for (const auto& one : cases) {
    SCOPED_TRACE(trial++);
    const RodProperties rod = rodOf(one.c, 20);
    const Pose base{expSO3({0.3, -0.2, 0.5}), {1, -2, 0.5}};
    const Vector3 gravity = gravityFor(rod, one.gamma, kDown);
    const Place light = endOf(HeavyRod(rod), startOf(base.rotation, one.a), 400);
    const GripperPoses ends{base, {Quaternion(light.r).normalized(), base.position + light.p}};
    const Vector6 a = shotUnderWeight(rod, base, one.a, ends.last, gravity, 8);
    const auto places = nodesOf(HeavyRod(rod, gravity), startOf(base.rotation, a), 20, 40);
    ASSERT_EQ(negativeDirections(HeavyRod(rod, gravity), base.rotation, a, 1, 200), 0);
    const std::vector<Equilibrium> found = fitEnds(rod, ends, gravity);
    ASSERT_FALSE(found.empty());
    bool seen = false;
    for (const Equilibrium& e : found) {
      EXPECT_EQ(e.stability, Stability::stable);
      if ((e.wrench - a).norm() > 1e-4) continue;
      seen = true;
      expectSameRod(e, places, 2e-7);
      EXPECT_NEAR(e.energy, places.back().energy, 1e-6 * (1 + e.energy));
      EXPECT_NEAR(e.weight_energy, places.back().weight_energy, 1e-6 * (1 + std::abs(e.weight_energy)));
    }
    EXPECT_TRUE(seen) << a.transpose();
  }
}

TEST(HeavyRods, FitEndsFindsStableRodsWithTheEndsAskedFor) {
  Random random(55);
  int tried = 0, fitted = 0;
  const RodProperties rod = rodOf(unevenStiffness(), 10);
  const Vector3 gravity = gravityFor(rod, 20, {0.3, 0.1, -1});
  const HeavyRod heavy(rod, gravity);
  SamplingSpace space;
  space.gravity = gravity;
  RodSampler sampler(rod, space, 7);
  for (; tried < 15; ++tried) {
    const Equilibrium* drawn = sampler.next();
    ASSERT_TRUE(drawn);
    const GripperPoses ends{drawn->base, drawn->nodes.back()};
    const std::vector<Equilibrium> found = fitEnds(rod, ends, gravity);
    fitted += !found.empty();
    for (std::size_t i = 0; i < found.size(); ++i) {
      const Equilibrium& e = found[i];
      const Equilibrium& previous = found[i > 0 ? i - 1 : 0];
      EXPECT_LE(previous.energy + previous.weight_energy, e.energy + e.weight_energy);
      EXPECT_EQ(e.stability, Stability::stable);
      EXPECT_EQ(e.nodes.front().position, ends.first.position);
      EXPECT_LT((e.nodes.back().position - ends.last.position).norm(), 1e-9);
      EXPECT_LT(angleBetween(e.nodes.back().rotation, ends.last.rotation), 1e-9);
      if (tried > 5) continue;
      const Place y = endOf(heavy, startOf(ends.first.rotation, e.wrench), 1000);
      EXPECT_LT((ends.first.position + y.p - ends.last.position).norm(), 1e-7);
    }
  }
  EXPECT_GE(fitted, 0.8 * tried);
}

TEST(HeavyRods, ConjugatePointsAreAsManyAsTheNegativeDirectionsOfTheSecondVariation) {
  Random random(56);
#ifdef NDEBUG
  constexpr int kTrials = 160;
#else
  constexpr int kTrials = 30;
#endif
  int compared = 0, unstable = 0, changed = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    RodProperties rod = rodOf(trial % 3 == 0   ? roundStiffness()
                              : trial % 3 == 1 ? unevenStiffness()
                                               : softStiffness(),
                              8);
    const double scale = random.uniform(0.3, 1.2) * (trial % 3 == 2 ? 0.15 : 1);
    if (trial % 4 == 3) rod.rest_curvature.assign(1, randomVector(random, 3));
    if (trial % 8 == 7) rod.rest_curvature.assign(8, randomVector(random, 3));
    if (trial % 8 == 7) rod.rest_curvature[2] = rod.rest_curvature[5] = randomVector(random, 4);
    const Vector3 gravity = gravityFor(rod, scale * random.uniform(0, 60), randomVector(random, 1));
    const Quaternion base = random.rotation();
    const Vector6 a = randomWrench(random, 6.283, 40 * scale);
    EquilibriumIntegrator integrator(rod, gravity);
    Equilibrium e;
    if (integrator.solve({base, Vector3::Zero()}, a, e) == ChartStatus::inverted) continue;
    const HeavyRod heavy(rod, gravity);
    int shorter = 0, longer = 1;
    for (const int elements : {160, 1280}) {
      const double band = 1e-3 * std::pow(160.0 / elements, 2);
      shorter = negativeDirections(heavy, base, a, 1 - band, elements);
      longer = negativeDirections(heavy, base, a, 1 + band, elements);
      if (shorter == longer) break;
    }
    if (shorter != longer) continue;
    ++compared, unstable += longer > 0;
    EXPECT_EQ(e.conjugate_points, longer) << trial << " " << e.first_conjugate_t.value_or(-1);
    EXPECT_EQ(e.stability, longer > 0 ? Stability::unstable : Stability::stable);
    EXPECT_EQ(integrator.isStable(base, a), longer == 0);
    EquilibriumEnd end;
    ASSERT_EQ(integrator.end(base, a, end), ChartStatus::equilibrium);
    EXPECT_EQ(end.stable, longer == 0);
    // the weight's own second variation matters: the same shape's elastic energy alone says otherwise
    changed += rod.rest_curvature.empty() && EquilibriumIntegrator(rod).isStable(a) != (longer == 0);
  }
  EXPECT_GT(compared, kTrials * 8 / 10);
  EXPECT_GT(unstable, compared / 5);
  EXPECT_GT(changed, 0);
}

TEST(HeavyRods, NearTheirFirstConjugateTimeTheSecondVariationAgrees) {
  Random random(57);
#ifdef NDEBUG
  constexpr int kRods = 15;
#else
  constexpr int kRods = 2;
#endif
  for (int found = 0; found < kRods;) {
    RodProperties rod = rodOf(found % 2 ? roundStiffness() : unevenStiffness(), 1);
    const Vector3 gravity = gravityFor(rod, random.uniform(5, 40), randomVector(random, 1));
    const Quaternion base = random.rotation();
    const Vector6 a = randomWrench(random, 6.283, 40);
    Equilibrium e;
    EquilibriumIntegrator integrator(rod, gravity);
    if (integrator.solve({base, Vector3::Zero()}, a, e) == ChartStatus::inverted ||
        e.stability != Stability::unstable)
      continue;
    ++found;
    for (const double off : {-1e-3, -1e-4, 1e-4, 1e-3}) {
      rod.length = *e.first_conjugate_t * (1 + off);
      const int negative =
          negativeDirections(HeavyRod(rod, gravity), base, a, rod.length, std::abs(off) < 5e-4 ? 1500 : 600);
      EXPECT_EQ(negative > 0, off > 0);
      EXPECT_EQ(solvedAt(rod, {base, Vector3::Zero()}, a, gravity).conjugate_points, negative);
    }
  }
}

TEST(HeavyRods, AClampedColumnBucklesUnderItsOwnWeightAtTheCriticalHeight) {
  // integral of v''^2 - gamma (1 - s) v'^2 on v = s^2 (1 - s)^2 s^k (Ritz); the top carries no axial force.
  constexpr int kTerms = 9;
  Eigen::MatrixXd bending = Eigen::MatrixXd::Zero(kTerms, kTerms), weight = bending;
  constexpr int kCells = 20000;
  for (int cell = 0; cell < kCells; ++cell) {
    const double s = (cell + 0.5) / kCells;
    Eigen::VectorXd slope(kTerms), curvature(kTerms);
    for (int k = 0; k < kTerms; ++k) {
      // s^(k+2) - 2 s^(k+3) + s^(k+4)
      const auto first = [&](int p) { return p * std::pow(s, p - 1); };
      const auto second = [&](int p) { return p * (p - 1) * std::pow(s, p - 2); };
      slope[k] = first(k + 2) - 2 * first(k + 3) + first(k + 4);
      curvature[k] = second(k + 2) - 2 * second(k + 3) + second(k + 4);
    }
    bending += curvature * curvature.transpose() / kCells;
    weight += (1 - s) * slope * slope.transpose() / kCells;
  }
  // the largest 1 / gamma
  const double critical =
      1 / Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd>(weight, bending).eigenvalues().maxCoeff();
  EXPECT_NEAR(critical, 74.63, 0.02);  // Timoshenko and Gere, Theory of elastic stability, 2.12
  const RodProperties rod = rodOf(vector6(0.7, 1, 1, 1e9, 1e9, 1e9));
  const Pose upright{expSO3({0, -kPi / 2, 0}), Vector3::Zero()};
  const auto column = [&](double gamma) {
    return solvedAt(rod, upright, vector6(0, 0, 0, -gamma, 0, 0), gravityFor(rod, gamma, kDown));
  };
  EXPECT_EQ(column(critical * (1 - 1e-5)).stability, Stability::stable);
  const Equilibrium buckled = column(critical * (1 + 1e-5));
  EXPECT_EQ(buckled.stability, Stability::unstable);
  EXPECT_EQ(buckled.conjugate_points, 2);
}

TEST(HeavyRods, TurningBaseAndGravityTogetherTurnsTheRod) {
  Random random(58);
  for (int trial = 0; trial < 20; ++trial) {
    const RodProperties rod = rodOf(unevenStiffness(), 10);
    const Vector3 gravity = gravityFor(rod, 25, randomVector(random, 1));
    const Pose base{random.rotation(), randomVector(random, 2)}, turn{random.rotation(), Vector3(1, 2, 3)};
    const Vector6 a = randomWrench(random, 6.283, 30);
    const Equilibrium one = solvedAt(rod, base, a, gravity);
    const Equilibrium turned = solvedAt(rod, turn * base, a, turn.rotation * gravity);
    EXPECT_EQ(one.conjugate_points, turned.conjugate_points);
    EXPECT_NEAR(one.energy, turned.energy, 1e-10 * (1 + one.energy));
    EXPECT_NEAR(one.weight_energy, turned.weight_energy, 1e-10 * (1 + std::abs(one.weight_energy)));
    for (std::size_t i = 0; i < one.nodes.size(); ++i) {
      EXPECT_LT(((turn * one.nodes[i]).position - turned.nodes[i].position).norm(), 1e-11);
      EXPECT_LT(angleBetween((turn * one.nodes[i]).rotation, turned.nodes[i].rotation), 1e-10);
    }
  }
}

TEST(HeavyRods, UnitsDoNotMatter) {
  // The same rod in millimetres and grams, so to speak: lengths by 1e-3, forces by 1e6.
  Random random(59);
  const RodProperties rod = rodOf(unevenStiffness(), 10);
  const Vector3 gravity = gravityFor(rod, 25, {1, 1, -3});
  for (int trial = 0; trial < 10; ++trial) {
    const Quaternion base = random.rotation();
    const Vector6 a = randomWrench(random, 6.283, 30);
    const Equilibrium one = solvedAt(rod, {base, Vector3::Zero()}, a, gravity);
    constexpr double kLength = 1e-3, kForce = 1e6;
    RodProperties other = rod;
    other.length *= kLength, other.radius *= kLength;
    other.c.head<3>() *= kForce * kLength * kLength, other.c.tail<3>() *= kForce;
    other.density *= kForce / std::pow(kLength, 3);
    Vector6 b = a;
    b.head<3>() *= kForce * kLength, b.tail<3>() *= kForce;
    const Equilibrium same = solvedAt(other, {base, Vector3::Zero()}, b, gravity);
    EXPECT_EQ(same.conjugate_points, one.conjugate_points);
    EXPECT_LT((same.nodes.back().position / kLength - one.nodes.back().position).norm(), 1e-10);
    EXPECT_NEAR(same.weight_energy / kForce / kLength, one.weight_energy, 1e-9);
  }
}

}  // namespace
}  // namespace tendril
