// The inner loops: the same bits on every instruction set and in every company, of order eight, and their
// segments compose.
#include "tendril/statics/kernel.h"

#include <cmath>
#include <cstring>

#include "heavy_reference.h"
#include "tendril/lanes.h"
#include "tendril/statics/conjugate_points.h"
#include "tendril/statics/integrator.h"

namespace tendril::statics {
namespace {

using namespace reference;
using RowMatrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
using Matrix12 = Eigen::Matrix<double, 12, 12>;

template <class T>
[[nodiscard]] bool sameBits(const T& a, const T& b) {
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}

RodProperties bent(const Vector6& c) {
  RodProperties rod = rodOf(c);
  rod.rest_curvature.assign(1, Vector3(0.7, -1.1, 2));
  return rod;
}
std::vector<RodProperties> uniformRods() {
  return {rodOf(roundStiffness()), rodOf(unevenStiffness()), bent(unevenStiffness())};
}

std::vector<AlignedWrench> randomWrenches(const NaturalRod& rod, Random& random, int count) {
  std::vector<AlignedWrench> out;
  for (int i = 0; i < count; ++i) {
    const Vector6 a = randomWrench(random, 8, 50);
    out.push_back(aligned(a, rod.stepCount(a, kQuick)));
  }
  out.push_back(aligned(Vector6::Zero(), 4));
  out.push_back(aligned(vector6(0, 0, 0, -39, 0, 0), 12));
  out.push_back(aligned(vector6(0, 0, 0, 0, 0, -39), 12));
  return out;
}

void expectSame(const JointEnd& a, const JointEnd& b, bool whole) {
  EXPECT_EQ(a.screening, b.screening);
  if (!whole && a.screening == Screening::unstable) return;  // it may have stopped early
  EXPECT_TRUE(sameBits(a.path, b.path));
  EXPECT_TRUE(sameBits(a.k, b.k));
}

/// One rod with any base axes, for the kernels that walk along one.
SingleRod singleRod(const Vector6& c, Random& random, bool heavy) {
  SingleRod rod = {};
  for (int i = 0; i < 6; ++i) rod.compliance[i] = 1 / c[i];
  const Vector6 a = randomWrench(random, 6, 40);
  for (int i = 0; i < 3; ++i) rod.moment[i] = a[i];
  if (heavy)
    for (int i = 0; i < 3; ++i) rod.force[i] = a[3 + i], rod.weight[i] = random.uniform(-30, 30);
  else
    rod.force[2] = a[3];
  const Quaternion q = random.rotation();
  for (int i = 0; i < 4; ++i) rod.rotation[i] = q.coeffs()[i];
  rod.heavy = heavy;
  return rod;
}
std::array<double, kState> startState(const SingleRod& rod) {
  std::array<double, kState> state = {};
  std::copy_n(rod.rotation, 4, state.begin());
  return state;
}

TEST(Kernel, ThisMachinesKernelsHaveTheirNamesAndLanesOnce) {
  const auto all = availableKernels();
  ASSERT_FALSE(all.empty());
  EXPECT_STREQ(all.front()->name, "portable");
  for (std::size_t i = 1; i < all.size(); ++i) EXPECT_GT(all[i]->lanes, all[i - 1]->lanes);
}

TEST(Lanes, ProductsAndSumsThatAreFusedAreRoundedOnce) {
  const double e = std::ldexp(1.0, -30);
  using T = Lanes<2>;
  const T a = {1 + e, 1 - e}, square = {1 + 2 * e, 1 - 2 * e};  // but for e^2, which rounding a a would lose
  const T over = multiplyAdd(a, a, -square), under = subtractProduct(a, a, square);
  for (int l = 0; l < 2; ++l) {
    EXPECT_EQ(lanes(over)[l], e * e);
    EXPECT_EQ(lanes(under)[l], -e * e);
  }
}

TEST(Kernel, EveryInstructionSetGivesTheSameBitsForManyRods) {
  Random random(41);
  for (const RodProperties& properties : uniformRods()) {
    const NaturalRod rod(properties, Vector3::Zero());
    const std::vector<AlignedWrench> wrenches = randomWrenches(rod, random, 100);
    const auto pathsOf = [&](const Kernel& k) {
      std::vector<PathEnd> ends(wrenches.size());
      k.paths(rod.kernel, wrenches, ends.data());
      return ends;
    };
    const auto jointsOf = [&](const Kernel& k, bool stop) {
      std::vector<JointEnd> ends(wrenches.size());
      k.joints(rod.kernel, wrenches, 2e-3, stop, ends.data());
      return ends;
    };
    const Kernel& first = *availableKernels().front();
    const auto paths = pathsOf(first);
    const auto joints = jointsOf(first, false), stopped = jointsOf(first, true);
    int unstable = 0;
    for (const Kernel* k : availableKernels()) {
      SCOPED_TRACE(k->name);
      const auto other_paths = pathsOf(*k);
      const auto other_joints = jointsOf(*k, false), other_stopped = jointsOf(*k, true);
      for (std::size_t i = 0; i < wrenches.size(); ++i) {
        EXPECT_TRUE(sameBits(other_paths[i], paths[i]));
        expectSame(other_joints[i], joints[i], true);
        expectSame(other_stopped[i], stopped[i], false);
        EXPECT_EQ(stopped[i].screening, joints[i].screening);
        // the joint's origin moves from section to section: the same place but for rounding
        EXPECT_LT((Vector3::Map(paths[i].position) - Vector3::Map(joints[i].path.position)).norm(), 1e-13);
        JointEnd alone;
        k->joint(rod.kernel, wrenches[i], 2e-3, false, alone);
        JointEnd alone_first;
        first.joint(rod.kernel, wrenches[i], 2e-3, false, alone_first);
        expectSame(alone, alone_first, true);
        EXPECT_EQ(alone.screening, joints[i].screening);
        unstable += joints[i].screening == Screening::unstable;
      }
    }
    EXPECT_GT(unstable, 20);
  }
}

TEST(Kernel, EveryInstructionSetGivesTheSameBitsForOneRodLightOrHeavy) {
  Random random(42);
  const double kappa0[3] = {0.5, -1, 1.5};
  for (int trial = 0; trial < 40; ++trial) {
    const SingleRod rod = singleRod(trial % 4 < 2 ? roundStiffness() : unevenStiffness(), random, trial % 2);
    const Steps steps = {0.25, 0.03, 10, kappa0};
    struct Result {
      std::array<double, kState> path, segment;
      double path_record[10][kState], segment_record[10][kState];
      SegmentMatrices matrices;
    };
    const auto resultOf = [&](const Kernel& k) {
      Result r;
      std::memset(&r, 0, sizeof r);
      r.path = r.segment = startState(rod);
      k.path(rod, steps, r.path.data(), r.path_record);
      k.segment(rod, steps, r.segment.data(), r.segment_record, r.matrices);
      return r;
    };
    const Result first = resultOf(*availableKernels().front());
    EXPECT_TRUE(sameBits(first.path, first.segment));
    EXPECT_TRUE(sameBits(first.path_record, first.segment_record));
    for (const Kernel* k : availableKernels()) EXPECT_TRUE(sameBits(resultOf(*k), first)) << k->name;
  }
}

TEST(Kernel, ARodsNumbersDependNeitherOnItsNeighboursNorOnTheirNumber) {
  Random random(43);
  const NaturalRod rod(rodOf(unevenStiffness()), Vector3::Zero());
  const std::vector<AlignedWrench> wrenches = randomWrenches(rod, random, 30);
  const std::vector<AlignedWrench> backwards(wrenches.rbegin(), wrenches.rend());
  const std::size_t count = wrenches.size();
  for (const Kernel* k : availableKernels()) {
    SCOPED_TRACE(k->name);
    std::vector<PathEnd> paths(count), other_paths(count);
    std::vector<JointEnd> joints(count), other_joints(count);
    k->paths(rod.kernel, wrenches, paths.data());
    k->joints(rod.kernel, wrenches, 2e-3, false, joints.data());
    k->paths(rod.kernel, backwards, other_paths.data());
    k->joints(rod.kernel, backwards, 2e-3, false, other_joints.data());
    for (std::size_t i = 0; i < count; ++i) {
      EXPECT_TRUE(sameBits(other_paths[count - 1 - i], paths[i]));
      expectSame(other_joints[count - 1 - i], joints[i], true);
    }
    for (std::size_t n = 0; 2 * n <= count; ++n) {
      const std::span<const AlignedWrench> few(wrenches.data() + n, n);
      k->paths(rod.kernel, few, other_paths.data());
      k->joints(rod.kernel, few, 2e-3, false, other_joints.data());
      for (std::size_t i = 0; i < n; ++i) {
        EXPECT_TRUE(sameBits(other_paths[i], paths[n + i]));
        expectSame(other_joints[i], joints[n + i], true);
      }
    }
  }
}

TEST(Kernel, BatchAndSingleRodAgreeToTwelveDigits) {
  Random random(44);
  for (const RodProperties& rod : uniformRods()) {
    EquilibriumBatch batch(rod);
    EquilibriumIntegrator single(rod);
    std::vector<Vector6> wrenches;
    for (int i = 0; i < 600; ++i) wrenches.push_back(randomWrench(random, 6.283, 40));
    std::vector<EquilibriumEnd> ends(wrenches.size()), shapes(wrenches.size());
    batch.ends(wrenches, ends);
    batch.shapes(wrenches, shapes);
    int stable = 0;
    for (std::size_t i = 0; i < wrenches.size(); ++i) {
      EquilibriumEnd one;
      ASSERT_EQ(single.end(wrenches[i], one), ChartStatus::equilibrium);
      EXPECT_EQ(ends[i].stable, one.stable);
      EXPECT_LT((shapes[i].end_in_base.position - one.end_in_base.position).norm(), 1e-12);
      EXPECT_LT((shapes[i].end_in_base.rotation.coeffs() - one.end_in_base.rotation.coeffs()).norm(), 1e-12);
      EXPECT_NEAR(shapes[i].energy, one.energy, 1e-12 * (100 + one.energy));
      if (!one.stable) continue;
      ++stable;
      EXPECT_LT((ends[i].end_in_base.position - one.end_in_base.position).norm(), 1e-12);
      EXPECT_LT((ends[i].end_in_base.rotation.coeffs() - one.end_in_base.rotation.coeffs()).norm(), 1e-12);
      EXPECT_NEAR(ends[i].energy, shapes[i].energy, 1e-12 * (100 + one.energy));
      EXPECT_LT((ends[i].jacobian - one.jacobian).norm(), 1e-11 * one.jacobian.norm());
    }
    EXPECT_GT(stable, 30);
  }
}

TEST(Kernel, ConvergesWithOrderEight) {
  Random random(45);
  const double kappa0[3] = {0.5, -1, 1.5};
  for (const bool heavy : {false, true}) {
    const SingleRod rod = singleRod(roundStiffness(), random, heavy);
    const auto end = [&](int steps) {
      auto state = startState(rod);
      SegmentMatrices matrices;
      kernel().segment(rod, {0, 1.0 / steps, steps, kappa0}, state.data(), nullptr, matrices);
      Eigen::VectorXd out(kState + 36);
      out << Eigen::Map<Eigen::VectorXd>(state.data(), kState), Eigen::Map<Eigen::VectorXd>(matrices.x, 36);
      return out;
    };
    const Eigen::VectorXd exact = end(512);
    const Eigen::VectorXd coarse = end(48) - exact, fine = end(96) - exact;
    EXPECT_GT(std::log2(coarse.head(kState).norm() / fine.head(kState).norm()), 7.2) << heavy;
    EXPECT_GT(std::log2(coarse.tail(36).norm() / fine.tail(36).norm()), 7.2) << heavy;
  }
}

Matrix6 bracketOf(const Vector3& m, const Vector3& n) {
  Matrix6 b;
  b << skew(m), skew(n), skew(n), Matrix3::Zero();
  return b;
}

TEST(Kernel, EndJacobianOfALightRodObeysTheSymmetryKMinusKTransposeIsKTransposeBK) {
  Random random(46);
  for (const RodProperties& properties : uniformRods()) {
    const NaturalRod rod(properties, Vector3::Zero());
    for (int trial = 0; trial < 40; ++trial) {
      const Vector6 a = randomWrench(random, 6.283, 40);
      const AlignedWrench wrench = aligned(a, rod.stepCount(a, {8, 1e-6}));
      JointEnd end;
      kernel().joint(rod.kernel, wrench, 1e-3, false, end);
      Matrix6 k = Eigen::Map<const RowMatrix6>(end.k);  // about the last section; the law is about the base
      k.bottomRows<3>() += skew(Vector3::Map(end.path.position)) * k.topRows<3>();
      const Matrix6 b = bracketOf(Vector3::Map(wrench.moment), {0, 0, wrench.force});
      const Matrix6 right = k.transpose() * b * k;
      EXPECT_LT((k - k.transpose() - right).norm(), 1e-9 * (k.norm() + right.norm()));
      const Matrix6 y = k.inverse() + 0.5 * b;
      EXPECT_LT((y - y.transpose()).norm(), 1e-6 * y.norm());
    }
  }
}

/// Both solutions (K, L) over [start, start + length], as one matrix that takes (K, L) from one end to the
/// other.
Matrix12 transfer(const SingleRod& rod, std::array<double, kState>& state, double start, double length,
                  int steps) {
  const double kappa0[3] = {0.5, -1, 1.5};
  SegmentMatrices s;
  kernel().segment(rod, {start, length / steps, steps, kappa0}, state.data(), nullptr, s);
  Matrix12 out;
  const Matrix6 x = Eigen::Map<RowMatrix6>(s.x);
  if (rod.heavy) {
    out << Matrix6(Eigen::Map<RowMatrix6>(s.u)), x, Matrix6(Eigen::Map<RowMatrix6>(s.lu)),
        Matrix6(Eigen::Map<RowMatrix6>(s.lx));
  } else {
    const Matrix6 b = bracketOf(Vector3::Map(rod.moment), Vector3::Map(rod.force));
    out << Matrix6::Identity() + x * b, x, Matrix6::Zero(), Matrix6::Identity();
  }
  return out;
}

TEST(Kernel, SegmentsComposeToTheWholeRod) {
  Random random(47);
  for (int trial = 0; trial < 40; ++trial) {
    SingleRod rod = singleRod(trial % 4 < 2 ? roundStiffness() : unevenStiffness(), random, trial % 2);
    auto state = startState(rod), start = state;
    const Matrix12 first = transfer(rod, state, 0, 0.4, 60), second = transfer(rod, state, 0.4, 0.3, 45),
                   whole = transfer(rod, start, 0, 0.7, 105);
    EXPECT_LT((second * first - whole).norm(), 1e-9 * (1 + second.norm() * first.norm())) << trial;
  }
}

TEST(Kernel, YOfASegmentIsSymmetricLightOrHeavy) {
  // Y = Lx X^-1 + B/2 with B of the wrench that acts at the base's origin at the segment's end.
  Random random(48);
  for (int trial = 0; trial < 40; ++trial) {
    const SingleRod rod = singleRod(trial % 4 < 2 ? roundStiffness() : unevenStiffness(), random, trial % 2);
    auto state = startState(rod);
    const double length = 0.2;
    const Matrix12 t = transfer(rod, state, 0, length, 20);
    const Vector3 weight = Vector3::Map(rod.weight), area = Vector3::Map(&state[7]);
    const Matrix6 b =
        bracketOf(Vector3::Map(rod.moment) - area.cross(weight), Vector3::Map(rod.force) - length * weight);
    const Matrix6 y = t.bottomRightCorner<6, 6>() * t.topRightCorner<6, 6>().inverse() + 0.5 * b;
    EXPECT_LT((y - y.transpose()).norm(), 1e-8 * y.norm()) << trial;
  }
}

TEST(Kernel, AHeavyRodWithoutWeightIsTheLightOne) {
  Random random(49);
  for (int trial = 0; trial < 20; ++trial) {
    SingleRod light = singleRod(unevenStiffness(), random, false), heavy = light;
    heavy.heavy = true;
    auto one = startState(light), other = one;
    const Matrix12 a = transfer(light, one, 0, 1, 160), b = transfer(heavy, other, 0, 1, 160);
    EXPECT_LT((a - b).norm(), 1e-11 * a.norm());
    for (const int i : {0, 1, 2, 3, 4, 5, 6, 10})
      EXPECT_NEAR(one[static_cast<std::size_t>(i)], other[static_cast<std::size_t>(i)],
                  1e-11 * (1 + one[10]));
  }
}

TEST(Kernel, TimesToConjugatePointsPredictTheNextOne) {
  // A strut that buckles at t = 0.6412749, twice: seen from t = 0.64 these are 0.0012749 away.
  const NaturalRod rod(rodOf(vector6(1, 1, 1, 100, 50, 50)), Vector3::Zero());
  const AlignedWrench wrench = aligned(vector6(0, 0, 0, -60, 0, 0), 8);
  SingleRod single = {};
  std::copy_n(rod.kernel.compliance, 6, single.compliance);
  std::copy_n(wrench.moment, 3, single.moment);
  single.force[2] = wrench.force;
  std::copy_n(wrench.rotation, 4, single.rotation);
  const Matrix6 b = bracketOf(Vector3::Map(single.moment), Vector3::Map(single.force));
  auto state = startState(single);
  const double kappa0[3] = {};
  ConjugatePoints points;
  for (int i = 0; i < 4; ++i) {
    SegmentMatrices matrices;
    kernel().segment(single, {0.16 * i, 0.02, 8, kappa0}, state.data(), nullptr, matrices);
    // a straight rod: about each section in turn the wrench is the same
    const Pose place{Quaternion(state[3], state[0], state[1], state[2]), Vector3::Map(&state[4])};
    const Segment segment(matrices, &b, place, rod.c.cwiseInverse());
    std::fill_n(state.begin() + 4, 3, 0.0);
    if (i == 0) {
      points.start(segment);
      continue;
    }
    if (i == 3) {
      const Vector6 times = points.timesToConjugatePoints(segment);
      EXPECT_NEAR(times[0], 0.0012749, 1e-5);
      EXPECT_NEAR(times[1], 0.0012749, 1e-5);
      EXPECT_GT(times[2], 0.01);
    }
    ASSERT_TRUE(points.passIfFree(segment));
    if (i == 3) {
      EXPECT_LT(points.timeLeft(segment), 0.0012749);
      EXPECT_GT(points.timeLeft(segment), 0.0012749 / 6);
    }
  }
}

}  // namespace
}  // namespace tendril::statics
