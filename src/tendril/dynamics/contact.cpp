#include "tendril/dynamics/contact.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>

namespace tendril::contact {
namespace {

enum class MeshPart : std::uint64_t { vertex, edge, face };

/// Identifies a (rod part, mesh part) pair: rod part in the low 16 bits, mesh part above.
std::uint64_t keyOf(int node, bool on_segment, MeshPart part, int index) {
  return (static_cast<std::uint64_t>(index) << 18) | (static_cast<std::uint64_t>(part) << 16) |
         (static_cast<std::uint64_t>(node) << 1) | (on_segment ? 1U : 0U);
}

/// Of the barrier's reach: how far a step may lead beside its first guess before pairs are looked for again.
constexpr double kSlack = 0.25;

constexpr std::size_t kSlots = 1024;  // of the table from key to term; a power of two

}  // namespace

void Contacts::prepare(const Obstacles& obstacles, const RodProperties& rod, const Barrier& barrier) {
  radius_ = rod.radius + obstacles.deviation();
  barrier_ = barrier;
  self_contact_ = rod.self_contact;
  self_.prepare(rod.radius, rod.elementLength(), barrier);
  slack_ = kSlack * barrier.dhat;
  near_.clear();
  for (Neighbourhood& around : neighbourhoods_) around.known = false;
  assert(rod.elements < (1 << 14));  // keyOf's room for a node
  if (obstacles_ == &obstacles && edge_stamp_.size() == obstacles.edges().size()) return;
  obstacles_ = &obstacles;
  edge_stamp_.assign(obstacles.edges().size(), 0);
  stamp_ = 0;
  slots_.assign(kSlots, -1);
  used_slots_.clear();
  terms_.clear();
  friction_.clear();
}

namespace {

/// The plane across the way `apart` from a mesh part to the rod, on the foremost of the part's corners and
/// `margin` before it; without a normal, so that nothing is above it, where there is no way.
template <std::size_t N>
Plane planeBefore(const std::array<const Vector3*, N>& corners, const Vector3& apart, double margin) {
  Plane plane;
  const double distance = apart.norm();
  if (!(distance > 1e-150)) return plane;
  plane.normal = apart / distance;
  const Vector3& foremost = **std::max_element(corners.begin(), corners.end(), [&](auto* p, auto* q) {
    return plane.normal.dot(*p - *corners[0]) < plane.normal.dot(*q - *corners[0]);
  });
  plane.point = foremost + margin * plane.normal;
  return plane;
}

/// Whether the wedge keeps all that is within `slack` of these points on the side of a valley, whose faces
/// are nearer than its edge.
bool inValley(const MeshEdge& edge, const Vector3& on_edge, const std::array<Vector3, 4>& points,
              double slack) {
  if (!EdgeWeight::fadesInValley(edge)) return false;
  const double least = slack * edge.wedge.norm();
  return std::all_of(points.begin(), points.end(),
                     [&](const Vector3& p) { return edge.wedge.dot(p - on_edge) > least; });
}

/// What comes within `reach` of a segment that moves, p its ends before and after: a capsule about where it
/// is halfway or about a diagonal of the four, whichever is thinnest. All four within a distance of the axis
/// means all between.
Capsule capsuleAround(const std::array<Vector3, 4>& p, const std::array<Vector3, 2>& halfway, double reach) {
  Capsule best{halfway[0], halfway[1], std::numeric_limits<double>::infinity()};
  for (const auto& [a, b] : {std::pair{halfway[0], halfway[1]}, {p[0], p[3]}, {p[2], p[1]}}) {
    double aside = 0;
    for (const Vector3& point : p) aside = std::max(aside, closestPointOnSegment(point, a, b).distance);
    if (aside + reach < best.radius) best = {a, b, aside + reach};
  }
  return best;
}

}  // namespace

bool Contacts::staysWithin(const Neighbourhood& around, const Vector3& p0, const Vector3& p1,
                           const Vector3& d0, const Vector3& d1) const {
  const auto within = [&](std::size_t end, const Vector3& p) {
    const Vector3 &way = around.way[end], from = p - around.from[end];
    const double length2 = way.squaredNorm();
    const double t = length2 > 0 ? std::clamp(from.dot(way) / length2, 0.0, 1.0) : 0;
    return (from - t * way).squaredNorm() <= slack_ * slack_;
  };
  return around.known && within(0, p0) && within(0, p0 + d0) && within(1, p1) && within(1, p1 + d1);
}

void Contacts::lookAround(std::size_t segment, const std::vector<Vector3>& positions,
                          const std::vector<Vector3>& motion) {
  const std::size_t i = segment;
  const int k = static_cast<int>(segment);
  const bool last = i + 2 == positions.size();
  Neighbourhood& around = neighbourhoods_[segment];
  around = {.from = {positions[i], positions[i + 1]},
            .way = {motion[i], motion[i + 1]},
            .first_face = near_.node_faces.size(),
            .last_face = near_.node_faces.size(),
            .first_edge = near_.segment_edges.size(),
            .last_edge = near_.segment_edges.size(),
            .known = true};
  const auto vertices = obstacles_->vertices();
  const auto vertex = [&](int index) -> const Vector3& { return vertices[static_cast<std::size_t>(index)]; };
  const double reach = radius_ + barrier_.dhat * (1 + 1e-9) + 1e-12 + slack_ * (1 + 1e-9);
  const std::array<Vector3, 4> p = {positions[i], positions[i + 1], positions[i] + motion[i],
                                    positions[i + 1] + motion[i + 1]};
  const std::array<Vector3, 2> halfway = {p[0] + 0.5 * motion[i], p[1] + 0.5 * motion[i + 1]};
  const Capsule capsule = capsuleAround(p, halfway, reach);
  Aabb box;
  for (const Vector3& point : p) box.include(point);
  box.inflate(reach);
  faces_.clear();
  obstacles_->facesNear(box, capsule, faces_);
  if (faces_.empty()) return;
  const double extent = capsule.radius + (p[1] - p[0]).norm() + 2 * (motion[i].norm() + motion[i + 1].norm());
  if (++stamp_ == 0) std::fill(edge_stamp_.begin(), edge_stamp_.end(), 0U), stamp_ = 1;
  for (const int face : faces_) {
    const auto& f = obstacles_->faces()[static_cast<std::size_t>(face)];
    const Obstacles::FaceBound& bound = obstacles_->faceBounds()[static_cast<std::size_t>(face)];
    const Vector3 &a = vertex(f.vertices[0]), &b = vertex(f.vertices[1]), &c = vertex(f.vertices[2]);
    // A segment that stays wholly on one side of the face's plane, beyond reach, meets neither face nor its
    // edges. 1e-9 of the distances in play is for the normal's rounding, here and below.
    const double margin = 1e-9 * (extent + 2 * bound.radius), limit = reach + margin;
    std::array<double, 4> height;
    for (std::size_t j = 0; j < 4; ++j) height[j] = bound.normal.dot(p[j] - a);
    const auto [low, high] = std::minmax_element(height.begin(), height.end());
    if (*low > limit || *high < -limit) continue;
    const auto add_node = [&](int node, std::size_t from, std::size_t to) {
      if (std::min(height[from], height[to]) > limit || std::max(height[from], height[to]) < -limit) return;
      if (!Capsule{p[from], p[to], reach}.meets(bound.center, bound.radius)) return;
      const Vector3& mid = halfway[from];
      const Plane plane =
          planeBefore<3>({&a, &b, &c}, mid - closestPointOnTriangle(mid, a, b, c).closest, margin);
      if (std::min(plane.heightOf(p[from]), plane.heightOf(p[to])) < reach)
        near_.node_faces.push_back({node, face, plane});
    };
    add_node(k, 0, 2);
    if (last) add_node(k + 1, 1, 3);
    for (const int edge : f.edges) {
      std::uint32_t& stamp = edge_stamp_[static_cast<std::size_t>(edge)];
      if (stamp == stamp_) continue;
      stamp = stamp_;
      const MeshEdge& e = obstacles_->edges()[static_cast<std::size_t>(edge)];
      if (e.flat) continue;
      const Vector3 &ea = vertex(e.a), &eb = vertex(e.b);
      if (!capsule.meets(0.5 * (ea + eb), 0.5 * (eb - ea).norm())) continue;
      if (inValley(e, ea, p, slack_ + margin)) continue;
      const SegmentSegment near = closestPointsOfSegments(halfway[0], halfway[1], ea, eb);
      const Vector3 apart = (halfway[0] - ea) + near.s * (halfway[1] - halfway[0]) - near.t * (eb - ea);
      const Plane plane = planeBefore<2>({&ea, &eb}, apart, margin);
      if (std::any_of(p.begin(), p.end(), [&](const Vector3& q) { return plane.heightOf(q) < reach; }))
        near_.segment_edges.push_back({k, edge, plane});
    }
  }
  around.last_face = near_.node_faces.size(), around.last_edge = near_.segment_edges.size();
}

void Contacts::findCandidates(const std::vector<Vector3>& positions, const std::vector<Vector3>& motion) {
  if (self_contact_) self_.findCandidates(positions, motion);
  candidates_.clear();
  if (obstacles_->faces().empty()) return;
  const double reach = radius_ + barrier_.dhat * (1 + 1e-9) + 1e-12;
  const std::size_t segments = positions.size() - 1;
  neighbourhoods_.resize(segments);
  for (std::size_t i = 0; i < segments; ++i) {
    if (!staysWithin(neighbourhoods_[i], positions[i], positions[i + 1], motion[i], motion[i + 1]))
      lookAround(i, positions, motion);
    const Neighbourhood& around = neighbourhoods_[i];
    const std::array<Vector3, 4> p = {positions[i], positions[i + 1], positions[i] + motion[i],
                                      positions[i + 1] + motion[i + 1]};
    for (std::size_t j = around.first_face; j < around.last_face; ++j) {
      const Candidates::NodeFace& pair = near_.node_faces[j];
      const std::size_t end = static_cast<std::size_t>(pair.node) - i;
      if (std::min(pair.plane.heightOf(p[end]), pair.plane.heightOf(p[end + 2])) < reach)
        candidates_.node_faces.push_back(pair);
    }
    for (std::size_t j = around.first_edge; j < around.last_edge; ++j) {
      const Candidates::SegmentEdge& pair = near_.segment_edges[j];
      if (std::any_of(p.begin(), p.end(), [&](const Vector3& q) { return pair.plane.heightOf(q) < reach; }))
        candidates_.segment_edges.push_back(pair);
    }
  }
}

double Contacts::freeFraction(const std::vector<Vector3>& positions, const std::vector<Vector3>& motion,
                              KeptGap keep) const {
  const auto vertices = obstacles_->vertices();
  const auto vertex = [&](int index) -> const Vector3& { return vertices[static_cast<std::size_t>(index)]; };
  double fraction = self_contact_ ? self_.freeFraction(positions, motion, keep) : 1;
  for (const auto& [node, face, plane] : candidates_.node_faces) {
    const auto i = static_cast<std::size_t>(node);
    const auto& f = obstacles_->faces()[static_cast<std::size_t>(face)];
    fraction = std::min(fraction,
                        freeMotionPointTriangle(positions[i], motion[i], vertex(f.vertices[0]),
                                                vertex(f.vertices[1]), vertex(f.vertices[2]), radius_, keep));
  }
  for (const auto& [segment, edge, plane] : candidates_.segment_edges) {
    const auto i = static_cast<std::size_t>(segment);
    const MeshEdge& e = obstacles_->edges()[static_cast<std::size_t>(edge)];
    fraction =
        std::min(fraction, freeMotionSegmentEdge(positions[i], positions[i + 1], motion[i], motion[i + 1],
                                                 vertex(e.a), vertex(e.b), radius_, keep));
  }
  return fraction;
}

Term& Contacts::termFor(std::uint64_t key, bool& fresh) {
  std::size_t slot = (key * 0x9E3779B97F4A7C15ULL) >> 54;  // 10 bits
  if (terms_.size() < kSlots / 2) {
    while (slots_[slot] >= 0) {
      Term& term = terms_[static_cast<std::size_t>(slots_[slot])];
      if (term.key == key) {
        fresh = false;
        return term;
      }
      slot = (slot + 1) % kSlots;
    }
    slots_[slot] = static_cast<std::int32_t>(terms_.size());
    used_slots_.push_back(static_cast<std::int32_t>(slot));
  }  // a fuller table merges no more: the same sum in more terms
  fresh = true;
  terms_.emplace_back();
  terms_.back().key = key;
  return terms_.back();
}

EdgeWeight::EdgeWeight(const MeshEdge& edge, const Vector3& normal) {
  if (!fadesInValley(edge)) return;
  const Vector3 into = edge.wedge.normalized();
  const double x = std::max(0.0, -into.dot(normal));
  value = x * x * (3 - 2 * x);
  by_normal = -6 * x * (1 - x) * into;
}

void Contacts::addPair(const SegmentEdgePair& pair, double fade, const Vector3& fade_by_u) {
  if (pair.distance >= radius_ + barrier_.dhat) return;
  const MeshEdge& edge = obstacles_->edges()[static_cast<std::size_t>(pair.edge)];
  const Vector3 normal = pair.apart / pair.distance;
  const EdgeWeight counts(edge, normal);
  const double weight = fade * counts.value;
  if (weight <= 0) return;
  const bool inside_s = pair.s > 0 && pair.s<1, inside_t = pair.t> 0 && pair.t < 1;

  // How the normal turns: n stays perpendicular to the segment, and to the edge if the point is inside it.
  const Vector3 by_normal = fade * counts.by_normal;
  Vector3 dual = Vector3::Zero(), by_motion = Vector3::Zero(), by_turn = counts.value * fade_by_u;
  if (inside_s) {
    const Vector3 across =
        inside_t ? Vector3(pair.u - pair.u.dot(pair.f) / pair.f.squaredNorm() * pair.f) : pair.u;
    const double across2 = across.squaredNorm();
    if (across2 > 0) dual = across / across2;
    by_turn -= by_normal.dot(dual) * normal;
    if (!inside_t) {
      const Vector3 aside = normal.cross(pair.u.normalized());
      by_motion = by_normal.dot(aside) / pair.distance * aside;
    }
  } else {
    by_motion = (by_normal - by_normal.dot(normal) * normal) / pair.distance;
  }

  const bool fades = fade < 1, on_segment = inside_s || fades;
  const int node = on_segment || pair.s <= 0 ? pair.segment : pair.segment + 1;
  bool fresh = true;
  Term* term = nullptr;
  if (fades) {
    term = &terms_.emplace_back();
    term->key = ~0ULL;
  } else {
    const MeshPart part = inside_t ? MeshPart::edge : MeshPart::vertex;
    const int index = inside_t ? pair.edge : (pair.t <= 0 ? edge.a : edge.b);
    term = &termFor(keyOf(node, on_segment, part, index), fresh);
  }
  if (!fresh) {
    term->weight += weight, term->weight_by_motion += by_motion, term->weight_by_turn += by_turn;
    return;
  }
  *term = {.key = term->key,
           .node = node,
           .on_segment = on_segment,
           .s = on_segment ? pair.s : 0,
           .normal = normal,
           .distance = pair.distance,
           .weight = weight,
           .dual = dual,
           .mollified = fades,
           .weight_by_motion = by_motion,
           .weight_by_turn = by_turn};
}

bool Contacts::evaluate(const std::vector<Vector3>& positions) {
  for (const std::int32_t slot : used_slots_) slots_[static_cast<std::size_t>(slot)] = -1;
  used_slots_.clear();
  terms_.clear();
  if (self_contact_ && !self_.evaluate(positions)) return false;
  const auto vertices = obstacles_->vertices();
  const auto vertex = [&](int index) -> const Vector3& { return vertices[static_cast<std::size_t>(index)]; };
  const double reach = radius_ + barrier_.dhat;

  for (const auto& [node, face, plane] : candidates_.node_faces) {
    const Vector3& p = positions[static_cast<std::size_t>(node)];
    if (plane.heightOf(p) >= reach) continue;
    const auto& f = obstacles_->faces()[static_cast<std::size_t>(face)];
    const PointTriangle near =
        closestPointOnTriangle(p, vertex(f.vertices[0]), vertex(f.vertices[1]), vertex(f.vertices[2]));
    if (near.distance >= reach) continue;
    if (near.distance <= radius_) return false;
    std::uint64_t key = 0;
    switch (near.feature) {
      case Feature::vertex0:
        key = keyOf(node, false, MeshPart::vertex, f.vertices[0]);
        break;
      case Feature::vertex1:
        key = keyOf(node, false, MeshPart::vertex, f.vertices[1]);
        break;
      case Feature::vertex2:
        key = keyOf(node, false, MeshPart::vertex, f.vertices[2]);
        break;
      case Feature::edge01:
        key = keyOf(node, false, MeshPart::edge, f.edges[0]);
        break;
      case Feature::edge12:
        key = keyOf(node, false, MeshPart::edge, f.edges[1]);
        break;
      case Feature::edge20:
        key = keyOf(node, false, MeshPart::edge, f.edges[2]);
        break;
      case Feature::face:
        key = keyOf(node, false, MeshPart::face, face);
        break;
    }
    bool fresh = false;
    Term& term = termFor(key, fresh);
    if (!fresh) {
      term.weight += 1;
      continue;
    }
    term = {.key = key,
            .node = node,
            .on_segment = false,
            .s = 0,
            .normal = (p - near.closest) / near.distance,
            .distance = near.distance,
            .weight = 1,
            .dual = Vector3::Zero(),
            .mollified = false,
            .weight_by_motion = Vector3::Zero(),
            .weight_by_turn = Vector3::Zero()};
  }

  for (const auto& [segment, edge, plane] : candidates_.segment_edges) {
    const Vector3& p0 = positions[static_cast<std::size_t>(segment)];
    const Vector3& p1 = positions[static_cast<std::size_t>(segment) + 1];
    if (std::min(plane.heightOf(p0), plane.heightOf(p1)) >= reach) continue;
    const MeshEdge& e = obstacles_->edges()[static_cast<std::size_t>(edge)];
    const Vector3 &a = vertex(e.a), &b = vertex(e.b);
    const SegmentSegment near = closestPointsOfSegments(p0, p1, a, b);
    if (near.distance >= reach) continue;
    if (near.distance <= radius_) return false;
    const Vector3 u = p1 - p0, f = b - a;
    const Mollifier m(u, f);
    addPair({segment, edge, u, f, near.s, near.t, p0 + near.s * u - a - near.t * f, near.distance}, m.weight,
            m.by_u);
    if (!m.fades()) continue;
    for (const double t : {0.0, 1.0}) {
      const Vector3& end = t == 0 ? a : b;
      const PointSegment foot = closestPointOnSegment(end, p0, p1);
      addPair({segment, edge, u, f, foot.t, t, p0 + foot.t * u - end, foot.distance}, 1 - m.weight, -m.by_u);
    }
  }
  return true;
}

double Contacts::energy() const {
  double sum = self_contact_ ? self_.energy() : 0;
  for (const Term& term : terms_) sum += term.weight * barrier_(term.distance - radius_).energy;
  return sum;
}

double Contacts::room(const std::vector<Vector3>& positions) {
  constexpr int kMoves = 32;
  constexpr double kFirst = 0.5, kNext = 0.8;  // the first move, of dhat; the next one, of the last
  by_node_.resize(terms_.size());
  std::iota(by_node_.begin(), by_node_.end(), 0);
  const auto term = [&](int i) -> const Term& { return terms_[static_cast<std::size_t>(i)]; };
  std::sort(by_node_.begin(), by_node_.end(),
            [&](int i, int j) { return std::pair(term(i).node, i) < std::pair(term(j).node, j); });
  double least = std::numeric_limits<double>::infinity();
  for (auto first = by_node_.begin(), last = first; first != by_node_.end(); first = last) {
    last = std::find_if(first, by_node_.end(), [&](int i) { return term(i).node != term(*first).node; });
    const auto node = static_cast<std::size_t>(term(*first).node);
    const Vector3 along =
        (positions[std::min(node + 1, positions.size() - 1)] - positions[node > 0 ? node - 1 : 0])
            .normalized();
    const auto across = [&](int i) -> Vector3 { return term(i).normal - term(i).normal.dot(along) * along; };
    const bool pressed = std::any_of(first, last, [&](int i) {
      return std::any_of(first, last, [&](int j) { return across(i).dot(across(j)) < -0.1; });
    });
    if (!pressed) continue;
    // The largest of the smallest gaps over all places t around, by moves away from what is nearest. What is
    // not active is dhat away, less the way there.
    Vector3 t = Vector3::Zero();
    double most = 0, stride = kFirst * barrier_.dhat;
    for (int move = 0; move < kMoves; ++move, stride *= kNext) {
      Vector3 away = Vector3::Zero();
      double gap = std::numeric_limits<double>::infinity();
      for (auto i = first; i != last; ++i)
        if (const double d = term(*i).distance - radius_ + across(*i).dot(t); d < gap)
          gap = d, away = across(*i);
      most = std::max(most, std::min(gap, barrier_.dhat - t.norm()));
      t += stride * away;
    }
    least = std::min(least, most);
  }
  return least;
}

double Contacts::leastGap() const {
  double least = std::numeric_limits<double>::infinity();
  for (const Term& term : terms_) least = std::min(least, term.distance - radius_);
  if (self_contact_) least = std::min(least, self_.leastGap());
  return least;
}

void Contacts::addDerivatives(const std::vector<beam::Node>& nodes, BlockTridiagonal& system) const {
  if (self_contact_) self_.addDerivatives(nodes, system);
  for (const Term& term : terms_) {
    const Barrier::Value b = barrier_(term.distance - radius_);
    const double slope = term.weight * b.slope, curvature = term.weight * b.curvature;
    const auto i = static_cast<std::size_t>(term.node);
    const Vector3 n0 = nodes[i].rotation.transpose() * term.normal;
    const Vector3 push = slope * term.normal + b.energy * term.weight_by_motion;
    if (!term.on_segment) {
      system.rhs(i).tail<3>() -= nodes[i].rotation.transpose() * push;
      system.diagonal(i).bottomRightCorner<3, 3>().noalias() += (curvature * n0) * n0.transpose();
      continue;
    }
    const Vector3 n1 = nodes[i + 1].rotation.transpose() * term.normal;
    const Vector3 turn = b.energy * term.weight_by_turn;
    const double s0 = 1 - term.s, s1 = term.s;
    system.rhs(i).tail<3>() -= nodes[i].rotation.transpose() * (s0 * push - turn);
    system.rhs(i + 1).tail<3>() -= nodes[i + 1].rotation.transpose() * (s1 * push + turn);
    addRankOne(system, i, curvature, s0 * n0, s1 * n1);
    if (!term.mollified) addTilt(system, nodes, i, -slope, term.distance, term.s, term.normal, term.dual);
  }
}

void Contacts::lagFriction(const std::vector<Vector3>& positions, double coefficient, double slip_length) {
  friction_.clear();
  slip_length_ = slip_length;
  if (coefficient <= 0) return;
  for (const Term& term : terms_) {
    const auto i = static_cast<std::size_t>(term.node);
    const double limit = -coefficient * term.weight * barrier_(term.distance - radius_).slope;
    const Vector3 start =
        term.on_segment ? Vector3((1 - term.s) * positions[i] + term.s * positions[i + 1]) : positions[i];
    friction_.push_back({term.node, term.on_segment, term.s, term.normal, start, limit});
  }
}

namespace {

/// The smoothed |y| of lagged friction (Li et al. 2020, eq. 15): quadratic-cubic below `eps`, linear beyond.
struct SmoothNorm {
  double value, slope;
};
SmoothNorm smoothNorm(double y, double eps) {
  if (y >= eps) return {y, 1};
  const double x = y / eps;
  return {eps * (x * x * (1 - x / 3) + 1.0 / 3), x * (2 - x)};
}

Vector3 slip(const FrictionTerm& term, const std::vector<Vector3>& positions) {
  const auto i = static_cast<std::size_t>(term.node);
  const Vector3 now =
      term.on_segment ? Vector3((1 - term.s) * positions[i] + term.s * positions[i + 1]) : positions[i];
  const Vector3 moved = now - term.start;
  return moved - term.normal.dot(moved) * term.normal;
}

}  // namespace

Vector3 Contacts::contactForce(const Term& term) const {
  const Barrier::Value b = barrier_(term.distance - radius_);
  return -(term.weight * b.slope * term.normal + b.energy * term.weight_by_motion);
}

Vector3 Contacts::frictionForce(const FrictionTerm& term, const std::vector<Vector3>& positions) const {
  const Vector3 u = slip(term, positions);
  const double y = u.norm();
  if (y <= 0) return Vector3::Zero();
  return -term.limit * smoothNorm(y, slip_length_).slope / y * u;
}

double Contacts::frictionEnergy(const std::vector<Vector3>& positions) const {
  double sum = 0;
  for (const FrictionTerm& term : friction_)
    sum += term.limit * smoothNorm(slip(term, positions).norm(), slip_length_).value;
  return sum;
}

void Contacts::addFrictionDerivatives(const std::vector<beam::Node>& nodes, BlockTridiagonal& system) const {
  for (const FrictionTerm& term : friction_) {
    const auto i = static_cast<std::size_t>(term.node);
    const Vector3 now =
        term.on_segment ? Vector3((1 - term.s) * nodes[i].pose.position + term.s * nodes[i + 1].pose.position)
                        : nodes[i].pose.position;
    Vector3 u = now - term.start;
    u -= term.normal.dot(u) * term.normal;
    const double y = u.norm();
    const SmoothNorm f = smoothNorm(y, slip_length_);
    // Hessian in the tangent plane: slope/y across the slip, slope' along it; both >= 0.
    const double across = y > 1e-12 * slip_length_ ? f.slope / y : 2 / slip_length_;
    const double along = y < slip_length_ ? 2 / slip_length_ * (1 - y / slip_length_) : 0;
    Matrix3 h = across * (Matrix3::Identity() - term.normal * term.normal.transpose());
    if (y > 1e-12 * slip_length_) h += (along - across) / (y * y) * u * u.transpose();
    h *= term.limit;
    const Vector3 gradient = term.limit * across * u;
    const Matrix3& r0 = nodes[i].rotation;
    const double s0 = 1 - term.s, s1 = term.s;
    system.rhs(i).tail<3>() -= s0 * (r0.transpose() * gradient);
    system.diagonal(i).bottomRightCorner<3, 3>().noalias() += s0 * s0 * (r0.transpose() * h * r0);
    if (!term.on_segment) continue;
    const Matrix3& r1 = nodes[i + 1].rotation;
    system.rhs(i + 1).tail<3>() -= s1 * (r1.transpose() * gradient);
    system.diagonal(i + 1).bottomRightCorner<3, 3>().noalias() += s1 * s1 * (r1.transpose() * h * r1);
    system.upper(i).bottomRightCorner<3, 3>().noalias() += s0 * s1 * (r0.transpose() * h * r1);
  }
}

}  // namespace tendril::contact
