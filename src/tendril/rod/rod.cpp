#include "tendril/rod.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

namespace tendril {

Vector6 stiffnessOfRoundRod(double young_modulus, double shear_modulus, double radius,
                            double shear_correction) {
  const double area = std::numbers::pi * radius * radius, inertia = area * radius * radius / 4;
  const double bending = young_modulus * inertia, shear = shear_correction * shear_modulus * area;
  Vector6 c;
  c << shear_modulus * 2 * inertia, bending, bending, young_modulus * area, shear, shear;
  return c;
}

RodState RodState::atRest(RodShape shape) {
  RodState state;
  state.velocities.assign(shape.size(), Vector6::Zero());
  state.nodes = std::move(shape);
  return state;
}

Vector3 RodProperties::restCurvature(int element) const {
  if (rest_curvature.empty()) return Vector3::Zero();
  if (rest_curvature.size() == 1) return rest_curvature.front();
  assert(static_cast<int>(rest_curvature.size()) == elements);
  return rest_curvature[static_cast<std::size_t>(element)];
}

RodProperties withElements(const RodProperties& rod, int elements) {
  RodProperties out = rod;
  out.elements = elements;
  if (rod.rest_curvature.size() <= 1) return out;
  // The mean over each new element of the piecewise constant curvature; lengths are counted in 1 / (old new)
  // of L.
  out.rest_curvature.assign(static_cast<std::size_t>(elements), Vector3::Zero());
  for (int i = 0; i < elements; ++i)
    for (int j = i * rod.elements / elements; j < rod.elements && j * elements < (i + 1) * rod.elements;
         ++j) {
      const int overlap =
          std::min((i + 1) * rod.elements, (j + 1) * elements) - std::max(i * rod.elements, j * elements);
      out.rest_curvature[static_cast<std::size_t>(i)] +=
          static_cast<double>(overlap) / rod.elements * rod.restCurvature(j);
    }
  return out;
}

double meanNodeDistance(const RodShape& a, const RodShape& b) {
  assert(a.size() == b.size() && !a.empty());
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i].position - b[i].position).norm();
  return sum / static_cast<double>(a.size());
}

double maxNodeDistance(const RodShape& a, const RodShape& b) {
  assert(a.size() == b.size());
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    largest = std::max(largest, (a[i].position - b[i].position).norm());
  return largest;
}

RodShape resample(const RodShape& shape, int elements) {
  assert(shape.size() >= 2 && elements >= 1);
  if (static_cast<std::size_t>(elements) + 1 == shape.size()) return shape;
  const double last = static_cast<double>(shape.size() - 1);
  RodShape out(static_cast<std::size_t>(elements) + 1);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const double at = last * static_cast<double>(i) / elements;
    const auto k = std::min(static_cast<std::size_t>(at), shape.size() - 2);
    const double t = at - static_cast<double>(k);
    const Vector6 step = t * logSE3(shape[k].inverse() * shape[k + 1]);
    out[i] = shape[k] * expSE3(step);
  }
  out.front() = shape.front(), out.back() = shape.back();
  return out;
}

}  // namespace tendril
