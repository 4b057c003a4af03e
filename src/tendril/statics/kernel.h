/// The inner loops of the chart, compiled once for each instruction set from one source (kernel_lanes.h) and
/// chosen when the program starts. All of them give the same numbers, bit for bit. Private to the statics.
#pragma once

#include <cstddef>
#include <span>

namespace tendril::statics {

/// What the kernels know of a rod, in its own units.
struct KernelRod {
  double compliance[6];  // 1/c
  double kappa0[3];      // curvature at rest
};

/// The wrench a at the base in base axes whose z axis is along its force, the first node's rotation in these
/// axes, and the number of steps (even).
struct AlignedWrench {
  double moment[3], force;
  double rotation[4];  // x y z w
  int steps;
};

/// The place of the last section in the base axes of AlignedWrench, and the rod's energy.
struct PathEnd {
  double rotation[4], position[3], energy;
};

/// What a walk along the rod's segments says: the last segment's P is definite by more than a margin of time,
/// is not by more than the margin (or an earlier one's is not), or neither.
enum class Screening { stable, unstable, unsure };

struct JointEnd {
  PathEnd path;
  double k[36];  // K(1) row by row, in base axes about the last section; undefined if the walk stopped early
  Screening screening;
};

/// The number of steps in a segment.
inline constexpr int kStepsPerSegment = 2;
/// One rod to walk along. A weightless rod has `weight` 0 and base axes turned as those of AlignedWrench; a
/// heavy one may have any.
struct SingleRod {
  double compliance[6];
  double moment[3], force[3], weight[3];
  double rotation[4];  // of the first node, x y z w
  bool heavy;
};

/// The state along one rod, x y z w | position | P (the integral of the position; heavy rods) | energy.
inline constexpr int kState = 11, kEnergy = 10;

/// Steps of one rod: `count` of length h from the place `start` on, with curvature kappa0 at rest.
struct Steps {
  double start, h;
  int count;
  const double* kappa0;
};

/// Two solutions (K, L) along one segment that starts at position 0 (README.md, 4 and 9), row by row: X, Lx
/// from (0, 1) and U, Lu from (1, 0). Only X is filled in for a weightless rod, of which Lx = 1, U = 1 + X B,
/// Lu = 0.
struct SegmentMatrices {
  double x[36], lx[36], u[36], lu[36];
};

struct Kernel {
  const char* name;
  int lanes;
  /// The ends of many weightless rods.
  void (*paths)(const KernelRod&, std::span<const AlignedWrench>, PathEnd* ends);
  /// The ends of many weightless rods with K(1) and the screening with this margin, a fraction of the length.
  /// `stop`: give up a rod, and leave its end and K undefined, as soon as it is found unstable.
  void (*joints)(const KernelRod&, std::span<const AlignedWrench>, double margin, bool stop, JointEnd* ends);
  /// Walks along one rod from `state`, which becomes the end's; `record` (if any) gets the state at the start
  /// of every step.
  void (*path)(const SingleRod&, const Steps&, double* state, double (*record)[kState]);
  /// The same with the segment's matrices.
  void (*segment)(const SingleRod&, const Steps&, double* state, double (*record)[kState],
                  SegmentMatrices& out);
  /// What `joints` says, of one rod.
  void (*joint)(const KernelRod&, const AlignedWrench&, double margin, bool stop, JointEnd& end);
};

/// The fastest kernel this machine can run; TENDRIL_KERNEL=portable|avx2|avx512 in the environment asks for
/// another.
[[nodiscard]] const Kernel& kernel();
/// All the kernels this machine can run, slowest first.
[[nodiscard]] std::span<const Kernel* const> availableKernels();

}  // namespace tendril::statics
