/// What the motion that came nearest lacks to the goal, and what stops it there. Private to planner.
#pragma once

#include <functional>

#include "tendril/planner/goal.h"
#include "tendril/solution.h"

namespace tendril {

class Obstacles;

/// Judges `last`, the last shape of a motion that did not reach the goal: measures its distance, and finds
/// out by simulation what stops it when its grippers carry on toward the goal (README.md, "What stops it").
/// `stop` is asked before every step; once it says so, `limit` stays empty. Deterministic if `stop` is.
[[nodiscard]] Shortfall shortfallOf(const Scenario& scenario, const Obstacles& obstacles,
                                    const GoalTest& goal, const RodShape& last,
                                    const std::function<bool()>& stop);

}  // namespace tendril
