/// tendril/verification.h: checks a solution from its file and its meshes alone.
///
/// Shares no code with the simulator, the planner or the broad phase: its own loops over the triangles, its own
/// distances, its own bound on the motion between stored states.
#pragma once

#include "tendril/solution.h"

namespace tendril {

struct Check {
  std::string name;      // "clearance", "start", "goal", ...
  bool passed = false;
  std::string message;   // what was measured, and where it fails: state, time, node, face, millimetres
};

struct VerificationReport {
  std::vector<Check> checks;
  double smallest_clearance = 0;  // m, a lower bound of (distance - radius) over the whole motion
  [[nodiscard]] bool valid() const {
    for (const Check& check : checks)
      if (!check.passed) return false;
    return !checks.empty();
  }
};

/// Holds the whole motion to the claims of docs/solution.md. Throws InputError only if a mesh cannot be read or its
/// sha256 differs from the recorded one.
[[nodiscard]] VerificationReport verify(const Solution& solution);

}  // namespace tendril
