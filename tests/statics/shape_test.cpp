// Theorem 1: the shape, its energy and the Jacobian of its end.
#include <algorithm>

#include "heavy_reference.h"
#include "tendril/statics/integrator.h"

namespace tendril {
namespace {

using namespace reference;

constexpr double kMoment = 6.283, kForce = 40;

/// The end of a rod, exactly: far more steps than anything else takes.
statics::NaturalEnd exactEnd(statics::Integrator& integrator, const Vector6& a) {
  statics::NaturalEnd end;
  EXPECT_EQ(integrator.end(a, Vector3::Zero(), {8, 1e-6}, end), ChartStatus::equilibrium);
  return end;
}

TEST(Statics, MatricesFAndHEqualTheOnesPrintedInTheorem2) {
  Random random(1);
  for (int trial = 0; trial < 100; ++trial) {
    const Vector6 mu = randomWrench(random, 8, 50), k = unevenStiffness().cwiseInverse();
    const double m1 = mu[0], m2 = mu[1], m3 = mu[2], n1 = mu[3], n2 = mu[4], n3 = mu[5];
    Matrix6 f, h;
    f << 0, m3 * (k[2] - k[1]), m2 * (k[2] - k[1]), 0, n3 * (k[5] - k[4]), n2 * (k[5] - k[4]),      //
        m3 * (k[0] - k[2]), 0, m1 * (k[0] - k[2]), n3 * (k[3] - k[5]), 0, 1 + n1 * (k[3] - k[5]),   //
        m2 * (k[1] - k[0]), m1 * (k[1] - k[0]), 0, n2 * (k[4] - k[3]), -1 + n1 * (k[4] - k[3]), 0,  //
        0, -n3 * k[1], n2 * k[2], 0, m3 * k[2], -m2 * k[1],                                         //
        n3 * k[0], 0, -n1 * k[2], -m3 * k[2], 0, m1 * k[0],                                         //
        -n2 * k[0], n1 * k[1], 0, m2 * k[1], -m1 * k[0], 0;
    h << 0, m3 * k[2], -m2 * k[1], 0, 0, 0,                      //
        -m3 * k[2], 0, m1 * k[0], 0, 0, 0,                       //
        m2 * k[1], -m1 * k[0], 0, 0, 0, 0,                       //
        0, n3 * k[5], -n2 * k[4], 0, m3 * k[2], -m2 * k[1],      //
        -n3 * k[5], 0, 1 + n1 * k[3], -m3 * k[2], 0, m1 * k[0],  //
        n2 * k[4], -1 - n1 * k[3], 0, m2 * k[1], -m1 * k[0], 0;
    EXPECT_LT((matrixF(mu, unevenStiffness()) - f).norm(), 1e-12);
    EXPECT_LT((matrixH(mu, unevenStiffness()) - h).norm(), 1e-12);
  }
}

TEST(Statics, ShapeEnergyAndEndJacobianEqualTheLawsAndTheorem2IntegratedAsPrinted) {
  Random random(2);
  for (const Vector6& c : {roundStiffness(), unevenStiffness(), softStiffness()}) {
    const double force = c == softStiffness() ? 4 : kForce;
    EquilibriumIntegrator integrator(rodOf(c));
    for (int trial = 0; trial < 15; ++trial) {
      const Vector6 a = randomWrench(random, kMoment, force);
      const State expected = integrate(a, c, 1, 2000);
      Equilibrium e;
      ASSERT_EQ(integrator.solve({}, a, e), ChartStatus::equilibrium);
      EquilibriumEnd end;
      ASSERT_EQ(integrator.end(a, end), ChartStatus::equilibrium);
      EXPECT_LT((e.nodes.back().position - expected.p).norm(), 1e-7);
      EXPECT_LT((e.nodes.back().rotation.toRotationMatrix() - expected.r).norm(), 1e-6);
      EXPECT_LT((end.end_in_base.position - expected.p).norm(), 4e-6);
      EXPECT_LT((end.end_in_base.rotation.toRotationMatrix() - expected.r).norm(), 4e-5);
      EXPECT_NEAR(e.energy, expected.energy, 1e-7 * (1 + expected.energy));
      EXPECT_NEAR(end.energy, expected.energy, 1e-4 * (1 + expected.energy));
      EXPECT_LT((end.jacobian - expected.j).norm(), 1e-4 * expected.j.norm());
      EXPECT_EQ(e.weight_energy, 0);
    }
  }
}

TEST(Statics, FineIntegrationAgreesWithTheLawsInWorldAxesToEightDigits) {
  // What the larger tests below take for exact.
  Random random(3);
  for (const Vector6& c : {roundStiffness(), unevenStiffness()}) {
    statics::Integrator integrator(statics::NaturalRod(rodOf(c), Vector3::Zero()));
    for (int trial = 0; trial < 15; ++trial) {
      const Vector6 a = randomWrench(random, kMoment, kForce);
      const statics::NaturalEnd end = exactEnd(integrator, a);
      const Place expected = endOf(HeavyRod(rodOf(c)), startOf(Quaternion::Identity(), a), 2000);
      EXPECT_LT((end.end.position - expected.p).norm(), 2e-10);
      EXPECT_LT((end.end.rotation.toRotationMatrix() - expected.r).norm(), 2e-9);
      EXPECT_NEAR(end.energy, expected.energy, 1e-9 * (1 + expected.energy));
    }
  }
}

TEST(Statics, NinetyNineEndsInAHundredAreWithinOneMillionthOfTheLength) {
  Random random(4);
  const RodProperties rod = rodOf(roundStiffness());
  EquilibriumBatch batch(rod);
  EquilibriumIntegrator single(rod);
  statics::Integrator exact(statics::NaturalRod(rod, Vector3::Zero()));
  std::vector<Vector6> wrenches;
  for (int i = 0; i < 2000; ++i) wrenches.push_back(randomWrench(random, 6, 40));
  std::vector<EquilibriumEnd> ends(wrenches.size());
  batch.shapes(wrenches, ends);
  std::vector<double> of_batch, of_single, of_solve;
  Equilibrium e;
  for (std::size_t i = 0; i < wrenches.size(); ++i) {
    const Vector3 expected = exactEnd(exact, wrenches[i]).end.position;
    EquilibriumEnd end;
    ASSERT_EQ(single.end(wrenches[i], end), ChartStatus::equilibrium);
    ASSERT_EQ(single.shape({}, wrenches[i], e), ChartStatus::equilibrium);
    of_batch.push_back((ends[i].end_in_base.position - expected).norm());
    of_single.push_back((end.end_in_base.position - expected).norm());
    of_solve.push_back((e.nodes.back().position - expected).norm());
  }
  for (std::vector<double>* errors : {&of_batch, &of_single, &of_solve})
    std::sort(errors->begin(), errors->end());
  EXPECT_LE(of_batch[1980], 1e-6);
  EXPECT_LE(of_single[1980], 1e-6);
  EXPECT_LE(of_solve[1980], 1e-8);
  EXPECT_LE(of_batch.back(), 1e-5);
  EXPECT_LE(of_single.back(), 1e-5);
  EXPECT_LE(of_solve.back(), 1e-7);
}

TEST(Statics, EndJacobianIsTheDerivativeOfTheEndFrame) {
  Random random(5);
  for (const Vector6& c : {roundStiffness(), unevenStiffness()}) {
    // not its own units: length, stiffness and wrench all have some
    RodProperties rod = rodOf(c, 10, 0.7);
    rod.c *= 3;
    const statics::NaturalRod natural(rod, Vector3::Zero());
    statics::Integrator exact(natural);
    EquilibriumIntegrator integrator(rod);
    for (int trial = 0; trial < 20; ++trial) {
      const Vector6 a = randomWrench(random, 15, 80);
      EquilibriumEnd end;
      ASSERT_EQ(integrator.end(a, end), ChartStatus::equilibrium);
      const double size = end.jacobian.norm();
      for (int i = 0; i < 6; ++i) {
        const double d = 1e-3;
        const auto moved = [&](double by) {
          Pose q = exactEnd(exact, natural.units.wrenchToNatural(a + by * Vector6::Unit(i))).end;
          q.position *= rod.length;
          return q;
        };
        const Vector6 difference =
            (8 * logSE3(moved(-d).inverse() * moved(d)) - logSE3(moved(-2 * d).inverse() * moved(2 * d))) /
            (12 * d);
        EXPECT_LT((difference - end.jacobian.col(i)).norm(), 2e-5 * size) << i;
      }
    }
  }
}

TEST(Statics, WrenchAlongTheRodIsTheFirstOneCarriedByTheAdjoint) {
  // mu from the nodes against m' = -p' x n, n' = 0 in world axes.
  Random random(6);
  for (const Vector6& c : {roundStiffness(), unevenStiffness()}) {
    const RodProperties rod = rodOf(c, 20);
    for (int trial = 0; trial < 5; ++trial) {
      const Vector6 a = randomWrench(random, kMoment, kForce);
      const Equilibrium e = solved(rod, a);
      const std::vector<Place> expected =
          nodesOf(HeavyRod(rod), startOf(Quaternion::Identity(), a), rod.elements, 50);
      for (std::size_t i = 0; i < e.nodes.size(); ++i)
        EXPECT_LT((adjoint(e.nodes[i]).transpose() * a - expected[i].mu()).norm(), 1e-6 * (1 + a.norm()));
    }
  }
}

TEST(Statics, ForceMagnitudeMomentDotForceAndHamiltonianAreConstantAlongTheRod) {
  // By the chart's frames, and by the laws in world axes. H also with a constant curvature at rest.
  Random random(7);
  for (const Vector6& c : {roundStiffness(), unevenStiffness()}) {
    for (const Vector3& kappa0 : {Vector3(0, 0, 0), Vector3(0.7, -1.1, 2)}) {
      RodProperties rod = rodOf(c, 64);
      rod.rest_curvature.assign(1, kappa0);
      const auto invariants = [&](const Vector6& mu) {
        const Vector3 m = mu.head<3>(), n = mu.tail<3>();
        return Vector3(n.squaredNorm(), m.dot(n), 0.5 * mu.dot(strain(mu, c)) + mu[3] + m.dot(kappa0));
      };
      statics::Integrator integrator(statics::NaturalRod(rod, Vector3::Zero()));
      for (int trial = 0; trial < 10; ++trial) {
        const Vector6 a = randomWrench(random, kMoment, kForce);
        const Vector3 expected = invariants(a);
        const double size = 1 + a.squaredNorm();
        ASSERT_EQ(integrator.integrate(a, Vector3::Zero(), {40, 1e-6}, nullptr), ChartStatus::equilibrium);
        for (int i = 0; i <= rod.elements; ++i) {
          const Pose q = integrator.node(i, rod.elements);
          EXPECT_LT((invariants(adjoint(q).transpose() * a) - expected).norm(), 1e-10 * size);
        }
        for (const Place& y : nodesOf(HeavyRod(rod), startOf(Quaternion::Identity(), a), 8, 200))
          EXPECT_LT((invariants(y.mu()) - expected).norm(), 1e-9 * size);
      }
    }
  }
}

TEST(Statics, NodesBetweenStepsAreAsExactAsTheEnd) {
  Random random(8);
  std::vector<double> positions, angles;
  for (int trial = 0; trial < 60; ++trial) {
    const RodProperties rod = rodOf(roundStiffness(), 37);
    const Vector6 a = randomWrench(random, kMoment, kForce);
    const Equilibrium e = solved(rod, a);
    const std::vector<Place> exact = nodesOf(HeavyRod(rod), startOf(Quaternion::Identity(), a), 37, 20);
    for (std::size_t i = 0; i < e.nodes.size(); ++i) {
      positions.push_back((e.nodes[i].position - exact[i].p).norm());
      angles.push_back(angleBetween(e.nodes[i].rotation, Quaternion(exact[i].r).normalized()));
      EXPECT_NEAR(e.nodes[i].rotation.norm(), 1, 1e-14);
    }
  }
  std::sort(positions.begin(), positions.end());
  std::sort(angles.begin(), angles.end());
  const std::size_t p99 = positions.size() * 99 / 100;
  EXPECT_LT(positions[p99], 1e-7);
  EXPECT_LT(positions.back(), 4e-7);
  EXPECT_LT(angles[p99], 1e-6);
  EXPECT_LT(angles.back(), 4e-6);
}

TEST(Statics, ScalingStiffnessAndWrenchChangesNothing) {
  Random random(9);
  for (int trial = 0; trial < 20; ++trial) {
    const Vector6 c = trial % 2 ? roundStiffness() : unevenStiffness(), a = randomWrench(random, 6.283, 40);
    const Equilibrium one = solved(rodOf(c), a);
    for (double k = 1e-6; k < 2e6; k *= 10) {
      const Equilibrium scaled = solved(rodOf(k * c), k * a);
      EXPECT_EQ(scaled.stability, one.stability);
      EXPECT_EQ(scaled.conjugate_points, one.conjugate_points);
      EXPECT_NEAR(scaled.first_conjugate_t.value_or(2), one.first_conjugate_t.value_or(2), 5e-9);
      EXPECT_LT(maxNodeDistance(scaled.nodes, one.nodes), 1e-11);
      EXPECT_NEAR(scaled.energy / k, one.energy, 1e-10 * (1 + one.energy));
    }
  }
}

TEST(Statics, LengthIsAUnitToo) {
  Random random(10);
  for (int trial = 0; trial < 10; ++trial) {
    const Vector6 c = unevenStiffness(), a = randomWrench(random, 6.283, 40);
    const Equilibrium one = solved(rodOf(c), a);
    for (const double l : {1e-6, 7.3, 1e6}) {
      Vector6 c_long = c, a_long = a;
      c_long.tail<3>() /= l * l, a_long.head<3>() /= l, a_long.tail<3>() /= l * l;
      const Equilibrium longer = solved(rodOf(c_long, 40, l), a_long);
      EXPECT_EQ(longer.stability, one.stability);
      EXPECT_EQ(longer.conjugate_points, one.conjugate_points);
      EXPECT_LT((longer.nodes.back().position / l - one.nodes.back().position).norm(), 1e-11);
      EXPECT_NEAR(longer.energy * l, one.energy, 1e-10 * (1 + one.energy));
    }
  }
}

TEST(Statics, FirstNodeIsTheBaseToTheBitAndTheShapeMovesWithIt) {
  Random random(7);
  const RodProperties rod = rodOf(unevenStiffness(), 20);
  for (int trial = 0; trial < 10; ++trial) {
    const Vector6 a = randomWrench(random, kMoment, kForce);
    const Pose base{random.rotation(), {random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-5, 5)}};
    const Equilibrium at_origin = solved(rod, a), moved = solvedAt(rod, base, a);
    EXPECT_EQ(moved.nodes.front().position, base.position);
    EXPECT_EQ(moved.nodes.front().rotation.coeffs(), base.rotation.coeffs());
    EXPECT_EQ(moved.energy, at_origin.energy);
    for (std::size_t i = 0; i < moved.nodes.size(); ++i) {
      const Pose expected = base * at_origin.nodes[i];
      EXPECT_LT((moved.nodes[i].position - expected.position).norm(), 1e-13);
      EXPECT_LT(angleBetween(moved.nodes[i].rotation, expected.rotation), 1e-13);
    }
  }
}

TEST(Statics, ShapeAndSolveGiveTheSameRodButForRounding) {
  Random random(8);
  EquilibriumIntegrator integrator(rodOf(roundStiffness()));
  for (int trial = 0; trial < 20; ++trial) {
    const Vector6 a = randomWrench(random, kMoment, kForce);
    Equilibrium shape, solution;
    (void)integrator.shape({}, a, shape);
    (void)integrator.solve({}, a, solution);
    EXPECT_NEAR(shape.energy, solution.energy, 1e-12 * solution.energy);
    EXPECT_LT(maxNodeDistance(shape.nodes, solution.nodes), 1e-13);
    for (std::size_t i = 0; i < shape.nodes.size(); ++i)
      EXPECT_LT(angleBetween(shape.nodes[i].rotation, solution.nodes[i].rotation), 1e-12);
  }
}

TEST(Statics, EndMomentTwoPiEIOverLClosesTheRodIntoACircle) {
  for (const double length : {0.2, 1.0, 30.0}) {
    for (const double young_modulus : {1e5, 2e11}) {
      RodProperties rod;
      rod.length = length, rod.radius = 0.01 * length, rod.elements = 50;
      rod.c = stiffnessOfRoundRod(young_modulus, young_modulus / 2.8, rod.radius);
      const double ei = rod.c[1];
      const Equilibrium e = solved(rod, vector6(0, 0, 2 * kPi * ei / length, 0, 0, 0));
      EXPECT_LT((e.nodes.back().position - e.nodes.front().position).norm(), 1e-8 * length);
      EXPECT_LT(angleBetween(e.nodes.back().rotation, e.nodes.front().rotation), 1e-7);
      EXPECT_NEAR(e.energy, 2 * kPi * kPi * ei / length, 1e-8 * ei / length);
      for (const Pose& node : e.nodes)
        EXPECT_NEAR((node.position - Vector3(0, length / (2 * kPi), 0)).norm(), length / (2 * kPi),
                    2e-7 * length);
    }
  }
}

TEST(Statics, AxialForceStretchesAndTransverseForceOfAShortRodShears) {
  const Vector6 c = vector6(1, 1, 1, 50, 40, 30);
  const Equilibrium pulled = solved(rodOf(c), vector6(0, 0, 0, 10, 0, 0));
  EXPECT_LT((pulled.nodes.back().position - Vector3(1.2, 0, 0)).norm(), 1e-12);
  EXPECT_NEAR(pulled.energy, 0.5 * 100 / 50, 1e-12);
}

TEST(Statics, ARodCompressedToNothingIsInverted) {
  const Vector6 c = vector6(1, 1, 1, 20, 40, 40);
  EquilibriumIntegrator integrator(rodOf(c));
  Equilibrium e;
  EquilibriumBatch batch(rodOf(c));
  EquilibriumEnd end;
  for (const double force : {-19.1, -21.0, -500.0}) {
    const Vector6 a = vector6(0, 0, 0, force, 0, 0);
    batch.shapes({&a, 1}, {&end, 1});
    EXPECT_EQ(end.energy, std::numeric_limits<double>::infinity());
    end.stable = true;
    batch.ends({&a, 1}, {&end, 1});
    EXPECT_FALSE(end.stable);
    bool stable = true;
    batch.areStable({&a, 1}, {&stable, 1});
    EXPECT_FALSE(stable);
    EXPECT_EQ(integrator.solve({}, a, e), ChartStatus::inverted);
    EXPECT_EQ(integrator.shape({}, a, e), ChartStatus::inverted);
    EXPECT_EQ(integrator.end(a, end), ChartStatus::inverted);
    EXPECT_FALSE(integrator.isStable(a));
  }
  EXPECT_EQ(integrator.shape({}, vector6(0, 0, 0, -18.9, 0, 0), e), ChartStatus::equilibrium);
}

TEST(Statics, AnySqueezeBeyondTheRodsLengthIsInvertedHoweverStrong) {
  const RodProperties rod;
  EquilibriumIntegrator integrator(rod);
  Equilibrium e;
  for (const double strain : {1.0, 10.0, 1e6, 1e12}) {
    EXPECT_EQ(integrator.solve({}, -strain * rod.c[3] * Vector6::Unit(3), e), ChartStatus::inverted);
    EXPECT_EQ(integrator.shape({}, -strain * rod.c[3] * Vector6::Unit(3), e), ChartStatus::inverted);
  }
}

TEST(Statics, ARodInvertedOnlyInItsMiddleIsInverted) {
  // The force turns from tension to compression and back relative to the tangent as the rod curls through a
  // full turn.
  const Vector6 c = vector6(1, 1, 1, 20, 1e4, 1e4), a = vector6(0, 0, 15, 20, 0, 0);
  double smallest = 1, at_end = 1;
  for (int i = 0; i <= 200; ++i) {
    at_end = 1 + integrate(a, c, i / 200.0, 400).mu[3] / c[3];
    smallest = std::min(smallest, at_end);
  }
  ASSERT_LT(smallest, 0.04);
  EquilibriumIntegrator integrator(rodOf(c));
  Equilibrium e;
  EXPECT_EQ(integrator.shape({}, a, e), ChartStatus::inverted);
}

TEST(Statics, BadRodsAndWrenchesAreBadInput) {
  RodProperties rod = rodOf(roundStiffness());
  EquilibriumIntegrator integrator(rod);
  EXPECT_THROW((void)integrator.isStable(Vector6::Constant(NAN)), InputError);
  EXPECT_THROW((void)integrator.isStable(vector6(1e6, 0, 0, 0, 0, 0)), InputError);
  rod.c[4] = 0;
  EXPECT_THROW(EquilibriumIntegrator{rod}, InputError);
  rod = rodOf(roundStiffness());
  rod.length = -1;
  EXPECT_THROW(EquilibriumIntegrator{rod}, InputError);
}

}  // namespace
}  // namespace tendril
