// Ways through the chart.
#include "heavy_reference.h"

namespace tendril {
namespace {

using namespace reference;

PoseAndWrench placementOf(const Equilibrium& e) { return {e.base, e.wrench}; }

/// From `from` to `to`, every station a stable rod with the frames stated and near its neighbours.
void expectWay(const ChartPath& path, const RodProperties& rod, const PoseAndWrench& from,
               const PoseAndWrench& to, const Vector3& gravity, double stride) {
  ASSERT_TRUE(path.connected);
  ASSERT_GE(path.stations.size(), 2U);
  const ChartStation &first = path.stations.front(), &last = path.stations.back();
  EXPECT_LT((first.wrench - from.wrench).norm(), 1e-14 * (1 + from.wrench.norm()));
  EXPECT_LT((last.wrench - to.wrench).norm(), 1e-14 * (1 + to.wrench.norm()));
  EXPECT_EQ(first.grippers.first.position, from.pose.position);
  EXPECT_LT(angleBetween(first.grippers.first.rotation, from.pose.rotation), 1e-14);
  EXPECT_LT((last.grippers.first.position - to.pose.position).norm(), 1e-14);
  EXPECT_LT(angleBetween(last.grippers.first.rotation, to.pose.rotation), 1e-14);
  EquilibriumIntegrator integrator(rod, gravity);
  Equilibrium e;
  for (std::size_t i = 0; i < path.stations.size(); ++i) {
    const ChartStation& station = path.stations[i];
    ASSERT_EQ(integrator.solve(station.grippers.first, station.wrench, e), ChartStatus::equilibrium);
    EXPECT_EQ(e.stability, Stability::stable) << i;
    EXPECT_LT((e.nodes.back().position - station.grippers.last.position).norm(), 2e-5 * rod.length);
    EXPECT_LT(angleBetween(e.nodes.back().rotation, station.grippers.last.rotation), 2e-4);
    if (i == 0) continue;
    const GripperPoses &a = path.stations[i - 1].grippers, &b = station.grippers;
    for (const auto& [p, q] : {std::pair(a.first, b.first), std::pair(a.last, b.last)}) {
      EXPECT_LE((p.position - q.position).norm(), stride * rod.length * (1 + 1e-9)) << i;
      EXPECT_LE(angleBetween(p.rotation, q.rotation), stride * (1 + 1e-9)) << i;
    }
  }
}

TEST(ChartPath, ConnectsRandomStableRodsThroughStableOnes) {
  for (const Vector6& c : {roundStiffness(), unevenStiffness()}) {
    const RodProperties rod = rodOf(7 * c, 4, 1);
    SamplingSpace space;
    space.workspace = Eigen::AlignedBox3d(Vector3::Constant(-1), Vector3::Constant(1));
#ifdef NDEBUG
    const int pairs = c == roundStiffness() ? 50 : 8;
#else
    const int pairs = 2;
#endif
    const std::vector<Equilibrium> rods = sampleRods(rod, space, 17, static_cast<std::size_t>(2 * pairs));
    int lost = 0;
    for (int i = 0; i < pairs; ++i) {
      const PoseAndWrench from = placementOf(rods[static_cast<std::size_t>(2 * i)]),
                          to = placementOf(rods[static_cast<std::size_t>(2 * i) + 1]);
      const ChartPath path = chartPath(rod, from, to);
      expectWay(path, rod, from, to, Vector3::Zero(), 0.02);
      lost += path.lost_at.has_value();
      if (path.lost_at) {
        EXPECT_GT(*path.lost_at, 0);
        EXPECT_LT(*path.lost_at, 1);
        EXPECT_FALSE(EquilibriumIntegrator(rod).isStable(path.lost_wrench));
        // it is on the straight way
        const Vector6 on_way = from.wrench + *path.lost_at * (to.wrench - from.wrench);
        EXPECT_LT((path.lost_wrench - on_way).norm(), 1e-12 * on_way.norm());
      }
    }
    if (pairs > 10) {
      EXPECT_GT(lost, 0) << "no pair whose straight way is lost";
      EXPECT_LT(lost, pairs);
    }
  }
}

TEST(ChartPath, ADetourIsFoundWhereTheStraightWayIsLost) {
  // From a compressed rod to its mirror image: half-way lies the straight rod under more than it can bear, 4
  // pi^2.
  const RodProperties rod = rodOf(roundStiffness(), 4);
  PoseAndWrench from, to;
  from.wrench = vector6(0, 0, 6.7, -42.5, 3.6, 0);
  ASSERT_TRUE(EquilibriumIntegrator(rod).isStable(from.wrench));
  to.wrench = vector6(0, 0, -6.7, -42.5, -3.6, 0);
  ASSERT_TRUE(EquilibriumIntegrator(rod).isStable(to.wrench));
  const ChartPath path = chartPath(rod, from, to);
  ASSERT_TRUE(path.lost_at);
  EXPECT_FALSE(EquilibriumIntegrator(rod).isStable(path.lost_wrench));
  expectWay(path, rod, from, to, Vector3::Zero(), 0.02);
}

TEST(ChartPath, HeavyRodsStayStableUnderTheirWeightWhileTheBaseTurns) {
  const RodProperties rod = rodOf(roundStiffness(), 4);
  const Vector3 gravity = gravityFor(rod, 15, {0, 0, -1});
  SamplingSpace space;
  space.gravity = gravity;
  space.workspace = Eigen::AlignedBox3d(Vector3::Constant(-1), Vector3::Constant(1));
  const std::vector<Equilibrium> rods = sampleRods(rod, space, 18, 16);
  int connected = 0;
  for (std::size_t i = 0; i + 1 < rods.size(); i += 2) {
    const PoseAndWrench from = placementOf(rods[i]), to = placementOf(rods[i + 1]);
    const ChartPath path = chartPath(rod, from, to, gravity, 0.05);
    if (!path.connected) {
      EXPECT_TRUE(path.stations.empty());
      continue;
    }
    ++connected;
    expectWay(path, rod, from, to, gravity, 0.05);
  }
  EXPECT_GE(connected, 6);
}

TEST(ChartPath, IsTheSameEveryTime) {
  const RodProperties rod = rodOf(roundStiffness(), 4);
  const std::vector<Equilibrium> rods = sampleRods(rod, {}, 19, 6);
  for (std::size_t i = 0; i + 1 < rods.size(); ++i) {
    const ChartPath one = chartPath(rod, placementOf(rods[i]), placementOf(rods[i + 1])),
                    two = chartPath(rod, placementOf(rods[i]), placementOf(rods[i + 1]));
    ASSERT_EQ(one.stations.size(), two.stations.size());
    EXPECT_EQ(one.lost_at, two.lost_at);
    for (std::size_t k = 0; k < one.stations.size(); ++k) {
      EXPECT_EQ(one.stations[k].wrench, two.stations[k].wrench);
      EXPECT_EQ(one.stations[k].grippers.last.position, two.stations[k].grippers.last.position);
    }
  }
}

TEST(ChartPath, AnUnstableEndIsBadInput) {
  const RodProperties rod = rodOf(roundStiffness(), 4);
  PoseAndWrench good, bad, no_rod;
  bad.wrench = vector6(0, 0, 0, -60, 0, 0);
  no_rod.wrench = vector6(0, 0, 0, -1e5, 0, 0);
  EXPECT_THROW((void)chartPath(rod, bad, good), InputError);
  EXPECT_THROW((void)chartPath(rod, good, bad), InputError);
  EXPECT_THROW((void)chartPath(rod, no_rod, good), InputError);
  EXPECT_THROW((void)chartPath(rod, good, no_rod), InputError);
}

TEST(ChartPath, ToWhereItIsAlreadyItIsTwoStationsOrSo) {
  const RodProperties rod = rodOf(roundStiffness(), 4);
  PoseAndWrench at;
  at.wrench = vector6(0, 1, 2, 3, 4, 5);
  const ChartPath path = chartPath(rod, at, at);
  expectWay(path, rod, at, at, Vector3::Zero(), 0.02);
  EXPECT_LE(path.stations.size(), 3U);
}

}  // namespace
}  // namespace tendril
