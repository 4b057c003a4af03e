/// The kernels, for any number of lanes. Included by one file for each instruction set. Private to the
/// statics.
#pragma once

#include <algorithm>
#include <cstring>

#include "tendril/statics/compose.h"
#include "tendril/statics/kernel.h"
#include "tendril/statics/laws.h"

namespace tendril::statics {
namespace {

[[nodiscard]] inline Screening screeningOf(double left, double right) {
  if (!(right > 0)) return Screening::unstable;
  return left > 0 ? Screening::stable : Screening::unsure;
}

// ------------------------------------------------------------------------------------------------ many rods

/// As many rods as there are lanes, each with a step length of its own.
template <class T>
struct LanesOfRods {
  LightChart<T> chart;
  T y[8];  // x y z w | position | energy
  int left[kWidth<T>] = {};
  std::size_t rod[kWidth<T>] = {};

  LanesOfRods() {
    std::memset(&chart, 0, sizeof chart);
    std::memset(y, 0, sizeof y);
  }
  /// Puts a rod into lane l, at its start.
  void load(int l, const KernelRod& properties, const AlignedWrench& wrench, std::size_t index) {
    const double h = 1.0 / wrench.steps;
    for (int i = 0; i < 3; ++i) {
      lanes(chart.moment[i])[l] = wrench.moment[i];
      lanes(chart.cm[i])[l] = h * properties.compliance[i];
      lanes(chart.cn[i])[l] = h * properties.compliance[3 + i];
      lanes(chart.kappa0[i])[l] = h * properties.kappa0[i];
    }
    lanes(chart.force)[l] = wrench.force;
    lanes(chart.h)[l] = h;
    for (int i = 0; i < 8; ++i) lanes(y[i])[l] = i < 4 ? wrench.rotation[i] : 0;
    left[l] = wrench.steps;
    rod[l] = index;
  }
  void store(int l, PathEnd& end) const {
    for (int i = 0; i < 4; ++i) end.rotation[i] = lanes(y[i])[l];
    for (int i = 0; i < 3; ++i) end.position[i] = lanes(y[4 + i])[l];
    end.energy = lanes(y[7])[l];
  }
};

/// The last two numbers of the path move nothing else: they are summed up, not integrated with the rest.
template <class T>
[[gnu::noinline]] void pathStep(LanesOfRods<T>& rods) {
  Rates<T, 6> k;
  T z[6];
  Section<T> s;
  T sum[2] = {rods.y[6], rods.y[7]};
  forEach<kStages>([&]<int S>() __attribute__((always_inline)) {
    unrolledStageState<S>(rods.y, k, z);
    sectionAt(rods.chart, z, s);
    rotationRate(z, s, k[S]);
    k[S][4] = positionRate(s, 0), k[S][5] = positionRate(s, 1);
    if constexpr (kA[kStages][S] != 0) {
      sum[0] = multiplyAdd(kA[kStages][S], positionRate(s, 2), sum[0]);
      sum[1] = multiplyAdd(kA[kStages][S], energyRate(rods.chart, s), sum[1]);
    }
  });
  unrolledStageState<kStages>(rods.y, k, rods.y);
  rods.y[6] = sum[0], rods.y[7] = sum[1];
  renormalise(rods.y);
}

template <int N>
void paths(const KernelRod& properties, std::span<const AlignedWrench> wrenches, PathEnd* ends) {
  using T = Lanes<N>;
  LanesOfRods<T> rods;
  std::size_t next = 0;
  int live = 0;
  for (int l = 0; l < N && next < wrenches.size(); ++l, ++next, ++live)
    rods.load(l, properties, wrenches[next], next);
  while (live > 0) {
    pathStep(rods);
    for (int l = 0; l < N; ++l) {
      if (rods.left[l] == 0 || --rods.left[l] > 0) continue;
      rods.store(l, ends[rods.rod[l]]);
      if (next < wrenches.size())
        rods.load(l, properties, wrenches[next], next), ++next;
      else
        --live;
    }
  }
}

/// Where a column of J begins: that of a unit moment along a base axis, then that of a unit force along it.
constexpr int columnAt(int c) { return 12 * (c % 3) + 6 * (c / 3); }

/// One step of the path and of the columns of J; all seven numbers of the frame are wanted at the stages.
template <class T>
[[gnu::noinline]] void jointStep(LanesOfRods<T>& rods, T* jac) {
  Rates<T, 7> k;
  Rates<T, 36> kj;
  T z[7];
  Section<T> s;
  Transport<T> a;
  T sum = rods.y[7];
  const LightChart<T>& chart = rods.chart;
#pragma GCC unroll 1
  for (int stage = 0; stage < kStages; ++stage) {
    stageState<7>(stage, rods.y, k, 0, z);
    sectionAt(chart, z, s);
    rotationRate(z, s, k[stage]);
#pragma GCC unroll 3
    for (int i = 0; i < 3; ++i) k[stage][4 + i] = positionRate(s, i);
    sum = multiplyAdd(kA[kStages][stage], energyRate(chart, s), sum);
    transportAt(chart, s, a);
    // + h C^-1 Ad_q^T, for a unit moment and a unit force along each base axis
    const T* p = z + 4;
    T turned[9];  // h C_m^-1 R^T
#pragma GCC unroll 9
    for (int i = 0; i < 9; ++i) turned[i] = chart.cm[i % 3] * s.r[i];
#pragma GCC unroll 3
    for (int b = 0; b < 3; ++b) {
      const int c = (b + 1) % 3, d = (b + 2) % 3;
      T eta[2][6], rate[2][6];
      stageState<12>(stage, jac, kj, 12 * b, eta[0]);
#pragma GCC unroll 3
      for (int i = 0; i < 3; ++i) {
        rate[0][i] = turned[3 * b + i];
        rate[0][3 + i] = broadcast<T>(0);
        rate[1][i] = differenceOfProducts(p[c], turned[3 * d + i], p[d], turned[3 * c + i]);
        rate[1][3 + i] = chart.cn[i] * s.r[3 * b + i];
      }
      addTransported<2>(a, eta, rate);
#pragma GCC unroll 12
      for (int i = 0; i < 12; ++i) kj[stage][12 * b + i] = rate[i / 6][i % 6];
    }
  }
  stageState<7>(kStages, rods.y, k, 0, rods.y);
#pragma GCC unroll 3
  for (int b = 0; b < 3; ++b) stageState<12>(kStages, jac, kj, 12 * b, jac + 12 * b);
  rods.y[7] = sum;
  renormalise(rods.y);
}

/// X = Ad_q J, row by row, from the columns of J.
template <class T>
TENDRIL_INLINE void inBaseAxes(const T* r, const T* p, const T* jac, T* x) {
#pragma GCC unroll 6
  for (int c = 0; c < 6; ++c) {
    const T* column = jac + columnAt(c);
    T w[3], l[3];
#pragma GCC unroll 3
    for (int i = 0; i < 3; ++i) {
      w[i] = dot(r[3 * i], column[0], r[3 * i + 1], column[1], r[3 * i + 2], column[2]);
      l[i] = dot(r[3 * i], column[3], r[3 * i + 1], column[4], r[3 * i + 2], column[5]);
    }
#pragma GCC unroll 3
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      x[6 * i + c] = w[i];
      x[6 * (3 + i) + c] = subtractProduct(p[k], w[j], multiplyAdd(p[j], w[k], l[i]));
    }
  }
}

/// What is known of a rod between two segments: K and Y (README.md, 5), about the section there, and of the
/// last segment passed.
template <class T>
struct Walk {
  T k[36], y[36];
  T origin[3];       // of the section, from the base
  T p[36];           // P of the last segment
  T smallest_pivot;  // of P
  T started;         // 1 after the first segment, else 0
};

/// Takes the section at position d for the origin: moments about it, K's and Y's twists at it (README.md, 5).
template <class T>
TENDRIL_INLINE void moveOrigin(const T* d, LightChart<T>& chart, Walk<T>& walk) {
  chart.moment[0] = subtractProduct(d[1], chart.force, chart.moment[0]);
  chart.moment[1] = multiplyAdd(d[0], chart.force, chart.moment[1]);
  // K: v - d x w, row by row
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
#pragma GCC unroll 6
    for (int c = 0; c < 6; ++c) {
      T& v = walk.k[6 * (3 + i) + c];
      v = multiplyAdd(d[k], walk.k[6 * j + c], subtractProduct(d[j], walk.k[6 * k + c], v));
    }
    walk.origin[i] = walk.origin[i] + d[i];
  }
  // Y: T^T Y T with T = [1 0; d^ 1]: columns, then rows; (d^)_ji = d_k, (d^)_ki = -d_j
#pragma GCC unroll 6
  for (int r = 0; r < 6; ++r) {
    T* row = walk.y + 6 * r;
#pragma GCC unroll 3
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      row[i] = subtractProduct(d[j], row[3 + k], multiplyAdd(d[k], row[3 + j], row[i]));
    }
  }
