/// The nearest rod against looking at all of them.
#include "tendril/planner/rod_index.h"

#include <gtest/gtest.h>

#include <deque>

#include "dynamics/scenes.h"

namespace tendril {
namespace {

RodShape anyRod(Random& random) {
  return scenes::straight(
      {random.rotation(), {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)}}, 1, 8);
}

/// Rods of all kinds: anywhere, next to one of those before, or turned about its middle.
std::deque<RodShape> someRods(Random& random, int count) {
  std::deque<RodShape> rods = {anyRod(random)};
  while (static_cast<int>(rods.size()) < count) {
    RodShape rod = anyRod(random);
    const double kind = random.uniform();
    if (kind < 0.5) {
      rod = rods[static_cast<std::size_t>(random.uniform() * static_cast<double>(rods.size()))];
      if (kind < 0.2)
        for (Pose& node : rod) node.position += Vector3(1e-3, 0, 1e-3) * random.uniform();
      else if (kind < 0.4)
        std::reverse(rod.begin(), rod.end());  // the same centroid
    }
    rods.push_back(std::move(rod));
  }
  return rods;
}

TEST(RodIndex, FindsTheRodThatLookingAtAllFinds) {
  Random random(1);
  for (const int count : {1, 2, 9, 40, 700}) {
    const std::deque<RodShape> rods = someRods(random, count);
    RodIndex index;
    std::vector<int> failures(rods.size(), 0);
    for (const RodShape& rod : rods) index.add(rod);
    for (int k = 0; k < count; ++k)
      for (; random.uniform() < 0.5; ++failures[static_cast<std::size_t>(k)]) index.fail(k);
    for (int look = 0; look < 200; ++look) {
      RodShape target = anyRod(random);
      if (look % 2 == 0) target = rods[static_cast<std::size_t>(random.uniform() * count)];
      const double penalty = look % 3 == 0 ? 0 : random.uniform(0, 3);
      int best = -1;
      double least = std::numeric_limits<double>::infinity();
      for (int k = 0; k < count; ++k) {
        const double distance = (1 + penalty * failures[static_cast<std::size_t>(k)]) *
                                meanNodeDistance(rods[static_cast<std::size_t>(k)], target);
        if (distance < least) least = distance, best = k;
      }
      EXPECT_EQ(index.nearest(target, penalty), best);
    }
  }
}

TEST(RodIndex, FindsTheLeastFailedOfManyWithOneCentroid) {
  Random random(3);
  for (int trial = 0; trial < 50; ++trial) {
    const RodShape rod = anyRod(random);
    std::deque<RodShape> rods;
    std::vector<int> failures;
    RodIndex index;
    for (int k = 0; k < 200; ++k) {
      index.add(rods.emplace_back(k % 3 == 0 ? anyRod(random) : rod));
      failures.push_back(1 + static_cast<int>(random.uniform() * 1000));
      for (int i = 0; i < failures.back(); ++i) index.fail(k);
    }
    RodShape target = rod;
    for (Pose& node : target) node.position.x() += 0.01;
    int best = -1;
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 200; ++k) {
      const double distance = (1.0 + failures[static_cast<std::size_t>(k)]) *
                              meanNodeDistance(rods[static_cast<std::size_t>(k)], target);
      if (distance < least) least = distance, best = k;
    }
    EXPECT_EQ(index.nearest(target, 1), best);
  }
}

TEST(RodIndex, KnowsWhetherARodIsNear) {
  Random random(2);
  const std::deque<RodShape> rods = someRods(random, 300);
  RodIndex index;
  for (const RodShape& rod : rods) index.add(rod);
  int near = 0;
  for (int look = 0; look < 500; ++look) {
    const RodShape target = anyRod(random);
    const double distance = random.uniform(0, 0.5);
    const bool any = std::any_of(rods.begin(), rods.end(), [&](const RodShape& rod) {
      return meanNodeDistance(rod, target) < distance;
    });
    EXPECT_EQ(index.hasWithin(target, distance), any);
    near += any;
  }
  EXPECT_GT(near, 50);
  EXPECT_LT(near, 450);
}

}  // namespace
}  // namespace tendril
