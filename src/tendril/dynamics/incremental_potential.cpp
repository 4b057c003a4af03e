/// The incremental potential of one time step, term by term; README.md has the formulas.
#include <cmath>
#include <numbers>

#include "tendril/dynamics/workspace.h"

namespace tendril {

void RodWorkspace::Impl::prepare(const RodModel& model, const std::array<GripperGoal, 2>& step_goals,
                                 const RodState& state) {
  const RodProperties& rod = model.rod;
  const std::size_t n = state.nodes.size();
  const std::size_t element_count = n - 1;
  const double h = rod.length / static_cast<double>(element_count), dt = model.simulation.time_step;
  const bool resized = nodes.size() != n;
  if (resized) {
    elements.resize(element_count);
    predicted_positions.resize(n), predicted_rotations.resize(n), masses.resize(n);
    nodes.resize(n), trial.resize(n);
    positions.resize(n), trial_positions.resize(n), motion.resize(n);
    limited_motion.resize(n);
    psi.resize(element_count), trial_psi.resize(element_count);
    wrenches.resize(element_count), trial_wrenches.resize(element_count);
    system.resize(n);
    gradient.resize(n);
  }

  // The scheme, as v_new = (x - x_hat)/tau and a = (v_new - v_hat)/tau: implicit Euler, or BDF2 once there is
  // a history.
  const bool second = model.simulation.scheme == Scheme::second_order && !state.previous_nodes.empty();
  const double tau = second ? 2 * dt / 3 : dt, drag = model.simulation.drag;
  const bool inertia = model.simulation.inertia;
  inertia_weight = (inertia ? 1 / (tau * tau) : 0) + std::max(drag, inertia ? 0.0 : 1e-9) / tau;
  const double coast = inertia ? tau / (1 + drag * tau) : 0;  // how far the velocity carries against the drag

  const double area = std::numbers::pi * rod.radius * rod.radius;
  for (std::size_t i = 0; i < n; ++i) {
    masses[i] = rod.density * area * h * (i == 0 || i + 1 == n ? 0.5 : 1.0);
    nodes[i].pose = state.nodes[i];
    nodes[i].rotation = state.nodes[i].rotation.toRotationMatrix();
    positions[i] = state.nodes[i].position;
    Vector6 v_hat = state.velocities[i];
    Vector3 x_hat = state.nodes[i].position;
    Vector3 turn = Vector3::Zero();  // from the frame now to the scheme's x_hat
    if (second) {
      v_hat = (4 * state.velocities[i] - state.previous_velocities[i]) / 3;
      x_hat = (4 * state.nodes[i].position - state.previous_nodes[i].position) / 3;
      turn = logSO3(state.previous_nodes[i].rotation.conjugate() * state.nodes[i].rotation) / 3;
    }
    predicted_positions[i] = x_hat + coast * v_hat.tail<3>();
    predicted_rotations[i] = state.nodes[i].rotation * expSO3(turn + coast * v_hat.head<3>());
  }
  // Rotary inertia of a round section per unit mass: (r^2/2, r^2/4, r^2/4).
  rotary = 0.25 * rod.radius * rod.radius * Vector3(2, 1, 1);

  // Rayleigh damping beta c du/dt with du/dt = (u - u_hat)/tau folds into the element: stiffness c (1 +
  // beta/tau), at ease at (u_rest + beta/tau u_hat) / (1 + beta/tau).
  const double rate = damping_rate = model.simulation.stiffness_damping / tau;
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
    Vector6 reference = (rate / (1 + rate)) * u_hat;
    reference.head<3>() += rod.restCurvature(static_cast<int>(k)) / (1 + rate);
    elements[k] = {h, (1 + rate) * rod.c, reference};
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
    if (goals[e].moving) grip.pull.cap = limits.max_force, grip.turn.cap = limits.max_torque;
    grip.travel_brake = {.stiffness = grip.pull.stiffness, .slack = 1.1 * limits.max_speed * dt};
    grip.turn_brake = {.stiffness = grip.turn.stiffness, .slack = 1.1 * limits.max_turn * dt};
  }

  has_contacts = !model.obstacles->faces().empty() || rod.self_contact;
  if (has_contacts) {
    const double dhat = model.simulation.contact_distance;
    contacts.prepare(*model.obstacles, rod, {dhat, 0.25 * model.grippers.max_force / dhat});
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
    sum += 0.5 * m * inertia_weight * (at[i].pose.position - predicted_positions[i]).squaredNorm();
    sum -= m * model.gravity.dot(at[i].pose.position);
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
    const Vector3 force = w * (nodes[i].pose.position - predicted_positions[i]) - m * model.gravity;
    system.rhs[i].tail<3>() -= r.transpose() * force;
    system.diagonal[i].diagonal().tail<3>().array() += w;
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
