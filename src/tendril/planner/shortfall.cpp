#include "tendril/planner/shortfall.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tendril/planner/extend.h"

namespace tendril {
namespace {

constexpr double kPhase = 1;        // s of simulated time the grippers carry on for, per phase
constexpr double kTimeStep = 0.02;  // s, at least: the probe wants rest, not waves
constexpr double kAtRest = 0.02;    // of the grippers' speed: what moves slower is at rest
constexpr double kNearer = 0.9;     // of the distance: a probe that ends nearer gets on
constexpr double kAtLimit = 0.95;   // of its largest force or torque: the gripper exerts it
constexpr double kResists = 0.1;    // of the gripper's force: contacts that add up to less do not resist it
constexpr double kOpposite = -0.5;  // cosine of the angle between forces that press on opposite sides

/// What came of carrying on toward the goal.
struct Probe {
  RodState state;
  bool reached = false;       // the goal
  bool ends_reached = false;  // both ends are at the goal, and the rod at rest
  bool cancelled = false;
  // Of the first phase whose gripper did not get to its pose.
  std::optional<End> stuck;
  bool left_workspace = false;
  RodShape shape;
  Quantities quantities;
};

double endDistance(const RodShape& a, const RodShape& b, End end) {
  return (endPose(a, end).position - endPose(b, end).position).norm();
}
double endAngle(const RodShape& a, const RodShape& b, End end) {
  return angleBetween(endPose(a, end).rotation, endPose(b, end).rotation);
}

/// The scenario's rod, in steps of equal length.
Scenario probedScenario(Scenario scenario) {
  scenario.simulation.time_step = std::max(scenario.simulation.time_step, kTimeStep);
  scenario.simulation.step_tolerance = 0;
  return scenario;
}

class Prober {
 public:
  Prober(const Scenario& scenario, const Obstacles& obstacles, const GoalTest& goal,
         const std::function<bool()>& stop)
      : scenario_(probedScenario(scenario)),
        model_(scenario_, obstacles),
        goal_(goal),
        stop_(stop),
        reach_(std::min(scenario.planner.reach_fraction * scenario.rod.length,
                        scenario.goal->position_tolerance)) {}

  /// Algorithm 1 from `last` to the goal's end poses, then rest if both arrive.
  [[nodiscard]] Probe operator()(const RodShape& last, End leading);
  /// What stops a probe that did not get there.
  void judge(const Probe& probe, Shortfall& out) const;

 private:
  /// Whether an end is where a phase of EXTEND takes it.
  [[nodiscard]] bool positionReached(const RodShape& shape, End end) const {
    return endDistance(shape, goal_.shape(), end) <= reach_;
  }
  [[nodiscard]] bool arrived(const RodShape& shape, End end) const {
    return positionReached(shape, end) && endAngle(shape, goal_.shape(), end) <= kReachAngle;
  }
  /// Whether an end is within the goal's tolerances.
  [[nodiscard]] bool atGoal(const RodShape& shape, End end) const {
    const Goal& goal = *scenario_.goal;
    return endDistance(shape, goal_.shape(), end) <= goal.position_tolerance &&
           (!goal.angle_tolerance || endAngle(shape, goal_.shape(), end) <= *goal.angle_tolerance);
  }
  void rest(Probe& probe);
  [[nodiscard]] Limit limitOf(const Probe& probe, End gripper) const;
  [[nodiscard]] bool pinched(const Probe& probe, double force) const;
  [[nodiscard]] FaceContact faceContact(const ContactForce& contact) const;
  /// A place on the centreline [m, world], at arc length `s` [m].
  [[nodiscard]] Vector3 placeAt(const RodShape& shape, double s) const;
  [[nodiscard]] Vector3 nearestToWorkspaceLimit(const RodShape& shape) const;

