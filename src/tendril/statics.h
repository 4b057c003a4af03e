/// tendril/statics.h: equilibria of an extensible, shearable rod held at its ends, on the chart of Theorem 1;
/// their stability by Theorem 2, exactly; sampling; fitting both ends. src/tendril/statics/README.md derives
/// it.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "tendril/rod.h"

namespace tendril {

enum class Stability {
  stable,    // no conjugate point in (0, 1]
  unstable,  // at least one in (0, 1)
  marginal   // one at (or within rounding of) 1, where Theorem 2 says nothing
};

/// One point of the chart: the rod whose first node is at `base` and carries the wrench a there.
struct Equilibrium {
  Pose base;
  Vector6 wrench = Vector6::Zero();  // a = mu(0): N m, N, in the frame of the first node
  RodShape nodes;                    // elements + 1 frames, world
  double energy = 0;                 // J, elastic
  double weight_energy = 0;          // J, of the rod's weight, counted from the base's height
  Stability stability = Stability::unstable;
  int conjugate_points = 0;                 // in (0, 1), with multiplicity; valid unless inverted
  std::optional<double> first_conjugate_t;  // in (0, 1]; empty exactly when stable
};

/// What the chart has to say of a wrench: `inverted` (1 + u4 <= 0.05 somewhere: no rod) or an equilibrium.
enum class ChartStatus { equilibrium, inverted };

/// The last frame of an equilibrium, seen from its first.
struct EquilibriumEnd {
  Pose end_in_base;                    // m
  double energy = 0;                   // J, elastic
  Matrix6 jacobian = Matrix6::Zero();  // J(1) = dq(1)/da in the end's body frame, (angular; linear): rad, m per N m, N
  bool stable = false;                 // neither unstable nor marginal
};

/// Integrates the chart for one rod and keeps its memory between calls. Not thread-safe; make one per thread.
/// `gravity` [m/s^2, world] makes the rod heavy: then the shape depends on how the base is turned.
class EquilibriumIntegrator {
 public:
  explicit EquilibriumIntegrator(const RodProperties& rod, const Vector3& gravity = Vector3::Zero());
  ~EquilibriumIntegrator();
  EquilibriumIntegrator(EquilibriumIntegrator&&) noexcept;

  /// Shape, energy and stability for the wrench a [N m, N] at `base`, to about 1e-8 L. `out` is reused: no allocation after
  /// the first call.
  [[nodiscard]] ChartStatus solve(const Pose& base, const Vector6& wrench, Equilibrium& out);
  /// Shape and energy only; `out.stability` is left alone.
  [[nodiscard]] ChartStatus shape(const Pose& base, const Vector6& wrench, Equilibrium& out);
  /// Only the verdict and no conjugate time: the planner's question. `base` matters to a heavy rod alone.
  [[nodiscard]] bool isStable(const Quaternion& base, const Vector6& wrench);
  [[nodiscard]] bool isStable(const Vector6& wrench) { return isStable(Quaternion::Identity(), wrench); }
  /// The end, to 1e-6 L in 99 rods of a hundred, with its Jacobian and the verdict.
  [[nodiscard]] ChartStatus end(const Quaternion& base, const Vector6& wrench, EquilibriumEnd& out);
  [[nodiscard]] ChartStatus end(const Vector6& wrench, EquilibriumEnd& out) {
    return end(Quaternion::Identity(), wrench, out);
  }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Integrates many rods of one kind at once, in the lanes of the processor's widest registers. What it says of a rod does not
/// depend on the others, on their number or on the processor. Not thread-safe; make one per thread.
class EquilibriumBatch {
 public:
  explicit EquilibriumBatch(const RodProperties& rod);
  ~EquilibriumBatch();
  EquilibriumBatch(EquilibriumBatch&&) noexcept;

  /// The ends' frames and energies alone, to 1e-6 L in 99 rods of a hundred. Inverted rods get an energy of infinity.
  /// `ends` has as many elements as `wrenches`.
  void shapes(std::span<const Vector6> wrenches, std::span<EquilibriumEnd> ends);
  /// The same with Jacobians and verdicts.
  void ends(std::span<const Vector6> wrenches, std::span<EquilibriumEnd> ends);
  /// The verdicts alone: a rod is given up as soon as it is found unstable.
  void areStable(std::span<const Vector6> wrenches, std::span<bool> stable);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The smallest distance [m] of the centreline to itself between elements farther apart along the rod than pi
/// r, where being near means self-contact and not just bending. Infinity if there are no such pairs.
[[nodiscard]] double selfDistance(const RodShape& shape, const RodProperties& rod);

/// Half-widths of the box A from which a is drawn, in the rod's own units.
struct SamplingBox {
  double moment = 6.283185307179586;  // EI/L
  double force = 40.0;                // EI/L^2
};
/// Draws a from the box until it is stable, uninverted and (with the rod's radius) clear of itself. Expected
/// draws about 4 at the default box. Base pose is left to the caller.
/// Throws InputError after 100000 draws without one: a box far beyond the stable wrenches.
[[nodiscard]] Equilibrium sampleStable(EquilibriumIntegrator& integrator, const RodProperties& rod,
                                       const SamplingBox& box, Random& random);

/// All distinct stable equilibria found between two end frames, by ascending energy: Newton on a with J(1),
/// continued along the geodesic through stable rods from the 20 nearest of a library of 2000, and the 20 of
/// least energy near by, (built on the first call for a stiffness, 0.2 s, and kept). Empty if none is found;
/// that includes the circle of marginal rods that a rod with c2 = c3, c5 = c6 forms between coaxial ends when
/// it buckles off their axis. Deterministic and thread-safe; about 10 ms.
[[nodiscard]] std::vector<Equilibrium> fitEnds(const RodProperties& rod, const GripperPoses& ends);

/// Every stable equilibrium for a placement, by ascending energy: one or none for a pose and wrench.
[[nodiscard]] std::vector<Equilibrium> equilibriaOf(const RodProperties& rod, const Placement& placement);

}  // namespace tendril