#pragma GCC unroll 6
  for (int c = 0; c < 6; ++c)
#pragma GCC unroll 3
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      T& y = walk.y[6 * i + c];
      y = subtractProduct(d[j], walk.y[6 * (3 + k) + c], multiplyAdd(d[k], walk.y[6 * (3 + j) + c], y));
    }
}

/// h S = Ad_q (h C^-1) Ad_q^T.
template <class T, class C>
TENDRIL_INLINE void complianceInBaseAxes(const C& chart, const T* r, const T* p, T* s) {
  T mm[9], nn[9];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      mm[3 * i + j] = broadcast<T>(0), nn[3 * i + j] = broadcast<T>(0);
      for (int k = 0; k < 3; ++k) {
        mm[3 * i + j] = multiplyAdd(chart.cm[k] * r[3 * i + k], r[3 * j + k], mm[3 * i + j]);
        nn[3 * i + j] = multiplyAdd(chart.cn[k] * r[3 * i + k], r[3 * j + k], nn[3 * i + j]);
      }
    }
  T pm[9];  // p^ mm
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      pm[3 * i + j] = differenceOfProducts(p[(i + 1) % 3], mm[3 * ((i + 2) % 3) + j], p[(i + 2) % 3],
                                           mm[3 * ((i + 1) % 3) + j]);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const int k = (j + 1) % 3, l = (j + 2) % 3;
      s[6 * i + j] = mm[3 * i + j];
      s[6 * (3 + i) + j] = s[6 * j + 3 + i] = pm[3 * i + j];
      s[6 * (3 + i) + 3 + j] =  // - (p^ mm) p^
          subtractProduct(p[l], pm[3 * i + k], multiplyAdd(p[k], pm[3 * i + l], nn[3 * i + j]));
    }
}

