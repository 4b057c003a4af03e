/// tendril/verification.h: checks a solution from its file and its meshes alone.
///
/// Shares no code with the simulator, the planner or the broad phase: its own search for the triangles that
/// matter, its own distances, its own bound on the motion between stored states.
/// src/tendril/verification/README.md has the proof.
#pragma once

#include "tendril/solution.h"

namespace tendril {

struct Check {
  /// structure, times, controls, held, speed, quaternions, frames, stretch, steps, workspace, clearance,
  /// self_contact (only if the scenario asks for it), start, goal (not for a simulation).
  std::string name;
  bool passed = false;
  std::string message;  // what was measured, and where it fails: state, time, node, face, millimetres
};

struct VerificationReport {
  std::vector<Check> checks;
  /// A lower bound of (distance to the meshes - radius) over the whole motion [m], proved; at most 5 % or
  /// 1e-8 L below what is attained, and L/10 where nothing is nearer. In [-1e-8 L, L/10] if "clearance"
  /// passed; if it failed, the value where it fails; 0 if it could not be judged.
  double smallest_clearance = 0;
  [[nodiscard]] bool valid() const {
    for (const Check& check : checks)
      if (!check.passed) return false;
    return !checks.empty();
  }
};

/// Holds the whole motion to the claims of docs/solution.md. A motion whose form is broken ("structure"
/// fails) is judged no further; times that do not increase leave out what needs them. Throws InputError only
/// if a mesh cannot be read or its sha256 differs from the recorded one.
[[nodiscard]] VerificationReport verify(const Solution& solution);

}  // namespace tendril
