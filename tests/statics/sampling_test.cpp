// Drawing static rods; the distance of a rod to itself.
#include <algorithm>

#include "heavy_reference.h"
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
      if (static_cast<double>(j - i - 1) * h > kPi * rod.radius)
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
  (void)integrator.shape({}, vector6(0, 2 * kPi, 0, 0, 0, 0), e);
  rod.radius = 0.01;
  EXPECT_LT(selfDistance(e.nodes, rod), 1e-7);
  rod.radius = 1;
  EXPECT_EQ(selfDistance(e.nodes, rod), std::numeric_limits<double>::infinity());
}

bool sameRod(const Equilibrium& a, const Equilibrium& b) {
  bool same = a.wrench == b.wrench && a.energy == b.energy && a.weight_energy == b.weight_energy &&
              a.stability == b.stability && a.nodes.size() == b.nodes.size();
  for (std::size_t i = 0; same && i < a.nodes.size(); ++i)
    same = a.nodes[i].position == b.nodes[i].position &&
           a.nodes[i].rotation.coeffs() == b.nodes[i].rotation.coeffs();
  return same;
}

/// A slab with its normal along z, from z = low to high, wider than any workspace here.
Obstacles slab(double low, double high) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices.emplace_back((i & 1) ? 5 : -5, (i & 2) ? 5 : -5, (i & 4) ? high : low);
  mesh.faces = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return Obstacles(std::span<const TriangleMesh>(&mesh, 1));
}

TEST(Sampler, RodsAreStableInTheBoxInsideTheWorkspaceClearOfObstaclesAndOfThemselves) {
  RodProperties rod = rodOf(7 * roundStiffness(), 40, 2);
  rod.radius = 0.02;
  const Obstacles obstacles = slab(-0.1, 0.1);
  SamplingSpace space;
  space.box = {.moment = 5, .force = 30};
  space.workspace = Eigen::AlignedBox3d(Vector3(-1, -2, -1.5), Vector3(2, 1, 1.5));
  space.obstacles = &obstacles;
  const double ei = rod.bendingStiffness();
  RodSampler sampler(rod, space, 22);
  EquilibriumIntegrator integrator(rod);
  int above = 0, below = 0;
  Vector3 turned = Vector3::Zero();
  for (int trial = 0; trial < 60; ++trial) {
    const Equilibrium* e = sampler.next();
    ASSERT_TRUE(e);
    EXPECT_EQ(e->stability, Stability::stable);
    EXPECT_FALSE(e->first_conjugate_t);
    EXPECT_GT(selfDistanceOfAllPairs(e->nodes, rod), 2 * rod.radius);
    EXPECT_LE(e->wrench.head<3>().cwiseAbs().maxCoeff(), 5 * ei / 2);
    EXPECT_LE(e->wrench.tail<3>().cwiseAbs().maxCoeff(), 30 * ei / 4);
    Equilibrium again;
    ASSERT_EQ(integrator.solve(e->base, e->wrench, again), ChartStatus::equilibrium);
    EXPECT_LT(maxNodeDistance(e->nodes, again.nodes), 1e-12);
    EXPECT_EQ(again.stability, Stability::stable);
    for (std::size_t i = 0; i < e->nodes.size(); ++i) {
      EXPECT_TRUE(space.workspace->contains(e->nodes[i].position));
      // wholly on one side of the slab, a radius away
      const double z = e->nodes[i].position.z();
      EXPECT_GT(std::abs(z), 0.1 + rod.radius);
      EXPECT_EQ(z > 0, e->base.position.z() > 0);
    }
    ++(e->base.position.z() > 0 ? above : below);
    turned += e->base.rotation * Vector3::UnitX();
  }
  EXPECT_GT(above, 5);
  EXPECT_GT(below, 5);
  EXPECT_LT(turned.norm() / 60, 0.5);  // bases face all ways
}

TEST(Sampler, RodsAreTheSameHoweverManyThreadsDrawThem) {
  const RodProperties rod = rodOf(unevenStiffness(), 10);
  SamplingSpace space;
  space.workspace = Eigen::AlignedBox3d(Vector3::Constant(-1), Vector3::Constant(1));
  for (const bool heavy : {false, true}) {
    if (heavy) space.gravity = gravityFor(rod, 20, {0, 0, -1});
    const std::size_t count = heavy ? 4 : 80;
    const std::vector<Equilibrium> one = sampleRods(rod, space, 5, count, 1);
    ASSERT_EQ(one.size(), count);
    RodSampler sampler(rod, space, 5);
    for (const Equilibrium& e : one) {
      const Equilibrium* next = sampler.next();
      ASSERT_TRUE(next);
      EXPECT_TRUE(sameRod(*next, e));
    }
    for (const int threads : {2, 5}) {
      const std::vector<Equilibrium> many = sampleRods(rod, space, 5, count, threads);
      ASSERT_EQ(many.size(), count);
      for (std::size_t i = 0; i < count; ++i) EXPECT_TRUE(sameRod(one[i], many[i])) << threads << " " << i;
    }
    const std::vector<Equilibrium> fewer = sampleRods(rod, space, 5, 3, 2);
    ASSERT_EQ(fewer.size(), 3U);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_TRUE(sameRod(one[i], fewer[i]));
    EXPECT_FALSE(sameRod(one[0], sampleRods(rod, space, 6, 1).front()));
  }
}

