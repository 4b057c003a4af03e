/// The laws (2)-(4) along one rod, or several in lanes, and their derivative by the wrench a at the base
/// (README.md, 2 to 4 and 9). Private to the statics.
///
/// Everything is in the rod's own units and times the step: an integration step then is of length 1. "Base"
/// is the frame of the first node; base axes may be turned at will, and are turned so that z is along the
/// force there: then a = (moment; 0, 0, force), and the position along z moves nothing else.
#pragma once

#include "tendril/statics/dormand_prince8.h"

namespace tendril::statics {
namespace {

/// What is constant over one step of a weightless rod.
template <class T>
struct LightChart {
  T moment[3], force;  // a = (moment; 0, 0, force)
  T cm[3], cn[3];      // h / c: compliance in bending and in stretch
  T kappa0[3], h;      // h times the curvature at rest, and h: xi of the unloaded rod
  [[nodiscard]] TENDRIL_INLINE T forceAlong(const T* r, int i) const { return force * r[6 + i]; }
  TENDRIL_INLINE void momentAbout(const T* p, const T*, T* t) const {
    t[0] = subtractProduct(p[1], force, moment[0]), t[1] = multiplyAdd(p[0], force, moment[1]);
    t[2] = moment[2];
  }
};

/// The same for a rod with weight w per length. The wrench at the base's origin falls along it: n0 - s w, m0
/// - P x w with P the integral of the position (README.md, 9); `force` is its force at this stage.
template <class T>
struct HeavyChart {
  T moment[3], force[3], weight[3];
  T cm[3], cn[3], kappa0[3], h;
  [[nodiscard]] TENDRIL_INLINE T forceAlong(const T* r, int i) const {
    return dot(r[i], force[0], r[3 + i], force[1], r[6 + i], force[2]);
  }
  TENDRIL_INLINE void momentAbout(const T* p, const T* area, T* t) const {
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      t[i] = multiplyAdd(area[k], weight[j], subtractProduct(area[j], weight[k], moment[i]));
      t[i] = multiplyAdd(p[k], force[j], subtractProduct(p[j], force[k], t[i]));
    }
  }
};

/// One cross-section: its rotation R (row by row), mu = (m; n), and h xi = (kappa; v).
template <class T>
struct Section {
  T r[9], m[3], n[3], kappa[3], v[3];
};

/// The section at the frame y = (quaternion x y z w | position | P), eq. (3) and mu = Ad_q^T (wrench at the
/// base's origin).
template <class T, class C>
TENDRIL_INLINE void sectionAt(const C& chart, const T* y, Section<T>& s) {
  const T x2 = y[0] + y[0], y2 = y[1] + y[1], z2 = y[2] + y[2];
  const T xx = subtractProduct(y[0], x2, broadcast<T>(1)), yy = y[1] * y2, zz = y[2] * z2;  // xx: 1 - x x2
  const T xy = y[0] * y2, xz = y[0] * z2, yz = y[1] * z2;
  T* r = s.r;
  r[0] = 1 - (yy + zz), r[1] = subtractProduct(y[3], z2, xy), r[2] = multiplyAdd(y[3], y2, xz);
  r[3] = multiplyAdd(y[3], z2, xy), r[4] = xx - zz, r[5] = subtractProduct(y[3], x2, yz);
  r[6] = subtractProduct(y[3], y2, xz), r[7] = multiplyAdd(y[3], x2, yz), r[8] = xx - yy;
  T t[3];
  chart.momentAbout(y + 4, y + 7, t);
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i) {
    s.m[i] = dot(r[i], t[0], r[3 + i], t[1], r[6 + i], t[2]);
    s.n[i] = chart.forceAlong(r, i);
    s.kappa[i] = multiplyAdd(chart.cm[i], s.m[i], chart.kappa0[i]);
    s.v[i] = chart.cn[i] * s.n[i];
  }
  s.v[0] = s.v[0] + chart.h;
}

