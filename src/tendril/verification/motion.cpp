#include "tendril/verification/motion.h"

#include <algorithm>

namespace tendril::verification {

ClosestPair PairMotion::closestAt(double t) const {
  const auto at = [&](const Vector3& x_t0, const Vector3& x_t1) -> Vector3 {
    const Vector3 from = x_t0 - origin(), to = x_t1 - origin();
    return from + t * (to - from);
  };
  const Vector3 p0 = at(rod_t0[0], rod_t1[0]), p1 = at(rod_t0[1], rod_t1[1]);
  const Vector3 a = at(other_t0[0], other_t1[0]), b = at(other_t0[1], other_t1[1]);
  if (corners == 2) return segmentToSegment(p0, p1, a, b);
  return segmentToTriangle(p0, p1, a, b, at(other_t0[2], other_t1[2]));
}

TimeInterval separatedBy(const Vector3& n, const PairMotion& pair, double distance, double t,
                         const TimeInterval& within) {
  TimeInterval done = within;
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::size_t j = 0; j < static_cast<std::size_t>(pair.corners); ++j) {
      const double f_t0 = n.dot(pair.rod_t0[i] - pair.other_t0[j]);
      const double f_t1 = n.dot(pair.rod_t1[i] - pair.other_t1[j]);
      const double slope = f_t1 - f_t0;
      const auto f = [&](double time) { return f_t0 + time * slope; };
      if (!(f(t) >= distance)) return {1, 0};
      if (f(done.t0) < distance) done.t0 = std::max(done.t0, (distance - f_t0) / slope);
      if (f(done.t1) < distance) done.t1 = std::min(done.t1, (distance - f_t0) / slope);
    }
  }
  // Rounding in the division must not carry an end past t, where all was found to hold.
  return {std::min(done.t0, t), std::max(done.t1, t)};
}

Proof deepest(const PairMotion& pair, const Proof& known) {
  constexpr int kSamples = 256;
  Proof worst = known;
  for (int k = 0; k <= kSamples; ++k) {
    const double t = static_cast<double>(k) / kSamples, distance = pair.closestAt(t).distance;
    if (distance < worst.distance) worst.t = t, worst.distance = distance;
  }
  return worst;
}

}  // namespace tendril::verification
