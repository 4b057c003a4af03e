/// tendril/lanes.h: doubles that are worked on side by side, and the instruction sets to do it with.
///
/// Lanes<N> are N doubles, one rod each (or one element, or one column of a matrix); Lanes<1> is a plain
/// double. Code is written once for any N, compiled once for each instruction set (the kernels) and chosen
/// when the program starts. Every operation acts lane by lane and rounds as that of a double does, so a
/// lane's numbers depend neither on N, nor on its neighbours, nor on the instruction set.
#pragma once

#include <cmath>
#include <span>

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
  return T{} + value;
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