/// Passes the segment with matrix x; everything about the section at its start.
template <class T, class C>
[[gnu::noinline]] void passSegment(const C& chart, const T* x, Walk<T>& walk) {
  // K <- K + X (L + B K) with B = [m^ n^; n^ 0], n = (0, 0, force) and L = [1, -origin^; 0 1] da about here
  T bk[36];
#pragma GCC unroll 6
  for (int c = 0; c < 6; ++c) {
    const T *w = walk.k + c, *l = walk.k + 18 + c;
    const T *m = chart.moment, &f = chart.force;
    bk[c] = subtractProduct(f, l[6], differenceOfProducts(m[1], w[12], m[2], w[6]));
    bk[6 + c] = multiplyAdd(f, l[0], differenceOfProducts(m[2], w[0], m[0], w[12]));
    bk[12 + c] = differenceOfProducts(m[0], w[6], m[1], w[0]);
    bk[18 + c] = -(f * w[6]);
    bk[24 + c] = f * w[0];
    bk[30 + c] = broadcast<T>(0);
  }
#pragma GCC unroll 6
  for (int i = 0; i < 6; ++i) bk[7 * i] = bk[7 * i] + 1.0;
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;  // -(origin^)_ij = origin_k, -(origin^)_ik = -origin_j
    bk[6 * i + 3 + j] = bk[6 * i + 3 + j] + walk.origin[k];
    bk[6 * i + 3 + k] = bk[6 * i + 3 + k] - walk.origin[j];
  }
#pragma GCC unroll 6
  for (int i = 0; i < 6; ++i)
#pragma GCC unroll 6
    for (int j = 0; j < 6; ++j) {
      T sum = walk.k[6 * i + j];
#pragma GCC unroll 6
      for (int k = 0; k < 6; ++k) sum = multiplyAdd(x[6 * i + k], bk[6 * k + j], sum);
      walk.k[6 * i + j] = sum;
    }

  T factored[36], inverse[36];
  congruentOfD(walk.y, x, walk.p);
