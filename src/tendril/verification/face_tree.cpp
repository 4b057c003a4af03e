#include "tendril/verification/face_tree.h"

#include <algorithm>
#include <cassert>
#include <numeric>

namespace tendril::verification {
namespace {

constexpr int kLeafFaces = 4;

Bounds boundsOf(const Face& face) {
  Bounds bounds;
  for (const Vector3& corner : face.corners) bounds.include(corner);
  return bounds;
}

Vector3 centreOf(const Face& face) { return (face.corners[0] + face.corners[1] + face.corners[2]) / 3; }

}  // namespace

FaceTree::FaceTree(std::vector<Face> faces) : faces_(std::move(faces)) {
  if (faces_.empty()) return;
  build(0, static_cast<int>(faces_.size()));
  bounds_.reserve(faces_.size());
  for (const Face& face : faces_) bounds_.push_back(boundsOf(face));
}

void FaceTree::build(int first, int count) {
  const auto begin = faces_.begin() + first, end = begin + count;
  Bounds bounds, centres;
  for (auto face = begin; face != end; ++face) {
    for (const Vector3& corner : face->corners) bounds.include(corner);
    centres.include(centreOf(*face));
  }
  const std::size_t index = nodes_.size();
  nodes_.push_back({bounds, 0, first, count});
  if (count <= kLeafFaces) return;

  // Halve along the axis in which the centres are spread most; ties by mesh and number, so the order is
  // reproducible.
  Eigen::Index axis;
  (centres.max - centres.min).maxCoeff(&axis);
  const int half = count / 2;
  std::nth_element(begin, begin + half, end, [axis](const Face& a, const Face& b) {
    const double x = centreOf(a)[axis], y = centreOf(b)[axis];
    if (x != y) return x < y;
    return a.mesh != b.mesh ? a.mesh < b.mesh : a.number < b.number;
  });
  nodes_[index].count = 0;
  build(first, half);
  nodes_[index].right = static_cast<int>(nodes_.size());
  build(first + half, count - half);
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
