#include "tendril/geometry/box_tree.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <memory>
#include <new>
#include <stdexcept>
#include <type_traits>

namespace tendril {
namespace {

constexpr unsigned kBranching = 4;
constexpr unsigned kDepth = 64;  // Embree splits by halves when it comes near this
constexpr std::size_t kStack =
    kDepth * (kBranching - 1) + 1;  // what depth-first traversal can have to remember

/// A node or, without children, a leaf as Embree's builder makes them; lives until the tree is flattened.
struct BuildNode {
  unsigned children_count = 0;
  unsigned item = 0;
  const BuildNode* children[kBranching] = {};
  RTCBounds bounds[kBranching] = {};
};

void* createNode(RTCThreadLocalAllocator allocator, unsigned children_count, void*) {
  auto* node = new (rtcThreadLocalAlloc(allocator, sizeof(BuildNode), 16)) BuildNode;
  node->children_count = children_count;
  return node;
}

void* createLeaf(RTCThreadLocalAllocator allocator, const RTCBuildPrimitive* primitives, std::size_t count,
                 void*) {
  assert(count == 1);
  static_cast<void>(count);
  auto* leaf = new (rtcThreadLocalAlloc(allocator, sizeof(BuildNode), 16)) BuildNode;
  leaf->item = primitives->primID;
  return leaf;
}

void setChildren(void* node, void** children, unsigned count, void*) {
  for (unsigned k = 0; k < count; ++k)
    static_cast<BuildNode*>(node)->children[k] = static_cast<const BuildNode*>(children[k]);
}

void setBounds(void* node, const RTCBounds** bounds, unsigned count, void*) {
  for (unsigned k = 0; k < count; ++k) static_cast<BuildNode*>(node)->bounds[k] = *bounds[k];
}

/// A float not above x: at most two units in the last place below it. Boxes end at the range of float.
float roundedDown(double x) {
  constexpr double kLargest = 1e38;
  const auto nearest = static_cast<float>(std::clamp(x, -kLargest, kLargest));
  return nearest -
         (std::abs(nearest) * std::numeric_limits<float>::epsilon() + std::numeric_limits<float>::min());
}
float roundedUp(double x) { return -roundedDown(-x); }

using Float4 = float __attribute__((vector_size(16)));
constexpr float kRounding = std::numeric_limits<float>::epsilon();
Float4 all(float x) { return Float4{x, x, x, x}; }

}  // namespace

BoxTree::FloatBox BoxTree::roundedOutward(const Aabb& box) {
  FloatBox result;
  for (int i = 0; i < 3; ++i) result.min[i] = roundedDown(box.min[i]), result.max[i] = roundedUp(box.max[i]);
  return result;
}

BoxTree::BoxTree(std::span<const Aabb> boxes) {
  if (boxes.empty()) return;
  std::vector<RTCBuildPrimitive> items(boxes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const FloatBox box = roundedOutward(boxes[i]);
    items[i] = {box.min[0], box.min[1], box.min[2], 0,
                box.max[0], box.max[1], box.max[2], static_cast<unsigned>(i)};
  }

  // One thread: the build takes milliseconds, and the tree is the same every time.
  using Device = std::unique_ptr<std::remove_pointer_t<RTCDevice>, decltype(&rtcReleaseDevice)>;
  using Build = std::unique_ptr<std::remove_pointer_t<RTCBVH>, decltype(&rtcReleaseBVH)>;
  const Device device(rtcNewDevice("threads=1"), rtcReleaseDevice);
  if (!device) throw std::runtime_error("Embree gave no device to build the tree of the obstacles with.");
  const Build build(rtcNewBVH(device.get()), rtcReleaseBVH);
  RTCBuildArguments arguments = rtcDefaultBuildArguments();
  arguments.bvh = build.get();
  arguments.maxBranchingFactor = kBranching;
  arguments.maxDepth = kDepth;
  arguments.minLeafSize = arguments.maxLeafSize = 1;
  arguments.primitives = items.data();
  arguments.primitiveCount = arguments.primitiveArrayCapacity = items.size();
  arguments.createNode = createNode;
  arguments.createLeaf = createLeaf;
  arguments.setNodeChildren = setChildren;
  arguments.setNodeBounds = setBounds;
  const auto* root = static_cast<const BuildNode*>(rtcBuildBVH(&arguments));
  if (root == nullptr) throw std::runtime_error("Embree could not build the tree of the obstacles.");

  BuildNode above_leaf;  // a single item has no node above it: give it one
  if (root->children_count == 0) {
    above_leaf.children_count = 1;
    above_leaf.children[0] = root;
    above_leaf.bounds[0] = {items[0].lower_x, items[0].lower_y, items[0].lower_z, 0,
                            items[0].upper_x, items[0].upper_y, items[0].upper_z, 0};
    root = &above_leaf;
  }
  nodes_.reserve(boxes.size() / 2 + 1);
  flatten(root);
  nodes_.shrink_to_fit();
}

int BoxTree::flatten(const void* build_node) {
  const auto& from = *static_cast<const BuildNode*>(build_node);
  const std::size_t number = nodes_.size();
  nodes_.emplace_back();
  constexpr float kNowhere = std::numeric_limits<float>::infinity();
  Node node;
  for (unsigned k = 0; k < kBranching; ++k) {
    const bool exists = k < from.children_count;
    const RTCBounds& b = from.bounds[k];
    const float min[3] = {b.lower_x, b.lower_y, b.lower_z}, max[3] = {b.upper_x, b.upper_y, b.upper_z};
    for (int i = 0; i < 3; ++i) {
      node.min[i][k] = exists ? min[i] : kNowhere;
      node.max[i][k] = exists ? max[i] : -kNowhere;
    }
    node.child[k] = -1;
    float extent2 = 0;
    for (int i = 0; i < 3; ++i) {
      node.center[i][k] = exists ? 0.5F * min[i] + 0.5F * max[i] : 0;
      const float half = std::max(max[i] - node.center[i][k], node.center[i][k] - min[i]);
      extent2 += half * half;
      if (exists) largest_ = std::max({largest_, std::abs(min[i]), std::abs(max[i])});
    }
    node.radius[k] = exists ? std::sqrt(extent2) : 0;
    if (exists) {
      const BuildNode& child = *from.children[k];
      node.child[k] = child.children_count == 0 ? ~static_cast<int>(child.item) : flatten(&child);
    }
  }
  nodes_[number] = node;
  return static_cast<int>(number);
}

template <class MayMeet>
void BoxTree::visit(const Aabb& box, const MayMeet& may_meet, std::vector<int>& out) const {
  if (nodes_.empty()) return;
  const FloatBox query = roundedOutward(box);
  const Float4 min_x = all(query.min[0]), min_y = all(query.min[1]), min_z = all(query.min[2]);
  const Float4 max_x = all(query.max[0]), max_y = all(query.max[1]), max_z = all(query.max[2]);

  int stack[kStack];
  std::size_t top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const Node& node = nodes_[static_cast<std::size_t>(stack[--top])];
    Int4 meets = (node.min[0] <= max_x) & (node.max[0] >= min_x) & (node.min[1] <= max_y) &
                 (node.max[1] >= min_y) & (node.min[2] <= max_z) & (node.max[2] >= min_z);
    meets &= may_meet(node);
    for (int k = 0; k < static_cast<int>(kBranching); ++k) {
      if (!meets[k]) continue;
      if (node.child[k] < 0)
        out.push_back(~node.child[k]);
      else
        stack[top++] = node.child[k];
    }
  }
}

