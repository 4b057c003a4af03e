#include "tendril/planner/rod_index.h"

#include <algorithm>
#include <limits>

namespace tendril {
namespace {

Vector3 centroidOf(const RodShape& shape) {
  Vector3 sum = Vector3::Zero();
  for (const Pose& node : shape) sum += node.position;
  return sum / static_cast<double>(shape.size());
}

}  // namespace

RodIndex::RodIndex() {
  centroids_.setDistanceFunction(
      [](const Centroid& a, const Centroid& b) { return (a.position - b.position).norm(); });
}

void RodIndex::add(const RodShape& shape) {
  centroids_.add({centroidOf(shape), static_cast<int>(rods_.size())});
  rods_.push_back({&shape, 0});
}

void RodIndex::clear() {
  rods_.clear();
  centroids_.clear();
}

int RodIndex::nearest(const RodShape& target, double penalty) const {
  const Centroid centroid{centroidOf(target), -1};
  int best = -1;
  double least = std::numeric_limits<double>::infinity();
  const auto away = [&](const Centroid& c) { return (c.position - centroid.position).norm(); };
  // By growing distance of the centroids, until none of those left can be nearer: failures only add to (6).
  found_.clear();
  std::size_t looked_at = 0;
  for (std::size_t count = 8; found_.size() < rods_.size(); count *= 4) {
    centroids_.nearestK(centroid, count, found_);
    for (std::size_t i = looked_at; i < found_.size(); ++i) {
      if (away(found_[i]) > least) return best;
      const Rod& rod = rods_[static_cast<std::size_t>(found_[i].rod)];
      const double distance = (1 + penalty * rod.failures) * meanNodeDistance(*rod.shape, target);
      if (distance < least || (distance == least && found_[i].rod < best))
        least = distance, best = found_[i].rod;
    }
    // Of those as far away as the last, the next search may put others first.
    const auto first_tie = std::partition_point(
        found_.begin(), found_.end(), [&](const Centroid& c) { return away(c) < away(found_.back()); });
    looked_at = static_cast<std::size_t>(first_tie - found_.begin());
  }
  return best;
}

bool RodIndex::hasWithin(const RodShape& target, double distance) const {
  centroids_.nearestR({centroidOf(target), -1}, distance, found_);
  return std::any_of(found_.begin(), found_.end(), [&](const Centroid& near) {
    return meanNodeDistance(*rods_[static_cast<std::size_t>(near.rod)].shape, target) < distance;
  });
}

}  // namespace tendril