TEST(Sampler, AWorkspaceTooSmallForAnyRodYieldsNone) {
  const RodProperties rod = rodOf(roundStiffness(), 1);
  SamplingSpace space;
  space.box = {.moment = 0, .force = 0};  // straight rods alone
  space.workspace = Eigen::AlignedBox3d(Vector3::Zero(), Vector3::Constant(0.5));
  RodSampler sampler(rod, space, 1);
  EXPECT_EQ(sampler.next(), nullptr);
  EXPECT_EQ(sampler.next(), nullptr);
}

TEST(Sampler, WithUnstableRodsTooTheWrenchIsUniformInTheBox) {
  RodProperties rod = rodOf(roundStiffness(), 10);
  rod.radius = 1e-6;  // hardly ever in its own way
  SamplingSpace space;
  space.stable_only = false;
  constexpr std::size_t kCount = 1500;
  const std::vector<Equilibrium> rods = sampleRods(rod, space, 9, kCount, 2);
  ASSERT_EQ(rods.size(), kCount);
  int unstable = 0;
  for (int k = 0; k < 6; ++k) {
    std::vector<double> share;
    for (const Equilibrium& e : rods)
      share.push_back(e.wrench[k] / (k < 3 ? space.box.moment : space.box.force));
    std::sort(share.begin(), share.end());
    double largest = 0;  // Kolmogorov and Smirnov: 1.95 / sqrt(n) once in a thousand
    for (std::size_t i = 0; i < kCount; ++i)
      largest = std::max(largest, std::abs(static_cast<double>(i) / kCount - 0.5 * (share[i] + 1)));
    EXPECT_LT(largest, 1.95 / std::sqrt(kCount)) << k;
  }
  for (const Equilibrium& e : rods) {
    unstable += e.stability == Stability::unstable;
    EXPECT_EQ(e.base.position, Vector3(0, 0, 0));  // no workspace: the world's frame
  }
  EXPECT_NEAR(unstable / static_cast<double>(kCount), 0.73, 0.03);
}

TEST(Sampler, AboutTwentySevenWrenchesOfTheDefaultBoxInAHundredAreStable) {
  EquilibriumBatch batch(rodOf(roundStiffness()));
  Random random(23);
  constexpr std::size_t kCount = 10000;
  std::vector<Vector6> wrenches;
  for (std::size_t i = 0; i < kCount; ++i) wrenches.push_back(randomWrench(random, 2 * kPi, 40));
  const auto stable = std::make_unique<bool[]>(kCount);
  batch.areStable(wrenches, {stable.get(), kCount});
  EXPECT_NEAR(static_cast<double>(std::count(stable.get(), stable.get() + kCount, true)) / kCount, 0.27,
              0.015);
}

TEST(Sampler, StableRodsAreTheStableOnesAmongAll) {
  RodProperties rod = rodOf(unevenStiffness(), 10);
  for (const double gamma : {0.0, 30.0}) {
    SamplingSpace space;
    space.gravity = gravityFor(rod, gamma, {0, 0.2, -1});
    const std::vector<Equilibrium> stable = sampleRods(rod, space, 4, 40);
    space.stable_only = false;
    std::size_t next = 0;
    for (const Equilibrium& e : sampleRods(rod, space, 4, 200)) {
      if (e.stability != Stability::stable || next == stable.size()) continue;
      EXPECT_EQ(e.wrench, stable[next].wrench);
      EXPECT_LT(maxNodeDistance(e.nodes, stable[next++].nodes), 1e-12);
    }
    EXPECT_GT(next, 8U);
  }
}

TEST(Sampler, HeavyRodsAreStableUnderTheirWeightAndTheirForceBoxFollowsIt) {
  const RodProperties rod = rodOf(roundStiffness(), 10);
  SamplingSpace space;
  space.gravity = gravityFor(rod, 60, {0, 0, -1});
  space.box = {.moment = 4, .force = 15};
  space.workspace = Eigen::AlignedBox3d(Vector3::Constant(-1), Vector3::Constant(1));
  EquilibriumIntegrator integrator(rod, space.gravity);
  const HeavyRod heavy(rod, space.gravity);
  double mean = 0;
  const std::vector<Equilibrium> rods = sampleRods(rod, space, 8, 200, 2);
  ASSERT_EQ(rods.size(), 200U);
  for (const Equilibrium& e : rods) {
    EXPECT_EQ(e.stability, Stability::stable);
    EXPECT_TRUE(integrator.isStable(e.base.rotation, e.wrench));
    const Vector3 force = e.base.rotation * Vector3(e.wrench.tail<3>());
    EXPECT_GT(force.z(), -60 - 15 * std::sqrt(3.0));
    EXPECT_LT(force.z(), 15 * std::sqrt(3.0));
    mean += force.z() / 200;
  }
  EXPECT_NEAR(mean, -30, 8);
  for (int i = 0; i < 5; ++i) {
    const Place y = endOf(heavy, startOf(rods[i].base.rotation, rods[i].wrench), 600);
    EXPECT_LT((rods[i].base.position + y.p - rods[i].nodes.back().position).norm(), 1e-7);
  }
}

}  // namespace
}  // namespace tendril
