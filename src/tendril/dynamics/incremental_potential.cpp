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

contact::Barrier barrierFor(const RodModel& model, double reach) {
  return {reach, 0.25 * model.grippers.max_force / reach};
}

void RodWorkspace::Impl::prepare(const RodModel& model, const std::array<GripperGoal, 2>& step_goals,
                                 const RodState& state) {
  const RodProperties& rod = model.rod;
  const std::size_t n = state.nodes.size();
  const std::size_t element_count = n - 1;
  const double h = rod.length / static_cast<double>(element_count), dt = model.simulation.time_step;
  const bool resized = nodes.size() != n;
  if (resized) {
    rest_curvature.resize(3, element_count), elastic.resize(8, element_count);
    u_hat.resize(6, element_count);
    frames.resize(7, n);
    predicted_masses.resize(n), predicted_rotations.resize(n), predicted_motion.resize(n), masses.resize(n);
    nodes.resize(n), trial.resize(n);
    positions.resize(n), trial_positions.resize(n), motion.resize(n);
    limited_motion.resize(n);
    elements.resize(element_count), trial_elements.resize(element_count);
    system.resize(n);
    gradient.resize(n);
  }

  // Implicit Euler, or the second-order scheme once there is a history.
  const bool inertia = model.simulation.inertia;
  const bool second = isSecondOrder(model.simulation) && !state.accelerations.empty();
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

  // Rayleigh damping beta c du/dt with du/dt = (u - u_hat)/tau folds into the element.
  law.h = h;
  std::copy_n(rod.c.data(), 6, law.c);
  const bool two_strains = second && !state.previous_nodes.empty();
  law.rate = model.simulation.stiffness_damping / (two_strains ? 2 * dt / 3 : dt);
  evaluateStrains(nodes, elements);
  for (std::size_t k = 0; k < element_count; ++k) {
    const Vector3 rest = rod.restCurvature(static_cast<int>(k));
    for (int i = 0; i < 3; ++i) rest_curvature.at(i, k) = rest[i];
    Vector6 hat = elements.psi.column(k) / h;
    hat[3] -= 1;
    if (two_strains) {
      const Node a{state.previous_nodes[k], state.previous_nodes[k].rotation.toRotationMatrix()};
      const Node b{state.previous_nodes[k + 1], state.previous_nodes[k + 1].rotation.toRotationMatrix()};
      Vector6 u_previous = beam::relativeLog(a, b) / h;
      u_previous[3] -= 1;
      hat = (4 * hat - u_previous) / 3;
    }
    for (int i = 0; i < 6; ++i) u_hat.at(i, k) = hat[i];
  }
  const auto count = static_cast<int>(element_count);
  dynamics::kernel().prepare(count, law, rest_curvature.rows(), elements.psi.rows(), u_hat.rows(),
                             elastic.rows());
  dynamics::kernel().wrenches(count, law, elements.psi.rows(), elastic.rows(), elements.wrench.rows(),
                              elements.energies.data());

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
  if (has_contacts)
    contacts.prepare(*model.obstacles, rod, barrierFor(model, model.simulation.contact_distance));
}