/// q' = q (kappa; v), eq. (4): the rates of the quaternion and of the position's component i.
template <class T>
TENDRIL_INLINE void rotationRate(const T* y, const Section<T>& s, T* dy) {
  const T k1 = 0.5 * s.kappa[0], k2 = 0.5 * s.kappa[1], k3 = 0.5 * s.kappa[2];
  dy[0] = subtractProduct(y[2], k2, multiplyAdd(y[1], k3, y[3] * k1));
  dy[1] = subtractProduct(y[0], k3, multiplyAdd(y[2], k1, y[3] * k2));
  dy[2] = subtractProduct(y[1], k1, multiplyAdd(y[0], k2, y[3] * k3));
  dy[3] = -dot(y[0], k1, y[1], k2, y[2], k3);
}
template <class T>
[[nodiscard]] TENDRIL_INLINE T positionRate(const Section<T>& s, int i) {
  return dot(s.r[3 * i], s.v[0], s.r[3 * i + 1], s.v[1], s.r[3 * i + 2], s.v[2]);
}

/// Scales a quaternion whose length is 1 to a few digits back to length 1.
template <class T>
TENDRIL_INLINE void renormalise(T* y) {
  const T scale = 1.5 - 0.5 * multiplyAdd(y[3], y[3], dot(y[0], y[0], y[1], y[1], y[2], y[2]));
  for (int i = 0; i < 4; ++i) y[i] = y[i] * scale;
}

/// The matrix of h (C^-1 B(mu) - ad_xi), whose diagonal 3 x 3 blocks' diagonals are 0: eta' is it times eta +
/// C^-1 (the variation of mu with the frame held).
template <class T>
struct Transport {
  T ww[3][3], wl[3][3], lw[3][3], kappa[3];
};
template <class T, class C>
TENDRIL_INLINE void transportAt(const C& chart, const Section<T>& s, Transport<T>& a) {
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i) {
    a.kappa[i] = s.kappa[i];
#pragma GCC unroll 2
    for (int o = 1; o < 3; ++o) {
      const int j = (i + o) % 3;
      a.ww[i][j] = multiplyAdd(chart.cm[i], s.m[j], -s.kappa[j]);
      a.wl[i][j] = chart.cm[i] * s.n[j];
      a.lw[i][j] = multiplyAdd(chart.cn[i], s.n[j], -s.v[j]);
    }
  }
}

/// Adds transport times eta = (w; l) to the rate, for `Count` columns of J in T (or all its columns in the
/// lanes of W) side by side, so that a coefficient is loaded once for all of them.
template <int Count, class T, class W>
TENDRIL_INLINE void addTransported(const Transport<T>& a, const W (*eta)[6], W (*rate)[6]) {
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
#pragma GCC unroll 6
    for (int c = 0; c < Count; ++c) {
      const W *w = eta[c], *l = eta[c] + 3;
      rate[c][i] = multiplyAdd(a.ww[i][j], w[k], rate[c][i]);
      rate[c][i] = subtractProduct(a.ww[i][k], w[j], rate[c][i]);
      rate[c][i] = multiplyAdd(a.wl[i][j], l[k], rate[c][i]);
      rate[c][i] = subtractProduct(a.wl[i][k], l[j], rate[c][i]);
      rate[c][3 + i] = multiplyAdd(a.lw[i][j], w[k], rate[c][3 + i]);
      rate[c][3 + i] = subtractProduct(a.lw[i][k], w[j], rate[c][3 + i]);
      rate[c][3 + i] = subtractProduct(a.kappa[j], l[k], rate[c][3 + i]);
      rate[c][3 + i] = multiplyAdd(a.kappa[k], l[j], rate[c][3 + i]);
    }
  }
}

/// sum mu_i^2 / 2c_i, the energy density.
template <class T, class C>
[[nodiscard]] TENDRIL_INLINE T energyRate(const C& chart, const Section<T>& s) {
  T sum = broadcast<T>(0);
  for (int i = 0; i < 3; ++i)
    sum = multiplyAdd(chart.cn[i] * s.n[i], s.n[i], multiplyAdd(chart.cm[i] * s.m[i], s.m[i], sum));
  return 0.5 * sum;
}

}  // namespace
}  // namespace tendril::statics
