/// What a step's result says to people: read off the same springs, elements and barriers that the step was
/// solved with.
#include "tendril/quantities.h"

#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include "tendril/dynamics/workspace.h"

namespace tendril {
namespace {

/// Strains, elastic wrench and elastic energy of the elements; what guards their length counts as tension and
/// stretch, what guards their turn as moment and bending. A Rayleigh damper's share of the wrench is left
/// out: it has no energy, and an element at rest does not feel it.
void measureElements(const RodModel& model, RodWorkspace::Impl& w, Quantities& q) {
  const std::size_t n = w.nodes.size() - 1;
  const double h = w.law.h;
  dynamics::ElementLaw law = w.law;
  law.rate = 0;
  Table law_rows;
  ElementState elastic;
  law_rows.resize(8, n), elastic.resize(n);
  const auto count = static_cast<int>(n);
  dynamics::kernel().prepare(count, law, w.rest_curvature.rows(), w.elements.psi.rows(), w.u_hat.rows(),
                             law_rows.rows());
  dynamics::kernel().wrenches(count, law, w.elements.psi.rows(), law_rows.rows(), elastic.wrench.rows(),
                              elastic.energies.data());
  q.curvature.resize(n), q.strain.resize(n), q.internal_moment.resize(n), q.internal_force.resize(n);
  const LengthGuard guard(h, law.c[3]);
  const TurnGuard turn_guard = w.turnGuard();
  double sharpest = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const Vector6 f = elastic.wrench.column(k), u = strain(f, model.rod.c);
    const Vector6 xi = w.elements.psi.column(k) / h;
    q.curvature[k] = xi.head<3>(), q.strain[k] = u.tail<3>();
    q.internal_moment[k] = f.head<3>(), q.internal_force[k] = f.tail<3>();

    const Vector6 energy = 0.5 * h * f.cwiseProduct(u);
    q.twist += energy[0], q.stretch += energy[3], q.shear += energy[4] + energy[5];
    q.bending += std::max(0.0, elastic.energies[k] - energy[0] - energy[3] - energy[4] - energy[5]);

    if (const Vector3 turn = w.elements.turn(k); turn_guard.acts(turn)) {
      const double angle = turn.norm();
      const Guard::Value g = turn_guard(angle);
      q.internal_moment[k] += g.slope / angle * turn;
      q.bending += g.energy;
    }
    const Vector3 e = w.positions[k + 1] - w.positions[k];
    if (guard.acts(e)) {
      const double length = e.norm();
      const Guard::Value g = guard(length);
      const Quaternion middle = w.nodes[k].pose.rotation * expSO3(0.5 * h * q.curvature[k]);
      q.internal_force[k] += g.slope / length * (middle.conjugate() * e);
      q.stretch += g.energy;
    }

    // The element's centreline, p' = R v and R' = R kappa^, has the curvature |kappa x v|/|v|^2.
    const Vector3 v = xi.tail<3>();
    const double bent = xi.head<3>().cross(v).norm() / v.squaredNorm();
    if (bent <= sharpest) continue;
    sharpest = bent;
    q.bend_radius = 1 / bent;
    q.bend_radius_s = (static_cast<double>(k) + 0.5) * h;
  }
}

void measureGrippers(const RodWorkspace::Impl& w, Quantities& q) {
  for (const End end : kBothEnds) {
    const auto e = static_cast<std::size_t>(end);
    if (!w.goals[e].held) continue;
    const Node& node = end == End::first ? w.nodes.front() : w.nodes.back();
    w.grips[e].visit(node.pose, [&](const Spring& spring, const Vector3& x, bool rotation) {
      const double length = x.norm();
      if (length > 0)
        (rotation ? q.gripper_moment : q.gripper_force)[e] -=
            node.rotation * (spring(length).slope / length * x);
    });
  }
}

void measureMotion(const RodModel& model, const RodState& state, const RodWorkspace::Impl& w, Quantities& q) {
  for (std::size_t i = 0; i < state.nodes.size(); ++i) {
    const Vector3 offset = w.massOffset(i) * Vector3::UnitX(), turn = state.velocities[i].head<3>();
    const Vector3 at = w.positions[i] + w.nodes[i].rotation * offset;  // of the node's mass
    const Vector3 velocity = state.velocities[i].tail<3>() + w.nodes[i].rotation * turn.cross(offset);
    q.kinetic += 0.5 * w.masses[i] * (velocity.squaredNorm() + turn.cwiseProduct(w.rotary).dot(turn));
    q.gravity -= w.masses[i] * model.gravity.dot(at);
  }
}

/// Contact forces and their energy. A rod that penetrates has none: the barrier has no value there.
void measureContacts(RodWorkspace::Impl& w, double h, Quantities& q) {
  if (!w.has_contacts) return;
  // The terms are those of the last trial, not of the iterate where that trial was refused.
  for (Vector3& m : w.motion) m.setZero();
  w.contacts.findCandidates(w.positions, w.motion);
  if (!w.contacts.evaluate(w.positions)) return;
  q.contact = w.contacts.energy();
  const auto at = [&](int segment, double s) -> Vector3 {
    const auto i = static_cast<std::size_t>(segment);
    return s > 0 ? Vector3((1 - s) * w.positions[i] + s * w.positions[i + 1]) : w.positions[i];
  };
  for (const contact::Term& term : w.contacts.terms())
    q.contacts.push_back({(term.node + term.s) * h, at(term.node, term.s) - term.distance * term.normal,
                          w.contacts.contactForce(term)});
  for (const contact::FrictionTerm& term : w.contacts.frictionTerms())
    q.friction.push_back(
        {(term.node + term.s) * h, at(term.node, term.s), w.contacts.frictionForce(term, w.positions)});
  const contact::SelfContacts& self = w.contacts.selfContacts();
  for (const contact::SelfContacts::Term& term : self.terms())
    q.self_contacts.push_back({{(term.i + term.s) * h, (term.j + term.t) * h},
                               at(term.i, term.s) - 0.5 * term.distance * term.normal,
                               self.normalForce(term) * term.normal});
}

}  // namespace

