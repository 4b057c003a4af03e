/// A symmetric block-tridiagonal system of 6 x 6 blocks, solved in O(N) by the kernel. Private to dynamics.
#pragma once

#include <algorithm>
#include <vector>

#include "tendril/base.h"
#include "tendril/dynamics/kernel.h"

namespace tendril {

class BlockTridiagonal {
 public:
  using BlockView =
      Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>, 0, Eigen::OuterStride<dynamics::kBlockRow>>;
  using ColumnView = Eigen::Map<Vector6, 0, Eigen::InnerStride<dynamics::kBlockRow>>;

  void resize(std::size_t blocks) {
    diagonal_.assign(blocks * dynamics::kBlock, 0);
    upper_.assign(blocks * dynamics::kBlock, 0);
    solution.resize(blocks);
  }
  /// Matrix and right-hand side.
  void setZero() {
    std::fill(diagonal_.begin(), diagonal_.end(), 0.0);
    std::fill(upper_.begin(), upper_.end(), 0.0);
  }

  /// H_kk, of which only the lower triangle counts; H_k,k+1; the right-hand side.
  [[nodiscard]] BlockView diagonal(std::size_t k) {
    return BlockView(diagonal_.data() + k * dynamics::kBlock);
  }
  [[nodiscard]] BlockView upper(std::size_t k) { return BlockView(upper_.data() + k * dynamics::kBlock); }
  [[nodiscard]] ColumnView rhs(std::size_t k) {
    return ColumnView(diagonal_.data() + k * dynamics::kBlock + 6);
  }
  [[nodiscard]] double* diagonalBlocks() { return diagonal_.data(); }
  [[nodiscard]] double* upperBlocks() { return upper_.data(); }

  /// Fills `solution`, one vector a block; destroys matrix and right-hand side. False if the matrix is not
  /// positive definite.
  [[nodiscard]] bool solve() {
    return dynamics::kernel().solve(static_cast<int>(solution.size()), diagonal_.data(), upper_.data(),
                                    solution.front().data());
  }

  std::vector<Vector6> solution;

 private:
  std::vector<double> diagonal_, upper_;
};

/// Adds weight * v v^T to the translational blocks of the nodes i and i + 1; v = (v0, v1) in their body
/// frames.
inline void addRankOne(BlockTridiagonal& system, std::size_t i, double weight, const Vector3& v0,
                       const Vector3& v1) {
  const Vector3 w0 = weight * v0, w1 = weight * v1;
  system.diagonal(i).bottomRightCorner<3, 3>().noalias() += w0 * v0.transpose();
  system.diagonal(i + 1).bottomRightCorner<3, 3>().noalias() += w1 * v1.transpose();
  system.upper(i).bottomRightCorner<3, 3>().noalias() += w0 * v1.transpose();
}

}  // namespace tendril
