/// The claims about a motion that need no mesh: its form, its times, its rod, its grippers.
#pragma once

#include "tendril/solution.h"
#include "tendril/verification.h"

namespace tendril::verification {

/// Whether the motion can be looked at at all: equally many times, held lists and states, at least one;
/// elements + 1 nodes in each; every number finite. The other checks presume it.
[[nodiscard]] Check checkStructure(const Solution& solution);

/// Times begin at 0 and increase strictly.
[[nodiscard]] Check checkTimes(const Trajectory& trajectory);
/// | |q| - 1 | <= 1e-9 for every node of every state.
[[nodiscard]] Check checkQuaternions(const Trajectory& trajectory);
/// Every element's direction lies within 0.5 rad of the mean of its two nodes' x axes.
[[nodiscard]] Check checkFrames(const Trajectory& trajectory);
/// Every node inside the workspace: a box is convex, so also between states.
[[nodiscard]] Check checkWorkspace(const Trajectory& trajectory, const Box& workspace);
/// Every element 0.8 to 1.25 of L/N long at every moment.
[[nodiscard]] Check checkStretch(const Trajectory& trajectory, const RodProperties& rod);
/// No node moves more than 0.25 L from one state to the next.
[[nodiscard]] Check checkSteps(const Trajectory& trajectory, const RodProperties& rod);

/// Controls follow one another without gaps from 0 to the last time; each holds what the scenario allows,
/// moves only what it holds, and its target is a pose.
[[nodiscard]] Check checkControls(const Solution& solution);
/// trajectory.held is what the controls hold; a held end that does not move keeps its pose to 0.02 L and 0.1
/// rad.
[[nodiscard]] Check checkHeld(const Solution& solution);
/// No end moves or turns faster than 1.5 times the limits between two states while it is held.
[[nodiscard]] Check checkSpeed(const Solution& solution);

}  // namespace tendril::verification
