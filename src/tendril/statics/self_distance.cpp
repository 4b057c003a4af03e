#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include "tendril/statics.h"

namespace tendril {

double selfDistance(const RodShape& shape, const RodProperties& rod) {
  assert(shape.size() >= 2);
  const std::size_t elements = shape.size() - 1;
  const double h = rod.length / static_cast<double>(elements);
  // elements i and j leave (j - i - 1) h of rod between them
  const auto apart = static_cast<std::size_t>(std::floor(std::numbers::pi * rod.radius / h)) + 2;
  double longest = 0;
  for (std::size_t i = 0; i < elements; ++i)
    longest = std::max(longest, (shape[i + 1].position - shape[i].position).norm());
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + apart < elements; ++i) {
    const Vector3 &a = shape[i].position, &b = shape[i + 1].position;
    for (std::size_t j = i + apart; j < elements;) {
      // First nodes a distance d apart: elements i and j + k come no nearer than d - (k + 2) longest.
      const double spare = (a - shape[j].position).norm() - smallest;
      if (spare > 2 * longest) {
        j += static_cast<std::size_t>(spare / longest) - 1;
        continue;
      }
      const double d = closestPointsOfSegments(a, b, shape[j].position, shape[j + 1].position).distance;
      smallest = std::min(smallest, d);
      ++j;
    }
  }
  return smallest;
}

}  // namespace tendril
