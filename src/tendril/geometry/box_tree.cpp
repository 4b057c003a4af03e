#include "tendril/geometry/box_tree.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <stdexcept>
#include <type_traits>

namespace tendril {
namespace {

constexpr unsigned kBranching = 4;
constexpr unsigned kDepth = 64;  // Embree splits by halves when it comes near this

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

/// What Embree's builder calls, from one thread. It keeps a child as a pointer it never follows; here that is
/// its code, as in Node::child, in an integer that is never 0.
struct BoxTree::Builder {
  static void* pointer(int code) { return reinterpret_cast<void*>(2 * std::intptr_t{code} + 1); }
  static int code(const void* pointer) {
    return static_cast<int>((reinterpret_cast<std::intptr_t>(pointer) - 1) / 2);
  }

  static void* createNode(RTCThreadLocalAllocator, unsigned, void* tree) {
    auto& nodes = static_cast<BoxTree*>(tree)->nodes_;
    constexpr float kNowhere = std::numeric_limits<float>::infinity();
    Node& node = nodes.emplace_back();
    for (int i = 0; i < 3; ++i) node.min[i] = all(kNowhere), node.max[i] = all(-kNowhere);
    for (int& child : node.child) child = -1;
    return pointer(static_cast<int>(nodes.size()) - 1);
  }

  static void setBounds(void* node, const RTCBounds** bounds, unsigned count, void* tree) {
    for (unsigned k = 0; k < count; ++k) {
      const RTCBounds& b = *bounds[k];
      static_cast<BoxTree*>(tree)->setBox(
          code(node), k, {{b.lower_x, b.lower_y, b.lower_z}, {b.upper_x, b.upper_y, b.upper_z}});
    }
  }

  static void setChildren(void* node, void** children, unsigned count, void* tree) {
    for (unsigned k = 0; k < count; ++k)
      static_cast<BoxTree*>(tree)->node(code(node)).child[k] = code(children[k]);
  }

