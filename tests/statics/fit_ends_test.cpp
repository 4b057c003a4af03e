// Fitting both ends.
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "heavy_reference.h"
#include "tendril/statics/integrator.h"
#include "tendril/statics/library.h"

namespace tendril {
namespace {

using namespace reference;

#ifdef NDEBUG
constexpr int kPoses = 150;
#else
constexpr int kPoses = 6;  // the sanitizers are slow
#endif

/// Half a metre long and 128 times softer: in its own units the same rod.
RodProperties scaledRod(const Vector6& natural, double radius, int elements) {
  Vector6 c = natural / 128;
  c.tail<3>() *= 4;
  RodProperties rod = rodOf(c, elements, 0.5);
  rod.radius = 0.5 * radius;
  return rod;
}

bool sameRods(const std::vector<Equilibrium>& a, const std::vector<Equilibrium>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (a[i].wrench != b[i].wrench || a[i].energy != b[i].energy ||
        a[i].nodes.back().position != b[i].nodes.back().position ||
        a[i].nodes.back().rotation.coeffs() != b[i].nodes.back().rotation.coeffs())
      return false;
  return true;
}

TEST(FitEnds, FindsAStableRodForEveryReachablePairOfPoses) {
  const struct {
    const char* name;
    Vector6 natural;
    double radius;
    int least_found_again;  // in a hundred
  } kinds[] = {{"round", roundStiffness(), 0.01, 85},
               {"uneven", unevenStiffness(), 0.01, 60},
               {"slender", roundStiffness(0.002), 0.002, 85}};
  for (const auto& kind : kinds) {
    SCOPED_TRACE(kind.name);
    const RodProperties rod = scaledRod(kind.natural, kind.radius, 8);
    RodSampler sampler(rod, {}, 24);
    Random random(24);
    const statics::NaturalRod natural(rod, Vector3::Zero());
    statics::Integrator exact(natural);
    int found_again = 0, missed = 0, missed_by_one = 0;
    const int poses = kind.natural == roundStiffness() ? kPoses : kPoses / 2;
    for (int trial = 0; trial < poses; ++trial) {
      const Equilibrium* drawn = sampler.next();
      ASSERT_TRUE(drawn);
      const Pose base{random.rotation(), {random.uniform(), random.uniform(), random.uniform()}};
      const GripperPoses ends{base, base * drawn->nodes.back()};
      const std::vector<Equilibrium> all = fitEnds(rod, ends),
                                     one = fitEnds(rod, ends, Vector3::Zero(), Wanted::one);
      missed += all.empty(), missed_by_one += one.empty();
      bool again = false;
      for (const auto* fitted : {&all, &one}) {
        for (std::size_t i = 0; i < fitted->size(); ++i) {
          const Equilibrium& e = (*fitted)[i];
          EXPECT_EQ(e.stability, Stability::stable);
          EXPECT_EQ(e.nodes.front().position, ends.first.position);
          EXPECT_LT((e.nodes.back().position - ends.last.position).norm(), 1e-9 * rod.length);
          EXPECT_LT(angleBetween(e.nodes.back().rotation, ends.last.rotation), 1e-9);
          EXPECT_LE((*fitted)[i > 0 ? i - 1 : 0].energy, e.energy);
          for (std::size_t j = 0; j < i; ++j)
            EXPECT_GT((e.wrench - (*fitted)[j].wrench).norm(), 1e-7 * e.wrench.norm());
          again = again || (e.wrench - drawn->wrench).norm() < 1e-6 * drawn->wrench.norm();
          // by far more steps: what fitEnds' own integration errs by
          statics::NaturalEnd end;
          ASSERT_EQ(exact.end(natural.units.wrenchToNatural(e.wrench), Vector3::Zero(), {8, 1e-6}, end),
                    ChartStatus::equilibrium);
          Pose last = end.end;
          last.position *= rod.length;
          EXPECT_LT(((base * last).position - ends.last.position).norm(), 1e-7 * rod.length);
          EXPECT_LT(angleBetween((base * last).rotation, ends.last.rotation), 1e-6);
          if (trial >= 4) continue;
          const Place y = endOf(HeavyRod(rod), startOf(base.rotation, e.wrench), 1000);
          EXPECT_LT((base.position + y.p - ends.last.position).norm(), 1e-7 * rod.length);
        }
      }
      found_again += again;
    }
    EXPECT_EQ(missed, 0);
    EXPECT_EQ(missed_by_one, 0);
    EXPECT_GE(100 * found_again, kind.least_found_again * poses);
  }
}

TEST(FitEnds, FindsTheStraightUnloadedRodFirst) {
  const RodProperties rod = rodOf(roundStiffness(), 10, 1);
  const Pose base{Quaternion(Eigen::AngleAxisd(1, Vector3(1, 2, 3).normalized())), {3, 2, 1}};
  const std::vector<Equilibrium> fitted =
      fitEnds(rod, {base, base * Pose{Quaternion::Identity(), Vector3::UnitX()}});
  ASSERT_FALSE(fitted.empty());
  EXPECT_LT(fitted[0].energy, 1e-12);
  EXPECT_LT(fitted[0].wrench.norm(), 1e-8);
}

TEST(FitEnds, FindsBothMirrorImagesOfABuckledStrut) {
  // Ends half a length apart on one axis: the elastica, bent to any side; the least energy is the same for
  // all.
  const std::vector<Equilibrium> fitted =
      fitEnds(rodOf(unevenStiffness(), 10), {{}, {Quaternion::Identity(), {0.6, 0, 0}}});
  ASSERT_GE(fitted.size(), 2U);
  EXPECT_NEAR(fitted[0].energy, fitted[1].energy, 1e-6 * fitted[0].energy);
  EXPECT_GT((fitted[0].wrench - fitted[1].wrench).norm(), 1);
}

TEST(FitEnds, CoaxialEndsOfARodThatBendsAlikeAllRoundHoldACircleOfMarginalRods) {
  // Turned about the axis, a buckled strut with c2 = c3, c5 = c6 is another one between the same ends: a
  // conjugate point at 1, where Theorem 2 says nothing. A tilted end, however little, singles one out.
  const RodProperties rod = rodOf(roundStiffness(), 10);
  EXPECT_TRUE(fitEnds(rod, {{}, {Quaternion::Identity(), {0.9, 0, 0}}}).empty());
  EXPECT_FALSE(fitEnds(rod, {{}, {expSO3({0, 0, 0.01}), {0.9, 0, 0}}}).empty());
}

TEST(FitEnds, FindsTheLeastEnergyOfACompressedRodWithItsEndsOffset) {
  // The rod bows out of the plane of its offset ends, to either side alike, at 1.483 J; twisted ones hold 6.8
  // J and more.
  RodProperties rod;
  rod.c = stiffnessOfRoundRod(5e7, 2e7, 0.01);
  rod.elements = 20;
  const std::vector<Equilibrium> found = fitEnds(rod, {{}, {Quaternion::Identity(), {0.9, 0.1, 0}}});
  ASSERT_GE(found.size(), 2U);
  EXPECT_NEAR(found[0].energy, 1.483, 1e-3);
  EXPECT_NEAR(found[1].energy, found[0].energy, 1e-6);
  EXPECT_NEAR(found[0].nodes[10].position.z(), -found[1].nodes[10].position.z(), 1e-6);
  EXPECT_GT(std::abs(found[0].nodes[10].position.z()), 0.01);
}

/// Sets $TENDRIL_CACHE while it lives.
class CacheFolder {
 public:
  explicit CacheFolder(const std::string& folder) {
    if (const char* old = std::getenv("TENDRIL_CACHE")) old_ = old;
    ::setenv("TENDRIL_CACHE", folder.c_str(), 1);
  }
  ~CacheFolder() {
    if (old_)
      ::setenv("TENDRIL_CACHE", old_->c_str(), 1);
    else
      ::unsetenv("TENDRIL_CACHE");
  }
  CacheFolder(const CacheFolder&) = delete;
  CacheFolder& operator=(const CacheFolder&) = delete;

