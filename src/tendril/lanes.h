/// tendril/lanes.h: doubles that are worked on side by side, and the instruction sets to do it with.
///
/// Lanes<N> are N doubles, one rod each (or one element, or one column of a matrix); Lanes<1> is a plain
/// double. Code is written once for any N, compiled once for each instruction set (the kernels) and chosen
/// when the program starts. Every operation acts lane by lane and rounds as that of a double does, so a
/// lane's numbers depend neither on N, nor on its neighbours, nor on the instruction set.
#pragma once

#include <cmath>
#include <span>
#include <type_traits>

#ifdef __FMA__
#include <immintrin.h>
#endif

#define TENDRIL_INLINE [[gnu::always_inline]] inline

namespace tendril {

enum class InstructionSet { portable, avx2, avx512 };

/// Those that this build knows and this machine can run, the narrowest first.
[[nodiscard]] std::span<const InstructionSet> instructionSets();
/// The widest, or what the environment's TENDRIL_KERNEL says (portable, avx2 or avx512). Throws InputError if
/// it is none of the above.
[[nodiscard]] InstructionSet instructionSet();
[[nodiscard]] const char* name(InstructionSet set);

namespace {  // a copy for every file that includes this: each is compiled for its own instruction set

template <int N>
struct LanesOf {
  using type [[gnu::vector_size(N * sizeof(double))]] = double;
};
template <>
struct LanesOf<1> {
  using type = double;
};
template <int N>
using Lanes = typename LanesOf<N>::type;

template <class T>
inline constexpr int kWidth = sizeof(T) / sizeof(double);

/// The lanes of v, one after the other.
template <class T>
TENDRIL_INLINE double* lanes(T& v) {
  return reinterpret_cast<double*>(&v);
}
template <class T>
TENDRIL_INLINE const double* lanes(const T& v) {
  return reinterpret_cast<const double*>(&v);
}

template <class T>
TENDRIL_INLINE T broadcast(double value) {
  return value - T{};  // which is value, whatever its sign
}

/// a b + c, rounded once. A factor may be a double where the others are lanes.
template <class A, class B, class T>
TENDRIL_INLINE T multiplyAdd(const A& a, const B& b, const T& c) {
  if constexpr (!std::is_same_v<A, T>) {
    return multiplyAdd(broadcast<T>(a), b, c);
  } else if constexpr (!std::is_same_v<B, T>) {
    return multiplyAdd(a, broadcast<T>(b), c);
#ifdef __AVX512F__
  } else if constexpr (kWidth<T> == 8) {
    return _mm512_fmadd_pd(a, b, c);
#endif
#ifdef __FMA__
  } else if constexpr (kWidth<T> == 4) {
    return _mm256_fmadd_pd(a, b, c);
#endif
  } else {
    T out;
    for (int l = 0; l < kWidth<T>; ++l) lanes(out)[l] = std::fma(lanes(a)[l], lanes(b)[l], lanes(c)[l]);
    return out;
  }
}
/// c - a b, rounded once.
template <class A, class B, class T>
TENDRIL_INLINE T subtractProduct(const A& a, const B& b, const T& c) {
  return multiplyAdd(-a, b, c);
}
/// a b - c d; the first product is rounded, then the result.
template <class A, class B>
TENDRIL_INLINE auto differenceOfProducts(const A& a, const B& b, const A& c, const B& d) {
  return subtractProduct(c, d, a * b);
}
/// a0 b0 + a1 b1 + a2 b2.
template <class A, class B>
TENDRIL_INLINE auto dot(const A& a0, const B& b0, const A& a1, const B& b1, const A& a2, const B& b2) {
  return multiplyAdd(a2, b2, multiplyAdd(a1, b1, a0 * b0));
}
template <class T>
TENDRIL_INLINE T smaller(const T& a, const T& b) {
  return a < b ? a : b;
}
template <class T>
TENDRIL_INLINE T larger(const T& a, const T& b) {
  return a < b ? b : a;
}
template <class T>
TENDRIL_INLINE T squareRoot(const T& v) {
  T out;
  for (int l = 0; l < kWidth<T>; ++l) lanes(out)[l] = std::sqrt(lanes(v)[l]);
  return out;
}

}  // namespace
}  // namespace tendril
