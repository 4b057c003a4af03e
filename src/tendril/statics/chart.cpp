#include "tendril/statics/chart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string>

namespace tendril::statics {
namespace {

/// The rate [rad over the rod] eight steps are trusted with: position errors then stay below 1e-6 L.
constexpr double kRatePerEightSteps = 9;
constexpr double kLargestRate = 1e4;

/// Scales the quaternion back to unit length (its drift is of the integrator's order).
template <class State>
void renormalise(State& y) {
  y.template head<4>() /= y.template head<4>().matrix().norm();
}

/// Two neighbouring doubles in one store: the Runge-Kutta sums load them as one packet right after, and a
/// load that spans two pending stores stalls (measured: 6.2 against 4.9 us for the path).
inline void storePair(double* to, double first, double second) {
  using Pair [[gnu::vector_size(16)]] = double;
  const Pair pair = {first, second};
  std::memcpy(to, &pair, sizeof pair);
}

/// The rotation matrix of a frame, by name: plain doubles stay in registers, which is worth 2 us of 7 a rod.
struct Rotation {
  double r11, r12, r13, r21, r22, r23, r31, r32, r33;
};

/// q' = q (kappa; e1 + eps) and the energy density, from PathState to PathState; returns R.
inline Rotation pathRate(const Chart& chart, const double* state, double* rate) {
  const double x = state[0], y = state[1], z = state[2], w = state[3], p1 = state[4], p2 = state[5],
               p3 = state[6];
  const double x2 = x + x, y2 = y + y, z2 = z + z;
  const double xx = x * x2, xy = x * y2, xz = x * z2, yy = y * y2, yz = y * z2, zz = z * z2;
  const double wx = w * x2, wy = w * y2, wz = w * z2;
  const Rotation r{1 - (yy + zz), xy - wz, xz + wy, xy + wz,      1 - (xx + zz),
                   yz - wx,       xz - wy, yz + wx, 1 - (xx + yy)};
  // mu = Ad_q^T a = (R^T (m0 - p x n0); R^T n0)
  const double f1 = chart.n0[0], f2 = chart.n0[1], f3 = chart.n0[2];
  const double t1 = chart.m0[0] - (p2 * f3 - p3 * f2), t2 = chart.m0[1] - (p3 * f1 - p1 * f3),
               t3 = chart.m0[2] - (p1 * f2 - p2 * f1);
  const double m1 = r.r11 * t1 + r.r21 * t2 + r.r31 * t3, n1 = r.r11 * f1 + r.r21 * f2 + r.r31 * f3;
  const double m2 = r.r12 * t1 + r.r22 * t2 + r.r32 * t3, n2 = r.r12 * f1 + r.r22 * f2 + r.r32 * f3;
  const double m3 = r.r13 * t1 + r.r23 * t2 + r.r33 * t3, n3 = r.r13 * f1 + r.r23 * f2 + r.r33 * f3;
  // (kappa / 2; eps) = mu / c, eq. (3)
  const double k1 = 0.5 * chart.compliance_m[0] * m1, k2 = 0.5 * chart.compliance_m[1] * m2,
               k3 = 0.5 * chart.compliance_m[2] * m3;
  const double e1 = chart.compliance_n[0] * n1, e2 = chart.compliance_n[1] * n2,
               e3 = chart.compliance_n[2] * n3;
  const double tangent = 1 + e1;
  storePair(rate, w * k1 + y * k3 - z * k2, w * k2 + z * k1 - x * k3);
  storePair(rate + 2, w * k3 + x * k2 - y * k1, -(x * k1 + y * k2 + z * k3));
  storePair(rate + 4, r.r11 * tangent + r.r12 * e2 + r.r13 * e3, r.r21 * tangent + r.r22 * e2 + r.r23 * e3);
  storePair(rate + 6, r.r31 * tangent + r.r32 * e2 + r.r33 * e3,
            m1 * k1 + m2 * k2 + m3 * k3 + 0.5 * (n1 * e1 + n2 * e2 + n3 * e3));
  return r;
}

/// The upper triangle of R diag(g) R^T: 11 12 13 22 23 33.
inline std::array<double, 6> turned(const Rotation& r, const Vector3& g) {
  const double a1 = g[0] * r.r11, a2 = g[1] * r.r12, a3 = g[2] * r.r13;
  const double b1 = g[0] * r.r21, b2 = g[1] * r.r22, b3 = g[2] * r.r23;
  return {a1 * r.r11 + a2 * r.r12 + a3 * r.r13,
          a1 * r.r21 + a2 * r.r22 + a3 * r.r23,
          a1 * r.r31 + a2 * r.r32 + a3 * r.r33,
          b1 * r.r21 + b2 * r.r22 + b3 * r.r23,
          b1 * r.r31 + b2 * r.r32 + b3 * r.r33,
          g[0] * r.r31 * r.r31 + g[1] * r.r32 * r.r32 + g[2] * r.r33 * r.r33};
}

/// K' = S (I + B K), S = Ad_q diag(1/c) Ad_q^T, at the frame (R, p); k and rate are 6 x 6, row-major.
inline void kRate(const Chart& chart, const Rotation& r, const double* p, const double* k, double* rate) {
  using Row = Eigen::Array<double, 6, 1>;
  const auto row = [](const double* at) { return Eigen::Map<const Row>(at); };
  const auto out = [](double* at) { return Eigen::Map<Row>(at); };
  const auto [a11, a12, a13, a22, a23, a33] = turned(r, chart.compliance_m);
  const auto [b11, b12, b13, b22, b23, b33] = turned(r, chart.compliance_n);
  const Vector3 &m0 = chart.m0, &n0 = chart.n0;
  const auto w1 = row(k), w2 = row(k + 6), w3 = row(k + 12);        // rotations
  const auto v1 = row(k + 18), v2 = row(k + 24), v3 = row(k + 30);  // translations
  // I + B K: force rows, then moment rows
  Row f1 = n0[1] * w3 - n0[2] * w2, f2 = n0[2] * w1 - n0[0] * w3, f3 = n0[0] * w2 - n0[1] * w1;
  Row t1 = m0[1] * w3 - m0[2] * w2 + n0[1] * v3 - n0[2] * v2;
  Row t2 = m0[2] * w1 - m0[0] * w3 + n0[2] * v1 - n0[0] * v3;
  Row t3 = m0[0] * w2 - m0[1] * w1 + n0[0] * v2 - n0[1] * v1;
  f1[3] += 1, f2[4] += 1, f3[5] += 1, t1[0] += 1, t2[1] += 1, t3[2] += 1;
  // Ad_q^T up to the rotation: the moment about the frame's own origin
  t1 -= p[1] * f3 - p[2] * f2, t2 -= p[2] * f1 - p[0] * f3, t3 -= p[0] * f2 - p[1] * f1;
  // the compliance, turned to the base frame
  const Row r1 = a11 * t1 + a12 * t2 + a13 * t3, r2 = a12 * t1 + a22 * t2 + a23 * t3,
            r3 = a13 * t1 + a23 * t2 + a33 * t3;
  out(rate) = r1, out(rate + 6) = r2, out(rate + 12) = r3;
  // Ad_q: the translation of the base frame's origin
  out(rate + 18) = b11 * f1 + b12 * f2 + b13 * f3 + p[1] * r3 - p[2] * r2;
  out(rate + 24) = b12 * f1 + b22 * f2 + b23 * f3 + p[2] * r1 - p[0] * r3;
  out(rate + 30) = b13 * f1 + b23 * f2 + b33 * f3 + p[0] * r2 - p[1] * r1;
}

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

Vector6 naturalStiffness(const RodProperties& rod) {
  if (!(std::isfinite(rod.length) && rod.length > 0))
    throw InputError("rod length is " + std::to_string(rod.length) + " m; a length must be finite and > 0");
  for (int i = 0; i < 6; ++i)
    if (!(std::isfinite(rod.c[i]) && rod.c[i] > 0))
      throw InputError("rod stiffness c" + std::to_string(i + 1) + " is " + std::to_string(rod.c[i]) +
                       "; every stiffness must be finite and > 0");
  const double bending = rod.bendingStiffness();
  Vector6 c = rod.c / bending;
  c.tail<3>() *= rod.length * rod.length;
  return c;
}

Vector6 Chart::wrench(const PathState& y) const {
  const Pose q = poseOf(y);
  const Quaternion back = q.rotation.conjugate();
  Vector6 mu;
  mu << back * (m0 - q.position.cross(n0)), back * n0;
  return mu;
}

Matrix6 Chart::bracket() const {
  // ad_eta^T a = (m x w + n x v; n x w) for eta = (w; v).
  Matrix6 b;
  b << skew(m0), skew(n0), skew(n0), Matrix3::Zero();
  return b;
}

void Chart::step(PathState& y, double h, Stages<PathState>& k) const {
  dormandPrince8(
      y, h, [this](const PathState& at, PathState& dy) { pathRate(*this, at.data(), dy.data()); }, k);
  renormalise(y);
}

void Chart::step(JointState& y, double h, Stages<JointState>& k) const {
  const auto rate = [this](const JointState& at, JointState& dy) {
    const Rotation r = pathRate(*this, at.data(), dy.data());
    kRate(*this, r, at.data() + 4, at.data() + 8, dy.data() + 8);
  };
  dormandPrince8(y, h, rate, k);
  renormalise(y);
}

PathState Chart::rate(const PathState& y) const {
  PathState dy;
  pathRate(*this, y.data(), dy.data());
  return dy;
}

PathState Chart::secondRate(const PathState& y, const PathState& dy) const {
  const Quaternion q(y[3], y[0], y[1], y[2]);
  const Vector6 mu = wrench(y);
  const Vector3 m = mu.head<3>(), n = mu.tail<3>();
  const Vector3 kappa = compliance_m.cwiseProduct(m);
  const Vector3 tangent = Vector3::UnitX() + compliance_n.cwiseProduct(n);
  const Vector3 n_rate = n.cross(kappa), m_rate = m.cross(kappa) + n.cross(tangent);  // eq. (2)
  const Vector3 kappa_rate = compliance_m.cwiseProduct(m_rate);
  const Vector3 p2 = q * (kappa.cross(tangent) + compliance_n.cwiseProduct(n_rate));
  // Q'' = (Q' kappa + Q kappa') / 2 with kappa as a pure quaternion
  const Quaternion dq(dy[3], dy[0], dy[1], dy[2]);
  const Quaternion k(0, kappa.x(), kappa.y(), kappa.z()),
      dk(0, kappa_rate.x(), kappa_rate.y(), kappa_rate.z());
  PathState out;
  out << 0.5 * ((dq * k).coeffs() + (q * dk).coeffs()), p2, 0;
  return out;
}

double Chart::stretch(const PathState& y) const { return 1 + compliance_n.x() * wrench(y)[3]; }

double Chart::stretchRate(const PathState& y) const {
  const Vector6 mu = wrench(y);  // n' = n x kappa
  return compliance_n.x() * (mu[4] * compliance_m.z() * mu[2] - mu[5] * compliance_m.y() * mu[1]);
}

double rateBound(const Vector6& c, const Vector6& a) {
  const double softest = c.head<3>().minCoeff(), stiffest = c.head<3>().maxCoeff(),
               force = a.tail<3>().norm();
  const double energy2 = a.cwiseAbs2().cwiseQuotient(c).sum() + 2 * (a[3] + force);
  return std::max(std::sqrt(energy2 * stiffest) / softest, std::sqrt(force / softest));
}

int stepCount(const Vector6& c, const Vector6& a) {
  const double rate = rateBound(c, a);
  if (!std::isfinite(rate)) throw InputError("the wrench is not finite; give six finite numbers (N m, N)");
  if (rate > kLargestRate)
    throw InputError("the wrench may bend or twist the rod by " + std::to_string(rate) +
                     " rad over its length, more than the " + std::to_string(kLargestRate) +
                     " that can be integrated; give a smaller wrench");
  return 8 * std::max(2, static_cast<int>(std::ceil(rate / kRatePerEightSteps)));
}

}  // namespace tendril::statics