 private:
  std::optional<std::string> old_;
};

/// Makes the process forget the libraries it keeps: a few are kept, and these are others.
void forgetLibraries() {
  const CacheFolder nowhere("");
  for (int i = 1; i <= 4; ++i) {
    const RodProperties rod = rodOf(vector6(1, 1, 1, 10 + i, 5, 5));
    (void)statics::libraryFor(statics::NaturalRod(rod, Vector3::Zero()));
  }
}

TEST(FitEnds, GivesTheSameBytesFromDiskFromAFileThatIsNotWholeAndWithoutOne) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("tendril_cache_" + std::to_string(::getpid()));
  std::filesystem::remove_all(folder);
  const RodProperties rod = rodOf(vector6(0.7, 0.9, 1.1, 3000, 1000, 1100), 10);
  const GripperPoses ends{{}, {expSO3({0.3, -0.8, 0.9}), {0.5, 0.3, -0.2}}};
  const auto fit = [&] {
    forgetLibraries();
    return fitEnds(rod, ends);
  };
  std::vector<Equilibrium> built;
  {
    const CacheFolder nowhere("");
    built = fit();
    EXPECT_TRUE(sameRods(built, fitEnds(rod, ends)));  // from memory
  }
  ASSERT_FALSE(built.empty());
  EXPECT_FALSE(std::filesystem::exists(folder));
  const CacheFolder here(folder.string());
  EXPECT_TRUE(sameRods(built, fit()));
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry.path());
  ASSERT_EQ(files.size(), 1U);
  const std::string whole = readFile(files[0]);
  EXPECT_TRUE(sameRods(built, fit()));  // read back
  EXPECT_EQ(readFile(files[0]), whole);
  std::string flipped = whole;
  flipped[whole.size() / 2] ^= 1;
  for (const std::string& bad : {flipped, whole.substr(0, whole.size() - 112), std::string()}) {
    writeFileAtomically(files[0], bad);
    EXPECT_TRUE(sameRods(built, fit()));
    EXPECT_EQ(readFile(files[0]), whole) << "not rebuilt from " << bad.size() << " bytes";
  }
  std::filesystem::remove_all(folder);
  // a place that cannot be written does not matter
  const CacheFolder bad("/dev/null/nowhere");
  EXPECT_TRUE(sameRods(built, fit()));
}

