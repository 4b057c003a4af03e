/// The built-in ways to extend. Private to planner.
#pragma once

#include "tendril/planner/extend.h"

namespace tendril {

/// What the rod would turn by at rest [rad] were it curved everywhere as where it is curved most.
[[nodiscard]] double restTurn(const RodProperties& rod);
/// The pieces by which an end is led, in L: 0.15, but no longer than a coil turns by 1 rad at rest. Longer
/// ones would lead its end off the line along which it unwinds.
[[nodiscard]] double pieceOf(const RodProperties& rod);

/// One pull (piece > 0) or push of `end` along its own tangent, as it turns: `pieces` steps of |piece| L, the
/// other end free.
[[nodiscard]] ExtendStrategy::Steps along(const RodProperties& rod, End end, double piece, int pieces);
/// The end `end` to `target` in a straight line, in steps of pieceOf(rod) L, the other end free.
[[nodiscard]] ExtendStrategy::Steps lead(const RodProperties& rod, End end, const Pose& target);

/// Algorithm 1 toward the sample, a random end leading (share 0.75); a random end along its own tangent, out
/// or in (0.25).
[[nodiscard]] std::vector<StrategyShare> builtInStrategies(double along_share);

}  // namespace tendril
