/// The broad phase: a tree of axis-aligned boxes over the faces, for box queries. Private to the module.
#pragma once

#include <span>
#include <vector>

#include "tendril/geometry.h"

namespace tendril {

/// A bounding volume hierarchy with four children a node. Embree finds the splits (surface area heuristic);
/// layout and traversal are here. Boxes are single precision, rounded outward, so nothing is missed. Every
/// item sits under a box of its own, so that the answer depends on the items' boxes alone and not on how the
/// tree was split.
class BoxTree {
 public:
  /// Item i has the box boxes[i], finite. No boxes: a tree that finds nothing.
  explicit BoxTree(std::span<const Aabb> boxes);

  /// Appends to `out`, each once, in no order to rely on, every item whose box meets `box`.
  void find(const Aabb& box, std::vector<int>& out) const;
  /// The same for those whose box may come near the capsule, too: no plane across the way from its axis to
  /// the box's middle lies between them.
  void find(const Aabb& box, const Capsule& capsule, std::vector<int>& out) const;

 private:
  using Float4 = float __attribute__((vector_size(16)));
  using Int4 = int __attribute__((vector_size(16)));
  struct FloatBox {
    float min[3], max[3];
  };
  /// Two cache lines: the boxes of four children, and what they are: the number of a node, or ~i for item i.
  struct alignas(64) Node {
    Float4 min[3],
        max[3];  // one coordinate of the four children; children that do not exist have an empty box
    int child[4];
  };
  template <class MayMeet>
  void visit(const Aabb& box, const MayMeet& may_meet, std::vector<int>& out) const;

  [[nodiscard]] static FloatBox roundedOutward(const Aabb& box);
  struct Builder;
  [[nodiscard]] Node& node(int number) { return nodes_[static_cast<std::size_t>(number)]; }
  void setBox(int node, unsigned k, const FloatBox& box);  // of child k

  float largest_ = 0;  // coordinate
  int root_ = 0;
  std::vector<Node> nodes_;  // as they were built: each before its descendants
};

}  // namespace tendril
