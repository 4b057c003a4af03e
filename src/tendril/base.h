/// tendril/base.h: small vectors, SE(3), input errors, seeded randomness, processor time, files.
///
/// Conventions of the whole project (docs/symbols.md): SI units; rotations are unit quaternions; a 6-vector
/// is (angular; linear), rotation first, expressed in the frame it belongs to (the "body" frame).
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <ctime>
#include <filesystem>
#include <random>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace tendril {

using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Quaternion = Eigen::Quaterniond;

/// Bad input: a file, a mesh, a parameter. The message says what, where and what to do. Caught once, in main.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// ---------------------------------------------------------------------------------------------- SE(3)

/// A frame q = (R, p): `rotation` takes body vectors to world, `position` [m] is the frame's origin in world.
struct Pose {
  Quaternion rotation = Quaternion::Identity();
  Vector3 position = Vector3::Zero();

  [[nodiscard]] Pose operator*(const Pose& other) const {
    return {(rotation * other.rotation).normalized(), position + rotation * other.position};
  }
  [[nodiscard]] Vector3 operator*(const Vector3& point) const { return position + rotation * point; }
  [[nodiscard]] Pose inverse() const {
    const Quaternion r = rotation.conjugate();
    return {r, -(r * position)};
  }
};

/// Cross-product matrix: skew(a) b = a x b.
[[nodiscard]] inline Matrix3 skew(const Vector3& a) {
  Matrix3 m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

/// Rotation exp of a rotation vector w [rad].
[[nodiscard]] Quaternion expSO3(const Vector3& w);
/// Rotation vector of q, angle in [0, pi] [rad].
[[nodiscard]] Vector3 logSO3(const Quaternion& q);
/// Right Jacobian of SO(3) and its inverse at w [rad]: exp(w + dw) = exp(w) exp(Jr(w) dw).
[[nodiscard]] Matrix3 rightJacobianSO3(const Vector3& w);
[[nodiscard]] Matrix3 rightJacobianInverseSO3(const Vector3& w);

/// exp and log of SE(3); xi = (angular [rad]; linear [m]).
[[nodiscard]] Pose expSE3(const Vector6& xi);
[[nodiscard]] Vector6 logSE3(const Pose& q);
/// Inverse right Jacobian of SE(3) at xi: log(exp(xi) exp(d)) = xi + Jr^-1(xi) d + O(d^2). The left one is at
/// -xi.
[[nodiscard]] Matrix6 rightJacobianInverseSE3(const Vector6& xi);

/// Ad_q = [R 0; p^ R, R]: takes a twist of the body frame to the world frame.
[[nodiscard]] Matrix6 adjoint(const Pose& q);
/// ad_xi eta = [xi, eta], the Lie bracket.
[[nodiscard]] Matrix6 smallAdjoint(const Vector6& xi);

/// The angle of the whole rotation between two frames, twist included, in [0, pi] [rad].
[[nodiscard]] double angleBetween(const Quaternion& a, const Quaternion& b);

// ---------------------------------------------------------------------------------------------- randomness

/// A seeded source of randomness whose numbers are the same on every platform and build.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  /// Uniform in [0, 1), 53 bits.
  [[nodiscard]] double uniform() { return static_cast<double>(engine_() >> 11) * 0x1.0p-53; }
  [[nodiscard]] double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Uniform over all rotations (Shoemake 1992).
  [[nodiscard]] Quaternion rotation();
  [[nodiscard]] std::uint64_t bits() { return engine_(); }

 private:
  std::mt19937_64 engine_;
};

// ---------------------------------------------------------------------------------------------- time

/// Processor time of all threads since the process started [s].
[[nodiscard]] inline double cpuSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

// ---------------------------------------------------------------------------------------------- files

/// The whole file as bytes. Throws InputError naming the file and the reason.
[[nodiscard]] std::string readFile(const std::filesystem::path& file);
/// Writes to a temporary name in the same folder (made if missing) and renames. Throws InputError.
void writeFileAtomically(const std::filesystem::path& file, std::string_view content);
/// SHA-256 as 64 lower-case hexadecimal digits.
[[nodiscard]] std::string sha256Hex(std::string_view bytes);
/// The candidate nearest to `word` by edit distance, for "did you mean"; empty if none is near.
[[nodiscard]] std::string nearestWord(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace tendril
