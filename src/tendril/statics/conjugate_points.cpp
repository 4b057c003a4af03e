#include "tendril/statics/conjugate_points.h"

namespace tendril::statics {
namespace {

Matrix6 symmetricPart(const Matrix6& a) { return 0.5 * (a + a.transpose()); }

/// P = X D X^T = X Y X^T + sym X, congruent to D = Y + Ys (README.md, 5).
Matrix6 congruentOfD(const Matrix6& y, const Matrix6& x) {
  const Matrix6 xy = x * y;
  return symmetricPart(xy * x.transpose() + x);
}

/// Ad_q diag(1/c)^(1/2): the factor of S at a frame.
Matrix6 factorOfS(const Chart& chart, const PathState& at) {
  Vector6 root;
  root << chart.compliance_m.cwiseSqrt(), chart.compliance_n.cwiseSqrt();
  return adjoint(poseOf(at)) * root.asDiagonal();
}

}  // namespace

void ConjugatePoints::start(const Matrix6& x) { y_ = symmetricPart(x.inverse()); }

bool ConjugatePoints::passIfFree(const Matrix6& x) {
  const Eigen::LLT<Matrix6> cholesky(congruentOfD(y_, x));
  if (cholesky.info() != Eigen::Success) return false;
  p_inverse_ = cholesky.solve(Matrix6::Identity());
  y_ = symmetricPart(x.inverse() - p_inverse_);
  return true;
}

bool ConjugatePoints::isFree(const Matrix6& x) const {
  return Eigen::LLT<Matrix6>(congruentOfD(y_, x)).info() == Eigen::Success;
}

Vector6 ConjugatePoints::timesToConjugatePoints(const Matrix6& x, const Chart& chart,
                                                const PathState& end) const {
  const Matrix6 f = factorOfS(chart, end).inverse();
  const Matrix6 e = f * congruentOfD(y_, x) * f.transpose();
  return Eigen::SelfAdjointEigenSolver<Matrix6>(e, Eigen::EigenvaluesOnly).eigenvalues();
}

void ConjugatePoints::pass(const Matrix6& x) {
  p_inverse_ = congruentOfD(y_, x).inverse();
  y_ = symmetricPart(x.inverse() - p_inverse_);
}

double ConjugatePoints::timeLeft(const Chart& chart, const PathState& end) const {
  const Matrix6 f = factorOfS(chart, end);
  return 1 / (f.transpose() * p_inverse_ * f).trace();
}

}  // namespace tendril::statics
