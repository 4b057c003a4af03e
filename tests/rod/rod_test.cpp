#include "tendril/rod.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

namespace tendril {
namespace {

constexpr double kPi = std::numbers::pi;

/// The integral of f(y, z) over a disc of radius r, by the midpoint rule in polar coordinates.
template <class Function>
double overDisc(double r, const Function& f) {
  constexpr int kRings = 400, kSectors = 64;
  double sum = 0;
  for (int i = 0; i < kRings; ++i)
    for (int j = 0; j < kSectors; ++j) {
      const double rho = r * (i + 0.5) / kRings, angle = 2 * kPi * (j + 0.5) / kSectors;
      sum += f(rho * std::cos(angle), rho * std::sin(angle)) * rho * (r / kRings) * (2 * kPi / kSectors);
    }
  return sum;
}

TEST(Stiffness, IsTheIntegralOfTheModuliOverTheCrossSection) {
  const double e = 5e7, g = 1.8e7, r = 0.013, k = 0.9;
  const Vector6 c = stiffnessOfRoundRod(e, g, r, k);
  const double area = overDisc(r, [](double, double) { return 1; });
  Vector6 expected;
  expected << g * overDisc(r, [](double y, double z) { return y * y + z * z; }),
      e * overDisc(r, [](double, double z) { return z * z; }),
      e * overDisc(r, [](double y, double) { return y * y; }), e * area, k * g * area, k * g * area;
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(c[i] / expected[i], 1, 1e-5) << i;
}

TEST(Stiffness, WithoutShearCorrectionIsThePapers) {
  const double e = 1e6, nu = 0.4, g = e / (2 * (1 + nu)), r = 0.01;
  const Vector6 c = stiffnessOfRoundRod(e, g, r);
  // In units of EI and EI/L^2 with L = 1: 1/(1 + nu), 1, 1, 4/r^2, and 4/r^2 / (2 (1 + nu)).
  EXPECT_NEAR(c[0] / c[1], 1 / (1 + nu), 1e-14);
  EXPECT_EQ(c[1], c[2]);
  EXPECT_NEAR(c[3] / c[1], 4 / (r * r), 1e-9);
  EXPECT_NEAR(c[4] / c[3], 1 / (2 * (1 + nu)), 1e-14);
  EXPECT_EQ(c[4], c[5]);
}

TEST(Stiffness, StrainIsEquationThree) {
  Vector6 mu, c;
  mu << 1, -2, 3, -4, 5, -6;
  c << 2, 4, 8, 16, 32, 64;
  const Vector6 u = strain(mu, c);
  for (int i = 0; i < 6; ++i) EXPECT_DOUBLE_EQ(u[i] * c[i], mu[i]);
}

RodShape straight(int nodes, const Vector3& from, const Vector3& step) {
  RodShape shape;
  for (int i = 0; i < nodes; ++i) shape.push_back({Quaternion::Identity(), from + i * step});
  return shape;
}

TEST(Distance, MeanAndLargestOfTheNodeGaps) {
  RodShape a = straight(4, {0, 0, 0}, {1, 0, 0}), b = a;
  EXPECT_EQ(meanNodeDistance(a, b), 0);
  EXPECT_EQ(maxNodeDistance(a, b), 0);
  b[1].position += Vector3(0, 3, 4);
  b[2].position += Vector3(0, 0, 1);
  EXPECT_DOUBLE_EQ(meanNodeDistance(a, b), (5 + 1) / 4.0);
  EXPECT_DOUBLE_EQ(maxNodeDistance(a, b), 5);
  EXPECT_DOUBLE_EQ(meanNodeDistance(b, a), meanNodeDistance(a, b));
  b[0].rotation = expSO3({1, 0, 0});
  EXPECT_DOUBLE_EQ(meanNodeDistance(a, b), 1.5) << "rotations do not count";
}

/// A rod of constant strain xi from `base`: a helix, every piece of which is a geodesic of SE(3).
RodShape helix(const Pose& base, const Vector6& xi, int elements) {
  RodShape shape;
  for (int i = 0; i <= elements; ++i)
    shape.push_back(base * expSE3(xi * (static_cast<double>(i) / elements)));
  return shape;
}

double farthest(const RodShape& a, const RodShape& b) {
  double largest = a.size() == b.size() ? 0 : 1e9;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    largest = std::max(
        {largest, (a[i].position - b[i].position).norm(), angleBetween(a[i].rotation, b[i].rotation)});
  return largest;
}

TEST(Resample, AHelixStaysOnItself) {
  Random random(1);
  for (const int from : {1, 4, 40})
    for (const int to : {1, 3, 12, 20, 41, 80}) {
      const Pose base{random.rotation(), {1, 2, 3}};
      Vector6 xi;
      xi << 0.7, 0.5, -0.4, 1, 0.01, 0.02;
      EXPECT_LT(farthest(resample(helix(base, xi, from), to), helix(base, xi, to)), 1e-14)
          << from << " to " << to;
    }
}

TEST(Resample, KeepsTheEndsExactlyAndEveryFrameARotation) {
  Random random(2);
  RodShape shape;
  for (int i = 0; i < 12; ++i)
    shape.push_back({random.rotation(), {random.uniform(), random.uniform(), random.uniform()}});
  for (const int elements : {1, 7, 11, 33, 100}) {
    const RodShape other = resample(shape, elements);
    ASSERT_EQ(other.size(), static_cast<std::size_t>(elements) + 1);
    for (const End end : kBothEnds) {
      EXPECT_EQ(endPose(other, end).position, endPose(shape, end).position);
      EXPECT_EQ(endPose(other, end).rotation.coeffs(), endPose(shape, end).rotation.coeffs());
    }
    for (const Pose& q : other) EXPECT_NEAR(q.rotation.norm(), 1, 1e-15);
  }
}

TEST(Resample, AMultipleOfTheElementsKeepsEveryNodeAndTheSameNumberChangesNothing) {
  Random random(3);
  RodShape shape;
  for (int i = 0; i < 9; ++i)
    shape.push_back({random.rotation(), {random.uniform(), random.uniform(), random.uniform()}});
  const RodShape finer = resample(shape, 24);
  for (std::size_t i = 0; i < shape.size(); ++i)
    EXPECT_LT((finer[3 * i].position - shape[i].position).norm(), 1e-14);
  EXPECT_LT(farthest(resample(finer, 8), shape), 1e-14);
  EXPECT_EQ(farthest(resample(shape, 8), shape), 0);
}

RodProperties curvedRod(int elements, std::uint64_t seed) {
  RodProperties rod;
  rod.length = 1.7, rod.elements = elements;
  Random random(seed);
  for (int k = 0; k < elements; ++k)
    rod.rest_curvature.emplace_back(random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-5, 5));
  return rod;
}

/// The turn [rad] from the first end to a fraction t of the length, component by component.
Vector3 turnUntil(const RodProperties& rod, double t) {
  Vector3 sum = Vector3::Zero();
  for (int k = 0; k < rod.elements; ++k)
    sum += std::clamp(t * rod.elements - k, 0.0, 1.0) * rod.elementLength() * rod.restCurvature(k);
  return sum;
}

TEST(WithElements, EveryNewElementTurnsByWhatItsStretchOfTheRodTurnedBefore) {
  for (const int from : {4, 7, 12, 40})
    for (const int to : {4, 5, 12, 13, 40, 97, 1000}) {
      const RodProperties rod = curvedRod(from, 11), cut = withElements(rod, to);
      ASSERT_EQ(cut.elements, to);
      ASSERT_EQ(cut.rest_curvature.size(), static_cast<std::size_t>(to));
      for (int k = 0; k < to; ++k) {
        const Vector3 turned =
            turnUntil(rod, static_cast<double>(k + 1) / to) - turnUntil(rod, static_cast<double>(k) / to);
        EXPECT_LT((cut.elementLength() * cut.restCurvature(k) - turned).norm(), 1e-13)
            << from << " to " << to;
      }
    }
}

TEST(WithElements, KeepsTheMeanCurvature) {
  const auto mean = [](const RodProperties& rod) {
    Vector3 sum = Vector3::Zero();
    for (const Vector3& curvature : rod.rest_curvature) sum += curvature;
    return Vector3(sum / static_cast<double>(rod.rest_curvature.size()));
  };
  for (const int to : {4, 12, 39, 40, 41, 500}) {
    const RodProperties rod = curvedRod(40, 12);
    EXPECT_LT((mean(withElements(rod, to)) - mean(rod)).norm(), 1e-14) << to;
  }
}

TEST(WithElements, RefiningAndCoarseningAgainGivesTheSameBack) {
  const RodProperties rod = curvedRod(12, 13);
  for (const int factor : {1, 2, 3, 7, 50}) {
    const RodProperties finer = withElements(rod, factor * 12), back = withElements(finer, 12);
    for (int k = 0; k < 12; ++k) {
      EXPECT_LT((back.restCurvature(k) - rod.restCurvature(k)).norm(), 1e-14) << factor;
      EXPECT_LT((finer.restCurvature(factor * k) - rod.restCurvature(k)).norm(), 1e-14) << factor;
    }
  }
}

TEST(WithElements, LeavesAStraightRodStraightAndOneCurvatureAsItIs) {
  RodProperties rod;
  EXPECT_TRUE(withElements(rod, 7).rest_curvature.empty());
  EXPECT_EQ(withElements(rod, 7).restCurvature(6), Vector3(0, 0, 0));
  rod.rest_curvature = {Vector3(1, 2, 3)};
  EXPECT_EQ(withElements(rod, 7).rest_curvature, rod.rest_curvature);
  EXPECT_EQ(withElements(rod, 7).restCurvature(6), Vector3(1, 2, 3));
}

TEST(RodState, AtRestHasAVelocityOfZeroForEveryNodeAndNoHistory) {
  const RodState state = RodState::atRest(straight(5, {0, 0, 0}, {0.1, 0, 0}));
  EXPECT_EQ(state.nodes.size(), 5u);
  ASSERT_EQ(state.velocities.size(), 5u);
  for (const Vector6& v : state.velocities) EXPECT_EQ(v, Vector6::Zero());
  EXPECT_TRUE(state.previous_nodes.empty() && state.accelerations.empty());
}

TEST(Ends, EachIsTheOtherOfTheOther) {
  EXPECT_EQ(other(End::first), End::last);
  EXPECT_EQ(other(End::last), End::first);
  EXPECT_STREQ(name(End::first), "first");
  EXPECT_STREQ(name(End::last), "last");
}

}  // namespace
}  // namespace tendril
