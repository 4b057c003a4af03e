/// The proof that two bodies keep their distance while they move, over all moments and not over samples.
#pragma once

#include <algorithm>
#include <array>
#include <limits>

#include "tendril/verification/distance.h"

namespace tendril::verification {

/// One element of the rod and something it must keep away from, during one step; t in [0, 1] is the fraction
/// of the step. Every corner moves in a straight line: x(t) = x_t0 + t (x_t1 - x_t0).
struct PairMotion {
  std::array<Vector3, 2> rod_t0, rod_t1;      // m, the ends of the element
  std::array<Vector3, 3> other_t0, other_t1;  // m, a triangle (3 corners) or another element (2)
  int corners;

  /// A corner of the other body. Where the two are near each other and far from 0, differences from it are
  /// exact.
  [[nodiscard]] const Vector3& origin() const { return other_t0[0]; }
  /// The closest points at t, their coordinates relative to `origin()`: far from 0, two nearly equal
  /// distances differ by less than the rounding of the coordinates, and the direction of the wrong pair
  /// separates nothing.
  [[nodiscard]] ClosestPair closestAt(double t) const;
};

/// What distance is to be proved, which follows the smallest distance met so far.
///
/// The requirement is distance >= thickness - 1e-8 L. More is proved, so that a useful bound comes out: with
/// g the smallest gap (distance - thickness) measured so far, all that is met later is proved to keep
///   thickness + min(L/10, g - max(g/20, 1e-8 L)),
/// never less than the requirement. As g only falls, what the last value says holds of the whole motion.
class DistanceToProve {
 public:
  /// thickness [m]: the radius of the rod, or twice that between two elements. length [m]: L.
  DistanceToProve(double thickness, double length)
      : thickness_(thickness), tolerance_(kTolerance * length), horizon_(kHorizon * length) {}

  static constexpr double kTolerance = 1e-8;  // fraction of L
  static constexpr double kHorizon = 0.1;     // fraction of L: gaps beyond this are not told apart

  [[nodiscard]] double thickness() const { return thickness_; }
  [[nodiscard]] double required() const { return thickness_ - tolerance_; }
  /// The distance every pair is to be proved to keep [m].
  [[nodiscard]] double value() const { return thickness_ + gap(); }
  /// The same as a gap, a lower bound of distance - thickness over all that has been proved [m].
  [[nodiscard]] double gap() const {
    return std::max(-tolerance_, std::min(horizon_, measured_ - std::max(0.05 * measured_, tolerance_)));
  }
  /// The smallest gap measured, an upper bound of the same; infinity if nothing was near.
  [[nodiscard]] double measuredGap() const { return measured_; }
  /// Whether gap() follows from a measurement, and is not just the horizon.
  [[nodiscard]] bool isMeasured() const { return gap() < horizon_; }
  /// Takes note of a distance that was measured [m]; true if it is the smallest.
  bool note(double distance) {
    if (!(distance - thickness_ < measured_)) return false;
    measured_ = distance - thickness_;
    return true;
  }

 private:
  double thickness_, tolerance_, horizon_;
  double measured_ = std::numeric_limits<double>::infinity();
};

struct Proof {
  enum class Status {
    proved,    // the distance is at least what was to be proved, at every moment
    violated,  // at `t` it is below what is required
    undecided  // around `t` neither could be shown
  } status = Status::proved;
  double t = 0;         // violated, undecided: the moment, fraction of the step
  double distance = 0;  // the distance there [m]
};

/// Proves that the pair keeps goal.value() at every t in [0, 1], or finds where it falls below
/// goal.required().
///
/// For any unit vector n, distance(t) >= min_i n.p_i(t) - max_j n.w_j(t), p_i the element's ends and w_j the
/// other's corners: a plane with the two bodies on its two sides, that far apart. Each n.(p_i - w_j) is
/// linear in t, so the times at which all are >= goal.value() form an interval known in closed form. n is the
/// direction of the closest points at the middle of the time left, where the bound is exact; what the
/// interval leaves is treated in the same way. `found` is called with every (t, distance) that is a new
/// smallest.
template <class Found>
[[nodiscard]] Proof prove(const PairMotion& pair, DistanceToProve& goal, Found&& found);

/// The moment and distance of the deepest of many samples, for a message.
[[nodiscard]] Proof deepest(const PairMotion& pair, const Proof& known);

// ----------------------------------------------------------------------------------------------
// implementation

struct TimeInterval {
  double t0, t1;
};
/// The times in `within` at which the plane with unit normal n keeps the bodies `distance` apart, as far as
/// they surround t; empty (t1 < t0) if they do not even include t.
[[nodiscard]] TimeInterval separatedBy(const Vector3& n, const PairMotion& pair, double distance, double t,
                                       const TimeInterval& within);

template <class Found>
Proof prove(const PairMotion& pair, DistanceToProve& goal, Found&& found) {
  constexpr double kShortest = 1e-12;      // fraction of a step: below this a remainder is given up
  constexpr int kEvaluations = 1'000'000;  // and so is a pair after this many
  // Remainders are shorter than half of what they come from, so no more than log2(1/kShortest) wait at once.
  std::array<TimeInterval, 64> waiting;
  std::size_t count = 0;
  waiting[count++] = {0, 1};
  for (int evaluation = 0; count > 0; ++evaluation) {
    const TimeInterval now = waiting[--count];
    const double t = 0.5 * (now.t0 + now.t1);
    const ClosestPair closest = pair.closestAt(t);
    if (goal.note(closest.distance)) found(t, closest.distance);
    if (!(closest.distance >= goal.required())) return {Proof::Status::violated, t, closest.distance};
    const Vector3 n = (closest.a - closest.b) / closest.distance;
    const TimeInterval done = separatedBy(n, pair, goal.value(), t, now);
    const bool stuck = done.t1 < done.t0 || now.t1 - now.t0 < kShortest || evaluation >= kEvaluations;
    if (stuck && !(done.t0 <= now.t0 && done.t1 >= now.t1))
      return {Proof::Status::undecided, t, closest.distance};
    if (done.t1 < now.t1) waiting[count++] = {done.t1, now.t1};
    if (done.t0 > now.t0) waiting[count++] = {now.t0, done.t0};
  }
  return {};
}

}  // namespace tendril::verification
