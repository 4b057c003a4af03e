#include "second_variation.h"

namespace tendril::reference {

int negativeDirections(const HeavyRod& rod, const Quaternion& base, const Vector6& wrench, double length,
                       int elements) {
  const double h = length / elements;
  Place y = startOf(base, wrench);
  Matrix6 diagonal = Matrix6::Zero();
  int negative = 0;
  const Matrix6 stiff = rod.c.asDiagonal();
  for (int i = 0; i < elements; ++i) {
    const Place middle = stepped(rod, y, i * h, h / 2);
    y = stepped(rod, middle, (i + 0.5) * h, h / 2);
    // mu^T [zeta, eta] = m . (w x w') + n . (v x w' + w x v') = zeta^T bracket eta for zeta = (w; v), eta =
    // (w'; v')
    const Vector6 mu = middle.mu();
    const Vector3 m = mu.head<3>(), n = mu.tail<3>();
    Matrix6 bracket;
    bracket << -skew(m), -skew(n), -skew(n), Matrix3::Zero();
    // -w . R (theta x v) = eta^T fall eta
    const Matrix3 weight = skew(middle.r.transpose() * rod.weight);
    Matrix6 fall;
    fall << Matrix3::Zero(), 0.5 * weight, -0.5 * weight, Matrix3::Zero();
    const Matrix6 ad = smallAdjoint(xiOf(mu, rod.c, rod.kappaAt((i + 0.5) * h)));
    const Matrix6 left = -Matrix6::Identity() / h + 0.5 * ad,
                  right = Matrix6::Identity() / h + 0.5 * ad;  // zeta
    const auto form = [&](const Matrix6& z1, const Matrix6& z2) -> Matrix6 {
      // eta in the middle is half the sum of the two nodes'; the second term is symmetrised
      return h * (z1.transpose() * stiff * z2 +
                  0.25 * (z1.transpose() * bracket + bracket.transpose() * z2 + fall));
    };
    // unknowns: eta at the inner nodes 1 .. elements - 1
    const Matrix6 a11 = form(right, right);
    if (i == 0) {
      diagonal = a11;
      continue;
    }
    diagonal += form(left, left);
    const Matrix6 coupling = form(left, right);
    Matrix6 inverse;
    if (const Eigen::LLT<Matrix6> cholesky(diagonal); cholesky.info() == Eigen::Success) {
      inverse = cholesky.solve(Matrix6::Identity());
    } else {
      negative += static_cast<int>(
          (Eigen::SelfAdjointEigenSolver<Matrix6>(diagonal, Eigen::EigenvaluesOnly).eigenvalues().array() < 0)
              .count());
      inverse = diagonal.inverse();
    }
    diagonal = a11 - coupling.transpose() * inverse * coupling;
    diagonal = 0.5 * (diagonal + diagonal.transpose()).eval();
  }
  return negative;
}

int negativeDirections(const Vector6& wrench, const Vector6& c, double length, int elements) {
  return negativeDirections(HeavyRod(rodOf(c, 1, length)), Quaternion::Identity(), wrench, length, elements);
}

}  // namespace tendril::reference