#pragma GCC unroll 36
  for (int i = 0; i < 36; ++i) factored[i] = walk.p[i];
  const T pivot = factorise(factored);
  invertFactorised(factored, inverse);
  symmetricInverse(x, walk.y);
#pragma GCC unroll 36
  for (int i = 0; i < 36; ++i) walk.y[i] = walk.started > 0 ? walk.y[i] - inverse[i] : walk.y[i];
  walk.smallest_pivot =
      walk.started > 0 ? pivot : broadcast<T>(1);  // the first segment has no conjugate point
  walk.started = broadcast<T>(1);
}

/// The smallest pivots of P - margin S and of P + margin S at the end of the last segment: the eigenvalues of
/// the pencil (P, S) are to first order the times from there to the conjugate points (README.md, 7).
template <class T, class C>
[[gnu::noinline]] void marginsAtEnd(const C& chart, const T* y, double margin, const Walk<T>& walk, T& left,
                                    T& right) {
  T s[36], factored[36];
  Section<T> section;
  sectionAt(chart, y, section);
  complianceInBaseAxes(chart, section.r, y + 4, s);
  const T scale = margin / larger(chart.h, broadcast<T>(1e-300));
#pragma GCC unroll 36
  for (int i = 0; i < 36; ++i) factored[i] = subtractProduct(scale, s[i], walk.p[i]);
  left = factorise(factored);
#pragma GCC unroll 36
  for (int i = 0; i < 36; ++i) factored[i] = multiplyAdd(scale, s[i], walk.p[i]);
  right = factorise(factored);
}

template <int N>
void joints(const KernelRod& properties, std::span<const AlignedWrench> wrenches, double margin, bool stop,
            JointEnd* ends) {
  using T = Lanes<N>;
  LanesOfRods<T> rods;
  Walk<T> walk;
  std::memset(&walk, 0, sizeof walk);
  bool unstable[N] = {};
  T jac[36], x[36];
  std::size_t next = 0;
  int live = 0;
  const auto load = [&](int l) {
    rods.load(l, properties, wrenches[next], next);
    for (int i = 0; i < 36; ++i) lanes(walk.k[i])[l] = 0, lanes(walk.y[i])[l] = 0;
    for (int i = 0; i < 3; ++i) lanes(walk.origin[i])[l] = 0;
    lanes(walk.started)[l] = 0;
    unstable[l] = false;
    ++next;
  };
  for (int l = 0; l < N && next < wrenches.size(); ++l, ++live) load(l);
  while (live > 0) {
    for (int i = 0; i < 36; ++i) jac[i] = broadcast<T>(0);
    for (int i = 0; i < kStepsPerSegment; ++i) jointStep(rods, jac);
    Section<T> section;
    sectionAt(rods.chart, rods.y, section);
    inBaseAxes(section.r, rods.y + 4, jac, x);
    passSegment(rods.chart, x, walk);
    T left, right;
    if (std::any_of(rods.left, rods.left + N, [](int n) { return n == kStepsPerSegment; }))
      marginsAtEnd(rods.chart, rods.y, margin, walk, left, right);
    moveOrigin(rods.y + 4, rods.chart, walk);
    for (int i = 0; i < 3; ++i) rods.y[4 + i] = broadcast<T>(0);
    for (int l = 0; l < N; ++l) {
      if (rods.left[l] == 0) continue;
      rods.left[l] -= kStepsPerSegment;
      const bool last = rods.left[l] == 0;
      const bool here = !(lanes(walk.smallest_pivot)[l] > 0);
      unstable[l] = unstable[l] || (here && !last);
      if (!last && !(stop && unstable[l])) continue;
      JointEnd& end = ends[rods.rod[l]];
      rods.store(l, end.path);
      for (int i = 0; i < 3; ++i) end.path.position[i] = lanes(walk.origin[i])[l];
      for (int i = 0; i < 36; ++i) end.k[i] = lanes(walk.k[i])[l];
      end.screening = unstable[l] ? Screening::unstable : screeningOf(lanes(left)[l], lanes(right)[l]);
      rods.left[l] = 0;
      if (next < wrenches.size())
        load(l);
      else
        --live;
    }
  }
}

// ------------------------------------------------------------------------------------------------ one rod

