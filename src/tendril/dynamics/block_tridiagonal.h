/// A symmetric block-tridiagonal system of 6 x 6 blocks and its Cholesky solution in O(N). Private to
/// dynamics.
#pragma once

#include <cmath>
#include <vector>

#include "tendril/base.h"

namespace tendril {

class BlockTridiagonal {
 public:
  void resize(std::size_t blocks) {
    diagonal.resize(blocks), upper.resize(blocks), rhs.resize(blocks);
    factor_.resize(blocks), coupling_.resize(blocks);
  }
  void setZero() {
    for (Matrix6& m : diagonal) m.setZero();
    for (Matrix6& m : upper) m.setZero();
  }

  std::vector<Matrix6> diagonal;  // H_kk
  std::vector<Matrix6> upper;     // H_k,k+1; the last is unused
  std::vector<Vector6> rhs;       // right-hand side, replaced by the solution

  /// Solves in place by H = L L^T. False, with rhs untouched, if H is not positive definite.
  [[nodiscard]] bool solve() {
    const std::size_t n = diagonal.size();
    Matrix6 pivot = diagonal[0];
    for (std::size_t k = 0; k < n; ++k) {
      if (!factor(pivot, factor_[k])) return false;
      if (k + 1 == n) break;
      coupling_[k] = upper[k];
      forward(factor_[k], coupling_[k]);
      pivot = diagonal[k + 1];
      pivot.noalias() -= coupling_[k].transpose() * coupling_[k];
    }
    for (std::size_t k = 0; k < n; ++k) {
      if (k > 0) rhs[k].noalias() -= coupling_[k - 1].transpose() * rhs[k - 1];
      forward(factor_[k], rhs[k]);
    }
    for (std::size_t k = n; k-- > 0;) {
      if (k + 1 < n) rhs[k].noalias() -= coupling_[k] * rhs[k + 1];
      backward(factor_[k], rhs[k]);
    }
    return true;
  }

 private:
  /// Lower Cholesky factor whose diagonal holds the reciprocals.
  [[nodiscard]] static bool factor(const Matrix6& a, Matrix6& l) {
    for (int j = 0; j < 6; ++j) {
      double d = a(j, j);
      for (int k = 0; k < j; ++k) d -= l(j, k) * l(j, k);
      if (!(d > 1e-14 * std::abs(a(j, j))) || !(d > 0)) return false;
      const double inverse = 1 / std::sqrt(d);
      l(j, j) = inverse;
      for (int i = j + 1; i < 6; ++i) {
        double v = a(i, j);
        for (int k = 0; k < j; ++k) v -= l(i, k) * l(j, k);
        l(i, j) = v * inverse;
      }
    }
    return true;
  }
  /// x <- L^-1 x for a block of columns.
  template <class Block>
  static void forward(const Matrix6& l, Block& x) {
    for (int i = 0; i < 6; ++i) {
      for (int k = 0; k < i; ++k) x.row(i) -= l(i, k) * x.row(k);
      x.row(i) *= l(i, i);
    }
  }
  static void backward(const Matrix6& l, Vector6& x) {
    for (int i = 5; i >= 0; --i) {
      for (int k = i + 1; k < 6; ++k) x[i] -= l(k, i) * x[k];
      x[i] *= l(i, i);
    }
  }

  using RowMajor6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;  // substitution works along rows

  std::vector<Matrix6> factor_;
  std::vector<RowMajor6> coupling_;
};

/// Adds weight * v v^T to the translational blocks of the nodes i and i + 1; v = (v0, v1) in their body
/// frames.
inline void addRankOne(BlockTridiagonal& system, std::size_t i, double weight, const Vector3& v0,
                       const Vector3& v1) {
  const Vector3 w0 = weight * v0, w1 = weight * v1;
  system.diagonal[i].bottomRightCorner<3, 3>().noalias() += w0 * v0.transpose();
  system.diagonal[i + 1].bottomRightCorner<3, 3>().noalias() += w1 * v1.transpose();
  system.upper[i].bottomRightCorner<3, 3>().noalias() += w0 * v1.transpose();
}

}  // namespace tendril
