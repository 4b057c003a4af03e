#include "tendril/statics/natural_rod.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace tendril::statics {
namespace {

/// Steps per radian of `turning` for an error of 1e-6 L in one rod of a hundred (bench/statics.cpp measures
/// it).
constexpr double kStepsPerRadian = 0.92;
/// Of the waves under a moment, what counts as turning: less than 1, since a segment takes more of them than
/// of other turning.
constexpr double kMomentWaves = 0.6;
constexpr double kLargestRate = 1e4;

}  // namespace

Units::Units(const RodProperties& rod)
    : length(rod.length),
      moment(rod.bendingStiffness() / rod.length),
      force(moment / rod.length),
      energy(moment) {}

Vector6 Units::wrenchToNatural(const Vector6& wrench) const {
  Vector6 a;
  a << wrench.head<3>() / moment, wrench.tail<3>() / force;
  return a;
}

Vector6 Units::wrenchToSi(const Vector6& wrench) const {
  Vector6 a;
  a << wrench.head<3>() * moment, wrench.tail<3>() * force;
  return a;
}

NaturalRod::NaturalRod(const RodProperties& rod, const Vector3& gravity) : units(rod) {
  if (!(std::isfinite(rod.length) && rod.length > 0))
    throw InputError("rod length is " + std::to_string(rod.length) + " m; a length must be finite and > 0");
  for (int i = 0; i < 6; ++i)
    if (!(std::isfinite(rod.c[i]) && rod.c[i] > 0))
      throw InputError("rod stiffness c" + std::to_string(i + 1) + " is " + std::to_string(rod.c[i]) +
                       "; every stiffness must be finite and > 0");
  if (rod.elements < 1)
    throw InputError("the rod has " + std::to_string(rod.elements) + " elements; it needs at least 1");
  c = rod.c / rod.bendingStiffness();
  c.tail<3>() *= rod.length * rod.length;
  kappa0.assign(1, Vector3::Zero());
  if (!rod.rest_curvature.empty()) kappa0 = rod.rest_curvature;
  if (kappa0.size() > 1 && std::equal(kappa0.begin() + 1, kappa0.end(), kappa0.begin())) kappa0.resize(1);
  largest_kappa0 = 0;
  for (Vector3& k : kappa0) k *= rod.length, largest_kappa0 = std::max(largest_kappa0, k.norm());
  weight =
      gravity * (rod.density * std::numbers::pi * rod.radius * rod.radius / (units.force / units.length));
  for (int i = 0; i < 6; ++i) kernel.compliance[i] = 1 / c[i];
  for (int i = 0; i < 3; ++i) kernel.kappa0[i] = kappa0[0][i];
  const double stiffest = c.head<3>().maxCoeff();
  kappa0_at_stiffest = std::sqrt(stiffest) * largest_kappa0;
  // A rod soft in torsion turns its axes fast but bends no faster: its softness counts a quarter.
  bends = 1 / std::sqrt(std::pow(std::min(c[1], c[2]), 0.75) * std::pow(c.head<3>().minCoeff(), 0.25));
  waves = kMomentWaves * stiffest / std::sqrt(c[0] * c[1] * c[2]);
}

double NaturalRod::turning(const Vector6& a) const {
  // |n| is at most `force`. With H = sum mu_i^2/2c_i + m.kappa0 + n1 and x^2 the largest sum m_i^2/c_i along
  // the rod,
  //   x^2/2 <= H + force + x (sum c_i kappa0_i^2)^(1/2), where H grows by no more than the weight times the
  //   way from the base. An estimate where kappa0 changes along the rod: H jumps there.
  const double w = weight.norm(), force = a.tail<3>().norm() + w, b = kappa0_at_stiffest;
  double h = a[3] + force;
  for (int i = 0; i < 6; ++i) h += 0.5 * kernel.compliance[i] * a[i] * a[i];
  if (largest_kappa0 > 0) h += a.head<3>().norm() * largest_kappa0;
  if (w > 0) h += w * (1 + force / c.tail<3>().minCoeff());
  const double x = b + std::sqrt(b * b + 2 * std::max(0.0, h));
  // Small deflections turn with the rod, with the waves of a strut, force^(1/2), and with those under a
  // moment about the axis i, |m_i| / (c_j c_k)^(1/2) <= x c_i / (c1 c2 c3)^(1/2), which are the shorter ones
  // where one stiffness is far above the others.
  return std::max(std::max(x, std::sqrt(force)) * bends, waves * x) + largest_kappa0;
}

double NaturalRod::leastStretch(const Vector6& a) const {
  return 1 - (a.tail<3>().norm() + weight.norm()) / c[3];
}

int NaturalRod::stepCount(const Vector6& a, const Accuracy& accuracy) const {
  const double rate = turning(a);
  if (!std::isfinite(rate) || !a.allFinite())
    throw InputError("the wrench is not finite; give six finite numbers (N m, N)");
  if (rate > kLargestRate)
    throw InputError("the wrench may bend or twist the rod by " + std::to_string(rate) +
                     " rad over its length, more than the " + std::to_string(kLargestRate) +
                     " that can be integrated; give a smaller wrench");
  const int steps =
      2 * std::max(2, static_cast<int>(std::ceil(0.5 * accuracy.steps * kStepsPerRadian * rate)));
  if (kappa0.size() == 1) return steps;
  const int elements = static_cast<int>(kappa0.size());
  return 2 * elements * ((steps + 2 * elements - 1) / (2 * elements));
}

AlignedWrench aligned(const Vector6& a, int steps) {
  AlignedWrench out;
  const Vector3 n = a.tail<3>();
  const double force = n.norm(), sign = n.z() < 0 ? -1 : 1, scale = force > 0 ? sign / force : 0;
  // by the angle between the force, or its opposite, and z
  const double cosine_of_half = std::sqrt(force > 0 ? 0.5 + 0.5 * scale * n.z() : 1);
  const double x = 0.5 * scale / cosine_of_half;
  const Quaternion q(cosine_of_half, x * n.y(), -x * n.x(), 0);
  const Vector3 m = q * Vector3(a.head<3>());
  for (int i = 0; i < 3; ++i) out.moment[i] = m[i];
  out.force = sign * force;
  for (int i = 0; i < 4; ++i) out.rotation[i] = q.coeffs()[i];
  out.steps = steps;
  return out;
}

}  // namespace tendril::statics