/// One rod, light or heavy: which numbers are integrated together, and the force at a place along it.
struct Light {
  static constexpr int kCoupled = 7, kMoments = 0, kSolutions = 1;  // x y z w | position; X
  LightChart<double> chart;
  TENDRIL_INLINE void setForce(const SingleRod& rod, double) { chart.force = rod.force[2]; }
};
struct Heavy {
  static constexpr int kCoupled = 10, kMoments = 3, kSolutions = 2;  // x y z w | position | P; X, then U
  HeavyChart<double> chart;
  TENDRIL_INLINE void setForce(const SingleRod& rod, double t) {
    for (int i = 0; i < 3; ++i)
      chart.weight[i] = rod.weight[i], chart.force[i] = rod.force[i] - t * rod.weight[i];
  }
};
template <class M>
[[nodiscard]] TENDRIL_INLINE M modelOf(const SingleRod& rod, const Steps& steps) {
  M model;
  for (int i = 0; i < 3; ++i) {
    model.chart.moment[i] = rod.moment[i];
    model.chart.cm[i] = steps.h * rod.compliance[i], model.chart.cn[i] = steps.h * rod.compliance[3 + i];
    model.chart.kappa0[i] = steps.h * steps.kappa0[i];
  }
  model.chart.h = steps.h;
  model.setForce(rod, steps.start);
  return model;
}

/// The rate of the path's coupled numbers, and of the energy.
template <class M>
TENDRIL_INLINE double singleRate(const M& model, const double* y, Section<double>& s, double* rate) {
  sectionAt(model.chart, y, s);
  rotationRate(y, s, rate);
  for (int i = 0; i < 3; ++i) rate[4 + i] = positionRate(s, i);
  if constexpr (M::kMoments > 0)
    for (int i = 0; i < 3; ++i) rate[7 + i] = model.chart.h * y[4 + i];
  return energyRate(model.chart, s);
}

template <class M>
void singlePath(const SingleRod& rod, const Steps& steps, double* y, double (*record)[kState]) {
  constexpr int kN = M::kCoupled;
  M model = modelOf<M>(rod, steps);
  for (int step = 0; step < steps.count; ++step) {
    if (record) std::copy_n(y, kState, record[step]);
    Rates<double, kN> k;
    double z[kN], energy = y[kEnergy];
    Section<double> s;
    forEach<kStages>([&]<int S>() __attribute__((always_inline)) {
      unrolledStageState<S>(y, k, z);
      model.setForce(rod, steps.start + (step + kNode[S]) * steps.h);
      energy = multiplyAdd(kA[kStages][S], singleRate(model, z, s, k[S]), energy);
    });
    unrolledStageState<kStages>(y, k, y);
    y[kEnergy] = energy;
    renormalise(y);
  }
}

/// Some columns of J and L of one solution, row by row: as many as there are lanes.
template <class W>
struct Columns {
  W jac[6], l[6];
};
template <int N>
inline constexpr int kBlocks = (6 + N - 1) / N;  // of N columns

/// At the start of a segment X = 0, Lx = 1; for a heavy rod also U = 1, Lu = 0, with J = Ad_q^-1 U.
template <class M, int N>
TENDRIL_INLINE void startColumns(const M& model, const double* y, Columns<Lanes<N>>* columns) {
  std::memset(columns, 0, M::kSolutions * kBlocks<N> * sizeof *columns);
  for (int c = 0; c < 6; ++c) lanes(columns[c / N].l[c])[c % N] = 1;
  if constexpr (M::kMoments > 0) {
    Section<double> s;
    sectionAt(model.chart, y, s);
    const double* p = y + 4;
    const auto jac = [&](int row, int c) -> double& {
      return lanes(columns[kBlocks<N> + c / N].jac[row])[c % N];
    };
    for (int i = 0; i < 3; ++i)
      for (int b = 0; b < 3; ++b) {  // Ad_q^-1 = [R^T 0; -R^T p^, R^T]
        const int c = (b + 1) % 3, d = (b + 2) % 3;
        jac(i, b) = jac(3 + i, 3 + b) = s.r[3 * b + i];
        jac(3 + i, b) = s.r[3 * d + i] * p[c] - s.r[3 * c + i] * p[d];
      }
  }
}

