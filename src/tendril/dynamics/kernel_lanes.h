/// The kernels of a step, for any number of lanes: one element in each. Included by one file for each
/// instruction set. Private to the dynamics.
#pragma once

#include <cmath>

#include "tendril/dynamics/kernel.h"

namespace tendril::dynamics {
namespace {

template <class T>
TENDRIL_INLINE T load(const double* from) {
  T out;
  for (int l = 0; l < kWidth<T>; ++l) lanes(out)[l] = from[l];
  return out;
}
template <class T>
TENDRIL_INLINE void store(double* to, const T& v) {
  for (int l = 0; l < kWidth<T>; ++l) to[l] = lanes(v)[l];
}
template <class T>
TENDRIL_INLINE void load(const Rows& rows, int first, int count, int k, T* out) {
#pragma GCC unroll 8
  for (int r = 0; r < count; ++r) out[r] = load<T>(rows[first + r] + k);
}
template <class T>
TENDRIL_INLINE void cross(const T* a, const T* b, T* out) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}
template <class T>
TENDRIL_INLINE T dot(const T* a, const T* b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// ------------------------------------------------------------------------------------------------ SE(3)

inline constexpr double kSeriesAngle2 = 1;  // squared angle up to which the series are exact to rounding

/// The Taylor coefficients of f(x^2) = (1 - x/2 cot(x/2))/x^2, by x^2: |B_2n|/(2n)!.
inline constexpr double kInverse[11] = {1.0 / 12,
                                        1.0 / 720,
                                        1.0 / 30240,
                                        1.0 / 1209600,
                                        1.0 / 47900160,
                                        691.0 / 1307674368000,
                                        1.0 / 74724249600,
                                        3617.0 / 10670622842880000,
                                        43867.0 / 5109094217170944000,
                                        2.174868698558062e-16,
                                        5.50900282836023e-18};

/// f and, if asked, df/d(x^2): what log and the inverse Jacobians of SE(3) are made of (base/se3.cpp).
template <class T>
TENDRIL_INLINE T inverseCoefficient(const T& x2, T* rate = nullptr) {
  T f = broadcast<T>(kInverse[10]);
#pragma GCC unroll 10
  for (int n = 9; n >= 0; --n) f = kInverse[n] + x2 * f;
  if (rate) {
    *rate = broadcast<T>(10 * kInverse[10]);
#pragma GCC unroll 9
    for (int n = 9; n >= 1; --n) *rate = n * kInverse[n] + x2 * *rate;
  }
  for (int l = 0; l < kWidth<T>; ++l) {
    const double y = lanes(x2)[l];
    if (y <= kSeriesAngle2) continue;
    const double x = std::sqrt(y), s = std::sin(0.5 * x), cot = std::cos(0.5 * x) / s;
    const double g = (1 - 0.5 * x * cot) / y;
    lanes(f)[l] = g;
    if (rate) lanes(*rate)[l] = ((-0.5 * cot + 0.25 * x / (s * s)) / y - 2 * g / x) / (2 * x);
  }
  return f;
}

/// angle / sin(angle/2) of a unit quaternion with vector part of squared norm s2 and |w| = c: with t =
/// tan(angle/4) = s/(1 + c) it is 4 atan(t)/s.
template <class T>
TENDRIL_INLINE T logScale(const T& s2, const T& c) {
  const T r = 1 / (1 + c), t2 = s2 * r * r;
  T sum = broadcast<T>(1.0 / 27);
#pragma GCC unroll 13
  for (int n = 12; n >= 0; --n) sum = 1.0 / (2 * n + 1) - t2 * sum;
  T scale = 4 * r * sum;
  for (int l = 0; l < kWidth<T>; ++l) {
    const double s = std::sqrt(lanes(s2)[l]);
    if (s > 0.479425538604203) lanes(scale)[l] = 2 * std::atan2(s, lanes(c)[l]) / s;  // more than a radian
  }
  return scale;
}

template <class T>
void strainsOf(int elements, const Rows& nodes, const Rows& psi) {
  for (int k = 0; k < elements; k += kWidth<T>) {
    T a[7], b[7];
    load(nodes, 0, 7, k, a), load(nodes, 0, 7, k + 1, b);
    // conj(a) b
    T v[3], turned[3], d[3];
    cross(a, b, turned);
    const T w = a[3] * b[3] + dot(a, b);
    const T sign = w < 0 ? broadcast<T>(-1) : broadcast<T>(1);
    for (int i = 0; i < 3; ++i) {
      v[i] = a[3] * b[i] - b[3] * a[i] - turned[i];
      d[i] = b[4 + i] - a[4 + i];
    }
    const T scale = sign * logScale<T>(dot(v, v), sign * w);
    for (int i = 0; i < 3; ++i) v[i] *= scale;
    // R_a^T d = d - 2 w (a x d) + 2 a x (a x d)
    T once[3], twice[3];
    cross(a, d, once), cross(a, once, twice);
    for (int i = 0; i < 3; ++i) d[i] = d[i] + 2 * (twice[i] - a[3] * once[i]);
    cross(v, d, once), cross(v, once, twice);
    const T f = inverseCoefficient<T>(dot(v, v));
    for (int i = 0; i < 3; ++i) {
      store(psi[i] + k, v[i]);
      store(psi[3 + i] + k, T(d[i] - 0.5 * once[i] + f * twice[i]));
    }
  }
}

// ------------------------------------------------------------------------------------------------ law

/// The stiffness of an element: the rod's, but that to its shear force it gives way by the bending that the
/// force makes within it, too; the less, the tauter it is (README.md, section 2).
template <class T>
TENDRIL_INLINE void shearStiffness(const ElementLaw& law, const T& stretch, T* shear) {
  const T tension = law.c[3] * (stretch > 0 ? stretch : T{});
  const double h2 = law.h * law.h;
  shear[0] = 1 / (1 / law.c[4] + h2 / (12 * law.c[2] + 1.2 * h2 * tension));
  shear[1] = 1 / (1 / law.c[5] + h2 / (12 * law.c[1] + 1.2 * h2 * tension));
}

template <class T>
void prepareElements(int elements, const ElementLaw& law, const Rows& rest, const Rows& psi_rows,
                     const Rows& u_hat, const Rows& elastic) {
  const double h = law.h, soft = law.c[1] < law.c[2] ? law.c[1] : law.c[2];
  for (int k = 0; k < elements; k += kWidth<T>) {
    T psi[6], stiffness[6], ease[6], at_rest[6];
    load(psi_rows, 0, 6, k, psi);
    load(rest, 0, 3, k, at_rest);
    for (int i = 3; i < 6; ++i) at_rest[i] = T{};
    for (int i = 0; i < 6; ++i) ease[i] = at_rest[i], stiffness[i] = broadcast<T>(law.c[i]);
    shearStiffness<T>(law, psi[3] / h - 1, stiffness + 4);
    for (int pass = 0; pass < 2; ++pass) {  // the wrench owes something to the shift itself
      T f[6], rate[6], gain[6], wrench[6], x[3], y[3];
      for (int i = 0; i < 6; ++i) f[i] = stiffness[i] * (psi[i] / h - (i == 3 ? 1.0 : 0.0) - ease[i]);
      // u' = c^-1 ad_U^T f
      cross(f, psi, x), cross(f + 3, psi + 3, y);
      for (int i = 0; i < 3; ++i) rate[i] = (x[i] + y[i]) / (h * law.c[i]);
      cross(f + 3, psi, x);
      for (int i = 0; i < 3; ++i) rate[3 + i] = x[i] / (h * law.c[3 + i]);
      // ad_psi u', ad_u'^T f
      cross(psi, rate, gain), cross(psi, rate + 3, x), cross(psi + 3, rate, y);
      for (int i = 0; i < 3; ++i) gain[3 + i] = x[i] + y[i];
      cross(f, rate, x), cross(f + 3, rate + 3, y), cross(f + 3, rate, wrench + 3);
      for (int i = 0; i < 3; ++i) wrench[i] = x[i] + y[i];
      // The series in h has no meaning for an element that turns by a radian, or that its force could buckle.
      const T coarse = dot(psi, psi) + (h * h / soft) * squareRoot<T>(dot(f + 3, f + 3));
      const T share = coarse < 1 ? 1 - coarse * coarse : T{};
      for (int i = 0; i < 6; ++i)
        ease[i] = at_rest[i] + share * (h / 12 * gain[i] + f[i] / law.c[i] -
                                        (f[i] + h * h / 12 * wrench[i]) / stiffness[i]);
    }
    for (int i = 0; i < 6; ++i) {
      const T hat = load<T>(u_hat[i] + k);
      store(elastic[i] + k, T((ease[i] + law.rate * hat) / (1 + law.rate)));
    }
    store(elastic[6] + k, stiffness[4]), store(elastic[7] + k, stiffness[5]);
  }
}

template <class T>
void wrenchesOf(int elements, const ElementLaw& law, const Rows& psi, const Rows& elastic, const Rows& f,
                double* energies) {
  for (int k = 0; k < elements; k += kWidth<T>) {
    T energy = T{};
    for (int i = 0; i < 6; ++i) {
      const T u = load<T>(psi[i] + k) / law.h - (i == 3 ? 1.0 : 0.0) - load<T>(elastic[i] + k);
      const T stiffness = i < 4 ? broadcast<T>(law.c[i]) : load<T>(elastic[2 + i] + k);
      const T wrench = (1 + law.rate) * stiffness * u;
      energy = energy + wrench * u;
      store(f[i] + k, wrench);
    }
    store(energies + k, T(0.5 * law.h * energy));
  }
}

// ------------------------------------------------------------------------------------------------ Hessian

template <class T>
using Matrix = T[3][3];

template <class T>
TENDRIL_INLINE void addSkew(double by, const T* a, Matrix<T>& m) {
  m[0][1] = m[0][1] - by * a[2], m[0][2] = m[0][2] + by * a[1];
  m[1][0] = m[1][0] + by * a[2], m[1][2] = m[1][2] - by * a[0];
  m[2][0] = m[2][0] - by * a[1], m[2][1] = m[2][1] + by * a[0];
}

/// A 6 x 6 block, turns before shifts.
template <class T>
struct Block {
  T m[6][6];
  TENDRIL_INLINE Block() {
    for (auto& row : m)
      for (T& value : row) value = T{};
  }
  /// += sign a^T diag(k) b, for the quarter that begins at (row, column)
  TENDRIL_INLINE void addProduct(int row, int column, double sign, const Matrix<T>& a, const T* k,
                                 const Matrix<T>& b) {
#pragma GCC unroll 3
    for (int r = 0; r < 3; ++r)
#pragma GCC unroll 3
      for (int c = 0; c < 3; ++c)
        m[row + r][column + c] =
            m[row + r][column + c] + ((sign * k[0]) * a[0][r] * b[0][c] + (sign * k[1]) * a[1][r] * b[1][c] +
                                      (sign * k[2]) * a[2][r] * b[2][c]);
  }
  /// += sign [a 0; q a]^T C [b 0; p b], C = diag(km, kn)
  TENDRIL_INLINE void add(double sign, const Matrix<T>& a, const Matrix<T>& q, const Matrix<T>& b,
                          const Matrix<T>& p, const T* km, const T* kn) {
    addProduct(0, 0, sign, a, km, b), addProduct(0, 0, sign, q, kn, p);
    addProduct(0, 3, sign, q, kn, b);
    addProduct(3, 0, sign, a, kn, p);
    addProduct(3, 3, sign, a, kn, b);
  }
  /// += by v^, for the quarter that begins at (row, column)
  TENDRIL_INLINE void addSkew(int row, int column, double by, const T* v) {
    m[row][column + 1] = m[row][column + 1] - by * v[2], m[row][column + 2] = m[row][column + 2] + by * v[1];
    m[row + 1][column] = m[row + 1][column] + by * v[2];
    m[row + 1][column + 2] = m[row + 1][column + 2] - by * v[0];
    m[row + 2][column] = m[row + 2][column] - by * v[1];
    m[row + 2][column + 1] = m[row + 2][column + 1] + by * v[0];
  }
};

/// Adds lane l of a block's lower triangle, or sets it.
template <bool kAdd, class T>
TENDRIL_INLINE void putLower(const Block<T>& block, int l, double* to) {
#pragma GCC unroll 6
  for (int r = 0; r < 6; ++r)
#pragma GCC unroll 6
    for (int c = 0; c <= r; ++c) {
      const double value = lanes(block.m[r][c])[l];
      to[r * kBlockRow + c] = kAdd ? to[r * kBlockRow + c] + value : value;
    }
}

template <class T>
void derivativesOf(int elements, const ElementLaw& law, const Rows& psi_rows, const Rows& elastic,
                   const Rows& f_rows, bool geometric, double* diagonal, double* upper) {
  const double scale = (1 + law.rate) / law.h;
  for (int first = 0; first < elements; first += kWidth<T>) {
    T km[3], kn[3];
    for (int i = 0; i < 3; ++i) km[i] = broadcast<T>(scale * law.c[i]);
    kn[0] = broadcast<T>(scale * law.c[3]);
    kn[1] = scale * load<T>(elastic[6] + first), kn[2] = scale * load<T>(elastic[7] + first);
    T psi[6], f[6];
    load(psi_rows, 0, 6, first, psi), load(f_rows, 0, 6, first, f);
    const T *k = psi, *d = psi + 3, *m = f, *n = f + 3;
    // Jr^-1(psi) = [a 0; q a], Jr^-1(-psi) = [b 0; p b]: their even parts e, g and their odd ones, halves of
    // k^ and d^.
    T rate;
    const T x2 = dot(k, k), kd = dot(k, d), f2 = inverseCoefficient<T>(x2, &rate);
    Matrix<T> a, b, q, p;
    for (int r = 0; r < 3; ++r)
      for (int s = 0; s < 3; ++s) {
        T e = f2 * k[r] * k[s];
        T g = f2 * (d[r] * k[s] + k[r] * d[s]) + 2 * rate * kd * k[r] * k[s];
        if (r == s) e = e + (1 - f2 * x2), g = g - 2 * kd * (f2 + rate * x2);
        a[r][s] = b[r][s] = e, q[r][s] = p[r][s] = g;
      }
    addSkew(0.5, k, a), addSkew(-0.5, k, b), addSkew(0.5, d, q), addSkew(-0.5, d, p);

    // Gradient (-B^T f, A^T f), negated.
    T force_i[6], force_j[6];
    for (int i = 0; i < 3; ++i) {
      force_j[3 + i] = -(a[0][i] * n[0] + a[1][i] * n[1] + a[2][i] * n[2]);
      force_i[3 + i] = b[0][i] * n[0] + b[1][i] * n[1] + b[2][i] * n[2];
      force_j[i] = -(a[0][i] * m[0] + a[1][i] * m[1] + a[2][i] * m[2] + q[0][i] * n[0] + q[1][i] * n[1] +
                     q[2][i] * n[2]);
      force_i[i] =
          b[0][i] * m[0] + b[1][i] * m[1] + b[2][i] * m[2] + p[0][i] * n[0] + p[1][i] * n[1] + p[2][i] * n[2];
    }

    // Gauss-Newton.
    Block<T> ii, ij, jj;
    ii.add(1, b, p, b, p, km, kn);
    jj.add(1, a, q, a, q, km, kn);
    ij.add(-1, b, p, a, q, km, kn);
    if (geometric) {
      // f . psi'' = f . [eta_j, eta_i] to first order in h: antisymmetric coupling of the two nodes ...
      ij.addSkew(0, 0, 0.5, m), ij.addSkew(0, 3, 0.5, n), ij.addSkew(3, 0, 0.5, n);
      // ... to first order in psi = (k; d) the symmetric S = sym([m^ n^; n^ 0] ad_psi), 1/6 on either node
      // and 1/3 between (m^ k^ = k m^T - (m.k) I) ...
      const T trace = 2 * (dot(m, k) + dot(n, d)), trace_n = 2 * dot(n, k);
#pragma GCC unroll 3
      for (int r = 0; r < 3; ++r)
#pragma GCC unroll 3
        for (int s = 0; s < 3; ++s) {
          T ww = k[r] * m[s] + m[r] * k[s] + d[r] * n[s] + n[r] * d[s], wy = k[r] * n[s] + n[r] * k[s];
          if (r == s) ww = ww - trace, wy = wy - trace_n;
          ww = ww * (1.0 / 12), wy = wy * (1.0 / 12);
          for (Block<T>* block : {&ii, &jj}) {
            block->m[r][s] = block->m[r][s] + ww;
            block->m[3 + r][s] = block->m[3 + r][s] + wy;
          }
          ij.m[r][s] = ij.m[r][s] + 2 * ww;
          ij.m[r][3 + s] = ij.m[r][3 + s] + 2 * wy, ij.m[3 + r][s] = ij.m[3 + r][s] + 2 * wy;
        }
      // ... and, because positions move straight while the frame turns, -g . (w x y) at each node.
      ii.addSkew(3, 0, 0.5, force_i + 3), jj.addSkew(3, 0, 0.5, force_j + 3);
    }

    for (int l = 0; l < kWidth<T> && first + l < elements; ++l) {
      double* at = diagonal + (first + l) * kBlock;
      if (first + l > 0)
        putLower<true>(ii, l, at);
      else
        putLower<false>(ii, l, at);
      putLower<false>(jj, l, at + kBlock);
      double* between = upper + (first + l) * kBlock;
#pragma GCC unroll 6
      for (int r = 0; r < 6; ++r) {
#pragma GCC unroll 6
        for (int c = 0; c < 6; ++c) between[r * kBlockRow + c] = lanes(ij.m[r][c])[l];
        double& here = at[r * kBlockRow + 6];
        here = first + l > 0 ? here + lanes(force_i[r])[l] : lanes(force_i[r])[l];
        at[kBlock + r * kBlockRow + 6] = lanes(force_j[r])[l];
      }
    }
  }
}

// ------------------------------------------------------------------------------------------------ solver

/// One row of a block, in as many registers as it takes.
template <class T>
struct BlockRow {
  T part[kBlockRow / kWidth<T>];
  TENDRIL_INLINE void load(const double* from) {
    for (int i = 0; i < kBlockRow / kWidth<T>; ++i) part[i] = dynamics::load<T>(from + i * kWidth<T>);
  }
  TENDRIL_INLINE void store(double* to) const {
    for (int i = 0; i < kBlockRow / kWidth<T>; ++i) dynamics::store(to + i * kWidth<T>, part[i]);
  }
  /// -= by other
  TENDRIL_INLINE void subtract(double by, const BlockRow& other) {
    for (int i = 0; i < kBlockRow / kWidth<T>; ++i) part[i] = part[i] - by * other.part[i];
  }
  TENDRIL_INLINE void scale(double by) {
    for (int i = 0; i < kBlockRow / kWidth<T>; ++i) part[i] = by * part[i];
  }
};

/// The lower triangle of `pivot` becomes L D L^T: L below the diagonal, 1/D on it.
TENDRIL_INLINE bool factor(double* pivot) {
  for (int j = 0; j < 6; ++j) {
    double scaled[6];  // L_jk D_k
    double d = pivot[j * kBlockRow + j];
    const double before = std::abs(d);
    for (int k = 0; k < j; ++k) {
      scaled[k] = pivot[j * kBlockRow + k];
      const double l = scaled[k] * pivot[k * kBlockRow + k];
      pivot[j * kBlockRow + k] = l;
      d -= scaled[k] * l;
    }
    if (!(d > 1e-14 * before) || !(d > 0)) return false;
    pivot[j * kBlockRow + j] = 1 / d;
    for (int i = j + 1; i < 6; ++i) {
      double v = pivot[i * kBlockRow + j];
      for (int k = 0; k < j; ++k) v -= pivot[i * kBlockRow + k] * pivot[j * kBlockRow + k];
      pivot[i * kBlockRow + j] = v;  // L_ij D_j, divided when its row's turn comes
    }
  }
  return true;
}

/// Factors `pivot`, replaces `coupling` (to the next block) by W = L^-1 (coupling | right-hand side), and
/// takes W^T D^-1 W from the next block.
template <class T>
TENDRIL_INLINE bool eliminate(double* pivot, double* coupling, double* next) {
  if (!factor(pivot)) return false;
  BlockRow<T> w[6];
#pragma GCC unroll 6
  for (int i = 0; i < 6; ++i) {
    coupling[i * kBlockRow + 6] = pivot[i * kBlockRow + 6];
    w[i].load(coupling + i * kBlockRow);
#pragma GCC unroll 6
    for (int k = 0; k < i; ++k) w[i].subtract(pivot[i * kBlockRow + k], w[k]);
    w[i].store(coupling + i * kBlockRow);
  }
  double scaled[6][kBlockRow];
#pragma GCC unroll 6
  for (int k = 0; k < 6; ++k) {
    BlockRow<T> row = w[k];
    row.scale(pivot[k * kBlockRow + k]);
    row.store(scaled[k]);
  }
#pragma GCC unroll 6
  for (int i = 0; i < 6; ++i) {
    BlockRow<T> row;
    row.load(next + i * kBlockRow);
#pragma GCC unroll 6
    for (int k = 0; k < 6; ++k) row.subtract(scaled[k][i], w[k]);
    row.store(next + i * kBlockRow);
  }
  return true;
}

/// x = L^-T D^-1 (right-hand side - W x_next)
TENDRIL_INLINE void substitute(const double* pivot, const double* w, const double* next, double* x) {
  for (int i = 5; i >= 0; --i) {
    const double* row = w + i * kBlockRow;
    double v = row[6];
    if (next)
      v -= (row[0] * next[0] + row[1] * next[1]) + (row[2] * next[2] + row[3] * next[3]) +
           (row[4] * next[4] + row[5] * next[5]);
    v *= pivot[i * kBlockRow + i];
    for (int k = i + 1; k < 6; ++k) v -= pivot[k * kBlockRow + i] * x[k];
    x[i] = v;
  }
}

template <class T>
bool solveSystem(int blocks, double* diagonal, double* upper, double* solution) {
  const int middle = blocks / 2;
  // The couplings of the far half, seen from its own side.
  for (int b = middle; b + 1 < blocks; ++b) {
    double* m = upper + b * kBlock;
    for (int r = 0; r < 6; ++r)
      for (int c = 0; c < r; ++c) {
        const double t = m[r * kBlockRow + c];
        m[r * kBlockRow + c] = m[c * kBlockRow + r], m[c * kBlockRow + r] = t;
      }
  }
  // Two chains that know nothing of each other until they meet: the processor works on both at once.
  for (int i = 0; i < blocks - middle - 1 || i < middle; ++i) {
    const int near = i, far = blocks - 1 - i;
    if (near < middle &&
        !eliminate<T>(diagonal + near * kBlock, upper + near * kBlock, diagonal + (near + 1) * kBlock))
      return false;
    if (far > middle &&
        !eliminate<T>(diagonal + far * kBlock, upper + (far - 1) * kBlock, diagonal + (far - 1) * kBlock))
      return false;
  }
  double* pivot = diagonal + middle * kBlock;
  if (!factor(pivot)) return false;
  double last[kBlock] = {};
  for (int i = 0; i < 6; ++i) {
    double v = pivot[i * kBlockRow + 6];
    for (int k = 0; k < i; ++k) v -= pivot[i * kBlockRow + k] * last[k * kBlockRow + 6];
    last[i * kBlockRow + 6] = v;
  }
  substitute(pivot, last, nullptr, solution + 6 * middle);
  for (int i = 1; i <= middle || middle + i < blocks; ++i) {
    const int near = middle - i, far = middle + i;
    if (near >= 0)
      substitute(diagonal + near * kBlock, upper + near * kBlock, solution + 6 * (near + 1),
                 solution + 6 * near);
    if (far < blocks)
      substitute(diagonal + far * kBlock, upper + (far - 1) * kBlock, solution + 6 * (far - 1),
                 solution + 6 * far);
  }
  return true;
}

template <int N>
const Kernel& makeKernel(const char* name) {
  using T = Lanes<N>;
  static const Kernel kernel = {name,          strainsOf<T>,     prepareElements<T>,
                                wrenchesOf<T>, derivativesOf<T>, solveSystem<T>};
  return kernel;
}

}  // namespace
}  // namespace tendril::dynamics
