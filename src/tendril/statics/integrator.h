/// The chart in the rod's own units, one rod at a time: shape, end and verdict. Private to the statics.
#pragma once

#include <optional>
#include <vector>

#include "tendril/statics.h"
#include "tendril/statics/conjugate_points.h"
#include "tendril/statics/natural_rod.h"

namespace tendril::statics {

inline constexpr double kSmallestStretch = 0.05;  // 1 + u4 at or below this is no rod

/// The end of a rod seen from its base: frame, energies and J(1) = dq(1)/da in the end's body frame, in the
/// rod's own units.
struct NaturalEnd {
  Pose end;
  double energy = 0, weight_energy = 0;
  Matrix6 jacobian;
  bool stable = false;
};

[[nodiscard]] EquilibriumEnd toSi(const NaturalEnd& end, const Units& units);

struct Verdict {
  Stability stability = Stability::stable;
  int conjugate_points = 0;
  std::optional<double> first_conjugate_t;
};

/// Keeps its memory between calls; one per thread. `weight` is the rod's, per length, in base axes.
class Integrator {
 public:
  explicit Integrator(NaturalRod rod) : rod_(std::move(rod)) {}
  [[nodiscard]] const NaturalRod& rod() const { return rod_; }

  /// Integrates the shape, and with `verdict` the conjugate points too; frame(t) and the energies are those
  /// of this rod then.
  [[nodiscard]] ChartStatus integrate(const Vector6& a, const Vector3& weight, const Accuracy& accuracy,
                                      Verdict* verdict);
  /// The frame at node `i` of `elements`, relative to the base, of the rod integrated last.
  [[nodiscard]] Pose node(int i, int elements) const;
  [[nodiscard]] double energy() const { return states_.back()[kEnergy]; }
  [[nodiscard]] double weightEnergy() const;

  /// The end with its Jacobian and whether the rod is stable.
  [[nodiscard]] ChartStatus end(const Vector6& a, const Vector3& weight, const Accuracy& accuracy,
                                NaturalEnd& out);
  /// Whether the rod is a stable one, neither marginal nor inverted.
  [[nodiscard]] bool isStable(const Vector6& a, const Vector3& weight);
  /// The same at a second look, for a rod that screening is unsure of.
  [[nodiscard]] bool isStableAtSecondLook(const Vector6& a);
  /// The same by the fine walk at once, for rods that screening is unsure of.
  [[nodiscard]] bool isStableByFineWalk(const Vector6& a, const Vector3& weight);
  /// Whether the kernels that screen can work on this rod: uniform, weightless and far from inverted.
  [[nodiscard]] bool canScreen(const Vector6& a) const {
    return rod_.uniformAndWeightless() && rod_.leastStretch(a) > kSmallestStretch;
  }

  /// From a kernel's end of a rod, as it is for an aligned wrench.
  static void fromKernel(const AlignedWrench& wrench, const JointEnd& joint, NaturalEnd& out);

 private:
  using State = std::array<double, kState>;

  void begin(const Vector6& a, const Vector3& weight, const Accuracy& accuracy);
  [[nodiscard]] const double* kappa0(int step) const;
  [[nodiscard]] bool inverted() const;
  [[nodiscard]] Segment segment(State& state, double start, double h, int count, int step,
                                State* record) const;
  void walkThroughConjugatePoints(Verdict& verdict, bool stop);
  [[nodiscard]] double firstConjugateTime() const;

  NaturalRod rod_;
  SingleRod single_ = {};
  Quaternion from_base_axes_;  // the alignment's inverse
  int steps_ = 0;
  std::vector<State> states_;  // at every step, steps_ + 1
  Matrix6 k_, l_;              // K(1) and L(1) about the last section, after a walk through conjugate points
};

}  // namespace tendril::statics