void BoxTree::find(const Aabb& box, std::vector<int>& out) const {
  visit(
      box,
      [](const Node&) {
        return Int4{-1, -1, -1, -1};
      },
      out);
}

void BoxTree::find(const Aabb& box, const Capsule& capsule, std::vector<int>& out) const {
  Float4 a[3], along[3];
  float length2 = 0;
  for (int i = 0; i < 3; ++i) {
    const auto from = static_cast<float>(capsule.a[i]), way = static_cast<float>(capsule.b[i] - capsule.a[i]);
    a[i] = all(from), along[i] = all(way);
    length2 += way * way;
  }
  const Float4 inverse = all(length2 > std::numeric_limits<float>::min() ? 1 / length2 : 0), zero = all(0),
               one = all(1);
  // What single precision may lose of a distance: with X the largest coordinate, the roundings of a, b - a
  // and the differences move points by less than 10 eps X, those of t the foot by less than 16 eps X; and
  // some of the distance.
  const auto coordinate =
      static_cast<float>(std::max(capsule.a.cwiseAbs().maxCoeff(), capsule.b.cwiseAbs().maxCoeff()));
  const Float4 reach =
      all(static_cast<float>(capsule.radius) + 32 * kRounding * std::max(largest_, coordinate));
  visit(
      box,
      [&](const Node& node) {
        const Float4 x = node.center[0] - a[0], y = node.center[1] - a[1], z = node.center[2] - a[2];
        Float4 t = (x * along[0] + y * along[1] + z * along[2]) * inverse;
        t = t < zero ? zero : t;
        t = t > one ? one : t;
        const Float4 dx = x - t * along[0], dy = y - t * along[1], dz = z - t * along[2];
        const Float4 limit = (reach + node.radius) * (1 + 64 * kRounding);
        return dx * dx + dy * dy + dz * dz <= limit * limit;
      },
      out);
}

}  // namespace tendril