  Scenario scenario_;
  RodModel model_;
  const GoalTest& goal_;
  const std::function<bool()>& stop_;
  double reach_;  // m
  RodWorkspace workspace_;
};

Probe Prober::operator()(const RodShape& last, End leading) {
  const Extend extend(model_, {.reach = reach_, .phase_limit = kPhase});
  Probe probe;
  probe.state = RodState::atRest(last);
  for (const Phase& phase : algorithm1(leading, {goal_.shape().front(), goal_.shape().back()}).phases) {
    const ExtendReport report = extend({{phase}}, probe.state, workspace_, stop_);
    probe.cancelled = probe.cancelled || report.cancelled;
    const bool moved = report.steps > 0 || report.left_workspace;  // else it was there, or may not move
    if (probe.stuck || !moved || arrived(probe.state.nodes, phase.moving)) continue;
    probe.stuck = phase.moving;
    probe.left_workspace = report.left_workspace;
    probe.shape = probe.state.nodes;
    if (!report.left_workspace) probe.quantities = measure(model_, probe.state, workspace_);
  }
  const auto bothAtGoal = [&] {
    return atGoal(probe.state.nodes, End::first) && atGoal(probe.state.nodes, End::last);
  };
  if (bothAtGoal()) rest(probe);
  probe.ends_reached = bothAtGoal();
  probe.reached = goal_(probe.state.nodes);
  return probe;
}

/// Holds both ends until the rod is at rest, if the scenario's grasps allow it.
void Prober::rest(Probe& probe) {
  if (!model_.grippers.allows(Grasp::both)) return;
  Control hold;
  hold.held = {true, true};
  ControlRunner runner(model_, hold, probe.state);
  const double least = kAtRest * model_.grippers.max_speed * model_.simulation.time_step;
  for (double time = 0; time < kPhase; time += model_.simulation.time_step) {
    if (stop_()) {
      probe.cancelled = true;
      return;
    }
    const RodShape before = probe.state.nodes;
    runner.advance(probe.state, workspace_);
    if (maxNodeDistance(before, probe.state.nodes) < least) return;
  }
}

/// Whether the rod is held between opposite sides: two forces across it, at the same place along it (within
/// its diameter), each a good part of the gripper's.
bool Prober::pinched(const Probe& probe, double force) const {
  const std::vector<ContactForce>& contacts = probe.quantities.contacts;
  const auto across = [&](const ContactForce& c) -> Vector3 {
    const auto element =
        std::clamp(static_cast<int>(c.s / model_.rod.elementLength()), 0, model_.rod.elements - 1);
    const auto k = static_cast<std::size_t>(element);
    const Vector3 tangent = (probe.shape[k + 1].position - probe.shape[k].position).normalized();
    return c.force - tangent.dot(c.force) * tangent;
  };
  for (std::size_t i = 0; i < contacts.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      if (std::abs(contacts[i].s - contacts[j].s) > 2 * model_.rod.radius) continue;
      const Vector3 a = across(contacts[i]), b = across(contacts[j]);
      if (std::min(a.norm(), b.norm()) >= kResists * force && a.dot(b) <= kOpposite * a.norm() * b.norm())
        return true;
    }
  return false;
}

Limit Prober::limitOf(const Probe& probe, End gripper) const {
  if (probe.left_workspace) return Limit::workspace;
  const Quantities& q = probe.quantities;
  const auto e = static_cast<std::size_t>(gripper);
  const double force = q.gripper_force[e].norm(), torque = q.gripper_moment[e].norm();
  double resistance = 0;  // N
  for (const ContactForce& c : q.contacts) resistance += c.force.norm();
  for (const SelfContactForce& c : q.self_contacts) resistance += c.force.norm();

  if (!positionReached(probe.shape, gripper)) {
    if (force < kAtLimit * model_.grippers.max_force) return Limit::time;  // it is on its way
    if (pinched(probe, force)) return Limit::clearance;
    if (resistance >= kResists * force || !q.bend_radius_s) return Limit::force;
    const auto sharpest = static_cast<std::size_t>(*q.bend_radius_s / model_.rod.elementLength());
    return q.internal_force[sharpest].x() < 0 ? Limit::bend : Limit::force;
  }
  if (torque < kAtLimit * model_.grippers.max_torque) return Limit::time;
  const double twist =
      std::abs(q.gripper_moment[e].dot(endPose(probe.shape, gripper).rotation * Vector3::UnitX()));
  const bool twists = twist > std::sqrt(0.5) * torque;
  return twists || resistance * model_.rod.length >= kResists * torque ? Limit::torque : Limit::bend;
}

FaceContact Prober::faceContact(const ContactForce& contact) const {
  FaceContact out{
      .s = contact.s, .position = contact.position, .force = contact.force, .mesh = {}, .face = 0};
  const std::array<Vector3, 2> place = {contact.position, contact.position};
  const Obstacles::Clearance near = model_.obstacles->clearance(place, 1e-3 * model_.rod.radius);
  if (near.face < 0) return out;
  const Obstacles::Face& face = model_.obstacles->faces()[static_cast<std::size_t>(near.face)];
  out.mesh = scenario_.environment.meshes[static_cast<std::size_t>(face.mesh)].file;
  out.face = model_.obstacles->faceInMesh(near.face, contact.position);
  return out;
}

Vector3 Prober::placeAt(const RodShape& shape, double s) const {
  const double at = std::clamp(s / model_.rod.elementLength(), 0.0, static_cast<double>(model_.rod.elements));
  const auto k = std::min(static_cast<std::size_t>(at), shape.size() - 2);
  const double share = at - static_cast<double>(k);
  return (1 - share) * shape[k].position + share * shape[k + 1].position;
}

Vector3 Prober::nearestToWorkspaceLimit(const RodShape& shape) const {
  const auto room = [&](const Pose& node) {
    return std::min((node.position - model_.workspace.min).minCoeff(),
                    (model_.workspace.max - node.position).minCoeff());
  };
  return std::min_element(shape.begin(), shape.end(),
                          [&](const Pose& a, const Pose& b) { return room(a) < room(b); })
      ->position;
}

void Prober::judge(const Probe& probe, Shortfall& out) const {
  const Quantities& q = probe.quantities;
  const auto e = static_cast<std::size_t>(*probe.stuck);
  out.limit = limitOf(probe, *probe.stuck);
  if (out.limit == Limit::time) return;
  out.gripper = probe.stuck;
  if (probe.left_workspace) {
    out.position = nearestToWorkspaceLimit(probe.shape);
    return;
  }
  out.gripper_force = q.gripper_force[e].norm(), out.gripper_torque = q.gripper_moment[e].norm();
  out.clearance = q.clearance, out.bend_radius = q.bend_radius, out.bend_radius_s = q.bend_radius_s;
  const auto weaker = [](const auto& a, const auto& b) { return a.force.norm() < b.force.norm(); };
  const auto strongest = std::max_element(q.contacts.begin(), q.contacts.end(), weaker);
  const auto self = std::max_element(q.self_contacts.begin(), q.self_contacts.end(), weaker);
  if (strongest != q.contacts.end()) out.contact = faceContact(*strongest);
  if (out.limit == Limit::bend)
    out.position = placeAt(probe.shape, *q.bend_radius_s);
  else if (strongest != q.contacts.end())
    out.position = strongest->position;
  else if (self != q.self_contacts.end())
    out.position = self->position;
  else
    out.position = endPose(probe.shape, *probe.stuck).position;
}

/// Where the rod is farthest from the goal's shape.
Vector3 farthestNode(const RodShape& shape, const RodShape& goal) {
  std::size_t farthest = 0;
  for (std::size_t i = 0; i < shape.size(); ++i)
    if ((shape[i].position - goal[i].position).norm() >
        (shape[farthest].position - goal[farthest].position).norm())
      farthest = i;
  return shape[farthest].position;
}

}  // namespace

Shortfall shortfallOf(const Scenario& scenario, const Obstacles& obstacles, const GoalTest& goal,
                      const RodShape& last, const std::function<bool()>& stop) {
  Shortfall out;
  out.distance = goal.distance(last);
  out.largest_distance = maxNodeDistance(last, goal.shape());
  for (const End end : kBothEnds) {
    const auto e = static_cast<std::size_t>(end);
    out.end_distance[e] = endDistance(last, goal.shape(), end);
    out.end_angle[e] = endAngle(last, goal.shape(), end);
  }

  Prober prober(scenario, obstacles, goal, stop);
  std::optional<Probe> best;
  for (const End leading : kBothEnds) {
    Probe probe = prober(last, leading);
    if (probe.cancelled) return out;
    if (!best || probe.reached || goal.distance(probe.state.nodes) < goal.distance(best->state.nodes))
      best = std::move(probe);
    if (best->reached) break;
  }
  const double left = goal.distance(best->state.nodes);
  if (best->ends_reached && !best->reached) {
    out.limit = Limit::shape;
    out.position = farthestNode(best->state.nodes, goal.shape());
  } else if (best->reached || left < kNearer * out.distance || !best->stuck) {
    out.limit = Limit::time;
  } else {
    prober.judge(*best, out);
  }
  return out;
}

}  // namespace tendril
