/// The incremental potential of one time step, term by term; README.md has the formulas.
#include <cmath>
#include <numbers>

#include "tendril/dynamics/workspace.h"

namespace tendril {
namespace {

constexpr double kClamp = 1000;  // how much stiffer than a moving gripper one that is held still is
/// What a step of the second-order scheme leaves of the highest frequencies.
constexpr double kSpectralRadius = 0.8;

}  // namespace

void RodWorkspace::Impl::prepare(const RodModel& model, const std::array<GripperGoal, 2>& step_goals,
                                 const RodState& state) {
  const RodProperties& rod = model.rod;
  const std::size_t n = state.nodes.size();
  const std::size_t element_count = n - 1;
  const double h = rod.length / static_cast<double>(element_count), dt = model.simulation.time_step;
  const bool resized = nodes.size() != n;
  if (resized) {
    elements.resize(element_count);
    predicted_masses.resize(n), predicted_rotations.resize(n), predicted_motion.resize(n), masses.resize(n);
    nodes.resize(n), trial.resize(n);
    positions.resize(n), trial_positions.resize(n), motion.resize(n);
    limited_motion.resize(n);
    psi.resize(element_count), trial_psi.resize(element_count);
    wrenches.resize(element_count), trial_wrenches.resize(element_count);
    system.resize(n);
    gradient.resize(n);
  }

  // Implicit Euler, or the second-order scheme once there is a history.
  const bool inertia = model.simulation.inertia;
  const bool second =
      model.simulation.scheme == Scheme::second_order && inertia && !state.accelerations.empty();
  scheme = second ? Newmark::secondOrder(kSpectralRadius, dt) : Newmark::implicitEuler(dt);
  const double drag = model.simulation.drag;
  inertia_weight = inertia ? scheme.weight(drag) : std::max(drag, 1e-9) / dt;
  end_offset = h / 6;

  const double area = std::numbers::pi * rod.radius * rod.radius;
  for (std::size_t i = 0; i < n; ++i) {
    masses[i] = rod.density * area * h * (i == 0 || i + 1 == n ? 0.5 : 1.0);
    nodes[i].pose = state.nodes[i];
    nodes[i].rotation = state.nodes[i].rotation.toRotationMatrix();
    positions[i] = state.nodes[i].position;
    Vector6 predicted = Vector6::Zero();
    const Vector3 offset = massOffset(i) * Vector3::UnitX();
    predicted_masses[i] = positions[i] + nodes[i].rotation * offset;
    if (inertia) {
      const Vector6& v = state.velocities[i];
      const Vector6 a = second ? state.accelerations[i] : Vector6::Zero();
      predicted = scheme.predict(v, a, drag);
      const Vector3 w = v.head<3>();
      const Vector3 mass_v = v.tail<3>() + nodes[i].rotation * w.cross(offset);
      const Vector3 mass_a =
          a.tail<3>() + nodes[i].rotation * (a.head<3>().cross(offset) + w.cross(w.cross(offset)));
      predicted_masses[i] += scheme.predict(mass_v, second ? mass_a : Vector3::Zero(), drag);
    }
    predicted_rotations[i] = state.nodes[i].rotation * expSO3(predicted.head<3>());
    predicted_motion[i] = predicted.tail<3>();
  }
  // Rotary inertia of a round section per unit mass: (r^2/2, r^2/4, r^2/4).
  rotary = 0.25 * rod.radius * rod.radius * Vector3(2, 1, 1);

  // Rayleigh damping beta c du/dt with du/dt = (u - u_hat)/tau folds into the element: stiffness c (1 +
  // beta/tau), at ease at (u_rest + beta/tau u_hat) / (1 + beta/tau).
  const double rate = model.simulation.stiffness_damping / (second ? 2 * dt / 3 : dt);
  evaluateElements(nodes, psi, wrenches);  // psi is needed; the wrenches are set below
  for (std::size_t k = 0; k < element_count; ++k) {
    Vector6 u_hat = psi[k] / h;
    u_hat[3] -= 1;
    if (second) {
      const Node a{state.previous_nodes[k], state.previous_nodes[k].rotation.toRotationMatrix()};
      const Node b{state.previous_nodes[k + 1], state.previous_nodes[k + 1].rotation.toRotationMatrix()};
      Vector6 u_previous = beam::relativeLog(a, b) / h;
      u_previous[3] -= 1;
      u_hat = (4 * u_hat - u_previous) / 3;
    }
    Vector6 rest = Vector6::Zero();
    rest.head<3>() = rod.restCurvature(static_cast<int>(k));
    beam::Element& element = elements[k];
    element = {h, beam::elementStiffness(rod.c, h, rod.c[3] * (psi[k][3] / h - 1)), rest};
    for (int pass = 0; pass < 2; ++pass)  // the wrench owes something to the shift itself
      element.reference = rest + beam::restStrainShift(rod.c, h, psi[k], element.wrench(psi[k]));
    element.c *= 1 + rate;
    element.reference = (element.reference + rate * u_hat) / (1 + rate);
    wrenches[k] = elements[k].wrench(psi[k]);
  }

  // Grippers: PD as implicit springs that reach the largest force within 0.2 % of L and the largest torque
  // within 0.02 rad. A moving end gives way at these; one held still is clamped. None is pushed faster than a
  // fifth above its speed.
  goals = step_goals;
  const GripperLimits& limits = model.grippers;
  for (std::size_t e = 0; e < 2; ++e) {
    Grip& grip = grips[e];
    grip.target = goals[e].pose;
    grip.start = e == 0 ? state.nodes.front() : state.nodes.back();
    grip.pull = {.stiffness = limits.max_force / (0.002 * rod.length)};
    grip.turn = {.stiffness = limits.max_torque / 0.02};
    grip.travel_brake = {.stiffness = grip.pull.stiffness, .slack = 1.1 * limits.max_speed * dt};
    grip.turn_brake = {.stiffness = grip.turn.stiffness, .slack = 1.1 * limits.max_turn * dt};
    if (goals[e].moving)
      grip.pull.cap = limits.max_force, grip.turn.cap = limits.max_torque;
    else
      grip.pull.stiffness *= kClamp, grip.turn.stiffness *= kClamp;
  }

  has_contacts = !model.obstacles->faces().empty() || rod.self_contact;
  if (has_contacts) {
    const double dhat = model.simulation.contact_distance;
    contacts.prepare(*model.obstacles, rod, {dhat, 0.25 * model.grippers.max_force / dhat});
  }
}

void RodWorkspace::Impl::updateState(const RodModel& model, RodState& state) const {
  const bool keep_history = model.simulation.scheme == Scheme::second_order && model.simulation.inertia;
  if (!keep_history) state.accelerations.clear(), state.previous_nodes.clear();
  const bool second = !state.accelerations.empty();
  if (keep_history)
    state.accelerations.resize(nodes.size(), Vector6::Zero()), state.previous_nodes = state.nodes;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Vector6 v = state.velocities[i], a = second ? state.accelerations[i] : Vector6::Zero();
    Vector6 moved;
    moved << logSO3(state.nodes[i].rotation.conjugate() * nodes[i].pose.rotation),
        positions[i] - state.nodes[i].position;
    const Vector6 beyond = moved - scheme.coast(v, a);
    state.velocities[i] = scheme.coastVelocity(v, a) + scheme.velocityRate() * beyond;
    if (keep_history) state.accelerations[i] = scheme.accelerationRate() * beyond;
    state.nodes[i] = nodes[i].pose;
  }
}

