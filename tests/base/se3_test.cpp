#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tendril/base.h"

namespace tendril {
namespace {

// Everything is held against matrix series in long double, which know nothing of closed forms or of small
// angles.
using Real = long double;
template <int N>
using Matrix = Eigen::Matrix<Real, N, N>;

/// sum over n of a^n factor(n) until the terms vanish, for norms up to about 5.
template <int N, class Factor>
Matrix<N> series(const Matrix<N>& a, const Factor& factor) {
  Matrix<N> sum = Matrix<N>::Zero(), power = Matrix<N>::Identity();
  for (int n = 0; n < 60; ++n) sum += factor(n) * power, power = (power * a).eval();
  return sum;
}
Real factorial(int n) { return n == 0 ? 1 : n * factorial(n - 1); }

template <int N>
Matrix<N> matrixExponential(const Matrix<N>& a) {
  return series<N>(a, [](int n) { return 1 / factorial(n); });
}

/// Jr(xi) = sum (-1)^n ad^n / (n + 1)!, the right Jacobian of the exponential map of any Lie group.
template <int N>
Matrix<N> rightJacobian(const Matrix<N>& ad) {
  return series<N>(ad, [](int n) { return (n % 2 == 0 ? 1 : -1) / factorial(n + 1); });
}

Matrix<4> hat(const Vector6& xi) {
  Matrix<4> m = Matrix<4>::Zero();
  m.topLeftCorner<3, 3>() = skew(xi.head<3>()).cast<Real>();
  m.topRightCorner<3, 1>() = xi.tail<3>().cast<Real>();
  return m;
}

Matrix<4> asMatrix(const Pose& q) {
  Matrix<4> m = Matrix<4>::Identity();
  m.topLeftCorner<3, 3>() = q.rotation.cast<Real>().toRotationMatrix();
  m.topRightCorner<3, 1>() = q.position.cast<Real>();
  return m;
}

template <class A, class B>
double difference(const A& a, const B& b) {
  return static_cast<double>((a - b).cwiseAbs().maxCoeff());
}

Vector3 direction(Random& random) { return (random.rotation() * Vector3::UnitX()).normalized(); }

/// Angles from 1e-12 to pi, log-spaced, with those where the formulae change and where the logarithm is
/// hardest.
std::vector<double> angles() {
  constexpr double pi = std::numbers::pi;
  std::vector<double> list = {0,         0.0999999, 0.1000001, 0.1999999, 0.2000001,
                              pi - 1e-3, pi - 1e-6, pi - 1e-9, pi};
  for (int i = 0; i <= 200; ++i) list.push_back(1e-12 * std::pow(pi * 1e12, i / 200.0));
  for (double& angle : list) angle = std::min(angle, pi);
  return list;
}

/// Calls check(xi) for every angle, several axes and translations from 1e-6 to 1e2 m.
template <class Check>
void forEveryTwist(const Check& check) {
  Random random(1);
  for (const double angle : angles())
    for (const double length : {0.0, 1e-6, 1e-2, 1.0, 1e2}) {
      Vector6 xi;
      xi << angle * direction(random), length * direction(random);
      check(xi);
    }
}

TEST(SE3, ExponentialEqualsTheMatrixExponential) {
  forEveryTwist([](const Vector6& xi) {
    const Pose q = expSE3(xi);
    EXPECT_LT(difference(asMatrix(q), matrixExponential<4>(hat(xi))), 1e-15 * (1 + xi.tail<3>().norm()) * 2)
        << xi.transpose();
    EXPECT_NEAR(q.rotation.norm(), 1, 4e-16);
  });
}

TEST(SE3, LogarithmUndoesTheExponential) {
  forEveryTwist([](const Vector6& xi) {
    const Vector6 back = logSE3(expSE3(xi));
    const double size = 1 + xi.tail<3>().norm();
    if (xi.head<3>().norm() < std::numbers::pi - 1e-12) {
      EXPECT_LT(difference(back, xi), 4e-15 * size) << xi.transpose();
      // relative in the angle, too: a rod's rotation per element is small
      EXPECT_LE((back - xi).head<3>().norm(), 1e-15 * xi.head<3>().norm() * 2) << xi.transpose();
    }
    EXPECT_LT(difference(asMatrix(expSE3(back)), asMatrix(expSE3(xi))), 1e-14 * size) << xi.transpose();
  });
}

TEST(SO3, LogarithmTakesEitherSignOfTheQuaternionAndStaysWithinPi) {
  Random random(2);
  for (const double angle : angles())
    for (int i = 0; i < 5; ++i) {
      const Quaternion q = expSO3(angle * direction(random));
      const Vector3 w = logSO3(q), opposite = logSO3(Quaternion(-q.coeffs()));
      EXPECT_LE(w.norm(), std::numbers::pi * (1 + 1e-15));
      EXPECT_NEAR(w.norm(), angle, 1e-15 * (1 + angle));
      EXPECT_TRUE(w == opposite || angle >= std::numbers::pi - 1e-12);
    }
}

TEST(SO3, RightJacobianAndItsInverseEqualTheirSeries) {
  forEveryTwist([](const Vector6& xi) {
    const Vector3 w = xi.head<3>();
    const Matrix<3> jacobian = rightJacobian<3>(skew(w).cast<Real>());
    EXPECT_LT(difference(rightJacobianSO3(w).cast<Real>(), jacobian), 1e-15);
    EXPECT_LT(difference(rightJacobianInverseSO3(w).cast<Real>(), jacobian.inverse()), 4e-15);
  });
}

TEST(SE3, InverseRightJacobianEqualsItsSeries) {
  forEveryTwist([](const Vector6& xi) {
    const Matrix<6> jacobian = rightJacobian<6>(smallAdjoint(xi).cast<Real>());
    EXPECT_LT(difference(rightJacobianInverseSE3(xi).cast<Real>(), jacobian.inverse()),
              1e-14 * (1 + xi.tail<3>().norm()))
        << xi.transpose();
  });
}

TEST(SE3, InverseRightJacobianIsTheDerivativeOfTheLogarithm) {
  static constexpr double h = 1e-4;  // central differences: error about h^2 + rounding / h
  forEveryTwist([](const Vector6& xi) {
    if (xi.head<3>().norm() > 3) return;  // the logarithm jumps at pi
    const Matrix6 jacobian = rightJacobianInverseSE3(xi);
    for (int k = 0; k < 6; ++k) {
      const Vector6 d = h * Vector6::Unit(k);
      const Vector6 slope = (logSE3(expSE3(xi) * expSE3(d)) - logSE3(expSE3(xi) * expSE3(-d))) / (2 * h);
      EXPECT_LT(difference(slope, jacobian.col(k)), 1e-7 * (1 + xi.tail<3>().norm())) << xi.transpose();
    }
  });
}

TEST(SE3, LeftJacobianIsTheRightOneAtTheOppositeTwist) {
  Random random(3);
  for (int i = 0; i < 100; ++i) {
    Vector6 xi, d;
    xi << random.uniform(0, 3) * direction(random), direction(random);
    d << 1e-6 * direction(random), 1e-6 * direction(random);
    const Vector6 moved = logSE3(expSE3(d) * expSE3(xi));
    EXPECT_LT(difference(moved, xi + rightJacobianInverseSE3(-xi) * d), 1e-10);
  }
}

TEST(SE3, AdjointCarriesTwistsThroughAFrame) {
  Random random(4);
  for (int i = 0; i < 200; ++i) {
    Vector6 a, b;
    a << random.uniform(0, 3) * direction(random), 2 * direction(random);
    b << random.uniform(0, 3) * direction(random), 2 * direction(random);
    const Pose q = expSE3(a), r = expSE3(b);
    const Matrix<4> conjugate = asMatrix(q) * hat(b) * asMatrix(q).inverse();
    EXPECT_LT(difference(hat(adjoint(q) * b), conjugate), 1e-14);
    EXPECT_LT(difference(adjoint(q * r), adjoint(q) * adjoint(r)), 1e-14);
    EXPECT_LT(difference(adjoint(q.inverse()) * adjoint(q), Matrix6::Identity()), 1e-14);
    // Ad of an exponential is the exponential of ad
    EXPECT_LT(difference(adjoint(q).cast<Real>(), matrixExponential<6>(smallAdjoint(a).cast<Real>())), 1e-14);
  }
}

TEST(SE3, SmallAdjointIsTheCommutator) {
  Random random(5);
  for (int i = 0; i < 100; ++i) {
    Vector6 a, b;
    a << direction(random), 2 * direction(random);
    b << direction(random), 2 * direction(random);
    const Matrix<4> commutator = hat(a) * hat(b) - hat(b) * hat(a);
    EXPECT_LT(difference(hat(smallAdjoint(a) * b), commutator), 1e-15 * 8);
  }
}

TEST(Pose, ProductAndInverseAreThoseOfMatrices) {
  Random random(6);
  for (int i = 0; i < 200; ++i) {
    const Pose a{random.rotation(), 3 * direction(random)}, b{random.rotation(), 3 * direction(random)};
    EXPECT_LT(difference(asMatrix(a * b), asMatrix(a) * asMatrix(b)), 4e-15);
    EXPECT_LT(difference(asMatrix(a.inverse() * a), Matrix<4>::Identity()), 4e-15);
    const Vector3 p = direction(random);
    EXPECT_LT((a * (b * p) - (a * b) * p).norm(), 4e-15);
  }
}

TEST(Pose, AThousandProductsStayRotations) {
  Random random(7);
  Pose q;
  for (int i = 0; i < 1000; ++i) q = q * Pose{random.rotation(), direction(random)};
  EXPECT_NEAR(q.rotation.norm(), 1, 1e-15);
}

TEST(AngleBetween, CountsTheWholeTurnAndIgnoresTheQuaternionsSign) {
  Random random(8);
  for (const double angle : angles()) {
    const Quaternion a = random.rotation(),
                     b = a * expSO3(angle * Vector3::UnitX());  // a twist about the rod's tangent
    EXPECT_NEAR(angleBetween(a, b), angle, 1e-15);
    EXPECT_NEAR(angleBetween(b, Quaternion(-a.coeffs())), angle, 1e-15);
  }
}

TEST(Skew, IsTheCrossProduct) {
  Random random(9);
  const Vector3 a = direction(random), b = direction(random);
  EXPECT_EQ(skew(a) * b, a.cross(b));
}

}  // namespace
}  // namespace tendril
