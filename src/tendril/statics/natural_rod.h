/// A rod in its own units: lengths by L, moments by EI/L, forces by EI/L^2 (README.md, 1), and what of a
/// wrench is known before anything is integrated. Private to the statics.
#pragma once

#include "tendril/rod.h"
#include "tendril/statics/kernel.h"

namespace tendril::statics {

/// The rod's units, to convert at the door.
struct Units {
  double length;  // L, m
  double moment;  // EI / L, N m
  double force;   // EI / L^2, N
  double energy;  // EI / L, J

  explicit Units(const RodProperties& rod);
  [[nodiscard]] Vector6 wrenchToNatural(const Vector6& wrench) const;
  [[nodiscard]] Vector6 wrenchToSi(const Vector6& wrench) const;
};

/// How exactly a rod is integrated: steps in multiples of what keeps the end within 1e-6 L in 99 rods of a
/// hundred, and by how much (a fraction of the length) the place of a conjugate point may then be wrong.
/// bench/statics.cpp measures both.
struct Accuracy {
  double steps;
  double margin;
};
inline constexpr Accuracy kScreening{0.7, 5e-3};  // a verdict where it is clear
inline constexpr Accuracy kQuick{1, 2e-3};        // an end, and its Jacobian
inline constexpr Accuracy kSecondLook{2, 1e-4};   // a verdict where those leave it open
inline constexpr Accuracy kFine{4, 1e-6};         // whatever is handed out; errors 4^-8 of the above

/// What is constant of a rod. Throws InputError unless length and every c_i are finite and > 0.
struct NaturalRod {
  Units units;
  Vector6 c;                                  // stiffness
  std::vector<Vector3> kappa0;                // curvature at rest: one, or one per element
  Vector3 weight;                             // per length, world axes
  KernelRod kernel;                           // kappa0[0] alone
  double largest_kappa0, kappa0_at_stiffest;  // |kappa0| and (stiffest c_i)^(1/2) |kappa0|, rad over the rod
  double bends, waves;  // how fast the moment bends the rod, and how short the waves under it (README.md, 2)

  /// `gravity` in m/s^2, world axes.
  NaturalRod(const RodProperties& rod, const Vector3& gravity);

  [[nodiscard]] bool heavy() const { return !weight.isZero(0); }
  /// Whether the kernels for many rods, which know neither weight nor a curvature that changes, can work on
  /// it.
  [[nodiscard]] bool uniformAndWeightless() const { return !heavy() && kappa0.size() == 1; }

  /// Radians over the rod at which it, and its small deflections, turn at most, nearly (README.md, 2).
  [[nodiscard]] double turning(const Vector6& a) const;
  /// The least that the tangent's stretch 1 + u4 can be anywhere on the rod.
  [[nodiscard]] double leastStretch(const Vector6& a) const;
  /// Steps for an integration. Even; a multiple of the elements where the curvature at rest changes.
  /// Throws InputError for a wrench that is not finite or too large to integrate.
  [[nodiscard]] int stepCount(const Vector6& a, const Accuracy& accuracy) const;
};

/// Turns base axes so that z is along the force of a: the turned axes' wrench is (R m; 0, 0, force) with R of
/// `rotation`.
[[nodiscard]] AlignedWrench aligned(const Vector6& a, int steps);

}  // namespace tendril::statics