/// eta' = h (C^-1 B(mu) - ad_xi) eta + h C^-1 Ad_q^T L, and L_m' = w x (R eta_l) for a heavy rod, for columns
/// in lanes.
template <class M, class W>
TENDRIL_INLINE void columnRate(const M& model, const Transport<double>& a, const Section<double>& s,
                               const double* p, const W* eta, const W* l, W* rate) {
  const W* moment = M::kMoments > 0 ? eta + 6 : l;
  W t[3];
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i) {
    const int c = (i + 1) % 3, d = (i + 2) % 3;
    t[i] = multiplyAdd(p[d], l[3 + c], subtractProduct(p[c], l[3 + d], moment[i]));
  }
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i) {
    rate[i] = model.chart.cm[i] * dot(s.r[i], t[0], s.r[3 + i], t[1], s.r[6 + i], t[2]);
    rate[3 + i] = model.chart.cn[i] * dot(s.r[i], l[3], s.r[3 + i], l[4], s.r[6 + i], l[5]);
  }
  addTransported<1>(a, reinterpret_cast<const W(*)[6]>(eta), reinterpret_cast<W(*)[6]>(rate));
  if constexpr (M::kMoments > 0) {
    const double* w = model.chart.weight;
    W dp[3];
    for (int i = 0; i < 3; ++i)
      dp[i] = model.chart.h * dot(s.r[3 * i], eta[3], s.r[3 * i + 1], eta[4], s.r[3 * i + 2], eta[5]);
    for (int i = 0; i < 3; ++i) {
      const int c = (i + 1) % 3, d = (i + 2) % 3;
      rate[6 + i] = subtractProduct(w[d], dp[c], w[c] * dp[d]);
    }
  }
}

/// Walks along one segment of one rod.
template <class M, int N>
TENDRIL_INLINE void walkColumns(M& model, const SingleRod& rod, const Steps& steps, double* y,
                                double (*record)[kState], Columns<Lanes<N>>* columns) {
  using W = Lanes<N>;
  constexpr int kN = M::kCoupled, kRows = 6 + M::kMoments, kCount = M::kSolutions * kBlocks<N>;
  W state[kCount][kRows];  // J, and the moment rows of L where they change
  for (int b = 0; b < kCount; ++b) {
    for (int i = 0; i < 6; ++i) state[b][i] = columns[b].jac[i];
    for (int i = 6; i < kRows; ++i) state[b][i] = columns[b].l[i - 6];
  }
  for (int step = 0; step < steps.count; ++step) {
    if (record) std::copy_n(y, kState, record[step]);
    Rates<double, kN> k;
    Rates<W, kRows> kj[kCount];
    double z[kN], energy = y[kEnergy];
    Section<double> s;
    Transport<double> a;
#pragma GCC unroll 1
    for (int stage = 0; stage < kStages; ++stage) {
      stageState<kN>(stage, y, k, 0, z);
      model.setForce(rod, steps.start + (step + kNode[stage]) * steps.h);
      energy = multiplyAdd(kA[kStages][stage], singleRate(model, z, s, k[stage]), energy);
      transportAt(model.chart, s, a);
      for (int b = 0; b < kCount; ++b) {
        W eta[kRows];
        stageState<kRows>(stage, state[b], kj[b], 0, eta);
        columnRate(model, a, s, z + 4, eta, columns[b].l, kj[b][stage]);
      }
    }
    stageState<kN>(kStages, y, k, 0, y);
    for (int b = 0; b < kCount; ++b) stageState<kRows>(kStages, state[b], kj[b], 0, state[b]);
    y[kEnergy] = energy;
    renormalise(y);
  }
  for (int b = 0; b < kCount; ++b) {
    for (int i = 0; i < 6; ++i) columns[b].jac[i] = state[b][i];
    for (int i = 6; i < kRows; ++i) columns[b].l[i - 6] = state[b][i];
  }
}

