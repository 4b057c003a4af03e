/// What one time step works on: the incremental potential, its iterate, its way points. Private to dynamics.
#pragma once

#include <algorithm>
#include <limits>

#include "tendril/dynamics.h"
#include "tendril/dynamics/beam.h"
#include "tendril/dynamics/block_tridiagonal.h"
#include "tendril/dynamics/contact.h"

namespace tendril {

using beam::Node;

/// Numbers of every element or node, row by row, for the kernels.
class Table {
 public:
  void resize(int rows, std::size_t columns) {
    stride_ = columns + 8;
    values_.assign(static_cast<std::size_t>(rows) * stride_, 0);
  }
  [[nodiscard]] dynamics::Rows rows() { return {values_.data(), stride_}; }
  [[nodiscard]] double& at(int row, std::size_t column) {
    return values_[static_cast<std::size_t>(row) * stride_ + column];
  }
  [[nodiscard]] double at(int row, std::size_t column) const {
    return values_[static_cast<std::size_t>(row) * stride_ + column];
  }
  /// The six numbers of a column.
  [[nodiscard]] Vector6 column(std::size_t column) const {
    return Eigen::Map<const Vector6, 0, Eigen::InnerStride<>>(
        values_.data() + column, Eigen::InnerStride<>(static_cast<Eigen::Index>(stride_)));
  }

 private:
  std::vector<double> values_;
  std::size_t stride_ = 0;
};

/// What the elements feel at an iterate.
struct ElementState {
  Table psi, wrench;                                 // 6 rows each
  [[nodiscard]] Vector3 turn(std::size_t k) const {  // the rotation vector from node to node
    return {psi.at(0, k), psi.at(1, k), psi.at(2, k)};
  }
  std::vector<double> energies;  // J

  void resize(std::size_t elements) {
    psi.resize(6, elements), wrench.resize(6, elements);
    energies.assign(elements + 8, 0);
  }
};

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

/// Newmark's formulas with the inertia averaged (Wood, Bossak and Zienkiewicz 1980): implicit Euler and the
/// second-order scheme are two members of the family. README.md, section 1.
struct Newmark {
  double alpha, beta, gamma, dt;

  [[nodiscard]] static Newmark implicitEuler(double dt) { return {0, 1, 1, dt}; }
  /// Of second order; `rho` is what a step leaves of the highest frequencies, in [0, 1].
  [[nodiscard]] static Newmark secondOrder(double rho, double dt) {
    const double alpha = (rho - 1) / (rho + 1);
    return {alpha, 0.25 * (1 - alpha) * (1 - alpha), 0.5 - alpha, dt};
  }

  [[nodiscard]] double accelerationRate() const { return 1 / (beta * dt * dt); }  // d a / d x
  [[nodiscard]] double velocityRate() const { return gamma / (beta * dt); }       // d v / d x
  /// The displacement that leaves no acceleration at the step's end, and the velocity there then.
  template <class Vector>
  [[nodiscard]] Vector coast(const Vector& v, const Vector& a) const {
    return dt * v + (dt * dt * (0.5 - beta)) * a;
  }
  template <class Vector>
  [[nodiscard]] Vector coastVelocity(const Vector& v, const Vector& a) const {
    return v + (dt * (1 - gamma)) * a;
  }
  /// W: what multiplies the mass in the incremental potential, 1/s^2, with mass-proportional drag [1/s].
  [[nodiscard]] double weight(double drag) const {
    return (1 - alpha) * accelerationRate() + drag * velocityRate();
  }
  /// x~ - x_n: the displacement at which inertia and drag want nothing.
  template <class Vector>
  [[nodiscard]] Vector predict(const Vector& v, const Vector& a, double drag) const {
    return coast(v, a) - (alpha * a + drag * coastVelocity(v, a)) / weight(drag);
  }
};

/// Without inertia both schemes are implicit Euler.
[[nodiscard]] inline bool isSecondOrder(const SimulationSettings& simulation) {
  return simulation.scheme == Scheme::second_order && simulation.inertia;
}

/// The limits of an element, which no motion crosses: its length over h, at every moment, and its turn from
/// node to node [rad], where the logarithm still is far from its jump.
inline constexpr double kLeastStretch = 0.81, kMostStretch = 1.24, kMostTurn = 2.8;

/// The potential that keeps a quantity from a limit, by how far it is beyond where the guard begins: K e^2/2
/// / (1 - e/reach), a spring of stiffness K at first and a barrier toward the limit, e = reach. From
/// kSteepest of the reach on its parabola goes on, so that what begins beyond has an energy, too.
struct Guard {
  static constexpr double kSteepest = 0.99;
  double stiffness, reach;

