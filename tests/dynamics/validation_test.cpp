/// The rod against theory: the quick ones among the experiments of docs/validation.md.
#include <gtest/gtest.h>

#include "dynamics/experiments.h"
#include "tendril/statics.h"

namespace tendril {
namespace {

using namespace experiments;
using std::numbers::pi;

TEST(Validation, CantileversHangAsHighAndWideAsTheElastica) {
  // Height over width at Gamma = rho A g L^3/EI = 1, 10, 100.
  for (const auto& [gamma, ratio, last_digit] :
       {std::tuple(1.0, 0.1246, 1e-4), std::tuple(10.0, 1.067, 1e-3), std::tuple(100.0, 5.888, 1e-3)}) {
    const Vector3 tip = cantilever(gamma, 40).back().position;
    EXPECT_NEAR(-tip.z() / tip.x(), ratio, 0.6 * last_digit) << "Gamma = " << gamma;
  }
}

TEST(Validation, CantileversConvergeToTheCosseratSolutionWithFourthOrder) {
  for (const double gamma : {10.0, 100.0, 1000.0}) {
    Scenario s;
    const RodShape fine = cantilever(gamma, 80, &s);
    const reference::Rod rod = reference::rodOf(s.rod, s.environment.gravity);
    const auto exact = reference::solve(rod, Pose{}, std::nullopt, reference::guessFrom(s.rod, fine));
    ASSERT_FALSE(exact.empty()) << gamma;
    const auto errorWith = [&](int elements) {
      return maxNodeDistance(cantilever(gamma, elements), reference::nodesOf(rod, exact, elements));
    };
    const double coarse = errorWith(10), medium = errorWith(20), last = errorWith(40);
    EXPECT_GT(coarse / medium, 8) << gamma;
    EXPECT_GT(medium / last, 8) << gamma;
    EXPECT_LT(last, gamma > 100 ? 1e-4 : 5e-6) << gamma;
  }
}

TEST(Validation, ATautRodStaysStraightHoweverFewItsElements) {
  // Hanging from its clamp, with a tension of up to 60 EI/h^2.
  for (const double gamma : {150.0, 600.0, 1500.0}) {
    Scenario s = settling(1e8, 0.001, 5, 0);
    s.environment.gravity.z() = -gravityFor(s.rod, gamma);
    s.simulation.drag = 1e-3 * -s.environment.gravity.z();
    RodModel model(s, nothing());
    model.newton.tolerance = 1e-10;
    RodShape shape = disturbed(scenes::straight(curlClamp(), 1, 5), 1e-3);
    EXPECT_LT(settle(model, held(curlClamp(), std::nullopt), shape, 50), 50);
    const double stretch = gamma * s.rod.bendingStiffness() / s.rod.c[3] / 2;
    EXPECT_LT((shape.back().position - shape.front().position - Vector3(0, 0, -1 - stretch)).norm(), 1e-7)
        << gamma;
    for (const Pose& q : shape) EXPECT_LT(angleBetween(q.rotation, curlClamp().rotation), 1e-8) << gamma;
  }
}

/// The tip, after half a second, of a cantilever let go from level.
Vector3 swungTip(Scheme scheme, double dt, int elements) {
  Scenario s = undamped(scheme, dt, elements);
  s.environment.gravity = {0, 0, -9.81};
  RodModel model(s, nothing());
  model.newton.tolerance = 1e-7;
  RodState state = RodState::atRest(scenes::straight({}, 1, elements));
  RodWorkspace workspace;
  for (long k = 0; k < std::lround(0.5 / dt); ++k) step(model, held(Pose{}, std::nullopt), state, workspace);
  return state.nodes.back().position;
}

TEST(Validation, ALargeSwingFollowsAnExplicitIntegrationInFiniteDifferences) {
  const Scenario s = undamped(Scheme::second_order, 1e-3, 40);
  const Vector3 exact = reference::swingOfCantilever(s.rod, 9.81, 80, 1e-5, {0.5}).front();
  const auto error = [&](Scheme scheme, double dt, int elements) {
    return (swungTip(scheme, dt, elements) - exact).norm();
  };
  EXPECT_LT(error(Scheme::second_order, 0.01, 20), 3.5e-3);
  EXPECT_LT(error(Scheme::second_order, 0.001, 20), 2e-4);
  const double coarse = error(Scheme::implicit_euler, 0.01, 20),
               fine = error(Scheme::implicit_euler, 0.0025, 20);
  EXPECT_NEAR(coarse / fine, 4, 0.5);
}

TEST(Validation, AnUndampedSwingLosesLessThanAHundredthOfItsEnergyInTenSecondsAndGainsNone) {
  Scenario s = undamped(Scheme::second_order, 0.01, 20);
  s.environment.gravity = {0, 0, -9.81};
  RodModel model(s, nothing());
  model.newton.tolerance = 1e-7;
  RodState state = RodState::atRest(scenes::straight({}, 1, 20));
  RodWorkspace workspace;
  const double start = energyOf(s, state),
               weight = pi * 1e-4 * 1000 * 9.81;  // N, times about 0.3 m turned over
  for (int k = 0; k < 1000; ++k) {
    step(model, held(Pose{}, std::nullopt), state, workspace);
    ASSERT_LT(energyOf(s, state) - start, 1e-3 * weight) << k;
  }
  EXPECT_GT(energyOf(s, state) - start, -3e-3 * weight);
}

TEST(Validation, EndsBroughtTogetherAndTwistedLeaveTheRodWhereShootingAndStaticsSay) {
  for (const double young : {1e6, 1e8}) {
    const RodShape shape = broughtTogether(young, 40);
    const Scenario s = scenes::rodScenario(young, 40);
    const Vector3 gravity(0, 0, -9.81);
    const reference::Rod rod = reference::rodOf(s.rod, gravity);
    const auto exact = reference::solve(rod, shape.front(), shape.back(), reference::guessFrom(s.rod, shape));
    ASSERT_FALSE(exact.empty()) << young;
    EXPECT_LT(maxNodeDistance(shape, reference::nodesOf(rod, exact, 40)), young > 1e7 ? 1e-6 : 2e-5) << young;
    EquilibriumIntegrator integrator(s.rod, gravity);
    Equilibrium chart;
    Vector6 a;
    a << exact.front().m, exact.front().n;
    ASSERT_EQ(integrator.solve(shape.front(), a, chart), ChartStatus::equilibrium);
    EXPECT_LT(maxNodeDistance(shape, chart.nodes), young > 1e7 ? 1e-6 : 2e-5) << young;
    EXPECT_EQ(chart.stability, Stability::stable) << young;
  }
}

TEST(Validation, ATwistedRingBucklesAtMichellsTwist) {
  const double michell = 2 * pi * std::sqrt(3.0) * 1.4;  // EI/GJ = 1.4
  EXPECT_FALSE(ringBuckles(0.99 * michell, 40));
  EXPECT_TRUE(ringBuckles(1.01 * michell, 40));
}

TEST(Validation, AClampedStraightRodBucklesAtGreenhillsTwist) {
  const double twist = 8.98682 * 1.4;  // M L/EI = 2 x, tan x = x
  EXPECT_FALSE(straightRodBuckles(0.995 * twist, 40));
  EXPECT_TRUE(straightRodBuckles(1.005 * twist, 40));
}

TEST(Validation, AFlatBeamBendsSidewaysAtPrandtlsAndMichellsLoads) {
  EXPECT_FALSE(uniformLoadBuckles(0.995 * 12.854, 20));
  EXPECT_TRUE(uniformLoadBuckles(1.005 * 12.854, 20));
  EXPECT_FALSE(tipLoadBuckles(0.99 * 4.0126, 20));
  EXPECT_TRUE(tipLoadBuckles(1.01 * 4.0126, 20));
}

TEST(Validation, AHangingCurlLeavesItsPlaneBetweenTheTwoWeightsAtWhichTheKirchhoffRodDoes) {
  const double curvature = 2 * pi;
  const std::vector<double> marginal = reference::marginalWeights(curvature, 1 / 1.4, 43);
  ASSERT_EQ(marginal.size(), 2U);
  for (const double share : {0.99, 1.01}) {
    EXPECT_EQ(curlLeavesItsPlane(curvature, share * marginal[0], 20), share > 1);
    EXPECT_EQ(curlLeavesItsPlane(curvature, share * marginal[1], 20), share < 1);
  }
}

TEST(Validation, ARopeRoundADrumPullsExpOfMuThetaTimesAsHard) {
  for (const auto& [mu, wrap] : {std::pair(0.1, pi), std::pair(0.3, pi / 2), std::pair(0.5, pi / 2)}) {
    const Capstan c = capstan(mu, wrap, 100, 128);
    EXPECT_NEAR(c.angle, wrap, 1e-3);
    EXPECT_NEAR(c.high / c.low, std::exp(mu * c.angle), 4e-3 * std::exp(mu * c.angle)) << mu << " " << wrap;
  }
}

TEST(Validation, ARodSlidesDownASlopeJustWhenItsTangentExceedsTheFriction) {
  for (const double mu : {0.2, 0.5}) {
    const bool across = mu == 0.5;
    // Sticking is creep slower than 1 cm/s, a hundredth of the grippers' speed.
    EXPECT_LT(speedOnSlope(std::atan(0.99 * mu), mu, 0.5, across), 0.01);
    const double slope = std::atan(1.5 * mu), pull = 9.81 * (std::sin(slope) - mu * std::cos(slope));
    EXPECT_NEAR(speedOnSlope(slope, mu, 0.5, across), 0.5 * pull, 0.03 * 0.5 * pull);
    EXPECT_GT(speedOnSlope(std::atan(1.01 * mu), mu, 1, across), 0.02);
  }
}

TEST(Validation, ATwistedSlackRodWindsRoundItselfAndStopsAtItsOwnThickness) {
  const RodProperties rod = scenes::rodScenario(5e7, 60).rod;
  double least = std::numeric_limits<double>::infinity(), now = 0;
  const auto watch = [&](double, const RodShape& shape) {
    now = selfDistance(shape, rod);
    least = std::min(least, now);
  };
  EXPECT_GT(twistAndSlacken(3, true, 60, watch).contacts, 0);
  EXPECT_GT(least, 2 * rod.radius);
  EXPECT_LT(now, 2.1 * rod.radius);  // touching, to the reach of contact
}

TEST(Validation, HeavyCurvedRodsStayWhereTheStaticsHaveThemWithFourthOrder) {
  Scenario s = settling(5e7, 0.01, 80, 9.81);
  s.rod.rest_curvature = {{1, 2, -3}};
  SamplingSpace space;
  space.box = {.moment = 4, .force = 20};
  space.gravity = s.environment.gravity;
  RodSampler sampler(s.rod, space, 5);
  std::array<double, 2> largest{};
  for (int k = 0; k < 6; ++k) {
    const RodShape exact = sampler.next()->nodes;
    for (const std::size_t fine : {0U, 1U}) {
      Scenario cut = s;
      cut.rod = withElements(s.rod, fine ? 40 : 20);
      RodModel model(cut, nothing());
      model.newton.tolerance = 1e-9;
      const RodShape wanted = thinned(exact, cut.rod.elements);
      RodShape shape = wanted;
      settle(model, held(wanted.front(), wanted.back()), shape);
      largest[fine] = std::max(largest[fine], maxNodeDistance(shape, wanted));
    }
  }
  EXPECT_LT(largest[1], 2e-5);
  EXPECT_GT(largest[0] / largest[1], 8);
}

}  // namespace
}  // namespace tendril
