#include "tendril/statics/conjugate_points.h"

namespace tendril::statics {
namespace {

using RowMatrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

Matrix6 symmetricPart(const Matrix6& a) { return 0.5 * (a + a.transpose()); }

/// P = X D X^T = X Y X^T + sym(U X^T), congruent to D = Y + X^-1 U (README.md, 5).
Matrix6 congruentOfD(const Matrix6& y, const Segment& segment) {
  return symmetricPart(segment.x * y * segment.x.transpose()) + segment.u_transpose;
}

}  // namespace

Segment::Segment(const SegmentMatrices& matrices, const Matrix6* b, const Pose& end,
                 const Vector6& compliance)
    : x(Eigen::Map<const RowMatrix6>(matrices.x)), heavy_(!b) {
  const Matrix6 ad = adjoint(end);
  s = ad * compliance.asDiagonal() * ad.transpose();
  span = end.position;
  const Matrix6 x_inverse = x.inverse();
  if (heavy_) {
    lx = Eigen::Map<const RowMatrix6>(matrices.lx);
    u = Eigen::Map<const RowMatrix6>(matrices.u);
    lu = Eigen::Map<const RowMatrix6>(matrices.lu);
    l_inverse = symmetricPart(lx * x_inverse);
    u_transpose = symmetricPart(u * x.transpose());
  } else {
    u = Matrix6::Identity() + x * *b;
    l_inverse = symmetricPart(x_inverse);
    u_transpose = symmetricPart(x);  // X B X^T is antisymmetric
  }
}

void Segment::advance(Matrix6& k, Matrix6& l) const {
  const Matrix6 start = k;
  k = u * start + x * l;
  if (heavy_) l = lu * start + lx * l;
  k.bottomRows<3>() -= skew(span) * k.topRows<3>();
  l.topRows<3>() -= skew(span) * l.bottomRows<3>();
}

void ConjugatePoints::arrive(const Segment& segment, const Matrix6& y) {
  Matrix6 shift = Matrix6::Identity();
  shift.bottomLeftCorner<3, 3>() = skew(segment.span);
  y_ = symmetricPart(shift.transpose() * y * shift);
}

bool ConjugatePoints::passIfFree(const Segment& segment) {
  const Eigen::LLT<Matrix6> cholesky(congruentOfD(y_, segment));
  if (cholesky.info() != Eigen::Success) return false;
  p_inverse_ = cholesky.solve(Matrix6::Identity());
  arrive(segment, segment.l_inverse - p_inverse_);
  return true;
}

Vector6 ConjugatePoints::timesToConjugatePoints(const Segment& segment) const {
  return Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6>(congruentOfD(y_, segment), segment.s,
                                                           Eigen::EigenvaluesOnly)
      .eigenvalues();
}

void ConjugatePoints::pass(const Segment& segment) {
  p_inverse_ = congruentOfD(y_, segment).inverse();
  arrive(segment, segment.l_inverse - p_inverse_);
}

}  // namespace tendril::statics