/// Ad_q J, row by row.
template <int N>
TENDRIL_INLINE void columnsInBaseAxes(const double* r, const double* p, const Columns<Lanes<N>>* columns,
                                      double* out) {
  for (int b = 0; b < kBlocks<N>; ++b) {
    const auto* jac = columns[b].jac;
    Lanes<N> w[3], l[3];
    for (int i = 0; i < 3; ++i) {
      w[i] = dot(r[3 * i], jac[0], r[3 * i + 1], jac[1], r[3 * i + 2], jac[2]);
      l[i] = dot(r[3 * i], jac[3], r[3 * i + 1], jac[4], r[3 * i + 2], jac[5]);
    }
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      l[i] = subtractProduct(p[k], w[j], multiplyAdd(p[j], w[k], l[i]));
    }
    const int count = std::min(N, 6 - N * b);
    for (int i = 0; i < 3; ++i) {
      std::copy_n(lanes(w[i]), count, out + 6 * i + N * b);
      std::copy_n(lanes(l[i]), count, out + 6 * (3 + i) + N * b);
    }
  }
}

template <class M, int N>
void singleSegment(const SingleRod& rod, const Steps& steps, double* y, double (*record)[kState],
                   SegmentMatrices& out) {
  M model = modelOf<M>(rod, steps);
  Columns<Lanes<N>> columns[M::kSolutions * kBlocks<N>];
  startColumns<M, N>(model, y, columns);
  walkColumns<M, N>(model, rod, steps, y, record, columns);
  Section<double> s;
  model.setForce(rod, steps.start + steps.count * steps.h);
  sectionAt(model.chart, y, s);
  columnsInBaseAxes<N>(s.r, y + 4, columns, out.x);
  if constexpr (M::kMoments > 0) {
    columnsInBaseAxes<N>(s.r, y + 4, columns + kBlocks<N>, out.u);
    for (int i = 0; i < 6; ++i)
      for (int c = 0; c < 6; ++c) {
        out.lx[6 * i + c] = lanes(columns[c / N].l[i])[c % N];
        out.lu[6 * i + c] = lanes(columns[kBlocks<N> + c / N].l[i])[c % N];
      }
  }
}

template <int N>
void singleJoint(const KernelRod& properties, const AlignedWrench& wrench, double margin, bool stop,
                 JointEnd& end) {
  SingleRod rod = {};
  std::copy_n(properties.compliance, 6, rod.compliance);
  std::copy_n(wrench.moment, 3, rod.moment);
  rod.force[2] = wrench.force;
  const Steps steps = {0, 1.0 / wrench.steps, kStepsPerSegment, properties.kappa0};
  Light model = modelOf<Light>(rod, steps);
  Walk<double> walk = {};
  double y[kState] = {}, left = 0, right = 0;
  std::copy_n(wrench.rotation, 4, y);
  bool unstable = false;
  for (int step = 0; step < wrench.steps && !(stop && unstable); step += kStepsPerSegment) {
    const bool last = step + kStepsPerSegment >= wrench.steps;
    Columns<Lanes<N>> columns[kBlocks<N>];
    startColumns<Light, N>(model, y, columns);
    walkColumns<Light, N>(model, rod, steps, y, nullptr, columns);
    Section<double> s;
    sectionAt(model.chart, y, s);
    double x[36];
    columnsInBaseAxes<N>(s.r, y + 4, columns, x);
    passSegment(model.chart, x, walk);
    unstable = unstable || (!(walk.smallest_pivot > 0) && !last);
    if (last) marginsAtEnd(model.chart, y, margin, walk, left, right);
    moveOrigin(y + 4, model.chart, walk);
    std::fill_n(y + 4, 3, 0.0);
  }
  std::copy_n(y, 4, end.path.rotation);
  std::copy_n(walk.origin, 3, end.path.position);
  end.path.energy = y[kEnergy];
  std::copy_n(walk.k, 36, end.k);
  end.screening = unstable ? Screening::unstable : screeningOf(left, right);
}

template <int N>
const Kernel& makeKernel(const char* name) {
  static const Kernel kernel = {
      name,
      N,
      paths<N>,
      joints<N>,
      [](const SingleRod& rod, const Steps& steps, double* state, double(*record)[kState]) {
        (rod.heavy ? singlePath<Heavy> : singlePath<Light>)(rod, steps, state, record);
      },
      [](const SingleRod& rod, const Steps& steps, double* state, double(*record)[kState],
         SegmentMatrices& out) {
        (rod.heavy ? singleSegment<Heavy, N> : singleSegment<Light, N>)(rod, steps, state, record, out);
      },
      singleJoint<N>};
  return kernel;
}

}  // namespace
}  // namespace tendril::statics
