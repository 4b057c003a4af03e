#include <cassert>
#include <limits>

#include "tendril/statics.h"
#include "tendril/statics/integrator.h"

namespace tendril {

using namespace statics;

struct EquilibriumBatch::Impl {
  Integrator natural;
  std::vector<AlignedWrench> wrenches;
  std::vector<std::size_t> index;  // of each of them among those asked for
  std::vector<PathEnd> paths;
  std::vector<JointEnd> joints;

  /// Lays out the rods that the kernels for many rods can work on, and calls alone(i) for every other.
  template <class Alone>
  void sort(std::span<const Vector6> si, const Alone& alone) {
    const NaturalRod& rod = natural.rod();
    wrenches.clear(), index.clear();
    for (std::size_t i = 0; i < si.size(); ++i) {
      const Vector6 a = rod.units.wrenchToNatural(si[i]);
      if (rod.uniformAndWeightless() && rod.leastStretch(a) > kSmallestStretch)
        wrenches.push_back(aligned(rod, a, rod.stepCount(a, kQuick))), index.push_back(i);
      else
        alone(i, a);
    }
  }
  void runJoints(bool stop) {
    joints.resize(wrenches.size());
    kernel().joints(natural.rod().kernel, wrenches, stop, joints.data());
  }
  void endAlone(const Vector6& a, EquilibriumEnd& out) {
    NaturalEnd end;
    if (natural.end(a, Vector3::Zero(), kQuick, end) == ChartStatus::equilibrium)
      out = toSi(end, natural.rod().units);
    else
      out = {}, out.energy = std::numeric_limits<double>::infinity();
  }
};

EquilibriumBatch::EquilibriumBatch(const RodProperties& rod)
    : impl_(std::make_unique<Impl>(Impl{Integrator(NaturalRod(rod, Vector3::Zero())), {}, {}, {}, {}})) {}
EquilibriumBatch::~EquilibriumBatch() = default;
EquilibriumBatch::EquilibriumBatch(EquilibriumBatch&&) noexcept = default;

void EquilibriumBatch::shapes(std::span<const Vector6> wrenches, std::span<EquilibriumEnd> ends) {
  assert(wrenches.size() == ends.size());
  Impl& impl = *impl_;
  impl.sort(wrenches, [&](std::size_t i, const Vector6& a) { impl.endAlone(a, ends[i]); });
  impl.paths.resize(impl.wrenches.size());
  kernel().paths(impl.natural.rod().kernel, impl.wrenches, impl.paths.data());
  const Units& units = impl.natural.rod().units;
  for (std::size_t k = 0; k < impl.wrenches.size(); ++k) {
    EquilibriumEnd& out = ends[impl.index[k]];
    const Quaternion back = Quaternion(Eigen::Map<const Quaternion>(impl.wrenches[k].rotation)).conjugate();
    out.end_in_base.rotation = back * Quaternion(Eigen::Map<const Quaternion>(impl.paths[k].rotation));
    out.end_in_base.position = units.length * (back * Vector3::Map(impl.paths[k].position));
    out.energy = units.energy * impl.paths[k].energy;
  }
}

void EquilibriumBatch::ends(std::span<const Vector6> wrenches, std::span<EquilibriumEnd> ends) {
  assert(wrenches.size() == ends.size());
  Impl& impl = *impl_;
  impl.sort(wrenches, [&](std::size_t i, const Vector6& a) { impl.endAlone(a, ends[i]); });
  impl.runJoints(false);
  const Units& units = impl.natural.rod().units;
  for (std::size_t k = 0; k < impl.wrenches.size(); ++k) {
    NaturalEnd end;
    Integrator::fromKernel(impl.wrenches[k], impl.joints[k], end);
    const std::size_t i = impl.index[k];
    if (impl.joints[k].screening == Screening::unsure)
      end.stable = impl.natural.isStable(units.wrenchToNatural(wrenches[i]), Vector3::Zero());
    ends[i] = toSi(end, units);
  }
}

void EquilibriumBatch::areStable(std::span<const Vector6> wrenches, std::span<bool> stable) {
  assert(wrenches.size() == stable.size());
  Impl& impl = *impl_;
  impl.sort(wrenches, [&](std::size_t i, const Vector6& a) { stable[i] = impl.natural.isStable(a, Vector3::Zero()); });
  impl.runJoints(true);
  for (std::size_t k = 0; k < impl.wrenches.size(); ++k) {
    const std::size_t i = impl.index[k];
    const Screening screening = impl.joints[k].screening;
    stable[i] = screening == Screening::unsure
                    ? impl.natural.isStable(impl.natural.rod().units.wrenchToNatural(wrenches[i]), Vector3::Zero())
                    : screening == Screening::stable;
  }
}

}  // namespace tendril
