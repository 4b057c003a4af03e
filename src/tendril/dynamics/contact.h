/// Contact of the rod with the obstacles: which parts are near, what the barrier says of them, how far they
/// may move. Incremental Potential Contact (Li et al. 2020), thick as in C-IPC (Li, Kaufman, Jiang 2021).
/// Private to dynamics.
#pragma once

#include <numbers>
#include <vector>

#include "tendril/dynamics/barrier.h"
#include "tendril/dynamics/beam.h"
#include "tendril/dynamics/block_tridiagonal.h"
#include "tendril/dynamics/self_contact.h"
#include "tendril/geometry.h"
#include "tendril/rod.h"

namespace tendril::contact {

/// A plane with all of a mesh part on it or behind it: a point of the rod is at least as far from the part as
/// it is high above the plane, and so is a segment whose ends are.
struct Plane {
  Vector3 normal = Vector3::Zero(), point = Vector3::Zero();
  [[nodiscard]] double heightOf(const Vector3& p) const { return normal.dot(p - point); }
};

/// Pairs of a rod part and a mesh part that can come near each other.
struct Candidates {
  struct NodeFace {
    int node, face;
    Plane plane;
  };
  struct SegmentEdge {
    int segment, edge;
    Plane plane;
  };
  std::vector<NodeFace> node_faces;
  std::vector<SegmentEdge> segment_edges;

  void clear() { node_faces.clear(), segment_edges.clear(); }
};

/// One active contact: a point of the rod (a node, or a point between two nodes) and a feature of the mesh.
/// Pairs with the same closest features are one term with their number as weight, so duplicates cost nothing
/// to assemble.
struct Term {
  std::uint64_t key;
  int node;         // the node, or the first node of the segment
  bool on_segment;  // between `node` and `node + 1`
  double s;         // where on the segment
  Vector3 normal;   // from mesh to rod, unit
  double distance;  // centreline to mesh, m
  double weight;    // of the merged pairs, each at most 1
  Vector3 dual;  // e*: segment direction across the mesh edge over its squared length, 1/m; only on_segment
  bool mollified;
  // Of the weight by the motion of the rod's point, and by that of the segment's second node less its
  // first's, 1/m.
  Vector3 weight_by_motion, weight_by_turn;
};

/// How much a mesh edge counts where n points from the edge to the rod: x^2 (3 - 2 x) of x = -n .
/// wedge/|wedge|, nothing where x < 0, which is in a valley, whose faces are nearer. An edge without a wedge
/// counts, and so does one whose faces meet at less than a right angle: there x is small for a segment that
/// lies across it on either face, and no thick rod gets into the valley.
struct EdgeWeight {
  double value = 1;
  Vector3 by_normal = Vector3::Zero();

  EdgeWeight(const MeshEdge& edge, const Vector3& normal);
  [[nodiscard]] static bool fadesInValley(const MeshEdge& edge) {
    const double length = edge.wedge.norm();
    return length > 0 && length <= std::numbers::sqrt2;  // which it is of faces at a right angle
  }
};

/// A lagged friction force: Coulomb with the normal force of the step's start.
struct FrictionTerm {
  int node;
  bool on_segment;
  double s;
  Vector3 normal, start;  // contact normal; where the rod's point was
  double limit;           // friction coefficient times normal force, N
};

/// Finds and evaluates contacts with obstacles and, if asked, of the rod with itself; keeps its memory.
class Contacts {
 public:
  /// Begins a step: what was found before is forgotten.
  void prepare(const Obstacles& obstacles, const RodProperties& rod, const Barrier& barrier);

