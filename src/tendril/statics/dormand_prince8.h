/// The explicit Runge-Kutta method of order 8 with 12 stages of Dormand and Prince (the DOP853 tableau;
/// Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd ed. 1993, section II.5), for
/// states made of several blocks. Private to the statics.
#pragma once

#include <array>
#include <utility>

#include "tendril/lanes.h"

namespace tendril::statics {
namespace {

inline constexpr int kStages = 12;

/// The state of stage s is y + sum_j kA[s][j] k_j, with rates k_j times the step; that of "stage" 12 is the
/// step's end.
inline constexpr double kA[kStages + 1][kStages] = {
    {},
    {5.26001519587677318785587544488e-2},
    {1.97250569845378994544595329183e-2, 5.91751709536136983633785987549e-2},
    {2.95875854768068491816892993775e-2, 0, 8.87627564304205475450678981324e-2},
    {2.41365134159266685502369798665e-1, 0, -8.84549479328286085344864962717e-1,
     9.24834003261792003115737966543e-1},
    {3.7037037037037037037037037037e-2, 0, 0, 1.70828608729473871279604482173e-1,
     1.25467687566822425016691814123e-1},
    {3.7109375e-2, 0, 0, 1.70252211019544039314978060272e-1, 6.02165389804559606850219397283e-2,
     -1.7578125e-2},
    {3.70920001185047927108779319836e-2, 0, 0, 1.70383925712239993810214054705e-1,
     1.07262030446373284651809199168e-1, -1.53194377486244017527936158236e-2,
     8.27378916381402288758473766002e-3},
    {6.24110958716075717114429577812e-1, 0, 0, -3.36089262944694129406857109825,
     -8.68219346841726006818189891453e-1, 2.75920996994467083049415600797e1,
     2.01540675504778934086186788979e1, -4.34898841810699588477366255144e1},
    {4.77662536438264365890433908527e-1, 0, 0, -2.48811461997166764192642586468,
     -5.90290826836842996371446475743e-1, 2.12300514481811942347288949897e1,
     1.52792336328824235832596922938e1, -3.32882109689848629194453265587e1,
     -2.03312017085086261358222928593e-2},
    {-9.3714243008598732571704021658e-1, 0, 0, 5.18637242884406370830023853209,
     1.09143734899672957818500254654, -8.14978701074692612513997267357, -1.85200656599969598641566180701e1,
     2.27394870993505042818970056734e1, 2.49360555267965238987089396762, -3.0467644718982195003823669022},
    {2.27331014751653820792359768449, 0, 0, -1.05344954667372501984066689879e1,
     -2.00087205822486249909675718444, -1.79589318631187989172765950534e1, 2.79488845294199600508499808837e1,
     -2.85899827713502369474065508674, -8.87285693353062954433549289258, 1.23605671757943030647266201528e1,
     6.43392746015763530355970484046e-1},
    {5.42937341165687622380535766363e-2, 0, 0, 0, 0, 4.45031289275240888144113950566,
     1.89151789931450038304281599044, -5.8012039600105847814672114227, 3.1116436695781989440891606237e-1,
     -1.52160949662516078556178806805e-1, 2.01365400804030348374776537501e-1,
     4.47106157277725905176885569043e-2}};

/// Where in the step each stage lies.
inline constexpr std::array<double, kStages> kNode = [] {
  std::array<double, kStages> node{};
  for (int s = 0; s < kStages; ++s)
    for (int j = 0; j < s; ++j) node[s] += kA[s][j];
  return node;
}();

/// The rates of stages 1 and 2 are not asked for any more when those of 5 and 6 come: 10 places do, and stay
/// in the processor's first cache.
inline constexpr int kPlaces = 10;
inline constexpr int kPlace[kStages] = {0, 1, 2, 3, 4, 1, 2, 5, 6, 7, 8, 9};

/// The rates (times the step) of a block of N numbers.
template <class T, int N>
struct Rates {
  T at[kPlaces][N];
  TENDRIL_INLINE T* operator[](int s) { return at[kPlace[s]]; }
  TENDRIL_INLINE const T* operator[](int s) const { return at[kPlace[s]]; }
};

/// The terms of all stages, one stage after the other, those with coefficient 0 left out.
struct Terms {
  int first[kStages + 2];
  struct Term {
    double coefficient;
    int place;
  } term[kStages * (kStages + 1) / 2];
};
inline constexpr Terms kTerms = [] {
  Terms terms{};
  int count = 0;
  for (int s = 0; s <= kStages; ++s) {
    terms.first[s] = count;
    for (int j = 0; j < s; ++j)
      if (kA[s][j] != 0) terms.term[count++] = {kA[s][j], kPlace[j]};
  }
  terms.first[kStages + 1] = count;
  return terms;
}();

/// The `Count` numbers of stage s's state from `start` on, from the rates of the stages before. Together, so
/// that a coefficient is loaded once for all of them.
template <int Count, class T, int N>
TENDRIL_INLINE void stageState(int s, const T* y, const Rates<T, N>& k, int start, T* out) {
  T sum[Count];
#pragma GCC unroll 16
  for (int i = 0; i < Count; ++i) sum[i] = y[start + i];
#pragma GCC unroll 1
  for (int t = kTerms.first[s]; t < kTerms.first[s + 1]; ++t) {
    const T coefficient = broadcast<T>(kTerms.term[t].coefficient);
    const T* rate = k.at[kTerms.term[t].place] + start;
#pragma GCC unroll 16
    for (int i = 0; i < Count; ++i) sum[i] = multiplyAdd(coefficient, rate[i], sum[i]);
  }
#pragma GCC unroll 16
  for (int i = 0; i < Count; ++i) out[i] = sum[i];
}

/// f.operator()<0>(), f.operator()<1>(), ... f.operator()<Count - 1>()
template <int Count, class F>
TENDRIL_INLINE void forEach(F&& f) {
  [&]<std::size_t... I>(std::index_sequence<I...>) __attribute__((always_inline)) {
    (f.template operator()<static_cast<int>(I)>(), ...);
  }
  (std::make_index_sequence<Count>{});
}

/// The same without loops, for a step that is short enough to stay in the processor's instruction cache.
template <int S, class T, int N>
TENDRIL_INLINE void unrolledStageState(const T* y, const Rates<T, N>& k, T* out) {
  T sum[N];
#pragma GCC unroll 16
  for (int i = 0; i < N; ++i) sum[i] = y[i];
  forEach<S>([&]<int J>() __attribute__((always_inline)) {
    if constexpr (kA[S][J] != 0)
#pragma GCC unroll 16
      for (int i = 0; i < N; ++i) sum[i] = multiplyAdd(kA[S][J], k[J][i], sum[i]);
  });
#pragma GCC unroll 16
  for (int i = 0; i < N; ++i) out[i] = sum[i];
}

}  // namespace
}  // namespace tendril::statics