Quantities measure(const RodModel& model, const RodState& state, RodWorkspace& workspace) {
  RodWorkspace::Impl& w = workspace.impl();
  assert(w.nodes.size() == state.nodes.size());
  Quantities q;
  measureElements(model, w, q);
  measureGrippers(w, q);
  measureMotion(model, state, w, q);
  measureContacts(w, model.rod.elementLength(), q);
  const double distance =
      model.obstacles->clearance(w.positions, std::numeric_limits<double>::infinity()).distance;
  if (std::isfinite(distance)) q.clearance = distance - model.rod.radius;
  q.total = q.kinetic + q.twist + q.bending + q.stretch + q.shear + q.gravity + q.contact;
  return q;
}

QuantitiesRecorder::QuantitiesRecorder(const RodModel& model, const RodState& start, RodWorkspace& workspace)
    : model_(model), ends_{start.nodes.front(), start.nodes.back()} {
  workspace.impl().prepare(model, {}, start);  // as if a step of no duration had led there
  start_total_ = measure(model, start, workspace).total;
}

void QuantitiesRecorder::record(double time, std::int64_t stored, const RodState& state,
                                RodWorkspace& workspace) {
  Quantities q = measure(model_, state, workspace);
  q.time = time, q.state = stored;
  // Implicit Euler has the force of a step's end act during all of it; the second-order scheme goes with the
  // trapezoidal rule, but for its first step, before which the force is not known.
  const bool euler = !isSecondOrder(model_.simulation);
  const Quantities& before = quantities_.empty() || euler ? q : quantities_.back();
  if (!quantities_.empty()) q.gripper_work = quantities_.back().gripper_work;
  for (const End end : kBothEnds) {
    const auto e = static_cast<std::size_t>(end);
    const Pose from = std::exchange(ends_[e], endPose(state.nodes, end));
    if (!workspace.impl().goals[e].held) continue;
    const Vector3 way = ends_[e].position - from.position;
    const Vector3 turn = from.rotation * logSO3(from.rotation.conjugate() * ends_[e].rotation);
    q.gripper_work[e] += 0.5 * (before.gripper_force[e] + q.gripper_force[e]).dot(way) +
                         0.5 * (before.gripper_moment[e] + q.gripper_moment[e]).dot(turn);
  }
  q.dissipated = q.gripper_work[0] + q.gripper_work[1] - (q.total - start_total_);
  quantities_.push_back(std::move(q));
}

}  // namespace tendril
