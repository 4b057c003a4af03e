/// Lengths of vectors of any size. Private to the module.
#pragma once

#include "tendril/base.h"

namespace tendril {

/// |v|, the slow way where the square over- or underflows.
[[nodiscard]] inline double lengthOf(const Vector3& v) {
  const double square = v.squaredNorm();
  return square > 1e-200 && square < 1e200 ? std::sqrt(square) : v.stableNorm();
}

/// v/|v|; v itself if it is zero.
[[nodiscard]] inline Vector3 unit(const Vector3& v) {
  const double length = lengthOf(v);
  return length > 0 ? Vector3(v / length) : v;
}

}  // namespace tendril
