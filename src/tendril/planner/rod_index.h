/// Which of many rods is nearest. Private to planner.
#pragma once

#include <iostream>  // which the next header needs and does not include

#include <ompl/datastructures/NearestNeighborsGNATNoThreadSafety.h>

#include <vector>

#include "tendril/rod.h"

namespace tendril {

/// Rods, numbered from 0 as they are added, by distance (6). They are looked for through their centroids,
/// whose distance bounds (6) from below.
class RodIndex {
 public:
  RodIndex();
  /// Refers to the shape, which must stay where it is. All have the same number of nodes.
  void add(const RodShape& shape);
  void clear();
  /// Counts a failed growth from rod k, one of those added.
  void fail(int k) { ++rods_[static_cast<std::size_t>(k)].failures; }
  /// The number of the rod that minimises the distance times 1 + penalty (>= 0) times its failures; of
  /// several the one that was added first; -1 if there is none.
  [[nodiscard]] int nearest(const RodShape& target, double penalty) const;
  /// Whether one is nearer than `distance` [m].
  [[nodiscard]] bool hasWithin(const RodShape& target, double distance) const;

 private:
  struct Rod {
    const RodShape* shape;
    int failures;
  };
  struct Centroid {
    Vector3 position;
    int rod;
    bool operator==(const Centroid&) const = default;
  };
  std::vector<Rod> rods_;
  ompl::NearestNeighborsGNATNoThreadSafety<Centroid> centroids_;
  mutable std::vector<Centroid> found_;  // scratch
};

}  // namespace tendril
