#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include "tendril/dynamics.h"
#include "tendril/dynamics/beam.h"
#include "tendril/dynamics/block_tridiagonal.h"
#include "tendril/dynamics/contact.h"

namespace tendril {
namespace {

using beam::Node;

constexpr double kKeptGap = 0.1;                             // fraction of every gap a Newton step must leave
constexpr double kLeastStretch = 0.81, kMostStretch = 1.24;  // of an element, along every straight motion
constexpr double kLargestNodeMotion = 0.24;                  // of L, along one straight motion

/// A spring on |x|, x a displacement [m] or a rotation vector [rad]: at ease up to `slack`, then linear, its
/// force never more than `cap`. The grippers' PD law as a potential.
struct Spring {
  double stiffness = 0, slack = 0, cap = std::numeric_limits<double>::infinity();

  struct Value {
    double energy, slope, curvature;  // by |x|
  };
  [[nodiscard]] Value operator()(double length) const {
    const double d = length - slack;
    if (d < 0) return {0, 0, 0};
    if (stiffness * d > cap) return {cap * (d - 0.5 * cap / stiffness), cap, 0};
    return {0.5 * stiffness * d * d, stiffness * d, stiffness};
  }
};

/// What holds one end during a step: springs to a pose, and brakes that keep the drive from being pushed
/// faster than it goes.
struct Grip {
  Pose target, start;
  Spring pull, turn;                // toward target
  Spring travel_brake, turn_brake;  // on the way from start

  template <class Visit>  // visit(spring, x in the frame of `at`, is a rotation)
  void visit(const Pose& at, Visit&& visit) const {
    const Quaternion inverse = at.rotation.conjugate();
    visit(pull, Vector3(inverse * (at.position - target.position)), false);
    visit(travel_brake, Vector3(inverse * (at.position - start.position)), false);
    visit(turn, logSO3(target.rotation.conjugate() * at.rotation), true);
    visit(turn_brake, logSO3(start.rotation.conjugate() * at.rotation), true);
  }
};

/// The smallest length, over t in [0, 1], of a vector that moves from e by t d.
double leastLength(const Vector3& e, const Vector3& d) {
  const double d2 = d.squaredNorm();
  const double t = d2 > 0 ? std::clamp(-e.dot(d) / d2, 0.0, 1.0) : 0;
  return (e + t * d).norm();
}

}  // namespace

struct RodWorkspace::Impl {
  // Constant during a step.
  std::vector<beam::Element> elements;  // with the Rayleigh term folded in
  std::vector<Vector3> predicted_positions;
  std::vector<Quaternion> predicted_rotations;
  std::vector<double> masses;        // kg
  double inertia_weight = 0;         // 1/s^2: what multiplies the mass in the incremental potential
  Vector3 rotary = Vector3::Zero();  // rotary inertia over mass, m^2
  std::array<GripperGoal, 2> goals;
  std::array<Grip, 2> grips;

  // The iterate.
  std::vector<Node> nodes, trial;
  std::vector<Vector3> positions, trial_positions, motion, limited_motion;
  std::vector<Vector6> psi, trial_psi;  // per element
  std::vector<Vector6> wrenches, trial_wrenches;
  BlockTridiagonal system;
  std::vector<Vector6> gradient;
  contact::Contacts contacts;
  bool has_contacts = false;

  // Way points.
  std::vector<RodShape> path;  // iterates, path[0] = start; the first `path_size` are valid
  std::size_t path_size = 0;
  std::vector<RodShape> way_points;
  std::size_t way_point_count = 0;

  void evaluateElements(const std::vector<Node>& at, std::vector<Vector6>& psi_out,
                        std::vector<Vector6>& wrench_out) const {
    for (std::size_t k = 0; k < elements.size(); ++k) {
      psi_out[k] = beam::relativeLog(at[k], at[k + 1]);
      wrench_out[k] = elements[k].wrench(psi_out[k]);
    }
  }

  /// The incremental potential but for contact: elasticity and damping, inertia and drag, gravity, grippers
  /// [J].
  [[nodiscard]] double smoothEnergy(const RodModel& model, const std::vector<Node>& at,
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
      grips[e].visit(q,
                     [&](const Spring& spring, const Vector3& x, bool) { sum += spring(x.norm()).energy; });
    }
    return sum;
  }

