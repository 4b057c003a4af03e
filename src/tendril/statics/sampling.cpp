#include <algorithm>
#include <thread>

#include "tendril/statics.h"
#include "tendril/statics/batch.h"

namespace tendril {

using namespace statics;

namespace {

constexpr std::size_t kBlock = 256;  // draws that share a stream of random numbers
constexpr std::uint64_t kFruitless =
    200000 / kBlock;  // blocks in a row without a rod, after which a sampler gives up

/// The seed of a block's stream: one step of SplitMix64 (Steele, Lea, Flood 2014), so that neighbouring
/// blocks have nothing in common.
std::uint64_t seedOf(std::uint64_t seed, std::uint64_t block) {
  std::uint64_t z = seed * 0xd1342543de82ef95ULL + (block + 1) * 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

}  // namespace

struct RodSampler::Impl {
  RodProperties rod;
  SamplingSpace space;
  std::uint64_t seed;
  bool heavy;
  EquilibriumIntegrator integrator;
  Batch batch;
  std::uint64_t block = 0, fruitless = 0;
  std::size_t place = kBlock;                                    // in the block; kBlock: a new block is due
  std::vector<Vector6> wrenches = std::vector<Vector6>(kBlock);  // in the rod's own units
  std::vector<Pose> bases = std::vector<Pose>(kBlock);
  std::vector<char> hopeful = std::vector<char>(kBlock);
  std::vector<Vector3> positions;
  Equilibrium out;

  Impl(const RodProperties& properties, const SamplingSpace& where, std::uint64_t s)
      : rod(properties),
        space(where),
        seed(s),
        heavy(!space.gravity.isZero(0)),
        integrator(rod, space.gravity),
        batch(NaturalRod(rod, Vector3::Zero())) {}

  /// Draws the block's wrenches and bases and tells, of light rods, which are worth a closer look.
  void draw(std::uint64_t index) {
    const Vector3 weight = NaturalRod(rod, space.gravity).weight;
    Random random(seedOf(seed, index));
    for (std::size_t i = 0; i < kBlock; ++i) {
      for (int k = 0; k < 3; ++k) wrenches[i][k] = random.uniform(-space.box.moment, space.box.moment);
      for (int k = 3; k < 6; ++k) wrenches[i][k] = random.uniform(-space.box.force, space.box.force);
      if (space.workspace) {
        for (int k = 0; k < 3; ++k)
          bases[i].position[k] = random.uniform(space.workspace->min()[k], space.workspace->max()[k]);
        bases[i].rotation = random.rotation();
      }
      if (heavy) wrenches[i].tail<3>() += random.uniform() * (bases[i].rotation.conjugate() * weight);
    }
    if (space.stable_only && !heavy)
      batch.verdicts(wrenches, [&](std::size_t i, bool stable) { hopeful[i] = stable; });
    else
      std::fill(hopeful.begin(), hopeful.end(), true);
  }

  /// Whether draw i is a rod to hand out; puts it into `out`.
  [[nodiscard]] bool accept(std::size_t i) {
    if (!hopeful[i]) return false;
    const Vector6 wrench = batch.rod().units.wrenchToSi(wrenches[i]);
    if (integrator.shape(bases[i], wrench, out) == ChartStatus::inverted) return false;
    positions.resize(out.nodes.size());
    for (std::size_t k = 0; k < positions.size(); ++k) {
      positions[k] = out.nodes[k].position;
      if (space.workspace && !space.workspace->contains(positions[k])) return false;
    }
    if (!(selfDistance(out.nodes, rod) > 2 * rod.radius)) return false;
    if (space.obstacles &&
        space.obstacles->clearance(positions, rod.radius + space.obstacles->deviation()).segment >= 0)
      return false;
    if (!space.stable_only) return integrator.solve(bases[i], wrench, out) == ChartStatus::equilibrium;
    // A light rod's verdict is known; a heavy one's is asked for last, being dear.
    if (heavy && !integrator.isStable(bases[i].rotation, wrench)) return false;
    out.stability = Stability::stable;
    out.conjugate_points = 0;
    out.first_conjugate_t.reset();
    return true;
  }

  [[nodiscard]] const Equilibrium* next() {
    for (;; ++place) {
      if (place >= kBlock) {
        if (fruitless == kFruitless) return nullptr;
        draw(block++);
        ++fruitless;
        place = 0;
      }
      if (accept(place)) {
        ++place;
        fruitless = 0;
        return &out;
      }
    }
  }
};

RodSampler::RodSampler(const RodProperties& rod, const SamplingSpace& space, std::uint64_t seed)
    : impl_(std::make_unique<Impl>(rod, space, seed)) {}
RodSampler::~RodSampler() = default;
RodSampler::RodSampler(RodSampler&&) noexcept = default;

const Equilibrium* RodSampler::next() { return impl_->next(); }

std::vector<Equilibrium> sampleRods(const RodProperties& rod, const SamplingSpace& space, std::uint64_t seed,
                                    std::size_t count, int threads) {
  const auto workers = static_cast<std::size_t>(std::max(1, threads));
  std::vector<RodSampler> samplers;
  for (std::size_t w = 0; w < workers; ++w) samplers.emplace_back(rod, space, seed);
  std::vector<std::vector<Equilibrium>> found(workers);
  std::vector<Equilibrium> all;
  std::uint64_t fruitless = 0;
  for (std::uint64_t first = 0; all.size() < count && fruitless < kFruitless; first += workers) {
    const auto work = [&](std::size_t w) {
      RodSampler::Impl& sampler = *samplers[w].impl_;
      found[w].clear();
      sampler.draw(first + w);
      for (std::size_t i = 0; i < kBlock; ++i)
        if (sampler.accept(i)) found[w].push_back(sampler.out);
    };
    std::vector<std::jthread> running;
    for (std::size_t w = 1; w < workers; ++w) running.emplace_back(work, w);
    work(0);
    running.clear();  // waits
    for (std::size_t w = 0; w < workers; ++w) {
      fruitless = found[w].empty() ? fruitless + 1 : 0;
      for (Equilibrium& e : found[w])
        if (all.size() < count) all.push_back(std::move(e));
      if (fruitless == kFruitless) break;
    }
  }
  return all;
}

}  // namespace tendril
