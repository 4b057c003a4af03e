/// Conjugate points by composing segments (README.md, 5 to 7 and 9), for light and heavy rods. Private to the
/// statics.
#pragma once

#include "tendril/base.h"
#include "tendril/statics/kernel.h"

namespace tendril::statics {

/// A conjugate point this near the end, as a fraction of the length, is taken to be at the end: the verdict
/// is `marginal`.
inline constexpr double kMarginalTime = 1e-6;

/// Two solutions (K, L) over one segment: (X, Lx) from (0, 1), (U, Lu) from (1, 0); and sym(Lx X^-1), sym(U
/// X^T). All about the section at its start: with the rod's base for the origin, the lever arms would drown
/// the stretch and shear of a stiff rod.
struct Segment {
  Matrix6 x, lx, u, lu;  // of a weightless rod, Lx = 1, Lu = 0 are left out
  Matrix6 l_inverse, u_transpose;
  Matrix6 s;     // Ad_q diag(1/c) Ad_q^T at the end
  Vector3 span;  // from the first section to the last

  /// `b` is B at the start, for a weightless rod; null for a heavy one. `end` is the frame of the last
  /// section, `compliance` is 1/c.
  Segment(const SegmentMatrices& matrices, const Matrix6* b, const Pose& end, const Vector6& compliance);
  /// (K, L) at the segment's end, about the section there, from that at its start, about the section there.
  void advance(Matrix6& k, Matrix6& l) const;

 private:
  bool heavy_;
};

/// Y = L K^-1 + B/2 at the end of the segments passed so far, about the section there, and what came up on
/// the way.
class ConjugatePoints {
 public:
  /// Starts with the first segment. No segment has a conjugate point of its own.
  void start(const Segment& segment) { arrive(segment, segment.l_inverse); }
  /// Passes the next segment. Returns false, and leaves everything as it was, if a conjugate point lies
  /// inside or at its end.
  [[nodiscard]] bool passIfFree(const Segment& segment);
  /// The eigenvalues of the pencil (D, -dD/dt) at the end of the segment, ascending: to first order the
  /// times from there to the conjugate points, negative for those passed.
  [[nodiscard]] Vector6 timesToConjugatePoints(const Segment& segment) const;
  /// Passes the segment whatever it holds.
  void pass(const Segment& segment);
  /// The smallest possible time to a conjugate point after `segment`, the last one passed by passIfFree, is
  /// at least this.
  [[nodiscard]] double timeLeft(const Segment& segment) const {
    return 1 / p_inverse_.cwiseProduct(segment.s).sum();
  }

 private:
  /// Takes Y at the segment's end, about its start, to the section at its end.
  void arrive(const Segment& segment, const Matrix6& y);

  Matrix6 y_;          // Y
  Matrix6 p_inverse_;  // P^-1 of the last segment passed, P = X D X^T
};

}  // namespace tendril::statics
