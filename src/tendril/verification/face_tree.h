/// The faces of all meshes, and those near a box: a tree of boxes of the checker's own, in double precision.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "tendril/base.h"

namespace tendril::verification {

struct Face {
  std::array<Vector3, 3> corners;  // m, world
  Vector3 normal;                  // unit, either side; zero if it cannot be computed
  int mesh;                        // which of the scenario's meshes
  int number;                      // which face of that mesh, as loaded
};

/// An axis-aligned box [m].
struct Bounds {
  Vector3 min = Vector3::Constant(std::numeric_limits<double>::infinity());
  Vector3 max = Vector3::Constant(-std::numeric_limits<double>::infinity());

  void include(const Vector3& p) { min = min.cwiseMin(p), max = max.cwiseMax(p); }
  void include(const Bounds& other) { min = min.cwiseMin(other.min), max = max.cwiseMax(other.max); }
  /// False only if the boxes are more than `margin` apart along an axis, and so all points in them.
  [[nodiscard]] bool near(const Bounds& other, double margin) const {
    return (min.array() - margin <= other.max.array()).all() &&
           (other.min.array() - margin <= max.array()).all();
  }
};

/// Immutable once built.
class FaceTree {
 public:
  explicit FaceTree(std::vector<Face> faces);

  [[nodiscard]] std::span<const Face> faces() const { return faces_; }

  /// Replaces `out` by every face whose box is near `box` (see Bounds::near): no face nearer than `margin` to
  /// any point of `box` is left out. In the tree's own order, which depends on the faces alone.
  void facesNear(const Bounds& box, double margin, std::vector<const Face*>& out) const;

 private:
  /// Inner nodes: the left child follows, `right` is the other. Leaves: faces [first, first + count).
  struct Node {
    Bounds bounds;
    int right = 0;
    int first = 0, count = 0;
  };
  /// A face while the tree is built.
  struct Item {
    Vector3 centre;
    int face;
  };
  /// Adds the tree of `items`, which it sorts and which come `first` in the order; returns their bounds.
  Bounds build(std::span<const Bounds> bounds, std::span<Item> items, int first);

  std::vector<Face> faces_;
  std::vector<Bounds> bounds_;  // one per face
  std::vector<Node> nodes_;
};

}  // namespace tendril::verification
