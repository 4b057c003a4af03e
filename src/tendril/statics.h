/// tendril/statics.h: equilibria of an extensible, shearable rod held at its ends, on the chart of Theorem 1;
/// their stability by Theorem 2, exactly; sampling; fitting both ends. src/tendril/statics/README.md derives
/// it.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "tendril/geometry.h"
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
  Pose end_in_base;   // m
  double energy = 0;  // J, elastic
  Matrix6 jacobian =
      Matrix6::Zero();  // J(1) = dq(1)/da in the end's body frame, (angular; linear): rad, m per N m, N
  bool stable = false;  // neither unstable nor marginal
};

/// Integrates the chart for one rod and keeps its memory between calls. Not thread-safe; make one per thread.
/// `gravity` [m/s^2, world] makes the rod heavy: then the shape depends on how the base is turned.
class EquilibriumIntegrator {
 public:
  explicit EquilibriumIntegrator(const RodProperties& rod, const Vector3& gravity = Vector3::Zero());
  ~EquilibriumIntegrator();
  EquilibriumIntegrator(EquilibriumIntegrator&&) noexcept;

  /// Shape, energy and stability for the wrench a [N m, N] at `base`, to 1e-10 L. `out` is reused: no
  /// allocation after the first call.
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

/// Integrates many rods of one kind at once, in the lanes of the processor's widest registers. What it says
/// of a rod does not depend on the others, on their number or on the processor. Not thread-safe; make one per
/// thread.
class EquilibriumBatch {
 public:
  explicit EquilibriumBatch(const RodProperties& rod);
  ~EquilibriumBatch();
  EquilibriumBatch(EquilibriumBatch&&) noexcept;

  /// The ends' frames and energies alone, to 1e-6 L in 99 rods of a hundred. Inverted rods get an energy of
  /// infinity. `ends` has as many elements as `wrenches`.
  void shapes(std::span<const Vector6> wrenches, std::span<EquilibriumEnd> ends);
  /// The same with verdicts, and with the Jacobians of the stable rods: an unstable rod is given up when it
  /// is found out, and has nothing but its verdict.
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

/// What static rods are drawn from.
struct SamplingSpace {
  SamplingBox box;
  bool stable_only = true;                       // false: whatever the verdict, but no inverted rod
  std::optional<Eigen::AlignedBox3d> workspace;  // m, world; none: every rod begins at the world's frame
  const Obstacles* obstacles = nullptr;
  Vector3 gravity = Vector3::Zero();  // m/s^2, world
};

/// Draws static rods: a uniform in the box (for a heavy rod the force's box is centred on a uniform share of
/// the weight), the base's frame uniform in the workspace and over all rotations, until the rod is stable,
/// wholly inside the workspace, clear of the obstacles and of itself. The sequence depends on the seed alone.
/// Refers to the obstacles, does not own them.
class RodSampler {
 public:
  RodSampler(const RodProperties& rod, const SamplingSpace& space, std::uint64_t seed);
  ~RodSampler();
  RodSampler(RodSampler&&) noexcept;

  /// The next rod, valid until the next call; null after some 200,000 draws in a row without one.
  [[nodiscard]] const Equilibrium* next();

 private:
  friend std::vector<Equilibrium> sampleRods(const RodProperties&, const SamplingSpace&, std::uint64_t,
                                             std::size_t, int);
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The first `count` rods of RodSampler, drawn by `threads` threads: the same whatever their number. Fewer
/// where RodSampler would give up.
[[nodiscard]] std::vector<Equilibrium> sampleRods(const RodProperties& rod, const SamplingSpace& space,
                                                  std::uint64_t seed, std::size_t count, int threads = 1);

/// How long fitEnds looks: until it has one equilibrium (or several at once), or for all it can find.
enum class Wanted { one, all };

/// The distinct stable equilibria found between two end frames [m], by ascending energy (elastic and of the
/// weight): Newton's method on a with J(1), continued along the geodesic to the wanted end from the nearest
/// rods of a library of stable ones, through stable rods only; a heavy rod gains its weight little by little,
/// between these ends or, if none can, between those of the library's rods before it is led to these. Each is
/// exact to 1e-9 L and rad. The library depends on stiffness and rest curvature; it is built once and kept in
/// memory, and on disk in $TENDRIL_CACHE (default: tendril in $XDG_CACHE_HOME or ~/.cache; empty: not at
/// all). Empty if none is found; that includes the circle of marginal rods that a rod with c2 = c3, c5 = c6
/// forms between coaxial ends when it buckles off their axis. Deterministic, thread-safe.
[[nodiscard]] std::vector<Equilibrium> fitEnds(const RodProperties& rod, const GripperPoses& ends,
                                               const Vector3& gravity = Vector3::Zero(),
                                               Wanted wanted = Wanted::all);

/// Every stable equilibrium for a placement, by ascending energy: one or none for a pose and wrench.
[[nodiscard]] std::vector<Equilibrium> equilibriaOf(const RodProperties& rod, const Placement& placement,
                                                    const Vector3& gravity = Vector3::Zero());

/// One place on a way through the chart: both grippers' frames [m] and the wrench at the first.
struct ChartStation {
  GripperPoses grippers;
  Vector6 wrench;  // N m, N
};

/// A quasi-static motion of the grippers from one stable equilibrium to another, through stable ones only.
struct ChartPath {
  bool connected = false;
  std::vector<ChartStation> stations;  // from start to goal; empty if not connected
  /// Where the straight way through the chart is first unstable, if it is: the part of the way that was gone,
  /// and the wrench.
  std::optional<double> lost_at;
  Vector6 lost_wrench = Vector6::Zero();
};

/// Looks for such a motion: straight in a, else by way of a = 0, else by way of rods of the library; the
/// base moves straight and by the shortest turn meanwhile. Every station is a stable rod; between stations
/// the grippers move by at most `stride` (of L, and rad), unless the stations are 1e-4 of the way's leg
/// apart. No contact, no obstacles. Throws InputError if an end of the way is not a stable rod.
[[nodiscard]] ChartPath chartPath(const RodProperties& rod, const PoseAndWrench& from,
                                  const PoseAndWrench& to, const Vector3& gravity = Vector3::Zero(),
                                  double stride = 0.02);

}  // namespace tendril
