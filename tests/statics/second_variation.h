/// The second variation of a clamped rod's energy on a grid: the brute-force answer to what Theorem 2 tells.
#pragma once

#include "heavy_reference.h"

namespace tendril::reference {

/// The number of negative directions of the energy with both ends clamped, of the first `length` of the rod,
/// from the second variation
///   integral of zeta^T C zeta + mu^T [zeta, eta] - w . R (theta x v),   zeta = eta' + [xi, eta],
///   eta(0) = eta(length) = 0,
/// on `elements` linear elements with the integrand at their middles; eta = (theta; v) is the variation of
/// the frame in its own axes. The matrix is block tridiagonal; its inertia is the sum of its pivot blocks'
/// (Sylvester). Of second order: it misplaces conjugate points by some 1e-3 at 160 elements.
[[nodiscard]] int negativeDirections(const HeavyRod& rod, const Quaternion& base, const Vector6& wrench,
                                     double length, int elements);
[[nodiscard]] int negativeDirections(const Vector6& wrench, const Vector6& c, double length, int elements);

}  // namespace tendril::reference
