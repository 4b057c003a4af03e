/// The built-in ways to extend. Private to planner.
#pragma once

#include "tendril/planner/extend.h"

namespace tendril {

inline constexpr double kPiece = 0.15;  // L

/// One pull (piece > 0) or push of `end` along its own tangent, as it turns: `pieces` steps of |piece| L, the
/// other end free.
[[nodiscard]] ExtendStrategy::Steps along(const RodProperties& rod, End end, double piece, int pieces);
/// The end `end` to `target` in a straight line, in steps of kPiece L, the other end free.
[[nodiscard]] ExtendStrategy::Steps lead(const RodProperties& rod, End end, const Pose& target);

/// Algorithm 1 toward the sample, a random end leading (share 0.75); a random end along its own tangent, out
/// or in (0.25).
[[nodiscard]] std::vector<StrategyShare> builtInStrategies(double along_share);

}  // namespace tendril
