#include "tendril/statics.h"
#include "tendril/statics/integrator.h"

namespace tendril {

using namespace statics;

struct EquilibriumIntegrator::Impl {
  int elements;
  Integrator natural;

  /// The rod's weight in base axes.
  [[nodiscard]] Vector3 weightAt(const Quaternion& base) const {
    return base.conjugate() * natural.rod().weight;
  }
  [[nodiscard]] const Units& units() const { return natural.rod().units; }

  /// The nodes in world, in metres, and the energies, of the rod integrated last.
  void write(const Pose& base, const Vector6& wrench, Equilibrium& out) const {
    out.base = base;
    out.wrench = wrench;
    out.nodes.resize(static_cast<std::size_t>(elements) + 1);
    out.nodes.front() = base;
    for (int i = 1; i <= elements; ++i) {
      Pose q = natural.node(i, elements);
      q.position *= units().length;
      out.nodes[static_cast<std::size_t>(i)] = base * q;
    }
    out.energy = natural.energy() * units().energy;
    out.weight_energy = natural.weightEnergy() * units().energy;
  }
};

EquilibriumIntegrator::EquilibriumIntegrator(const RodProperties& rod, const Vector3& gravity)
    : impl_(std::make_unique<Impl>(Impl{rod.elements, Integrator(NaturalRod(rod, gravity))})) {}
EquilibriumIntegrator::~EquilibriumIntegrator() = default;
EquilibriumIntegrator::EquilibriumIntegrator(EquilibriumIntegrator&&) noexcept = default;

ChartStatus EquilibriumIntegrator::shape(const Pose& base, const Vector6& wrench, Equilibrium& out) {
  const Vector6 a = impl_->units().wrenchToNatural(wrench);
  if (impl_->natural.integrate(a, impl_->weightAt(base.rotation), kFine, nullptr) == ChartStatus::inverted)
    return ChartStatus::inverted;
  impl_->write(base, wrench, out);
  return ChartStatus::equilibrium;
}

ChartStatus EquilibriumIntegrator::solve(const Pose& base, const Vector6& wrench, Equilibrium& out) {
  const Vector6 a = impl_->units().wrenchToNatural(wrench);
  Verdict verdict;
  if (impl_->natural.integrate(a, impl_->weightAt(base.rotation), kFine, &verdict) == ChartStatus::inverted)
    return ChartStatus::inverted;
  impl_->write(base, wrench, out);
  out.stability = verdict.stability;
  out.conjugate_points = verdict.conjugate_points;
  out.first_conjugate_t = verdict.first_conjugate_t;
  return ChartStatus::equilibrium;
}

bool EquilibriumIntegrator::isStable(const Quaternion& base, const Vector6& wrench) {
  return impl_->natural.isStable(impl_->units().wrenchToNatural(wrench), impl_->weightAt(base));
}

ChartStatus EquilibriumIntegrator::end(const Quaternion& base, const Vector6& wrench, EquilibriumEnd& out) {
  NaturalEnd natural;
  const Units& units = impl_->units();
  if (impl_->natural.end(units.wrenchToNatural(wrench), impl_->weightAt(base), kQuick, natural) ==
      ChartStatus::inverted)
    return ChartStatus::inverted;
  out = toSi(natural, units);
  return ChartStatus::equilibrium;
}

}  // namespace tendril
