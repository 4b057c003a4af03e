/// Where a motion must begin and where it must end.
#pragma once

#include "tendril/solution.h"
#include "tendril/verification.h"
#include "tendril/verification/face_tree.h"

namespace tendril::verification {

/// The first state is the scenario's start to 2e-3 L and 0.02 rad: every node, against the start's
/// equilibrium under the scenario's gravity. Of a simulation, which may start from any shape, only the frames
/// which the start itself gives: the first node's, or both ends'.
[[nodiscard]] Check checkStart(const Solution& solution, const FaceTree& faces);

/// The last state is in the goal region. Fails with "not reached" if the solution does not claim to be
/// solved.
[[nodiscard]] Check checkGoal(const Solution& solution, const FaceTree& faces);

}  // namespace tendril::verification