  /// Everything that can come within the radius + dhat while node i moves from positions[i] by motion[i].
  void findCandidates(const std::vector<Vector3>& positions, const std::vector<Vector3>& motion);
  /// The largest fraction of the motion that leaves every candidate what it must keep of its gap.
  [[nodiscard]] double freeFraction(const std::vector<Vector3>& positions, const std::vector<Vector3>& motion,
                                    KeptGap keep) const;
  /// Collects the active terms at these positions. False (and no terms) if something penetrates.
  [[nodiscard]] bool evaluate(const std::vector<Vector3>& positions);
  [[nodiscard]] double energy() const;
  /// The gap that the tightest place of the rod could have on all sides at once if it were moved a little
  /// across itself [m], from below; infinite where no place is pressed from opposite sides. For the terms of
  /// these positions.
  [[nodiscard]] double room(const std::vector<Vector3>& positions);
  /// Changes the barrier against the obstacles. It must not reach farther than the one the candidates were
  /// found for.
  void setBarrier(const Barrier& barrier) { barrier_ = barrier; }
  [[nodiscard]] const Barrier& barrier() const { return barrier_; }
  /// The smallest gap of an active term [m]; infinity if there is none.
  [[nodiscard]] double leastGap() const;
  void addDerivatives(const std::vector<beam::Node>& nodes, BlockTridiagonal& system) const;

  void lagFriction(const std::vector<Vector3>& positions, double coefficient, double slip_length);
  [[nodiscard]] double frictionEnergy(const std::vector<Vector3>& positions) const;
  void addFrictionDerivatives(const std::vector<beam::Node>& nodes, BlockTridiagonal& system) const;

  [[nodiscard]] std::size_t activeTerms() const { return terms_.size() + self_.activeTerms(); }
  [[nodiscard]] const std::vector<Term>& terms() const { return terms_; }
  [[nodiscard]] const std::vector<FrictionTerm>& frictionTerms() const { return friction_; }
  [[nodiscard]] const SelfContacts& selfContacts() const { return self_; }
  /// What a term pushes the rod's point with [N, world].
  [[nodiscard]] Vector3 contactForce(const Term& term) const;
  /// What a friction term pulls the rod with at these positions [N, world].
  [[nodiscard]] Vector3 frictionForce(const FrictionTerm& term, const std::vector<Vector3>& positions) const;

 private:
  /// Where a segment's ends may be, each within `slack_` of a straight line, for these pairs of `near_` to be
  /// all that can come within reach of it.
  struct Neighbourhood {
    std::array<Vector3, 2> from, way;
    std::size_t first_face, last_face, first_edge, last_edge;
    bool known = false;
  };
  [[nodiscard]] bool staysWithin(const Neighbourhood& around, const Vector3& p0, const Vector3& p1,
                                 const Vector3& d0, const Vector3& d1) const;
  void lookAround(std::size_t segment, const std::vector<Vector3>& positions,
                  const std::vector<Vector3>& motion);

  Term& termFor(std::uint64_t key, bool& fresh);
  /// A pair of a segment and a mesh edge with directions u and f, closest at s and t and `apart` there, whose
  /// weight is `fade` but for the edge's own.
  struct SegmentEdgePair {
    int segment, edge;
    Vector3 u, f;
    double s, t;
    Vector3 apart;
    double distance;
  };
  void addPair(const SegmentEdgePair& pair, double fade, const Vector3& fade_by_u);

  const Obstacles* obstacles_ = nullptr;
  double radius_ = 0;  // of the rod, and what the meshes are off their faces by
  Barrier barrier_;
  bool self_contact_ = false;
  SelfContacts self_;
  std::vector<Neighbourhood> neighbourhoods_;  // of the segments
  double slack_ = 0;                           // m
  Candidates near_, candidates_;
  std::vector<Term> terms_;
  std::vector<FrictionTerm> friction_;
  double slip_length_ = 0;  // m, below which friction is smoothed
  std::vector<int> faces_, by_node_;
  std::vector<std::uint32_t> edge_stamp_;
  std::uint32_t stamp_ = 0;
  std::vector<std::int32_t> slots_;  // open-addressing table from key to term
  std::vector<std::int32_t> used_slots_;
};

}  // namespace tendril::contact
