#include "tendril/verification/clearance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>

#include "tendril/verification/motion.h"

namespace tendril::verification {
namespace {

/// Two bodies at one moment: an element with a face, or with another element.
struct Place {
  std::size_t state;  // the motion from `state` - 1 to it; 0 for a motion of one state
  std::size_t element;
  const Face* face = nullptr;
  std::size_t other_element = 0;
  double t = 0;         // fraction of the step
  double distance = 0;  // m
};

/// One step of the motion, the elements' ends at its two ends.
struct Step {
  const RodShape& from;
  const RodShape& to;

  [[nodiscard]] Bounds sweptBounds(std::size_t element) const {
    Bounds box;
    for (const std::size_t i : {element, element + 1})
      box.include(from[i].position), box.include(to[i].position);
    return box;
  }
  [[nodiscard]] PairMotion pairWith(std::size_t element, const Face& face) const {
    PairMotion pair = rodPart(element);
    pair.other_t0 = pair.other_t1 = face.corners;
    pair.corners = 3;
    return pair;
  }
  [[nodiscard]] PairMotion pairWith(std::size_t element, std::size_t other) const {
    PairMotion pair = rodPart(element);
    pair.other_t0 = {from[other].position, from[other + 1].position, Vector3::Zero()};
    pair.other_t1 = {to[other].position, to[other + 1].position, Vector3::Zero()};
    pair.corners = 2;
    return pair;
  }

 private:
  [[nodiscard]] PairMotion rodPart(std::size_t element) const {
    PairMotion pair;
    pair.rod_t0 = {from[element].position, from[element + 1].position};
    pair.rod_t1 = {to[element].position, to[element + 1].position};
    return pair;
  }
};

/// Whether the direction of the face's normal alone keeps the element `distance` away all along: the cheapest
/// proof there is. It holds for any direction, so a normal spoilt by rounding (a sliver's) costs nothing but
/// time.
bool faceNormalSeparates(const PairMotion& pair, const Face& face, double distance) {
  const Vector3& origin = face.corners[0];
  double rod_low = std::numeric_limits<double>::infinity(), rod_high = -rod_low;
  for (const auto* ends : {&pair.rod_t0, &pair.rod_t1})
    for (const Vector3& end : *ends) {
      const double height = face.normal.dot(end - origin);
      rod_low = std::min(rod_low, height), rod_high = std::max(rod_high, height);
    }
  const double b = face.normal.dot(face.corners[1] - origin), c = face.normal.dot(face.corners[2] - origin);
  return rod_low - std::max({0.0, b, c}) >= distance || std::min({0.0, b, c}) - rod_high >= distance;
}

/// Carries the proofs of one kind through a motion: what is to be proved, where the rod came nearest, where
/// it failed.
class Prover {
 public:
  Prover(double thickness, double length) : goal_(thickness, length) {}

  [[nodiscard]] double distance() const { return goal_.value(); }
  [[nodiscard]] const DistanceToProve& goal() const { return goal_; }
  [[nodiscard]] const std::optional<Place>& nearest() const { return nearest_; }
  [[nodiscard]] const std::optional<Place>& failure() const { return failure_; }

  void prove(const PairMotion& pair, Place place) {
    const Proof proof = verification::prove(pair, goal_, [&](double t, double distance) {
      nearest_ = place;
      nearest_->t = t, nearest_->distance = distance;
    });
    if (proof.status == Proof::Status::proved) return;
    const Proof worst = deepest(pair, proof);
    if (failure_ && failure_->distance <= worst.distance) return;
    place.t = worst.t, place.distance = worst.distance;
    failure_ = place;
  }

 private:
  DistanceToProve goal_;
  std::optional<Place> nearest_, failure_;
};

void proveStepAgainstFaces(const Step& step, std::size_t state, const FaceTree& faces,
                           std::vector<const Face*>& scratch, Prover& prover) {
  for (std::size_t element = 0; element + 1 < step.from.size(); ++element) {
    faces.facesNear(step.sweptBounds(element), prover.distance(), scratch);
    for (const Face* face : scratch) {
      const PairMotion pair = step.pairWith(element, *face);
      if (faceNormalSeparates(pair, *face, prover.distance())) continue;
      prover.prove(pair, {.state = state, .element = element, .face = face});
    }
  }
}

void proveStepAgainstItself(const Step& step, std::size_t state, std::size_t between, Prover& prover) {
  // Elements in the order of where their boxes begin along x: those that can be near come soon after one
  // another.
  const std::size_t elements = step.from.size() - 1;
  std::vector<Bounds> boxes(elements);
  std::vector<std::size_t> order(elements);
  for (std::size_t e = 0; e < elements; ++e) boxes[e] = step.sweptBounds(e), order[e] = e;
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return boxes[a].min.x() != boxes[b].min.x() ? boxes[a].min.x() < boxes[b].min.x() : a < b;
  });
  for (std::size_t i = 0; i < elements; ++i) {
    for (std::size_t j = i + 1; j < elements; ++j) {
      if (boxes[order[j]].min.x() - prover.distance() > boxes[order[i]].max.x()) break;
      const auto [a, b] = std::minmax(order[i], order[j]);
      if (b - a <= between || !boxes[a].near(boxes[b], prover.distance())) continue;
      prover.prove(step.pairWith(a, b), {.state = state, .element = a, .other_element = b});
    }
  }
}

