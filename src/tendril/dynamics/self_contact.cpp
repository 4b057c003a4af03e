#include "tendril/dynamics/self_contact.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "tendril/geometry.h"

namespace tendril::contact {

void SelfContacts::prepare(double radius, double element_length, const Barrier& barrier) {
  radius_ = radius;
  barrier_ = barrier;
  // Elements i < j are (j - i - 1) h apart along the rod; nearer than pi r it is only bending.
  least_apart_ =
      1 + std::max(1, static_cast<int>(std::floor(std::numbers::pi * radius / element_length)) + 1);
}

void SelfContacts::findCandidates(const std::vector<Vector3>& positions, const std::vector<Vector3>& motion) {
  candidates_.clear();
  const std::size_t elements = positions.size() - 1;
  boxes_.resize(elements), order_.resize(elements);
  for (std::size_t k = 0; k < elements; ++k) {
    boxes_[k] = {};
    for (const std::size_t i : {k, k + 1})
      boxes_[k].include(positions[i]), boxes_[k].include(positions[i] + motion[i]);
    boxes_[k].inflate(radius_ + 0.5 * barrier_.dhat * (1 + 1e-9));
    order_[k] = static_cast<int>(k);
  }
  // Along the axis on which the rod is longest, a box meets only those that begin before it ends.
  Aabb all;
  for (const Aabb& box : boxes_) all.include(box.min), all.include(box.max);
  Eigen::Index axis = 0;
  (all.max - all.min).maxCoeff(&axis);
  const auto box = [&](int k) -> const Aabb& { return boxes_[static_cast<std::size_t>(k)]; };
  std::sort(order_.begin(), order_.end(),
            [&](int a, int b) { return std::pair(box(a).min[axis], a) < std::pair(box(b).min[axis], b); });
  for (std::size_t m = 0; m < elements; ++m)
    for (std::size_t n = m + 1; n < elements && box(order_[n]).min[axis] <= box(order_[m]).max[axis]; ++n) {
      const auto [i, j] = std::minmax(order_[m], order_[n]);
      if (j - i < least_apart_) continue;
      if ((box(i).min.array() <= box(j).max.array()).all() &&
          (box(i).max.array() >= box(j).min.array()).all())
        candidates_.push_back({i, j});
    }
  std::sort(candidates_.begin(), candidates_.end(),
            [](const Pair& a, const Pair& b) { return std::pair(a.i, a.j) < std::pair(b.i, b.j); });
}

double SelfContacts::freeFraction(const std::vector<Vector3>& positions, const std::vector<Vector3>& motion,
                                  KeptGap keep) const {
  double fraction = 1;
  for (const Pair& pair : candidates_) {
    const auto i = static_cast<std::size_t>(pair.i), j = static_cast<std::size_t>(pair.j);
    fraction = std::min(fraction, freeMotionSegmentSegment(positions[i], positions[i + 1], motion[i],
                                                           motion[i + 1], positions[j], positions[j + 1],
                                                           motion[j], motion[j + 1], 2 * radius_, keep));
  }
  return fraction;
}

void SelfContacts::add(const Pair& pair, double s, double t, const Vector3& apart, double distance,
                       double weight, const Vector3& weight_by_u, const Vector3& weight_by_v) {
  if (distance < 2 * radius_ + barrier_.dhat)
    terms_.push_back({pair.i, pair.j, s, t, apart / distance, distance, weight, weight_by_u, weight_by_v});
}

bool SelfContacts::evaluate(const std::vector<Vector3>& positions) {
  terms_.clear();
  for (const Pair& pair : candidates_) {
    const Vector3& p0 = positions[static_cast<std::size_t>(pair.i)];
    const Vector3& p1 = positions[static_cast<std::size_t>(pair.i) + 1];
    const Vector3& q0 = positions[static_cast<std::size_t>(pair.j)];
    const Vector3& q1 = positions[static_cast<std::size_t>(pair.j) + 1];
    const SegmentSegment near = closestPointsOfSegments(p0, p1, q0, q1);
    if (near.distance <= 2 * radius_) return false;
    if (near.distance >= 2 * radius_ + barrier_.dhat) continue;
    const Vector3 u = p1 - p0, v = q1 - q0;
    const Mollifier m(u, v);
    add(pair, near.s, near.t, p0 + near.s * u - q0 - near.t * v, near.distance, m.weight, m.by_u, m.by_v);
    if (!m.fades()) continue;
    for (const double s : {0.0, 1.0}) {
      const Vector3 p = p0 + s * u;
      const PointSegment foot = closestPointOnSegment(p, q0, q1);
      add(pair, s, foot.t, p - q0 - foot.t * v, foot.distance, 1 - m.weight, -m.by_u, -m.by_v);
    }
    for (const double t : {0.0, 1.0}) {
      const Vector3 q = q0 + t * v;
      const PointSegment foot = closestPointOnSegment(q, p0, p1);
      add(pair, foot.t, t, p0 + foot.t * u - q, foot.distance, 1 - m.weight, -m.by_u, -m.by_v);
    }
  }
  return true;
}

double SelfContacts::leastGap() const {
  double least = std::numeric_limits<double>::infinity();
  for (const Term& term : terms_) least = std::min(least, term.distance - 2 * radius_);
  return least;
}

double SelfContacts::energy() const {
  double sum = 0;
  for (const Term& term : terms_) sum += term.weight * barrier_(term.distance - 2 * radius_).energy;
  return sum;
}

void SelfContacts::addDerivatives(const std::vector<beam::Node>& nodes, BlockTridiagonal& system) const {
  for (const Term& term : terms_) {
    const Barrier::Value b = barrier_(term.distance - 2 * radius_);
    const auto direction = [&](int element) -> Vector3 {
      const auto k = static_cast<std::size_t>(element);
      return nodes[k + 1].pose.position - nodes[k].pose.position;
    };
    const auto side = [&](int element, double s, int other, double t, const Vector3& normal,
                          const Vector3& weight_gradient) {
      const auto i = static_cast<std::size_t>(element);
      const Vector3 along = b.energy * weight_gradient, push = term.weight * b.slope * normal;
      const Vector3 n0 = (1 - s) * (nodes[i].rotation.transpose() * normal);
      const Vector3 n1 = s * (nodes[i + 1].rotation.transpose() * normal);
      system.rhs(i).tail<3>() -= nodes[i].rotation.transpose() * ((1 - s) * push - along);
      system.rhs(i + 1).tail<3>() -= nodes[i + 1].rotation.transpose() * (s * push + along);
      addRankOne(system, i, 2 * term.weight * b.curvature, n0, n1);
      if (term.weight != 1 || s <= 0 || s >= 1) return;  // a fading pair, or a node: no tilting
      const Vector3 u = direction(element), v = direction(other);
      const Vector3 across = t > 0 && t < 1 ? Vector3(u - u.dot(v) / v.squaredNorm() * v) : u;
      const Vector3 dual = across / across.squaredNorm(), tilt = dual.norm() * normal, e = dual.normalized();
      addTilt(system, nodes, i, -b.slope, term.distance, s, normal, dual);
      // What the other strand slides by along the tilting one: -2 alpha beta <= d alpha^2 + beta^2/d.
      const auto j = static_cast<std::size_t>(other);
      addRankOne(system, i, -b.slope * term.distance, nodes[i].rotation.transpose() * -tilt,
                 nodes[i + 1].rotation.transpose() * tilt);
      addRankOne(system, j, -b.slope / term.distance, (1 - t) * (nodes[j].rotation.transpose() * e),
                 t * (nodes[j + 1].rotation.transpose() * e));
    };
    side(term.i, term.s, term.j, term.t, term.normal, term.weight_by_u);
    side(term.j, term.t, term.i, term.s, -term.normal, term.weight_by_v);
  }
}

}  // namespace tendril::contact
