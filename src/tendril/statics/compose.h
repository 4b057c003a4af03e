/// Composing segments of a rod in lanes: conjugate points by the inertia of P (README.md, 5 and 6). Matrices
/// are 6 x 6, row by row. Private to the statics.
#pragma once

#include "tendril/lanes.h"

namespace tendril::statics {
namespace {

/// A = L D L^T of a symmetric matrix, without pivoting, in place: D on the diagonal, L below it. Returns the
/// smallest pivot: by Sylvester's law it is positive just when A is positive definite.
template <class T>
TENDRIL_INLINE T factorise(T* a) {
  T smallest = a[0];
#pragma GCC unroll 6
  for (int k = 0; k < 6; ++k) {
    smallest = smaller(smallest, a[7 * k]);
    const T inverse = 1.0 / a[7 * k];
#pragma GCC unroll 6
    for (int i = k + 1; i < 6; ++i) {
      const T l = a[6 * i + k] * inverse;
#pragma GCC unroll 6
      for (int j = k + 1; j <= i; ++j) a[6 * i + j] = subtractProduct(l, a[6 * j + k], a[6 * i + j]);
    }
#pragma GCC unroll 6
    for (int i = k + 1; i < 6; ++i) a[6 * i + k] = a[6 * i + k] * inverse;
  }
  return smallest;
}

/// The inverse of L D L^T from its factors, symmetric.
template <class T>
TENDRIL_INLINE void invertFactorised(const T* a, T* out) {
  T m[36];  // L^-1, unit lower triangular
#pragma GCC unroll 6
  for (int j = 0; j < 6; ++j)
#pragma GCC unroll 6
    for (int i = j + 1; i < 6; ++i) {
      T sum = a[6 * i + j];
#pragma GCC unroll 6
      for (int k = j + 1; k < i; ++k) sum = multiplyAdd(a[6 * i + k], m[6 * k + j], sum);
      m[6 * i + j] = -sum;
    }
  T d[6];
#pragma GCC unroll 6
  for (int k = 0; k < 6; ++k) d[k] = 1.0 / a[7 * k];
#pragma GCC unroll 6
  for (int i = 0; i < 6; ++i)
#pragma GCC unroll 6
    for (int j = 0; j <= i; ++j) {
      T sum = i == j ? d[i] : d[i] * m[6 * i + j];
#pragma GCC unroll 6
      for (int k = i + 1; k < 6; ++k) sum = multiplyAdd(m[6 * k + i] * d[k], m[6 * k + j], sum);
      out[6 * i + j] = out[6 * j + i] = sum;
    }
}

/// The symmetric part of X^-1. X = X(t) of a segment free of conjugate points is regular. Its elimination
/// does not pivot, so that lanes stay together: safe where sym(X) is definite, as it is in short segments; in
/// long ones a pivot may come near zero, which costs digits (README.md, 11).
template <class T>
TENDRIL_INLINE void symmetricInverse(const T* x, T* out) {
  T a[36], b[36];
#pragma GCC unroll 36
  for (int i = 0; i < 36; ++i) a[i] = x[i];
#pragma GCC unroll 6
  for (int k = 0; k < 6; ++k) {  // Gauss-Jordan in place
    const T pivot = 1.0 / a[7 * k];
#pragma GCC unroll 6
    for (int j = 0; j < 6; ++j) b[j] = a[6 * k + j] * pivot;
    b[k] = pivot;
#pragma GCC unroll 6
    for (int i = 0; i < 6; ++i) {
      if (i == k) continue;
      const T factor = a[6 * i + k];
#pragma GCC unroll 6
      for (int j = 0; j < 6; ++j)
        a[6 * i + j] = j == k ? -factor * pivot : subtractProduct(factor, b[j], a[6 * i + j]);
    }
#pragma GCC unroll 6
    for (int j = 0; j < 6; ++j) a[6 * k + j] = b[j];
  }
#pragma GCC unroll 6
  for (int i = 0; i < 6; ++i)
#pragma GCC unroll 6
    for (int j = 0; j <= i; ++j) out[6 * i + j] = out[6 * j + i] = 0.5 * (a[6 * i + j] + a[6 * j + i]);
}

/// P = X D X^T = sym(X Y X^T + X), congruent to D = Y + Ys.
template <class T>
TENDRIL_INLINE void congruentOfD(const T* y, const T* x, T* p) {
#pragma GCC unroll 6
  for (int i = 0; i < 6; ++i) {
    T row[6];
#pragma GCC unroll 6
    for (int j = 0; j < 6; ++j) {
      T sum = x[6 * i] * y[j];
#pragma GCC unroll 6
      for (int k = 1; k < 6; ++k) sum = multiplyAdd(x[6 * i + k], y[6 * k + j], sum);
      row[j] = sum;
    }
#pragma GCC unroll 6
    for (int j = 0; j <= i; ++j) {
      T sum = 0.5 * (x[6 * i + j] + x[6 * j + i]);
#pragma GCC unroll 6
      for (int k = 0; k < 6; ++k) sum = multiplyAdd(row[k], x[6 * j + k], sum);
      p[6 * i + j] = p[6 * j + i] = sum;
    }
  }
}

}  // namespace
}  // namespace tendril::statics