  using Value = Spring::Value;  // by e
  [[nodiscard]] Value operator()(double e) const {
    const double x = std::min(e / reach, kSteepest), left = 1 - x, beyond = e - x * reach;
    const double curvature = stiffness / (left * left * left);
    const double slope = 0.5 * stiffness * reach * (1 / (left * left) - 1);
    const double energy = 0.5 * stiffness * reach * reach * x * x / left;
    return {energy + (slope + 0.5 * curvature * beyond) * beyond, slope + curvature * beyond, curvature};
  }
};

/// Keeps an element's length l from the limits of a motion.
struct LengthGuard {
  static constexpr double kShortest = 0.88, kLongest = 1.15;  // of h: at ease between
  static constexpr double kStiffness = 10;                    // of EA/h
  double shortest, longest;
  Guard below, above;

  LengthGuard(double h, double ea)
      : shortest(kShortest * h),
        longest(kLongest * h),
        below{kStiffness * ea / h, (kShortest - kLeastStretch) * h},
        above{kStiffness * ea / h, (kMostStretch - kLongest) * h} {}

  [[nodiscard]] bool acts(const Vector3& e) const {
    const double l2 = e.squaredNorm();
    return l2 > longest * longest || l2 < shortest * shortest;
  }
  /// By the length, of one where it acts.
  [[nodiscard]] Guard::Value operator()(double length) const {
    if (length > longest) return above(length - longest);
    const Guard::Value short_by = below(shortest - length);
    return {short_by.energy, -short_by.slope, short_by.curvature};
  }
};

/// Keeps an element's turn, of the angle a from node to node, from its limit.
struct TurnGuard {
  static constexpr double kLargest = 2.2;  // rad: at ease below
  static constexpr double kStiffness =
      10;  // of c/h, c the largest of its stiffnesses against bending and twist
  Guard guard;

  TurnGuard(double h, double c) : guard{kStiffness * c / h, kMostTurn - kLargest} {}

  [[nodiscard]] static bool acts(const Vector3& turn) { return turn.squaredNorm() > kLargest * kLargest; }
  /// By the angle, of one where it acts.
  [[nodiscard]] Guard::Value operator()(double angle) const { return guard(angle - kLargest); }
};

/// The barrier that reaches so far [m]: a gap of half of that holds 0.3 times the largest force of a gripper.
[[nodiscard]] contact::Barrier barrierFor(const RodModel& model, double reach);

struct RodWorkspace::Impl {
  // Constant during a step.
  dynamics::ElementLaw law{};
  Table rest_curvature, elastic, u_hat;  // of the elements: 3, 8 and 6 rows
  Newmark scheme{};
  std::vector<Vector3> predicted_masses;  // x~ of the nodes' masses, world
  std::vector<Quaternion> predicted_rotations;
  std::vector<Vector3> predicted_motion;  // of the nodes: the first guess
  std::vector<double> masses;             // kg
  double inertia_weight = 0;              // W, 1/s^2
  double end_offset = 0;                  // h/6, m: how far inside the rod the end nodes' masses sit
  Vector3 rotary = Vector3::Zero();       // rotary inertia over mass, m^2
  std::array<GripperGoal, 2> goals;
  std::array<Grip, 2> grips;

  // The iterate.
  std::vector<Node> nodes, trial;
  std::vector<Vector3> positions, trial_positions, motion, limited_motion;
  ElementState elements, trial_elements;
  Table frames;  // of the nodes, for the kernel: quaternion and position, 7 rows
  BlockTridiagonal system;
  std::vector<Vector6> gradient;
  contact::Contacts contacts;
  bool has_contacts = false;