  /// A leaf of several items is a node.
  static void* createLeaf(RTCThreadLocalAllocator allocator, const RTCBuildPrimitive* items,
                          std::size_t count, void* tree) {
    assert(count <= kBranching);
    if (count == 1) return pointer(~static_cast<int>(items[0].primID));
    void* leaf = createNode(allocator, static_cast<unsigned>(count), tree);
    for (unsigned k = 0; k < count; ++k) {
      const RTCBuildPrimitive& item = items[k];
      static_cast<BoxTree*>(tree)->setBox(
          code(leaf), k,
          {{item.lower_x, item.lower_y, item.lower_z}, {item.upper_x, item.upper_y, item.upper_z}});
      static_cast<BoxTree*>(tree)->node(code(leaf)).child[k] = ~static_cast<int>(item.primID);
    }
    return leaf;
  }
};

void BoxTree::setBox(int number, unsigned k, const FloatBox& box) {
  Node& node = this->node(number);
  for (int i = 0; i < 3; ++i) {
    node.min[i][k] = box.min[i], node.max[i][k] = box.max[i];
    largest_ = std::max({largest_, std::abs(box.min[i]), std::abs(box.max[i])});
  }
}

BoxTree::BoxTree(std::span<const Aabb> boxes) {
  if (boxes.empty()) return;
  std::vector<RTCBuildPrimitive> items(boxes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const FloatBox box = roundedOutward(boxes[i]);
    items[i] = {box.min[0], box.min[1], box.min[2], 0,
                box.max[0], box.max[1], box.max[2], static_cast<unsigned>(i)};
  }
  nodes_.reserve(boxes.size() / 2 + 1);  // most trees need less; what is not used is never touched

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
  arguments.minLeafSize = arguments.maxLeafSize = kBranching;
  arguments.primitives = items.data();
  arguments.primitiveCount = arguments.primitiveArrayCapacity = items.size();
  arguments.createNode = Builder::createNode;
  arguments.createLeaf = Builder::createLeaf;
  arguments.setNodeChildren = Builder::setChildren;
  arguments.setNodeBounds = Builder::setBounds;
  arguments.userPtr = this;
  const void* root = rtcBuildBVH(&arguments);
  if (root == nullptr) throw std::runtime_error("Embree could not build the tree of the obstacles.");
  root_ = Builder::code(root);
  if (root_ < 0) {  // a single item has no node above it: give it one
    const RTCBuildPrimitive& item = items[0];
    void* above = Builder::createNode(nullptr, 1, this);
    root_ = Builder::code(above);
    setBox(root_, 0,
           {{item.lower_x, item.lower_y, item.lower_z}, {item.upper_x, item.upper_y, item.upper_z}});
    node(root_).child[0] = ~static_cast<int>(item.primID);
  }
}

template <class MayMeet>
void BoxTree::visit(const Aabb& box, const MayMeet& may_meet, std::vector<int>& out) const {
  if (nodes_.empty()) return;
  const FloatBox query = roundedOutward(box);
  const Float4 min_x = all(query.min[0]), min_y = all(query.min[1]), min_z = all(query.min[2]);
  const Float4 max_x = all(query.max[0]), max_y = all(query.max[1]), max_z = all(query.max[2]);

  // Breadth first, in `out` itself: what is found goes to its front, what is still to be looked at to its
  // end. A depth-first search would wait for every node's answer before it knew which node is next.
  std::size_t found = out.size(), next = found, end = found;
  const auto makeRoom = [&] {
    if (out.size() < end + kBranching) out.resize(2 * (end + kBranching));
  };
  makeRoom();
  out[end++] = root_;
  while (next < end) {
    const int number = out[next++];
    if (number < 0) {
      out[found++] = ~number;
      continue;
    }
    makeRoom();
    const Node& node = nodes_[static_cast<std::size_t>(number)];
    Int4 meets = (node.min[0] <= max_x) & (node.max[0] >= min_x) & (node.min[1] <= max_y) &
                 (node.max[1] >= min_y) & (node.min[2] <= max_z) & (node.max[2] >= min_z);
    meets &= may_meet(node);
    for (int k = 0; k < static_cast<int>(kBranching); ++k) {  // which do is anyone's guess: no branch
      out[end] = node.child[k];
      end += static_cast<std::size_t>(meets[k] & 1);
    }
  }
  out.resize(found);
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
  // With d from the axis' point at t to the box's middle and h half the box's size, the box is |d|^2 - |d| .
  // h beyond that point in units of 1/|d|, and the axis at most `ahead`. What single precision may lose of
  // that: with X the largest coordinate, the roundings of a, b - a, the box's middle and size and the
  // differences move points by less than 20 eps X, products lose a few eps of themselves, and t may be
  // anything.
  const auto coordinate =
      static_cast<float>(std::max(capsule.a.cwiseAbs().maxCoeff(), capsule.b.cwiseAbs().maxCoeff()));
  const float reach = static_cast<float>(capsule.radius) + 64 * kRounding * std::max(largest_, coordinate);
  const Float4 reach2 = all(reach * reach * (1 + 64 * kRounding));
  visit(
      box,
      [&](const Node& node) {
        Float4 d[3];
        for (int i = 0; i < 3; ++i) d[i] = (0.5F * node.min[i] + 0.5F * node.max[i]) - a[i];
        Float4 t = (d[0] * along[0] + d[1] * along[1] + d[2] * along[2]) * inverse;
        t = t < zero ? zero : t;
        t = t > one ? one : t;
        Float4 distance2 = zero, depth = zero, slope = zero;
        for (int i = 0; i < 3; ++i) {
          d[i] -= t * along[i];
          distance2 += d[i] * d[i];
          depth += (d[i] < zero ? -d[i] : d[i]) * (0.5F * node.max[i] - 0.5F * node.min[i]);
          slope += d[i] * along[i];
        }
        const Float4 behind = -t * slope, before = (one - t) * slope;
        const Float4 ahead = behind > before ? behind : before;
        const Float4 apart = distance2 - (depth + ahead) * (1 + 64 * kRounding);
        return ~((apart > zero) & (apart * apart > reach2 * distance2));  // what is no number may meet
      },
      out);
}

}  // namespace tendril