  /// Gradient into system.rhs (negated) and Hessian of the whole incremental potential at `nodes`; without
  /// `geometric` stiffness the Hessian is positive definite.
  void assemble(const RodModel& model, bool geometric) {
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

  void addSmoothTerms(const RodModel& model) {
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

  /// Moves `nodes` by fraction * (w, y) into `trial`.
  void retract(double fraction) {
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const Vector3 w = fraction * system.rhs[i].head<3>();
      trial[i].pose.rotation = (nodes[i].pose.rotation * expSO3(w)).normalized();
      trial[i].pose.position = positions[i] + fraction * motion[i];
      trial[i].rotation = trial[i].pose.rotation.toRotationMatrix();
      trial_positions[i] = trial[i].pose.position;
    }
  }

  /// Whether every element's length stays within the stretch limits and every node within the longest motion
  /// while the nodes move straight from a to b.
  [[nodiscard]] static bool motionKeepsLimits(const std::vector<Vector3>& a, const std::vector<Vector3>& d,
                                              double fraction, double h, double length) {
    for (std::size_t i = 0; i < a.size(); ++i) {
      if (fraction * d[i].norm() > kLargestNodeMotion * length) return false;
      if (i + 1 == a.size()) break;
      const Vector3 e = a[i + 1] - a[i], de = fraction * (d[i + 1] - d[i]);
      const double before = e.norm();
      if (leastLength(e, de) < std::min(kLeastStretch * h, before)) return false;
      if ((e + de).norm() > std::max(kMostStretch * h, before)) return false;
    }
    return true;
  }

  /// Evaluates the potential at `fraction` of the motion, in `trial`. False if that penetrates.
  [[nodiscard]] bool tryFraction(const RodModel& model, double fraction, double& energy) {
    retract(fraction);
    if (has_contacts && !contacts.evaluate(trial_positions)) return false;
    evaluateElements(trial, trial_psi, trial_wrenches);
    energy = smoothEnergy(model, trial, trial_wrenches);
    if (has_contacts) energy += contacts.energy() + contacts.frictionEnergy(trial_positions);
    return true;
  }

  /// Makes the trial the iterate; the contact terms are those of the last evaluation, which was the trial's.
  void acceptTrial(bool record) {
    std::swap(nodes, trial);
    std::swap(positions, trial_positions);
    std::swap(psi, trial_psi);
    std::swap(wrenches, trial_wrenches);
    if (record) recordIterate(nodes);
  }

  /// Whether every held end is, after `fraction` of the step, within 1.25 times a time step's travel of where
  /// it started (or no farther from there than it is now).
  [[nodiscard]] bool gripsKeepSpeed(const RodModel& model, double fraction) const {
    const double dt = model.simulation.time_step;
    for (std::size_t e = 0; e < 2; ++e) {
      if (!goals[e].held) continue;
      const std::size_t i = e == 0 ? 0 : nodes.size() - 1;
      const Pose &start = grips[e].start, &now = nodes[i].pose;
      const Vector3 w = fraction * system.rhs[i].head<3>();
      const double travel = (positions[i] + fraction * motion[i] - start.position).norm();
      const double turned = angleBetween(start.rotation, now.rotation * expSO3(w));
      if (travel > std::max(1.25 * model.grippers.max_speed * dt, (now.position - start.position).norm()) ||
          turned > std::max(1.25 * model.grippers.max_turn * dt, angleBetween(start.rotation, now.rotation)))
        return false;
    }
    return true;
  }

  void recordIterate(const std::vector<Node>& at) {
    if (path.size() == path_size) path.emplace_back();
    RodShape& shape = path[path_size++];
    shape.resize(at.size());
    for (std::size_t i = 0; i < at.size(); ++i) shape[i] = at[i].pose;
  }

  void chooseWayPoints(const RodModel& model);
};

RodWorkspace::RodWorkspace() : impl_(std::make_unique<Impl>()) {}
RodWorkspace::~RodWorkspace() = default;
RodWorkspace::RodWorkspace(RodWorkspace&&) noexcept = default;

std::span<const RodShape> RodWorkspace::wayPoints() const {
  return {impl_->way_points.data(), impl_->way_point_count};
}

/// From the step's start, always on to the farthest iterate whose straight line is free; the next one always
/// is, since Newton's own pieces are certified.
void RodWorkspace::Impl::chooseWayPoints(const RodModel& model) {
  way_point_count = 0;
  std::size_t from = 0;
  while (from + 1 < path_size) {
    std::size_t to = path_size - 1;
    for (; to > from + 1; --to) {
      for (std::size_t i = 0; i < nodes.size(); ++i) {
        trial_positions[i] = path[from][i].position;
        motion[i] = path[to][i].position - trial_positions[i];
      }
      if (!motionKeepsLimits(trial_positions, motion, 1, model.rod.elementLength(), model.rod.length))
        continue;
      if (!has_contacts) break;
      contacts.findCandidates(trial_positions, motion);
      if (contacts.freeFraction(trial_positions, motion, 0) >= 1) break;
    }
    if (way_points.size() == way_point_count) way_points.emplace_back();
    way_points[way_point_count++] = path[to];
    from = to;
  }
}

RodModel::RodModel(const Scenario& scenario, const Obstacles& obstacles_in)
    : rod(scenario.rod),
      simulation(scenario.simulation),
      grippers(scenario.grippers),
      workspace(scenario.environment.workspace),
      friction(scenario.environment.friction),
      gravity(scenario.environment.gravity),
      obstacles(&obstacles_in) {}

namespace {

/// Sets everything that stays constant during a step.
void prepare(const RodModel& model, const std::array<GripperGoal, 2>& goals, const RodState& state,
             RodWorkspace::Impl& w) {
  const RodProperties& rod = model.rod;
  const std::size_t n = state.nodes.size();
  const std::size_t elements = n - 1;
  const double h = rod.length / static_cast<double>(elements), dt = model.simulation.time_step;
  const bool resized = w.nodes.size() != n;
  if (resized) {
    w.elements.resize(elements);
    w.predicted_positions.resize(n), w.predicted_rotations.resize(n), w.masses.resize(n);
    w.nodes.resize(n), w.trial.resize(n);
    w.positions.resize(n), w.trial_positions.resize(n), w.motion.resize(n);
    w.limited_motion.resize(n);
    w.psi.resize(elements), w.trial_psi.resize(elements);
    w.wrenches.resize(elements), w.trial_wrenches.resize(elements);
    w.system.resize(n);
    w.gradient.resize(n);
  }

  // The scheme, as v_new = (x - x_hat)/tau and a = (v_new - v_hat)/tau: implicit Euler, or BDF2 once there is
  // a history.
  const bool second = model.simulation.scheme == Scheme::second_order && !state.previous_nodes.empty();
  const double tau = second ? 2 * dt / 3 : dt, drag = model.simulation.drag;
  const bool inertia = model.simulation.inertia;
  w.inertia_weight = (inertia ? 1 / (tau * tau) : 0) + std::max(drag, inertia ? 0.0 : 1e-9) / tau;
  const double coast = inertia ? tau / (1 + drag * tau) : 0;  // how far the velocity carries against the drag

  const double area = std::numbers::pi * rod.radius * rod.radius;
  for (std::size_t i = 0; i < n; ++i) {
    w.masses[i] = rod.density * area * h * (i == 0 || i + 1 == n ? 0.5 : 1.0);
    w.nodes[i].pose = state.nodes[i];
    w.nodes[i].rotation = state.nodes[i].rotation.toRotationMatrix();
    w.positions[i] = state.nodes[i].position;
    Vector6 v_hat = state.velocities[i];
    Vector3 x_hat = state.nodes[i].position;
    Vector3 turn = Vector3::Zero();  // from the frame now to the scheme's x_hat
    if (second) {
      v_hat = (4 * state.velocities[i] - state.previous_velocities[i]) / 3;
      x_hat = (4 * state.nodes[i].position - state.previous_nodes[i].position) / 3;
      turn = logSO3(state.previous_nodes[i].rotation.conjugate() * state.nodes[i].rotation) / 3;
    }
    w.predicted_positions[i] = x_hat + coast * v_hat.tail<3>();
    w.predicted_rotations[i] = state.nodes[i].rotation * expSO3(turn + coast * v_hat.head<3>());
  }
  // Rotary inertia of a round section per unit mass: (r^2/2, r^2/4, r^2/4).
  w.rotary = 0.25 * rod.radius * rod.radius * Vector3(2, 1, 1);

  // Rayleigh damping beta c du/dt with du/dt = (u - u_hat)/tau folds into the element: stiffness c (1 +
  // beta/tau), at ease at beta/tau u_hat / (1 + beta/tau).
  const double rate = model.simulation.stiffness_damping / tau;
  w.evaluateElements(w.nodes, w.psi, w.wrenches);  // psi is needed; the wrenches are set below
  for (std::size_t k = 0; k < elements; ++k) {
    Vector6 u_hat = w.psi[k] / h;
    u_hat[3] -= 1;
    if (second) {
      const Node a{state.previous_nodes[k], state.previous_nodes[k].rotation.toRotationMatrix()};
      const Node b{state.previous_nodes[k + 1], state.previous_nodes[k + 1].rotation.toRotationMatrix()};
      Vector6 u_previous = beam::relativeLog(a, b) / h;
      u_previous[3] -= 1;
      u_hat = (4 * u_hat - u_previous) / 3;
    }
    w.elements[k] = {h, (1 + rate) * rod.c, (rate / (1 + rate)) * u_hat};
    w.wrenches[k] = w.elements[k].wrench(w.psi[k]);
  }

  // Grippers: PD as implicit springs that reach the largest force within 0.2 % of L and the largest torque
  // within 0.02 rad. A moving end gives way at these; one held still is clamped. None is pushed faster than a
  // fifth above its speed.
  w.goals = goals;
  const GripperLimits& limits = model.grippers;
  for (std::size_t e = 0; e < 2; ++e) {
    Grip& grip = w.grips[e];
    grip.target = goals[e].pose;
    grip.start = e == 0 ? state.nodes.front() : state.nodes.back();
    grip.pull = {.stiffness = limits.max_force / (0.002 * rod.length)};
    grip.turn = {.stiffness = limits.max_torque / 0.02};
    if (goals[e].moving) grip.pull.cap = limits.max_force, grip.turn.cap = limits.max_torque;
    grip.travel_brake = {.stiffness = grip.pull.stiffness, .slack = 1.1 * limits.max_speed * dt};
    grip.turn_brake = {.stiffness = grip.turn.stiffness, .slack = 1.1 * limits.max_turn * dt};
  }

  w.has_contacts = !model.obstacles->faces().empty() || rod.self_contact;
  if (w.has_contacts) {
    const double dhat = model.simulation.contact_distance;
    w.contacts.prepare(*model.obstacles, rod, {dhat, 0.25 * model.grippers.max_force / dhat});
  }
}

}  // namespace

namespace {

/// The largest fraction, at most `fraction`, of w.motion that respects the limits on a straight motion and
/// keeps a tenth of every gap. Leaves the candidates of the whole motion in w.contacts.
double filter(const RodModel& model, double fraction, RodWorkspace::Impl& w) {
  const double h = w.elements[0].h;
  while (!RodWorkspace::Impl::motionKeepsLimits(w.positions, w.motion, fraction, h, model.rod.length) &&
         fraction > 1e-9)
    fraction *= 0.5;
  for (int halvings = 0; halvings < 8 && !w.gripsKeepSpeed(model, fraction); ++halvings) fraction *= 0.5;
  if (!w.has_contacts) return fraction;
  for (std::size_t i = 0; i < w.motion.size(); ++i) w.limited_motion[i] = fraction * w.motion[i];
  w.contacts.findCandidates(w.positions, w.limited_motion);
  return fraction * w.contacts.freeFraction(w.positions, w.limited_motion, kKeptGap);
}

}  // namespace

StepReport step(const RodModel& model, const std::array<GripperGoal, 2>& goals, RodState& state,
                RodWorkspace& workspace, bool record_way_points) {
  RodWorkspace::Impl& w = workspace.impl();
  prepare(model, goals, state, w);
  const std::size_t n = w.nodes.size();
  const double length = model.rod.length, dt = model.simulation.time_step;

  StepReport report;
  report.status = StepReport::Status::iteration_limit;
  if (w.has_contacts) {
    for (Vector3& m : w.motion) m.setZero();
    w.contacts.findCandidates(w.positions, w.motion);
    if (!w.contacts.evaluate(w.positions)) {
      report.status =
          StepReport::Status::stalled;  // the caller handed over a penetrating state: leave it as it is
      w.way_point_count = 0;
      return report;
    }
    // Slip below a hundredth of the gripper's travel counts as sticking.
    w.contacts.lagFriction(w.positions, model.friction, 0.01 * model.grippers.max_speed * dt);
  }
  w.path_size = 0;
  if (record_way_points) w.recordIterate(w.nodes);

  double energy = w.smoothEnergy(model, w.nodes, w.wrenches);
  if (w.has_contacts) energy += w.contacts.energy() + w.contacts.frictionEnergy(w.positions);

  // First guess: the motion goes on as it was. It passes the same filter, and is kept only if it lowers the
  // potential.
  for (std::size_t i = 0; i < n; ++i) {
    w.system.rhs[i] << logSO3(w.nodes[i].pose.rotation.conjugate() * w.predicted_rotations[i]),
        w.nodes[i].rotation.transpose() * (w.predicted_positions[i] - w.positions[i]);
    w.motion[i] = w.predicted_positions[i] - w.positions[i];
  }
  if (double guessed = 0; w.tryFraction(model, filter(model, 1, w), guessed) && guessed < energy) {
    energy = guessed;
    w.acceptTrial(record_way_points);
  } else if (w.has_contacts && !w.contacts.evaluate(w.positions)) {
    assert(false && "the step's start was free a moment ago");
  }

  while (report.iterations < model.newton.max_iterations) {
    ++report.iterations;
    w.assemble(model, true);
    for (std::size_t i = 0; i < n; ++i) w.gradient[i] = -w.system.rhs[i];
    if (!w.system.solve()) {
      w.assemble(model, false);
      if (!w.system.solve()) {
        report.status = StepReport::Status::stalled;
        break;
      }
    }
    double slope = 0, size = 0;
    for (std::size_t i = 0; i < n; ++i) {
      slope += w.gradient[i].dot(w.system.rhs[i]);
      w.motion[i] = w.nodes[i].rotation * w.system.rhs[i].tail<3>();
      size = std::max({size, w.system.rhs[i].head<3>().norm(), w.motion[i].norm() / length});
    }

    // The filter and the line search (Armijo).
    double fraction = filter(model, std::min(1.0, 1.0 / size), w);
    const bool whole = fraction == 1;
    bool accepted = false;
    double trial_energy = 0;
    for (int halvings = 0; halvings < 20; ++halvings, fraction *= 0.5)
      if (w.tryFraction(model, fraction, trial_energy) &&
          trial_energy <= energy + 1e-4 * fraction * slope + 1e-13 * std::abs(energy)) {
        accepted = true;
        break;
      }
    if (!accepted) {
      report.status =
          size < 10 * model.newton.tolerance ? StepReport::Status::converged : StepReport::Status::stalled;
      break;
    }
    energy = trial_energy;
    w.acceptTrial(record_way_points);
    if (whole && size < model.newton.tolerance) {
      report.status = StepReport::Status::converged;
      break;
    }
  }
  report.contacts = w.has_contacts ? static_cast<int>(w.contacts.activeTerms()) : 0;

  // New velocities by the scheme; history for the second-order one.
  const bool second = model.simulation.scheme == Scheme::second_order;
  const bool has_history = second && !state.previous_nodes.empty();
  if (second) {
    if (!has_history) state.previous_nodes = state.nodes, state.previous_velocities = state.velocities;
  }
  for (std::size_t i = 0; i < n; ++i) {
    const Pose now = state.nodes[i];
    const Vector6 velocity = state.velocities[i];
    Vector6 moved;
    moved << logSO3(now.rotation.conjugate() * w.nodes[i].pose.rotation), w.positions[i] - now.position;
    if (has_history) {
      Vector6 moved_before;
      moved_before << logSO3(state.previous_nodes[i].rotation.conjugate() * now.rotation),
          now.position - state.previous_nodes[i].position;
      state.velocities[i] = (3 * moved - moved_before) / (2 * dt);
    } else {
      state.velocities[i] = moved / dt;
    }
    if (second) state.previous_nodes[i] = now, state.previous_velocities[i] = velocity;
    state.nodes[i] = w.nodes[i].pose;
  }
  if (record_way_points) w.chooseWayPoints(model);
  return report;
}

}  // namespace tendril
