/// The inner loops of a step, compiled once for each instruction set from one source (kernel_lanes.h) and
/// chosen when the program starts (tendril/lanes.h). All of them give the same numbers, bit for bit. Private
/// to the dynamics.
#pragma once

#include <cstddef>

#include "tendril/lanes.h"

namespace tendril::dynamics {

/// Some numbers of every element (or node) of a rod: number r of element k is rows[r][k]. The rows are longer
/// than the rod by at least 8, so that the last lanes find something there.
struct Rows {
  double* values;
  std::size_t stride;
  double* operator[](int row) const { return values + static_cast<std::size_t>(row) * stride; }
};

/// What all elements of a rod have in common.
struct ElementLaw {
  double h;     // m
  double c[6];  // the rod's stiffness, N m^2 and N
  double rate;  // Rayleigh damping over the time it is taken: the step's stiffness is (1 + rate) c
};

/// In a block a row has 8 places: 6 of the matrix, one of the right-hand side (of the diagonal blocks), one
/// spare.
inline constexpr int kBlockRow = 8, kBlock = 6 * kBlockRow;

struct Kernel {
  const char* name;
  /// psi = log(q_i^-1 q_{i+1}), 6 rows, of the elements between `nodes`: quaternion x y z w, position [m].
  void (*strains)(int elements, const Rows& nodes, const Rows& psi);
  /// What an element is in this step, 8 rows: the strain at which it is at ease, by the rod's curvature at
  /// rest [1/m] (3 rows), by how its strain changes along it at psi, and by damping, whose rate of strain is
  /// counted from u_hat; and its stiffness in shear, without damping [N].
  void (*prepare)(int elements, const ElementLaw& law, const Rows& rest, const Rows& psi, const Rows& u_hat,
                  const Rows& elastic);
  /// f = (1 + rate) stiffness (u - reference), 6 rows, and the energies h/2 f.(u - reference).
  void (*wrenches)(int elements, const ElementLaw& law, const Rows& psi, const Rows& elastic, const Rows& f,
                   double* energies);
  /// Sets the blocks of the Hessian of the elements' energy by the nodes' body increments, and minus its
  /// gradient as right-hand side: README.md, 4. Of the diagonal blocks only the lower triangle is set.
  void (*derivatives)(int elements, const ElementLaw& law, const Rows& psi, const Rows& elastic,
                      const Rows& f, bool geometric, double* diagonal, double* upper);
  /// Solves the block-tridiagonal system by H = L D L^T, from both ends to the middle; destroys it. False if
  /// it is not positive definite. `solution` has 6 numbers a block.
  bool (*solve)(int blocks, double* diagonal, double* upper, double* solution);
};

[[nodiscard]] const Kernel& kernelFor(InstructionSet set);
[[nodiscard]] const Kernel& kernel();

}  // namespace tendril::dynamics