void RodWorkspace::Impl::evaluateElements(const std::vector<Node>& at, std::vector<Vector6>& psi_out,
                                          std::vector<Vector6>& wrench_out) const {
  for (std::size_t k = 0; k < elements.size(); ++k) {
    psi_out[k] = beam::relativeLog(at[k], at[k + 1]);
    wrench_out[k] = elements[k].wrench(psi_out[k]);
  }
}

double RodWorkspace::Impl::smoothEnergy(const RodModel& model, const std::vector<Node>& at,
                                        const std::vector<Vector6>& f) const {
  double sum = 0;
  for (std::size_t k = 0; k < elements.size(); ++k) sum += elements[k].energy(f[k]);
  for (std::size_t i = 0; i < at.size(); ++i) {
    const double m = masses[i];
    const Vector3 mass_at = at[i].pose.position + massOffset(i) * at[i].rotation.col(0);
    sum += 0.5 * m * inertia_weight * (mass_at - predicted_masses[i]).squaredNorm();
    sum -= m * model.gravity.dot(mass_at);
    const Vector3 theta = logSO3(predicted_rotations[i].conjugate() * at[i].pose.rotation);
    sum += 0.5 * inertia_weight * m * theta.cwiseProduct(rotary).dot(theta);
  }
  for (const End end : kBothEnds) {
    const auto e = static_cast<std::size_t>(end);
    if (!goals[e].held) continue;
    const Pose& q = (end == End::first ? at.front() : at.back()).pose;
    grips[e].visit(q, [&](const Spring& spring, const Vector3& x, bool) { sum += spring(x.norm()).energy; });
  }
  return sum;
}