TEST(FitEnds, GivesTheSameBytesFromSeveralThreads) {
  const RodProperties rod = rodOf(unevenStiffness(), 10);
  const auto ends = [](int i) {
    return GripperPoses{{}, {expSO3({0.1 * i, -0.8, 0.9}), {0.5, 0.3, -0.1 * i}}};
  };
  std::vector<std::vector<Equilibrium>> alone, together(4);
  for (int i = 0; i < 4; ++i) alone.push_back(fitEnds(rod, ends(i)));
  forgetLibraries();
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < 4; ++i)
      threads.emplace_back([&, i] { together[static_cast<std::size_t>(i)] = fitEnds(rod, ends(i)); });
  }
  for (std::size_t i = 0; i < 4; ++i) EXPECT_TRUE(sameRods(alone[i], together[i])) << i;
}

TEST(FitEnds, EndsOutOfReachHaveNoEquilibrium) {
  EXPECT_TRUE(fitEnds(rodOf(roundStiffness()), {{}, {Quaternion::Identity(), {3, 0, 0}}}).empty());
}

TEST(FitEnds, APlacementByPoseAndWrenchIsOneStableRodOrNone) {
  const RodProperties rod = rodOf(roundStiffness());
  EXPECT_EQ(equilibriaOf(rod, PoseAndWrench{{}, vector6(0, 1, 0, 0, 0, 0)}).size(), 1U);
  EXPECT_TRUE(equilibriaOf(rod, PoseAndWrench{{}, vector6(0, 0, 0, -60, 0, 0)}).empty());
  EXPECT_TRUE(equilibriaOf(rod, PoseAndWrench{{}, vector6(0, 0, 0, -1e5, 0, 0)}).empty());
  EXPECT_FALSE(equilibriaOf(rod, GripperPoses{{}, {Quaternion::Identity(), {0.9, 0.1, 0}}}).empty());
}

TEST(HeavyFitEnds, FindsARodBetweenEndsThatHoldNoWeightlessOneStably) {
  // Coaxial ends hold a buckled round rod in a circle of marginal equilibria; its weight makes it hang. The
  // dynamic rod of 320 elements, brought there and at rest, has its middle at z = -0.3205722 m.
  RodProperties rod;
  rod.c = stiffnessOfRoundRod(1e8, 1e8 / 2.8, rod.radius);
  const GripperPoses ends{{}, {expSO3({0.999 * 3.14159, 0, 0}), {0.5, 0, 0}}};
  EXPECT_TRUE(fitEnds(rod, ends).empty());
  const std::vector<Equilibrium> found = fitEnds(rod, ends, {0, 0, -9.81});
  ASSERT_FALSE(found.empty());
  double nearest = 1;
  for (const Equilibrium& e : found) {
    EXPECT_LT((e.nodes.back().position - ends.last.position).norm(), 1e-9);
    nearest = std::min(nearest, (e.nodes[20].position - Vector3(0.25, 0, -0.3205722)).norm());
  }
  EXPECT_LT(nearest, 2e-6);
}

}  // namespace
}  // namespace tendril
