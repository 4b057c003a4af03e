/// The goal region: gripper frames, and the shape where the scenario asks for it. Private to planner.
#pragma once

#include "tendril/scenario.h"

namespace tendril {

class GoalTest {
 public:
  /// `shape` is the goal's, with any number of elements; it is resampled to the shapes that are tested.
  GoalTest(const Goal& goal, RodShape shape, int elements)
      : position_(goal.position_tolerance),
        angle_(goal.angle_tolerance),
        shape_tolerance_(goal.shape_tolerance),
        shape_(resample(shape, elements)) {}

  [[nodiscard]] bool operator()(const RodShape& rod) const {
    for (const End end : kBothEnds) {
      const Pose &q = endPose(rod, end), &target = endPose(shape_, end);
      if ((q.position - target.position).norm() > position_) return false;
      if (angle_ && angleBetween(q.rotation, target.rotation) > *angle_) return false;
    }
    return !shape_tolerance_ || maxNodeDistance(rod, shape_) <= *shape_tolerance_;
  }
  /// Distance (6) to the goal's shape [m].
  [[nodiscard]] double distance(const RodShape& rod) const { return meanNodeDistance(rod, shape_); }
  [[nodiscard]] const RodShape& shape() const { return shape_; }

 private:
  double position_;
  std::optional<double> angle_, shape_tolerance_;
  RodShape shape_;
};

}  // namespace tendril