  // Way points.
  std::vector<RodShape> path;  // iterates, path[0] = start; the first `path_size` are valid
  std::size_t path_size = 0;
  std::vector<RodShape> way_points;
  std::size_t way_point_count = 0;
  std::vector<RodShape> steady;    // scratch: the way points with the held ends on straight lines
  std::vector<double> way_shares;  // scratch

  // A step in parts (step_tolerance).
  std::unique_ptr<RodModel> part_model;
  RodState start_state;
  RodShape coarser;             // the result of half as many parts
  std::vector<RodShape> parts;  // the way points of all of them; the first `part_count` are valid
  std::size_t part_count = 0;

  /// Sets everything that stays constant during a step, and the iterate to the step's start.
  void prepare(const RodModel& model, const std::array<GripperGoal, 2>& step_goals, const RodState& state);

  /// The step's result as the state: frames, velocities and, for the second-order scheme, its history.
  void updateState(const RodModel& model, RodState& state) const;

  /// psi of the elements between the nodes; with evaluateElements wrenches and energies, too.
  void evaluateStrains(const std::vector<Node>& at, ElementState& out);
  void evaluateElements(const std::vector<Node>& at, ElementState& out);
  /// The incremental potential but for contact: elasticity and damping, inertia and drag, gravity, grippers
  /// [J].
  [[nodiscard]] double smoothEnergy(const RodModel& model, const std::vector<Node>& at,
                                    const ElementState& state) const;
  /// Gradient into system.rhs (negated) and Hessian of the whole incremental potential at `nodes`; without
  /// `geometric` stiffness the Hessian is positive definite.
  void assemble(const RodModel& model, bool geometric);
  void addSmoothTerms(const RodModel& model);
  [[nodiscard]] TurnGuard turnGuard() const { return {law.h, std::max({law.c[0], law.c[1], law.c[2]})}; }
  /// Where node i's mass sits in the node's frame, along its tangent [m].
  [[nodiscard]] double massOffset(std::size_t i) const {
    return i == 0 ? end_offset : i + 1 == masses.size() ? -end_offset : 0;
  }

  /// Moves `nodes` by fraction * (w, y) into `trial`.
  void retract(double fraction) {
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const Vector3 w = fraction * system.solution[i].head<3>();
      trial[i].pose.rotation = (nodes[i].pose.rotation * expSO3(w)).normalized();
      trial[i].pose.position = positions[i] + fraction * motion[i];
      trial[i].rotation = trial[i].pose.rotation.toRotationMatrix();
      trial_positions[i] = trial[i].pose.position;
    }
  }

  /// Whether no element turns by more than `most` [rad] after `fraction` of the step, or by no more than now.
  [[nodiscard]] bool turnsKeepBelow(double most, double fraction) const {
    for (std::size_t k = 0; k + 1 < nodes.size(); ++k) {
      const double now = elements.turn(k).norm();
      const Vector3 w0 = fraction * system.solution[k].head<3>();
      const Vector3 w1 = fraction * system.solution[k + 1].head<3>();
      if (now + w0.norm() + w1.norm() <= most) continue;
      if (angleBetween(nodes[k].pose.rotation * expSO3(w0), nodes[k + 1].pose.rotation * expSO3(w1)) >
          std::max(most, now))
        return false;
    }
    return true;
  }

  /// Evaluates the potential at `fraction` of the motion, in `trial`. False if that penetrates.
  [[nodiscard]] bool tryFraction(const RodModel& model, double fraction, double& energy) {
    retract(fraction);
    if (has_contacts && !contacts.evaluate(trial_positions)) return false;
    evaluateElements(trial, trial_elements);
    energy = smoothEnergy(model, trial, trial_elements);
    if (has_contacts) energy += contacts.energy() + contacts.frictionEnergy(trial_positions);
    return true;
  }

  /// Makes the trial the iterate; the contact terms are those of the last evaluation, which was the trial's.
  void acceptTrial(bool record) {
    std::swap(nodes, trial);
    std::swap(positions, trial_positions);
    std::swap(elements, trial_elements);
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
      const Vector3 w = fraction * system.solution[i].head<3>();
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
  void steadyGrippers(const RodModel& model);
  [[nodiscard]] bool straightIsFree(const RodModel& model, const RodShape& from, const RodShape& to);
};

}  // namespace tendril
