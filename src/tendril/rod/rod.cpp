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
