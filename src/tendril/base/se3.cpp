#include <cmath>
#include <numbers>

#include "tendril/base.h"

namespace tendril {
namespace {

/// Coefficients of the series in the angle; below kSmall the Taylor polynomials are exact to rounding, above
/// it the closed forms lose no digit that matters (they are written without cancellation in 1 - cos).
constexpr double kSmallAngle2 = 1e-2;  // angle^2 below which the series are used (terms to angle^10)

struct Coefficients {
  double a;  // sin(x)/x
  double b;  // (1 - cos x)/x^2
  double c;  // (x - sin x)/x^3
};
Coefficients coefficients(double x2) {
  if (x2 < kSmallAngle2) {
    return {1 - x2 / 6 * (1 - x2 / 20 * (1 - x2 / 42 * (1 - x2 / 72))),
            0.5 * (1 - x2 / 12 * (1 - x2 / 30 * (1 - x2 / 56 * (1 - x2 / 90)))),
            1.0 / 6 * (1 - x2 / 20 * (1 - x2 / 42 * (1 - x2 / 72 * (1 - x2 / 110))))};
  }
  const double x = std::sqrt(x2), half = std::sin(0.5 * x);
  return {std::sin(x) / x, 2 * half * half / x2, (x - std::sin(x)) / (x2 * x)};
}

/// (1 - x/2 cot(x/2)) / x^2, the coefficient of skew(w)^2 in the inverse Jacobians; 1/12 at 0. x < 2 pi.
double inverseCoefficient(double x2) {
  if (x2 < kSmallAngle2)
    return 1.0 / 12 + x2 * (1.0 / 720 + x2 * (1.0 / 30240 + x2 * (1.0 / 1209600 + x2 / 47900160)));
  const double x = std::sqrt(x2);
  return (1 - 0.5 * x * std::cos(0.5 * x) / std::sin(0.5 * x)) / x2;
}

/// d inverseCoefficient / d(x^2).
double inverseCoefficientRate(double x2) {
  if (x2 < kSmallAngle2) return 1.0 / 720 + x2 * (2.0 / 30240 + x2 * (3.0 / 1209600 + x2 * 4.0 / 47900160));
  const double x = std::sqrt(x2), s = std::sin(0.5 * x), cot = std::cos(0.5 * x) / s;
  // f = (1 - x/2 cot(x/2))/x^2; df/dx = (-cot/2 + x/(4 s^2))/x^2 - 2 f/x
  const double f = (1 - 0.5 * x * cot) / x2;
  return ((-0.5 * cot + 0.25 * x / (s * s)) / x2 - 2 * f / x) / (2 * x);
}

}  // namespace

Quaternion expSO3(const Vector3& w) {
  const double x2 = 0.25 * w.squaredNorm();  // (half angle)^2
  const double sinc = x2 < kSmallAngle2 ? 1 - x2 / 6 * (1 - x2 / 20 * (1 - x2 / 42 * (1 - x2 / 72)))
                                        : std::sin(std::sqrt(x2)) / std::sqrt(x2);
  const double cosine = x2 < kSmallAngle2 ? std::sqrt(1 - x2 * sinc * sinc) : std::cos(std::sqrt(x2));
  const Vector3 v = 0.5 * sinc * w;
  return Quaternion(cosine, v.x(), v.y(), v.z());
}

Vector3 logSO3(const Quaternion& q) {
  const double sign = q.w() < 0 ? -1 : 1;
  const double sine = q.vec().norm(), cosine = sign * q.w();
  // angle / sin(angle/2), by atan2 so that both ends of [0, pi] are accurate
  const double scale = sine < 1e-12 ? 2 / cosine : 2 * std::atan2(sine, cosine) / sine;
  return sign * scale * q.vec();
}

Matrix3 rightJacobianSO3(const Vector3& w) {
  const Coefficients k = coefficients(w.squaredNorm());
  const Matrix3 s = skew(w);
  return Matrix3::Identity() - k.b * s + k.c * s * s;
}

Matrix3 rightJacobianInverseSO3(const Vector3& w) {
  const Matrix3 s = skew(w);
  return Matrix3::Identity() + 0.5 * s + inverseCoefficient(w.squaredNorm()) * s * s;
}

Pose expSE3(const Vector6& xi) {
  const Vector3 w = xi.head<3>(), v = xi.tail<3>();
  const Coefficients k = coefficients(w.squaredNorm());
  const Vector3 wv = w.cross(v);
  return {expSO3(w), v + k.b * wv + k.c * w.cross(wv)};
}

Vector6 logSE3(const Pose& q) {
  Vector6 xi;
  const Vector3 w = logSO3(q.rotation), wp = w.cross(q.position);
  xi.head<3>() = w;
  xi.tail<3>() = q.position - 0.5 * wp + inverseCoefficient(w.squaredNorm()) * w.cross(wp);
  return xi;
}

Matrix6 rightJacobianInverseSE3(const Vector6& xi) {
  // Jr^-1(w, v) = [A 0; Q A] with A = I + w^/2 + f(|w|^2) w^ w^ and Q the derivative of A along v:
  // Q = v^/2 + f (w^ v^ + v^ w^) + 2 f' (w.v) w^ w^, since the map a + eps b -> A(a + eps b) carries SE(3) as
  // dual numbers.
  const Vector3 w = xi.head<3>(), v = xi.tail<3>();
  const double x2 = w.squaredNorm(), f = inverseCoefficient(x2);
  const Matrix3 ws = skew(w), vs = skew(v), ww = ws * ws;
  const Matrix3 wv = ws * vs;
  Matrix6 j;
  j.topLeftCorner<3, 3>() = Matrix3::Identity() + 0.5 * ws + f * ww;
  j.topRightCorner<3, 3>().setZero();
  j.bottomLeftCorner<3, 3>() =
      0.5 * vs + f * (wv + wv.transpose()) + (2 * inverseCoefficientRate(x2) * w.dot(v)) * ww;
  j.bottomRightCorner<3, 3>() = j.topLeftCorner<3, 3>();
  return j;
}

Matrix6 adjoint(const Pose& q) {
  const Matrix3 r = q.rotation.toRotationMatrix();
  Matrix6 a;
  a << r, Matrix3::Zero(), skew(q.position) * r, r;
  return a;
}

Matrix6 smallAdjoint(const Vector6& xi) {
  const Matrix3 w = skew(xi.head<3>());
  Matrix6 a;
  a << w, Matrix3::Zero(), skew(xi.tail<3>()), w;
  return a;
}

double angleBetween(const Quaternion& a, const Quaternion& b) { return logSO3(a.conjugate() * b).norm(); }

Quaternion Random::rotation() {
  const double u = uniform(), v = 2 * std::numbers::pi * uniform(), w = 2 * std::numbers::pi * uniform();
  const double a = std::sqrt(1 - u), b = std::sqrt(u);
  return Quaternion(b * std::cos(w), a * std::sin(v), a * std::cos(v), b * std::sin(w));
}

}  // namespace tendril
