/// The beam element's derivatives against finite differences, and the linear solver against a dense one.
#include "tendril/dynamics/beam.h"

#include <gtest/gtest.h>

#include "tendril/dynamics/block_tridiagonal.h"
#include "tendril/dynamics/workspace.h"

namespace tendril {
namespace {

using beam::Node;

Vector6 randomVector(Random& random, double size) {
  Vector6 v;
  for (int i = 0; i < 6; ++i) v[i] = random.uniform(-size, size);
  return v;
}

Node moved(const Node& node, const Vector6& by) {
  Node out;
  out.pose.rotation = (node.pose.rotation * expSO3(by.head<3>())).normalized();
  out.pose.position = node.pose.position + node.rotation * by.tail<3>();
  out.rotation = out.pose.rotation.toRotationMatrix();
  return out;
}

struct Case {
  beam::Element element;
  Node i, j;
};

/// An element of length h, bent by about `bend` rad and stretched by a few percent.
Case randomCase(Random& random, double h, double bend) {
  Case c;
  Vector6 stiffness;
  stiffness << 0.7, 1, 1.3, 4e2, 1.5e2, 1.2e2;
  c.element = {h, stiffness, 0.1 * randomVector(random, 1)};
  Vector6 psi = randomVector(random, bend);
  psi.tail<3>() = h * (Vector3::UnitX() + 0.05 * randomVector(random, 1).head<3>());
  c.i.pose = {random.rotation(), randomVector(random, 1).head<3>()};
  c.j.pose = c.i.pose * expSE3(psi);
  c.i.rotation = c.i.pose.rotation.toRotationMatrix(), c.j.rotation = c.j.pose.rotation.toRotationMatrix();
  return c;
}

double energyAt(const Case& c, const Vector6& di, const Vector6& dj) {
  return c.element.energy(c.element.wrench(beam::relativeLog(moved(c.i, di), moved(c.j, dj))));
}

/// Gradient and Hessian by the increments of the two nodes, as the kernel has them.
struct Derivatives {
  Vector6 gradient_i, gradient_j;
  Matrix6 hessian_ii, hessian_ij, hessian_jj;
};
Derivatives derivatives(const Case& c, bool geometric) {
  dynamics::ElementLaw law{.h = c.element.h, .c = {}, .rate = 0};
  std::copy_n(c.element.c.data(), 6, law.c);
  Table psi, f, elastic;
  psi.resize(6, 1), f.resize(6, 1), elastic.resize(8, 1);
  elastic.at(6, 0) = c.element.c[4], elastic.at(7, 0) = c.element.c[5];
  const Vector6 p = beam::relativeLog(c.i, c.j), wrench = c.element.wrench(p);
  for (int i = 0; i < 6; ++i) psi.at(i, 0) = p[i], f.at(i, 0) = wrench[i];
  BlockTridiagonal system;
  system.resize(2);
  dynamics::kernel().derivatives(1, law, psi.rows(), elastic.rows(), f.rows(), geometric,
                                 system.diagonalBlocks(), system.upperBlocks());
  const auto symmetric = [&](std::size_t k) {
    return Matrix6(Matrix6(system.diagonal(k)).selfadjointView<Eigen::Lower>());
  };
  return {-system.rhs(0), -system.rhs(1), symmetric(0), system.upper(0), symmetric(1)};
}

TEST(Beam, GradientIsTheDerivativeOfTheEnergy) {
  Random random(1);
  for (int trial = 0; trial < 50; ++trial) {
    const Case c = randomCase(random, 0.1, 0.6);
    const Derivatives d = derivatives(c, false);
    const double step = 1e-6;
    for (int k = 0; k < 6; ++k) {
      const Vector6 e = step * Vector6::Unit(k), zero = Vector6::Zero();
      const double gi = (energyAt(c, e, zero) - energyAt(c, -e, zero)) / (2 * step);
      const double gj = (energyAt(c, zero, e) - energyAt(c, zero, -e)) / (2 * step);
      EXPECT_NEAR(gi, d.gradient_i[k], 1e-6 * (1 + d.gradient_i.norm()));
      EXPECT_NEAR(gj, d.gradient_j[k], 1e-6 * (1 + d.gradient_j.norm()));
    }
  }
}

/// The second derivative along a straight line of increments, by finite differences.
double curvatureAlong(const Case& c, const Vector6& di, const Vector6& dj) {
  const double step = 1e-4;
  return (energyAt(c, step * di, step * dj) - 2 * energyAt(c, Vector6::Zero(), Vector6::Zero()) +
          energyAt(c, -step * di, -step * dj)) /
         (step * step);
}

TEST(Beam, GeometricStiffnessMakesTheHessianExactToSecondOrderInTheElementLength) {
  // What plain Gauss-Newton misses is known but for a fraction h^2 (of the rod's length, 1), and the rest
  // shrinks with h.
  double previous = 0;
  for (const double h : {0.2, 0.1, 0.05}) {
    Random random(2);
    double error = 0, without = 0;
    for (int trial = 0; trial < 40; ++trial) {
      Case c = randomCase(random, h, 3 * h);
      const Derivatives full = derivatives(c, true), plain = derivatives(c, false);
      const Vector6 di = randomVector(random, 1), dj = randomVector(random, 1);
      const auto form = [&](const Derivatives& d) {
        return di.dot(d.hessian_ii * di) + dj.dot(d.hessian_jj * dj) + 2 * di.dot(d.hessian_ij * dj);
      };
      const double exact = curvatureAlong(c, di, dj);
      error += std::abs(form(full) - exact), without += std::abs(form(plain) - exact);
    }
    EXPECT_LT(error, h * h * without) << "h = " << h;
    if (previous > 0) {
      EXPECT_LT(error, 0.75 * previous) << "h = " << h;
    }
    previous = error;
  }
}

TEST(Beam, EnergyDoesNotChangeUnderRigidMotions) {
  Random random(3);
  for (int trial = 0; trial < 20; ++trial) {
    Case c = randomCase(random, 0.1, 1.0);
    const double before = energyAt(c, Vector6::Zero(), Vector6::Zero());
    const Pose rigid{random.rotation(), Vector3(3, -2, 5)};
    for (Node* node : {&c.i, &c.j}) {
      node->pose = rigid * node->pose;
      node->rotation = node->pose.rotation.toRotationMatrix();
    }
    EXPECT_NEAR(energyAt(c, Vector6::Zero(), Vector6::Zero()), before, 1e-10 * (1 + before));
  }
}

TEST(BlockTridiagonal, SolvesLikeADenseSolverAndSeesIndefiniteness) {
  Random random(4);
  for (const std::size_t blocks : {1U, 2U, 3U, 8U, 41U}) {
    const auto size = static_cast<Eigen::Index>(6 * blocks);
    BlockTridiagonal system;
    system.resize(blocks);
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd rhs(size);
    for (std::size_t k = 0; k < blocks; ++k) {
      Matrix6 a;
      for (int c = 0; c < 6; ++c) a.col(c) = randomVector(random, 1);
      system.diagonal(k) = a * a.transpose() + 8 * Matrix6::Identity();
      for (int c = 0; c < 6; ++c) system.upper(k).col(c) = randomVector(random, 1);
      system.rhs(k) = randomVector(random, 1);
      const auto at = static_cast<Eigen::Index>(6 * k);
      dense.block<6, 6>(at, at) = system.diagonal(k);
      if (k + 1 < blocks) {
        dense.block<6, 6>(at, at + 6) = system.upper(k);
        dense.block<6, 6>(at + 6, at) = system.upper(k).transpose();
      }
      rhs.segment<6>(at) = system.rhs(k);
    }
    const Eigen::VectorXd expected = dense.ldlt().solve(rhs);
    BlockTridiagonal indefinite = system;
    ASSERT_TRUE(system.solve());
    for (std::size_t k = 0; k < blocks; ++k)
      EXPECT_LT((system.solution[k] - expected.segment<6>(static_cast<Eigen::Index>(6 * k))).norm(), 1e-12);
    indefinite.diagonal(blocks - 1)(3, 3) = -1;
    EXPECT_FALSE(indefinite.solve());
  }
}

}  // namespace
}  // namespace tendril
