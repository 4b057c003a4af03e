// Theorem 1: the shape, its energy and the Jacobian of its end.
#include "tendril/statics/chart.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "reference.h"

namespace tendril {
namespace {

using namespace reference;

constexpr double kMoment = 6.283, kForce = 40;

Equilibrium solved(const RodProperties& rod, const Vector6& wrench, const Pose& base = {}) {
  EquilibriumIntegrator integrator(rod);
  Equilibrium e;
  EXPECT_EQ(integrator.solve(base, wrench, e), ChartStatus::equilibrium);
  return e;
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
  for (const Vector6& c : {roundStiffness(), unevenStiffness()}) {
    EquilibriumIntegrator integrator(rodOf(c));
    for (int trial = 0; trial < 20; ++trial) {
      const Vector6 a = randomWrench(random, kMoment, kForce);
      const State expected = integrate(a, c, 1, 2000);
      Equilibrium e;
      ASSERT_EQ(integrator.solve({}, a, e), ChartStatus::equilibrium);
      Pose end;
      Matrix6 jacobian;
      ASSERT_EQ(integrator.endPose(a, end, jacobian), ChartStatus::equilibrium);
      EXPECT_LT((e.nodes.back().position - expected.p).norm(), 3e-6);
      EXPECT_LT((e.nodes.back().rotation.toRotationMatrix() - expected.r).norm(), 2e-5);
      EXPECT_LT((end.position - expected.p).norm(), 3e-6);
      EXPECT_NEAR(e.energy, expected.energy, 1e-6 * (1 + expected.energy));
      EXPECT_LT((jacobian - expected.j).norm(), 1e-4 * expected.j.norm());
    }
  }
}

TEST(Statics, WrenchAlongTheRodIsTheFirstOneCarriedByTheAdjoint) {
  Random random(3);
  const Vector6 c = unevenStiffness();
  for (int trial = 0; trial < 10; ++trial) {
    const Vector6 a = randomWrench(random, kMoment, kForce);
    for (const double s : {0.3, 1.0}) {
      const State y = integrate(a, c, s, 2000);
      EXPECT_LT((adjoint({Quaternion(y.r), y.p}).transpose() * a - y.mu).norm(), 1e-6 * (1 + a.norm()));
    }
  }
}

TEST(Statics, ForceMagnitudeMomentDotForceAndHamiltonianAreConstantAlongTheRod) {
  Random random(4);
  for (const Vector6& c : {roundStiffness(), unevenStiffness()}) {
    for (int trial = 0; trial < 20; ++trial) {
      const Vector6 a = randomWrench(random, kMoment, kForce);
      const statics::Chart chart(c, a);
      const auto invariants = [&](const Vector6& mu) {
        const Vector3 m = mu.head<3>(), n = mu.tail<3>();
        return Vector3(n.squaredNorm(), m.dot(n), 0.5 * mu.dot(strain(mu, c)) + mu[3]);
      };
      statics::PathState y = statics::startOfPath();
      statics::Stages<statics::PathState> stages;
      for (int i = 0; i < 16; ++i) {
        chart.step(y, 1.0 / 16, stages);
        const Vector3 change = invariants(chart.wrench(y)) - invariants(a);
        EXPECT_LT(std::abs(change[0]), 1e-10 * (1 + a.squaredNorm()));
        EXPECT_LT(std::abs(change[1]), 1e-10 * (1 + a.squaredNorm()));
        EXPECT_LT(std::abs(change[2]), 1e-3);
      }
    }
  }
}

TEST(Statics, IntegratorConvergesWithOrderEight) {
  const Vector6 a = vector6(2, 5, -3, -20, 15, 8), c = roundStiffness();
  const statics::Chart chart(c, a);
  const auto end = [&](int steps) {
    statics::JointState y;
    y.head<8>() = statics::startOfPath();
    y.tail<36>().setZero();
    statics::Stages<statics::JointState> stages;
    for (int i = 0; i < steps; ++i) chart.step(y, 1.0 / steps, stages);
    return y;
  };
  const statics::JointState exact = end(512);
  double previous_path = 0, previous_k = 0;
  for (const int steps : {8, 16, 32}) {
    const statics::JointState error = end(steps) - exact;
    const double path = error.head<8>().matrix().norm(), k = error.tail<36>().matrix().norm();
    if (steps > 8) {
      EXPECT_GT(std::log2(previous_path / path), 7.2) << steps;
      EXPECT_GT(std::log2(previous_k / k), 7.2) << steps;
    }
    previous_path = path, previous_k = k;
  }
}

TEST(Statics, EndJacobianIsTheDerivativeOfTheEndFrameAndItsDeterminantThatOfK) {
  Random random(5);
  for (const Vector6& c : {roundStiffness(), unevenStiffness()}) {
    RodProperties rod = rodOf(c, 10, 0.7);
    rod.c *= 3;
    EquilibriumIntegrator integrator(rod);
    for (int trial = 0; trial < 10; ++trial) {
      const Vector6 a = randomWrench(random, 15, 80);
      Pose end, plus, minus;
      Matrix6 jacobian, unused;
      ASSERT_EQ(integrator.endPose(a, end, jacobian), ChartStatus::equilibrium);
      for (int i = 0; i < 6; ++i) {
        const double d = 1e-4;
        (void)integrator.endPose(a + d * Vector6::Unit(i), plus, unused);
        (void)integrator.endPose(a - d * Vector6::Unit(i), minus, unused);
        const Vector6 difference = logSE3(minus.inverse() * plus) / (2 * d);
        EXPECT_LT((difference - jacobian.col(i)).norm(), 1e-5 * jacobian.norm()) << i;
      }
    }
  }
}

TEST(Statics, NodesBetweenStepsAreAccurateToOneMillionthOfTheLength) {
  Random random(6);
  std::vector<double> positions, angles;
  for (int trial = 0; trial < 100; ++trial) {
    const Vector6 c = roundStiffness(), a = randomWrench(random, kMoment, kForce);
    const Equilibrium e = solved(rodOf(c, 37), a);
    const statics::Chart chart(c, a);
    statics::PathState y = statics::startOfPath();
    statics::Stages<statics::PathState> stages;
    for (const Pose& node : e.nodes) {
      const Pose exact = statics::poseOf(y);
      positions.push_back((node.position - exact.position).norm());
      angles.push_back(angleBetween(node.rotation, exact.rotation));
      EXPECT_NEAR(node.rotation.norm(), 1, 1e-14);
      for (int k = 0; k < 4; ++k) chart.step(y, 1.0 / 37 / 4, stages);
    }
  }
  std::sort(positions.begin(), positions.end());
  std::sort(angles.begin(), angles.end());
  const std::size_t p99 = positions.size() * 99 / 100;
  EXPECT_LT(positions[p99], 1e-6);
  EXPECT_LT(positions.back(), 4e-6);
  EXPECT_LT(angles[p99], 1e-5);
  EXPECT_LT(angles.back(), 4e-5);
}

TEST(Statics, FirstNodeIsTheBaseToTheBitAndTheShapeMovesWithIt) {
  Random random(7);
  const RodProperties rod = rodOf(unevenStiffness(), 20);
  for (int trial = 0; trial < 10; ++trial) {
    const Vector6 a = randomWrench(random, kMoment, kForce);
    const Pose base{random.rotation(), {random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-5, 5)}};
    const Equilibrium at_origin = solved(rod, a), moved = solved(rod, a, base);
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

TEST(Statics, ShapeAndSolveGiveTheSameBytes) {
  Random random(8);
  EquilibriumIntegrator integrator(rodOf(roundStiffness()));
  for (int trial = 0; trial < 20; ++trial) {
    const Vector6 a = randomWrench(random, kMoment, kForce);
    Equilibrium shape, solution;
    (void)integrator.shape({}, a, shape);
    (void)integrator.solve({}, a, solution);
    EXPECT_EQ(shape.energy, solution.energy);
    for (std::size_t i = 0; i < shape.nodes.size(); ++i) {
      EXPECT_EQ(shape.nodes[i].position, solution.nodes[i].position);
      EXPECT_EQ(shape.nodes[i].rotation.coeffs(), solution.nodes[i].rotation.coeffs());
    }
  }
}

TEST(Statics, EndMomentTwoPiEIOverLClosesTheRodIntoACircle) {
  for (const double length : {0.2, 1.0, 30.0}) {
    for (const double young_modulus : {1e5, 2e11}) {
      RodProperties rod;
      rod.length = length, rod.radius = 0.01 * length, rod.elements = 50;
      rod.c = stiffnessOfRoundRod(young_modulus, young_modulus / 2.8, rod.radius);
      const double ei = rod.c[1];
      const Equilibrium e = solved(rod, vector6(0, 0, 2 * M_PI * ei / length, 0, 0, 0));
      EXPECT_LT((e.nodes.back().position - e.nodes.front().position).norm(), 1e-8 * length);
      EXPECT_LT(angleBetween(e.nodes.back().rotation, e.nodes.front().rotation), 1e-7);
      EXPECT_NEAR(e.energy, 2 * M_PI * M_PI * ei / length, 1e-8 * ei / length);
      for (const Pose& node : e.nodes)
        EXPECT_NEAR((node.position - Vector3(0, length / (2 * M_PI), 0)).norm(), length / (2 * M_PI),
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
  Pose end;
  Matrix6 jacobian;
  for (const double force : {-19.1, -21.0, -500.0}) {
    const Vector6 a = vector6(0, 0, 0, force, 0, 0);
    EXPECT_EQ(integrator.solve({}, a, e), ChartStatus::inverted);
    EXPECT_EQ(integrator.shape({}, a, e), ChartStatus::inverted);
    EXPECT_EQ(integrator.endPose(a, end, jacobian), ChartStatus::inverted);
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
