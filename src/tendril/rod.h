/// tendril/rod.h: what a rod is, at rest and in motion; the grippers' controls; the distance (6).
#pragma once

#include <array>
#include <optional>
#include <variant>
#include <vector>

#include "tendril/base.h"

namespace tendril {

/// A rod's constant properties, SI units.
struct RodProperties {
  double length = 1.0;     // L, m
  double radius = 0.01;    // r, m
  double density = 1000.;  // rho, kg/m^3
  Vector6 c =
      Vector6::Ones();  // stiffness c = (GJ, EI2, EI3, EA, GA2, GA3), section 2.3: N m^2 (three), N (three)
  int elements = 40;    // N, elements of the discrete rod; N + 1 nodes
  bool self_contact = false;  // true: the rod may not pass through itself
  /// The pre-formed rod's curvature at rest: (twist, bending, bending) [1/m] in the material frame. Empty:
  /// straight; one: the same all along the rod; else one per element.
  std::vector<Vector3> rest_curvature;

  [[nodiscard]] double elementLength() const { return length / elements; }  // h, m
  [[nodiscard]] double bendingStiffness() const {
    return 0.5 * (c[1] + c[2]);
  }  // EI, N m^2: the unit of forces
  /// The curvature at rest of an element [1/m].
  [[nodiscard]] Vector3 restCurvature(int element) const;
};

/// The rod cut into another number of elements; a rest curvature given per element is averaged over the new
/// ones.
[[nodiscard]] RodProperties withElements(const RodProperties& rod, int elements);

/// c = (GJ, EI, EI, EA, k GA, k GA) of a solid round rod, section 2.3; I = pi r^4/4, J = 2I, A = pi r^2.
///   young_modulus, shear_modulus [Pa], radius [m], shear_correction k [-] (the paper has 1).
[[nodiscard]] Vector6 stiffnessOfRoundRod(double young_modulus, double shear_modulus, double radius,
                                          double shear_correction = 1.0);

/// Strain of the rod, eq. (3): u_i = mu_i / c_i = (twist, bending, bending [1/m]; stretch, shear, shear [-]),
/// counted from the shape at rest: kappa = rest curvature + (u1, u2, u3).
///   mu = (m; n): internal moment [N m] and force [N], in the material frame.
[[nodiscard]] inline Vector6 strain(const Vector6& mu, const Vector6& c) { return mu.cwiseQuotient(c); }

/// The two ends of a rod: `first` at s = 0, `last` at s = L.
enum class End { first = 0, last = 1 };
inline constexpr std::array<End, 2> kBothEnds = {End::first, End::last};
[[nodiscard]] inline const char* name(End end) { return end == End::first ? "first" : "last"; }
[[nodiscard]] inline End other(End end) { return end == End::first ? End::last : End::first; }

/// N + 1 node frames from s = 0 to s = L; local x is the rod's tangent.
using RodShape = std::vector<Pose>;

[[nodiscard]] inline const Pose& endPose(const RodShape& shape, End end) {
  return end == End::first ? shape.front() : shape.back();
}

/// A rod in motion. `velocities[i]` = (angular, body frame [rad/s]; linear, world frame [m/s]).
/// `accelerations` [rad/s^2; m/s^2], in the same frames, and `previous_nodes` are the history of the
/// second-order scheme and empty otherwise.
struct RodState {
  RodShape nodes;
  std::vector<Vector6> velocities;
  std::vector<Vector6> accelerations;
  RodShape previous_nodes;

  [[nodiscard]] static RodState atRest(RodShape shape);
};

/// Distance (6): the mean distance of corresponding node positions [m]. Both shapes have the same number of
/// nodes.
[[nodiscard]] double meanNodeDistance(const RodShape& a, const RodShape& b);
/// The largest distance of corresponding node positions [m].
[[nodiscard]] double maxNodeDistance(const RodShape& a, const RodShape& b);

/// The shape with another number of elements: frames interpolated on the geodesics of SE(3)
/// between neighbouring nodes; the end frames stay exact.
[[nodiscard]] RodShape resample(const RodShape& shape, int elements);

/// Where a rod is put: the frame of its first node with the coordinate a (wrench there, N m and N, in that
/// frame) ...
struct PoseAndWrench {
  Pose pose;
  Vector6 wrench = Vector6::Zero();
};
/// ... or the frames of both its ends.
struct GripperPoses {
  Pose first, last;
};
using Placement = std::variant<PoseAndWrench, GripperPoses>;

/// What the grippers do from `start_s` to `end_s`. A held end that does not move keeps the pose it has; the
/// moving one (which must be held) approaches `target` on a straight line and by the shortest turn; an end
/// not held is free.
struct Control {
  double start_s = 0, end_s = 0;
  std::array<bool, 2> held = {false, false};
  std::optional<End> moving;
  Pose target;  // used only when moving

  [[nodiscard]] bool isHeld(End end) const { return held[static_cast<std::size_t>(end)]; }
};

/// A stored motion: between states k-1 and k every node's position moves in a straight line.
struct Trajectory {
  std::vector<double> time_s;             // strictly increasing
  std::vector<std::array<bool, 2>> held;  // ends held during the motion that leads to state k
  std::vector<RodShape> shapes;
};

}  // namespace tendril
