#include "tendril/verification/face_tree.h"

#include <algorithm>
#include <cassert>

namespace tendril::verification {
namespace {

constexpr std::size_t kLeafFaces = 4;

Bounds boundsOf(const Face& face) {
  Bounds bounds;
  for (const Vector3& corner : face.corners) bounds.include(corner);
  return bounds;
}

Vector3 centreOf(const Face& face) { return (face.corners[0] + face.corners[1] + face.corners[2]) / 3; }

}  // namespace

FaceTree::FaceTree(std::vector<Face> faces) {
  if (faces.empty()) return;
  std::vector<Item> items;
  items.reserve(faces.size());
  for (const Face& face : faces) items.push_back({centreOf(face), static_cast<int>(items.size())});
  std::vector<Bounds> bounds(faces.size());
  std::transform(faces.begin(), faces.end(), bounds.begin(), boundsOf);
  build(bounds, items, 0);
  faces_.reserve(faces.size()), bounds_.reserve(faces.size());
  for (const Item& item : items) {
    faces_.push_back(faces[static_cast<std::size_t>(item.face)]);
    bounds_.push_back(bounds[static_cast<std::size_t>(item.face)]);
  }
}

Bounds FaceTree::build(std::span<const Bounds> bounds, std::span<Item> items, int first) {
  const std::size_t index = nodes_.size();
  nodes_.push_back({{}, 0, first, static_cast<int>(items.size())});
  Bounds all;
  if (items.size() <= kLeafFaces) {
    for (const Item& item : items) all.include(bounds[static_cast<std::size_t>(item.face)]);
  } else {
    // Halve along the axis in which the centres are spread most; ties by number, so the order is
    // reproducible.
    Bounds centres;
    for (const Item& item : items) centres.include(item.centre);
    Eigen::Index axis;
    (centres.max - centres.min).maxCoeff(&axis);
    const std::size_t half = items.size() / 2;
    std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(half), items.end(),
                     [axis](const Item& a, const Item& b) {
                       return a.centre[axis] != b.centre[axis] ? a.centre[axis] < b.centre[axis]
                                                               : a.face < b.face;
                     });
    nodes_[index].count = 0;
    all = build(bounds, items.first(half), first);
    nodes_[index].right = static_cast<int>(nodes_.size());
    all.include(build(bounds, items.subspan(half), first + static_cast<int>(half)));
  }
  return nodes_[index].bounds = all;
}

void FaceTree::facesNear(const Bounds& box, double margin, std::vector<const Face*>& out) const {
  out.clear();
  if (nodes_.empty()) return;
  std::array<int, 64> waiting;  // the tree is halved at each level, so its depth is below 32
  std::size_t count = 0;
  waiting[count++] = 0;
  while (count > 0) {
    const int index = waiting[--count];
    const Node& node = nodes_[static_cast<std::size_t>(index)];
    if (!node.bounds.near(box, margin)) continue;
    if (node.count == 0) {
      assert(count + 2 <= waiting.size());
      waiting[count++] = node.right;
      waiting[count++] = index + 1;
      continue;
    }
    for (int k = node.first; k < node.first + node.count; ++k) {
      const auto face = static_cast<std::size_t>(k);
      if (bounds_[face].near(box, margin)) out.push_back(&faces_[face]);
    }
  }
}

}  // namespace tendril::verification
