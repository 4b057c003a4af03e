#include "tendril/statics/batch.h"

#include <cassert>

namespace tendril {

using namespace statics;

struct EquilibriumBatch::Impl {
  Batch batch;
  std::vector<Vector6> natural;

  std::span<const Vector6> toNatural(std::span<const Vector6> wrenches) {
    natural.clear();
    for (const Vector6& wrench : wrenches) natural.push_back(batch.rod().units.wrenchToNatural(wrench));
    return natural;
  }
};

EquilibriumBatch::EquilibriumBatch(const RodProperties& rod)
    : impl_(std::make_unique<Impl>(Impl{Batch(NaturalRod(rod, Vector3::Zero())), {}})) {}
EquilibriumBatch::~EquilibriumBatch() = default;
EquilibriumBatch::EquilibriumBatch(EquilibriumBatch&&) noexcept = default;

void EquilibriumBatch::shapes(std::span<const Vector6> wrenches, std::span<EquilibriumEnd> ends) {
  assert(wrenches.size() == ends.size());
  const Units& units = impl_->batch.rod().units;
  impl_->batch.paths(impl_->toNatural(wrenches), kQuick, [&](std::size_t i, const NaturalEnd& end) {
    ends[i].end_in_base = {end.end.rotation, units.length * end.end.position};
    ends[i].energy = units.energy * end.energy;
  });
}

void EquilibriumBatch::ends(std::span<const Vector6> wrenches, std::span<EquilibriumEnd> ends) {
  assert(wrenches.size() == ends.size());
  impl_->batch.ends(impl_->toNatural(wrenches), kQuick, true, [&](std::size_t i, const NaturalEnd& end) {
    if (end.stable) ends[i] = toSi(end, impl_->batch.rod().units);
    ends[i].stable = end.stable;
  });
}

void EquilibriumBatch::areStable(std::span<const Vector6> wrenches, std::span<bool> stable) {
  assert(wrenches.size() == stable.size());
  impl_->batch.verdicts(impl_->toNatural(wrenches),
                        [&](std::size_t i, bool verdict) { stable[i] = verdict; });
}

}  // namespace tendril
