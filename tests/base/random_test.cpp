#include <gtest/gtest.h>

#include <numbers>

#include "tendril/base.h"

namespace tendril {
namespace {

TEST(Random, IsTheGeneratorTheStandardFixes) {
  // [rand.predef]: the 10000th number of a default-seeded mt19937_64, whose seed is 5489.
  Random random(5489);
  std::uint64_t value = 0;
  for (int i = 0; i < 10000; ++i) value = random.bits();
  EXPECT_EQ(value, 9981545732273789042u);
}

TEST(Random, TheSameSeedGivesTheSameNumbersAndAnotherSeedOthers) {
  Random a(1), b(1), c(2);
  for (int i = 0; i < 100; ++i) {
    const double x = a.uniform();
    EXPECT_EQ(x, b.uniform());
    EXPECT_NE(x, c.uniform());
  }
  EXPECT_EQ(a.rotation().coeffs(), b.rotation().coeffs());
}

TEST(Random, UniformIsTheTopFiftyThreeBits) {
  Random a(3), b(3);
  for (int i = 0; i < 100; ++i)
    EXPECT_EQ(a.uniform(), static_cast<double>(b.bits() >> 11) / 9007199254740992.0);
}

TEST(Random, UniformHasTheMomentsOfTheUniformDistribution) {
  Random random(4);
  constexpr int n = 200000;
  double sum = 0, squares = 0;
  for (int i = 0; i < n; ++i) {
    const double x = random.uniform(-2, 4);
    ASSERT_TRUE(x >= -2 && x < 4);
    sum += x, squares += x * x;
  }
  EXPECT_NEAR(sum / n, 1, 5 * std::sqrt(3.0 / n));  // variance 36/12
  EXPECT_NEAR(squares / n - 1, 3, 0.05);
}

TEST(Random, RotationsAreUniform) {
  // Of a uniform rotation every entry of the matrix has mean 0 and mean square 1/3, and the angle w has the
  // density (1 - cos w) / pi, whose mean is pi/2 + 2/pi.
  Random random(5);
  constexpr int n = 100000;
  Matrix3 mean = Matrix3::Zero(), square = Matrix3::Zero();
  double angle = 0;
  for (int i = 0; i < n; ++i) {
    const Quaternion q = random.rotation();
    ASSERT_NEAR(q.norm(), 1, 1e-15);
    const Matrix3 r = q.toRotationMatrix();
    mean += r / n, square += r.cwiseAbs2() / n;
    angle += logSO3(q).norm() / n;
  }
  EXPECT_LT(mean.cwiseAbs().maxCoeff(), 5 * std::sqrt(1.0 / 3 / n));
  EXPECT_LT((square - Matrix3::Constant(1.0 / 3)).cwiseAbs().maxCoeff(), 5 * std::sqrt(4.0 / 45 / n));
  EXPECT_NEAR(angle, std::numbers::pi / 2 + 2 / std::numbers::pi, 0.01);
}

}  // namespace
}  // namespace tendril
