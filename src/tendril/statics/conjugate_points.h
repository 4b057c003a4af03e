/// Conjugate points by composing segments (README.md, 5 and 6). Private to the statics.
#pragma once

#include "tendril/statics/chart.h"

namespace tendril::statics {

/// A conjugate point this near the end, as a fraction of the length, is taken to be at the end: the verdict
/// is `marginal`.
inline constexpr double kMarginalTime = 1e-6;

/// Y = K^-1 + B/2 at the end of the segments passed so far, and what came up on the way.
class ConjugatePoints {
 public:
  /// Starts with the first segment: x = K over it. No segment has a conjugate point of its own.
  void start(const Matrix6& x);
  /// Passes the next segment. Returns false, and leaves everything as it was, if a conjugate point lies
  /// inside or at its end.
  [[nodiscard]] bool passIfFree(const Matrix6& x);
  /// Whether the segment x holds a conjugate point, seen from its start; passes nothing.
  [[nodiscard]] bool isFree(const Matrix6& x) const;

  /// The eigenvalues of the pencil (D, -dD/dt) at the end of the segment x, ascending: to first order the
  /// times from there to the conjugate points, negative for those passed. `end` is the frame at the segment's
  /// end.
  [[nodiscard]] Vector6 timesToConjugatePoints(const Matrix6& x, const Chart& chart,
                                               const PathState& end) const;
  /// Passes the segment whatever it holds.
  void pass(const Matrix6& x);
  /// The smallest possible time to a conjugate point after the last segment passed by passIfFree is at least
  /// this.
  [[nodiscard]] double timeLeft(const Chart& chart, const PathState& end) const;

 private:
  Matrix6 y_;          // Y
  Matrix6 p_inverse_;  // P^-1 of the last segment passed, P = X D X^T
};

}  // namespace tendril::statics