/// Calls prove_step(step, state) for every step until one fails. A motion of one state is a step that stands
/// still.
template <class ProveStep>
void walk(const Trajectory& trajectory, Prover& prover, ProveStep&& prove_step) {
  const std::vector<RodShape>& shapes = trajectory.shapes;
  if (shapes.size() == 1) prove_step(Step{shapes[0], shapes[0]}, std::size_t{0});
  for (std::size_t k = 1; k < shapes.size() && !prover.failure(); ++k)
    prove_step(Step{shapes[k - 1], shapes[k]}, k);
}

std::string when(const Trajectory& trajectory, const Place& place) {
  const std::vector<double>& time = trajectory.time_s;
  const std::size_t k = place.state;
  if (k == 0 || place.t == 1) return fmt::format("at state {} (t = {:.6g} s)", k, time[k]);
  if (place.t == 0) return fmt::format("at state {} (t = {:.6g} s)", k - 1, time[k - 1]);
  return fmt::format("between states {} and {} (t = {:.6g} s)", k - 1, k,
                     time[k - 1] + place.t * (time[k] - time[k - 1]));
}

/// The outcome in words; `what` names the body on the other side, `limit` the distance it is held to.
Clearance outcome(const Trajectory& trajectory, const Prover& prover, Check check,
                  const std::function<std::string(const Place&)>& what, const std::string& limit) {
  if (const auto& failure = prover.failure()) {
    const double required = prover.goal().required(), distance = failure->distance;
    const std::string where = fmt::format("element {} {}", failure->element, when(trajectory, *failure));
    if (distance >= required) {
      check.message = fmt::format("{} cannot be shown to keep its distance from {}: {:.8g} mm, {}", where,
                                  what(*failure), 1e3 * distance, limit);
    } else if (distance == 0) {
      check.message = fmt::format("{} cuts through {}; {}", where, what(*failure), limit);
    } else {
      check.message = fmt::format("{} comes within {:.6g} mm of {}; {} (too near by {:.3g} mm)", where,
                                  1e3 * distance, what(*failure), limit, 1e3 * (required - distance));
    }
    return {check, distance - prover.goal().thickness()};
  }
  check.passed = true;
  const double gap = prover.goal().gap();
  check.message = fmt::format("the gap is at least {:.6g} mm at every moment", 1e3 * gap);
  if (prover.goal().isMeasured())
    check.message += fmt::format("; the smallest measured, {:.6g} mm, is that of element {} to {} {}",
                                 1e3 * prover.goal().measuredGap(), prover.nearest()->element,
                                 what(*prover.nearest()), when(trajectory, *prover.nearest()));
  return {check, gap};
}

}  // namespace

std::size_t elementsBetween(const RodProperties& rod) {
  return static_cast<std::size_t>(std::floor(std::numbers::pi * rod.radius / rod.elementLength())) + 1;
}

Clearance checkClearance(const Trajectory& trajectory, const RodProperties& rod, const FaceTree& faces,
                         const std::vector<std::string>& mesh_names) {
  Prover prover(rod.radius, rod.length);
  std::vector<const Face*> scratch;
  walk(trajectory, prover, [&](const Step& step, std::size_t state) {
    proveStepAgainstFaces(step, state, faces, scratch, prover);
  });
  return outcome(
      trajectory, prover, {"clearance", false, ""},
      [&](const Place& place) {
        return fmt::format("face {} of {}", place.face->number,
                           mesh_names[static_cast<std::size_t>(place.face->mesh)]);
      },
      fmt::format("the radius is {:.6g} mm", 1e3 * rod.radius));
}

Clearance checkSelfContact(const Trajectory& trajectory, const RodProperties& rod) {
  Prover prover(2 * rod.radius, rod.length);
  const std::size_t between = elementsBetween(rod);
  walk(trajectory, prover,
       [&](const Step& step, std::size_t state) { proveStepAgainstItself(step, state, between, prover); });
  return outcome(
      trajectory, prover, {"self_contact", false, ""},
      [](const Place& place) { return fmt::format("element {}", place.other_element); },
      fmt::format("twice the radius is {:.6g} mm", 2e3 * rod.radius));
}

bool isClear(const RodShape& shape, const RodProperties& rod, const FaceTree& faces) {
  Prover to_faces(rod.radius, rod.length), to_itself(2 * rod.radius, rod.length);
  std::vector<const Face*> scratch;
  proveStepAgainstFaces({shape, shape}, 0, faces, scratch, to_faces);
  if (rod.self_contact) proveStepAgainstItself({shape, shape}, 0, elementsBetween(rod), to_itself);
  return !to_faces.failure() && !to_itself.failure();
}

}  // namespace tendril::verification