void RodWorkspace::Impl::updateState(const RodModel& model, RodState& state) const {
  const bool keep_history = isSecondOrder(model.simulation);
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

void RodWorkspace::Impl::evaluateStrains(const std::vector<Node>& at, ElementState& out) {
  for (std::size_t i = 0; i < at.size(); ++i) {
    for (int j = 0; j < 4; ++j) frames.at(j, i) = at[i].pose.rotation.coeffs()[j];
    for (int j = 0; j < 3; ++j) frames.at(4 + j, i) = at[i].pose.position[j];
  }
  dynamics::kernel().strains(static_cast<int>(at.size()) - 1, frames.rows(), out.psi.rows());
}

void RodWorkspace::Impl::evaluateElements(const std::vector<Node>& at, ElementState& out) {
  evaluateStrains(at, out);
  dynamics::kernel().wrenches(static_cast<int>(at.size()) - 1, law, out.psi.rows(), elastic.rows(),
                              out.wrench.rows(), out.energies.data());
}

double RodWorkspace::Impl::smoothEnergy(const RodModel& model, const std::vector<Node>& at,
                                        const ElementState& state) const {
  double sum = 0;
  const LengthGuard guard(law.h, law.c[3]);
  const TurnGuard turn_guard = turnGuard();
  for (std::size_t k = 0; k + 1 < at.size(); ++k) {
    sum += state.energies[k];
    const Vector3 e = at[k + 1].pose.position - at[k].pose.position;
    if (guard.acts(e)) sum += guard(e.norm()).energy;
    const Vector3 turn = state.turn(k);
    if (turn_guard.acts(turn)) sum += turn_guard(turn.norm()).energy;
  }
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
  dynamics::kernel().derivatives(static_cast<int>(nodes.size()) - 1, law, elements.psi.rows(), elastic.rows(),
                                 elements.wrench.rows(), geometric, system.diagonalBlocks(),
                                 system.upperBlocks());
  addSmoothTerms(model);
  if (!has_contacts) return;
  contacts.addDerivatives(nodes, system);
  contacts.addFrictionDerivatives(nodes, system);
}

void RodWorkspace::Impl::addSmoothTerms(const RodModel& model) {
  const LengthGuard guard(law.h, law.c[3]);
  const TurnGuard turn_guard = turnGuard();
  for (std::size_t k = 0; k + 1 < nodes.size(); ++k) {
    if (const Vector3 turn = elements.turn(k); turn_guard.acts(turn)) {
      // The axis is the same for both nodes, and the angle grows as they turn about it.
      const double angle = turn.norm();
      const Guard::Value f = turn_guard(angle);
      const Vector3 axis = turn / angle;
      const Matrix3 block = f.curvature * axis * axis.transpose();
      system.rhs(k).head<3>() += f.slope * axis;
      system.rhs(k + 1).head<3>() -= f.slope * axis;
      system.diagonal(k).topLeftCorner<3, 3>() += block;
      system.diagonal(k + 1).topLeftCorner<3, 3>() += block;
      system.upper(k).topLeftCorner<3, 3>() -= block;
    }
    const Vector3 e = nodes[k + 1].pose.position - nodes[k].pose.position;
    if (!guard.acts(e)) continue;
    const double length = e.norm();
    const Guard::Value f = guard(length);
    const Vector3 n0 = nodes[k].rotation.transpose() * e / length;
    const Vector3 n1 = nodes[k + 1].rotation.transpose() * e / length;
    system.rhs(k).tail<3>() += f.slope * n0;
    system.rhs(k + 1).tail<3>() -= f.slope * n1;
    addRankOne(system, k, f.curvature, -n0, n1);
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Matrix3& r = nodes[i].rotation;
    const double m = masses[i], w = m * inertia_weight;
    const double offset = massOffset(i);
    const Vector3 mass_at = nodes[i].pose.position + offset * r.col(0);
    const Vector3 force = r.transpose() * (w * (mass_at - predicted_masses[i]) - m * model.gravity);
    system.rhs(i).tail<3>() -= force;
    system.diagonal(i).diagonal().tail<3>().array() += w;
    if (offset != 0) {  // the mass moves by y - o x w, o along the tangent
      const Matrix3 o = skew(Vector3(offset, 0, 0));
      system.rhs(i).head<3>() -= o * force;
      system.diagonal(i).topLeftCorner<3, 3>() -= w * o * o;
      system.diagonal(i).topRightCorner<3, 3>() += w * o;
      system.diagonal(i).bottomLeftCorner<3, 3>() -= w * o;
    }
    const Vector3 theta = logSO3(predicted_rotations[i].conjugate() * nodes[i].pose.rotation);
    const Matrix3 j = rightJacobianInverseSO3(theta);
    system.rhs(i).head<3>() -= w * (j.transpose() * rotary.cwiseProduct(theta));
    system.diagonal(i).topLeftCorner<3, 3>() += w * (j.transpose() * rotary.asDiagonal() * j);
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
      system.rhs(i).segment<3>(at) -= secant * x;
      Matrix3 h = secant * Matrix3::Identity();
      if (length > 0) h += (f.curvature - secant) / (length * length) * x * x.transpose();
      system.diagonal(i).block<3, 3>(at, at) += h;
    });
  }
}

}  // namespace tendril