void RodWorkspace::Impl::assemble(const RodModel& model, bool geometric) {
  system.setZero();
  for (Vector6& r : system.rhs) r.setZero();
  beam::ElementDerivatives d;
  for (std::size_t k = 0; k < elements.size(); ++k) {
    beam::derivatives(elements[k], psi[k], wrenches[k], geometric, d);
    system.rhs[k] -= d.gradient_i;
    system.rhs[k + 1] -= d.gradient_j;
    system.diagonal[k] += d.hessian_ii;
    system.diagonal[k + 1] += d.hessian_jj;
    system.upper[k] += d.hessian_ij;
  }
  addSmoothTerms(model);
  if (!has_contacts) return;
  contacts.addDerivatives(nodes, system);
  contacts.addFrictionDerivatives(nodes, system);
}

void RodWorkspace::Impl::addSmoothTerms(const RodModel& model) {
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Matrix3& r = nodes[i].rotation;
    const double m = masses[i], w = m * inertia_weight;
    const double offset = massOffset(i);
    const Vector3 mass_at = nodes[i].pose.position + offset * r.col(0);
    const Vector3 force = r.transpose() * (w * (mass_at - predicted_masses[i]) - m * model.gravity);
    system.rhs[i].tail<3>() -= force;
    system.diagonal[i].diagonal().tail<3>().array() += w;
    if (offset != 0) {  // the mass moves by y - o x w, o along the tangent
      const Matrix3 o = skew(Vector3(offset, 0, 0));
      system.rhs[i].head<3>() -= o * force;
      system.diagonal[i].topLeftCorner<3, 3>() -= w * o * o;
      system.diagonal[i].topRightCorner<3, 3>() += w * o;
      system.diagonal[i].bottomLeftCorner<3, 3>() -= w * o;
    }
    const Vector3 theta = logSO3(predicted_rotations[i].conjugate() * nodes[i].pose.rotation);
    const Matrix3 j = rightJacobianInverseSO3(theta);
    system.rhs[i].head<3>() -= w * (j.transpose() * rotary.cwiseProduct(theta));
    system.diagonal[i].topLeftCorner<3, 3>() += w * (j.transpose() * rotary.asDiagonal() * j);
  }
  for (const End end : kBothEnds) {
    const auto e = static_cast<std::size_t>(end);
    if (!goals[e].held) continue;
    const std::size_t i = end == End::first ? 0 : nodes.size() - 1;
    // Radial potentials; for rotations the gradient by w is exact, for Jr(theta)^T theta = theta.
    grips[e].visit(nodes[i].pose, [&](const Spring& spring, const Vector3& x, bool rotation) {
      const double length = x.norm();
      const Spring::Value f = spring(length);
      const double secant = length > 0 ? f.slope / length : f.curvature;
      if (secant == 0 && spring.slack > 0) return;
      const int at = rotation ? 0 : 3;
      system.rhs[i].segment<3>(at) -= secant * x;
      Matrix3 h = secant * Matrix3::Identity();
      if (length > 0) h += (f.curvature - secant) / (length * length) * x * x.transpose();
      system.diagonal[i].block<3, 3>(at, at) += h;
    });
  }
}

}  // namespace tendril
