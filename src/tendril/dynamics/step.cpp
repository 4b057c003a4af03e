/// Newton's method with its filter, and the way points of what it did.
#include <algorithm>
#include <cassert>
#include <cmath>

#include "tendril/dynamics/workspace.h"

namespace tendril {
namespace {

constexpr double kLargestNodeMotion = 0.24;  // of L, along one straight motion
constexpr double kKeptGap = 0.1;             // fraction of every gap a Newton step must leave
// Shorter steps (filteredDirection):
constexpr double kWornGap = 0.01;   // of dhat: where a gap is smaller
constexpr double kTooLittle = 0.1;  // of a step: and the filter leaves less
constexpr double kSoftShare = 4;    // soft modes then get this times the fraction that was left
constexpr int kShorterSteps = 3;    // at most
constexpr double kGuessLeastGap =
    0.1;                              // of dhat: where the first guess leaves less, Newton starts without it
constexpr double kLeastReach = 0.02;  // of the contact distance, in narrow passages

/// The smallest length, over t in [0, 1], of a vector that moves from e by t d.
double leastLength(const Vector3& e, const Vector3& d) {
  const double d2 = d.squaredNorm();
  const double t = d2 > 0 ? std::clamp(-e.dot(d) / d2, 0.0, 1.0) : 0;
  return (e + t * d).norm();
}

/// Whether every element's length stays within the stretch limits and every node within the longest motion
/// while the nodes move straight from a to b.
bool motionKeepsLimits(const std::vector<Vector3>& a, const std::vector<Vector3>& d, double fraction,
                       double h, double length) {
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

}  // namespace

RodWorkspace::RodWorkspace() : impl_(std::make_unique<Impl>()) {}
RodWorkspace::~RodWorkspace() = default;
RodWorkspace::RodWorkspace(RodWorkspace&&) noexcept = default;

std::span<const RodShape> RodWorkspace::wayPoints() const {
  return {impl_->way_points.data(), impl_->way_point_count};
}

/// Whether every node may go straight from one shape to the other: within the limits and free. Overwrites
/// trial_positions, motion and the candidates.
bool RodWorkspace::Impl::straightIsFree(const RodModel& model, const RodShape& from, const RodShape& to) {
  for (std::size_t i = 0; i < from.size(); ++i) {
    trial_positions[i] = from[i].position;
    motion[i] = to[i].position - trial_positions[i];
  }
  if (!motionKeepsLimits(trial_positions, motion, 1, model.rod.elementLength(), model.rod.length))
    return false;
  if (!has_contacts) return true;
  contacts.findCandidates(trial_positions, motion);
  return contacts.freeFraction(trial_positions, motion, 0) >= 1;
}

/// From the step's start, always on to the farthest iterate whose straight line is free; the next one always
/// is, since Newton's own pieces are certified.
void RodWorkspace::Impl::chooseWayPoints(const RodModel& model) {
  way_point_count = 0;
  std::size_t from = 0;
  while (from + 1 < path_size) {
    std::size_t to = path_size - 1;
    while (to > from + 1 && !straightIsFree(model, path[from], path[to])) --to;
    if (way_points.size() == way_point_count) way_points.emplace_back();
    way_points[way_point_count++] = path[to];
    from = to;
  }
  if (way_point_count > 1) steadyGrippers(model);
}

/// Newton's iterates carry a held end to and fro; its gripper goes straight from the step's start to its end.
/// So the end is put onto that straight line, and the nodes next to it give way, less and less over some
/// elements: as few as possible for which all stays free. Where none does, the way points stay as they were.
void RodWorkspace::Impl::steadyGrippers(const RodModel& model) {
  const RodShape& start = path[0];
  const std::size_t last = way_point_count - 1, n = start.size();
  // How far along each way point is, by the way of the fastest node.
  std::vector<double>& share = way_shares;
  share.assign(way_point_count, 0);
  for (std::size_t j = 0; j <= last; ++j)
    share[j] = (j > 0 ? share[j - 1] : 0) + maxNodeDistance(j > 0 ? way_points[j - 1] : start, way_points[j]);
  if (!(share[last] > 0)) return;
  if (steady.size() < last) steady.resize(last);
  for (const std::size_t yielding : {n / 13 + 1, n / 5, n / 2}) {
    const double reach = static_cast<double>(yielding);
    bool free = true;
    for (std::size_t j = 0; j < last && free; ++j) {
      RodShape& shape = steady[j] = way_points[j];
      const double f = share[j] / share[last];
      for (const End end : kBothEnds) {
        if (!goals[static_cast<std::size_t>(end)].held) continue;
        const Pose &a = endPose(start, end), &b = endPose(way_points[last], end);
        const Vector3 aside =
            a.position + f * (b.position - a.position) - endPose(way_points[j], end).position;
        for (std::size_t k = 0; k < yielding && k < n; ++k)
          shape[end == End::first ? k : n - 1 - k].position += (1 - static_cast<double>(k) / reach) * aside;
        (end == End::first ? shape.front() : shape.back()).rotation = a.rotation.slerp(f, b.rotation);
      }
      free = straightIsFree(model, j > 0 ? steady[j - 1] : start, shape);
    }
    if (!free || !straightIsFree(model, steady[last - 1], way_points[last])) continue;
    std::swap_ranges(steady.begin(), steady.begin() + static_cast<std::ptrdiff_t>(last), way_points.begin());
    return;
  }
}

namespace {

/// A fraction, at most `fraction`, of w.motion that respects the limits on a straight motion and on turns.
double withinLimits(const RodModel& model, double fraction, const RodWorkspace::Impl& w) {
  const double h = w.law.h;
  while (fraction > 1e-9 && !(motionKeepsLimits(w.positions, w.motion, fraction, h, model.rod.length) &&
                              w.turnsKeepBelow(kMostTurn, fraction)))
    fraction *= 0.5;
  double slower = fraction;
  for (int halvings = 0; halvings < 8; ++halvings, slower *= 0.5)
    if (w.gripsKeepSpeed(model, slower)) return slower;
  return fraction;  // the rod overpowers its gripper
}

/// The largest part, in [0, 1], of `fraction` of w.motion that keeps a tenth of every gap, and half of what
/// is within the barrier's reach: an iteration at most doubles a small gap. Leaves the candidates of the
/// whole motion in w.contacts.
double freePart(double fraction, RodWorkspace::Impl& w) {
  if (!w.has_contacts) return 1;
  for (std::size_t i = 0; i < w.motion.size(); ++i) w.limited_motion[i] = fraction * w.motion[i];
  w.contacts.findCandidates(w.positions, w.limited_motion);
  return w.contacts.freeFraction(w.positions, w.limited_motion, {kKeptGap, w.contacts.barrier().dhat});
}

/// A way toward the minimum, in w.system.solution and w.motion.
struct Direction {
  bool found = false;
  double slope = 0;    // of the potential along it
  double size = 0;     // rad, L: the largest of any node
  double travel2 = 0;  // m^2: of all nodes together, squared
  bool shortened = false;
};

/// Newton's direction for the potential and `stiffness` [N/m] times half of every node's squared travel.
/// Leaves the potential's gradient in w.gradient. Not found if the second derivatives are not positive
/// definite.
Direction newtonDirection(const RodModel& model, double stiffness, RodWorkspace::Impl& w) {
  const std::size_t n = w.nodes.size();
  const auto solve = [&](bool geometric) {
    w.assemble(model, geometric);
    for (std::size_t i = 0; i < n; ++i) {
      w.gradient[i] = -w.system.rhs(i);
      w.system.diagonal(i).diagonal().tail<3>().array() += stiffness;
    }
    return w.system.solve();
  };
  Direction d;
  if (!solve(true) && !solve(false)) return d;
  d.found = true;
  for (std::size_t i = 0; i < n; ++i) {
    d.slope += w.gradient[i].dot(w.system.solution[i]);
    w.motion[i] = w.nodes[i].rotation * w.system.solution[i].tail<3>();
    d.travel2 += w.motion[i].squaredNorm();
    d.size = std::max({d.size, w.system.solution[i].head<3>().norm(), w.motion[i].norm() / model.rod.length});
  }
  return d;
}

/// A direction, and how much of it the filter leaves. Where the rod is pressed to worn gaps, barriers push
/// with great force, and a soft mode that gets a little of it is what the filter sees: it cuts the opening of
/// the gaps together with that. A stiffness against all travel holds the soft modes and leaves the stiff
/// ones.
Direction filteredDirection(const RodModel& model, RodWorkspace::Impl& w, double& fraction) {
  const bool worn = w.has_contacts && w.contacts.leastGap() < kWornGap * w.contacts.barrier().dhat;
  double stiffness = 0;
  for (int shorter = 0;; ++shorter) {
    Direction d = newtonDirection(model, stiffness, w);
    if (!d.found) return d;
    d.shortened = shorter > 0;
    fraction = withinLimits(model, std::min(1.0, 1.0 / d.size), w);
    const double free = freePart(fraction, w);
    fraction *= free;
    if (!worn || free >= kTooLittle || !(free > 0) || shorter == kShorterSteps) return d;
    stiffness -= d.slope / (d.travel2 * kSoftShare * free);  // -slope/travel2 is that of the mode
  }
}

/// A step of the model's time step.
StepReport stepOnce(const RodModel& model, const std::array<GripperGoal, 2>& goals, RodState& state,
                    RodWorkspace& workspace, bool record_way_points) {
  RodWorkspace::Impl& w = workspace.impl();
  w.prepare(model, goals, state);
  const std::size_t n = w.nodes.size();
  const double dt = model.simulation.time_step;

  StepReport report;
  report.status = StepReport::Status::iteration_limit;
  for (std::size_t i = 0; i < n; ++i) {
    w.system.solution[i] << logSO3(w.nodes[i].pose.rotation.conjugate() * w.predicted_rotations[i]),
        w.nodes[i].rotation.transpose() * w.predicted_motion[i];
    w.motion[i] = w.predicted_motion[i];
  }
  double guess = withinLimits(model, 1, w);
  if (w.has_contacts) {
    for (std::size_t i = 0; i < n; ++i) w.limited_motion[i] = guess * w.motion[i];
    w.contacts.findCandidates(w.positions, w.limited_motion);  // the guess's, and so the start's
    if (!w.contacts.evaluate(w.positions)) {
      report.status =
          StepReport::Status::stalled;  // the caller handed over a penetrating state: leave it as it is
      w.way_point_count = 0;
      return report;
    }
    // A barrier that reaches beyond the middle of a passage plugs it.
    const double reach = model.simulation.contact_distance, room = w.contacts.room(w.positions);
    if (room < reach) {
      w.contacts.setBarrier(barrierFor(model, std::max(room, kLeastReach * reach)));
      if (!w.contacts.evaluate(w.positions)) assert(false && "the same positions were free");
    }
    // Slip below a hundredth of the gripper's travel counts as sticking.
    w.contacts.lagFriction(w.positions, model.friction, 0.01 * model.grippers.max_speed * dt);
  }
  w.path_size = 0;
  if (record_way_points) w.recordIterate(w.nodes);

  double energy = w.smoothEnergy(model, w.nodes, w.elements);
  if (w.has_contacts) energy += w.contacts.energy() + w.contacts.frictionEnergy(w.positions);

  // First guess: the motion goes on as it was. It passes the same filter, and is kept only if it lowers the
  // potential and leaves every gap room: an iteration at most doubles a small gap, and a guess that cuts it
  // to a tenth step after step, with few iterations in between, ends within rounding of the surface.
  guess *= freePart(guess, w);
  if (double guessed = 0;
      w.tryFraction(model, guess, guessed) && guessed < energy &&
      (!w.has_contacts || w.contacts.leastGap() >= kGuessLeastGap * w.contacts.barrier().dhat)) {
    energy = guessed;
    w.acceptTrial(record_way_points);
  } else if (w.has_contacts && !w.contacts.evaluate(w.positions)) {
    assert(false && "the step's start was free a moment ago");
  }

  while (report.iterations < model.newton.max_iterations) {
    ++report.iterations;
    double fraction = 0;
    const Direction direction = filteredDirection(model, w, fraction);
    if (!direction.found) {
      report.status = StepReport::Status::stalled;
      break;
    }
    const double slope = direction.slope;
    const bool whole = fraction == 1 && !direction.shortened;
    bool accepted = false;
    double trial_energy = 0;
    for (int halvings = 0; halvings < 20; ++halvings, fraction *= 0.5)
      if (w.tryFraction(model, fraction, trial_energy) &&
          trial_energy <= energy + 1e-4 * fraction * slope + 1e-13 * std::abs(energy)) {
        accepted = true;
        break;
      }
    if (!accepted) {
      report.status = !direction.shortened && direction.size < 10 * model.newton.tolerance
                          ? StepReport::Status::converged
                          : StepReport::Status::stalled;
      break;
    }
    energy = trial_energy;
    w.acceptTrial(record_way_points);
    if (whole && direction.size < model.newton.tolerance) {
      report.status = StepReport::Status::converged;
      break;
    }
  }
  report.contacts = w.has_contacts ? static_cast<int>(w.contacts.activeTerms()) : 0;

  w.updateState(model, state);
  if (record_way_points) w.chooseWayPoints(model);
  return report;
}

/// The same in `count` equal parts; the way points of all of them, if recorded, in w.parts.
StepReport stepInParts(int count, const RodModel& model, const std::array<GripperGoal, 2>& goals,
                       RodState& state, RodWorkspace& workspace, bool record_way_points) {
  RodWorkspace::Impl& w = workspace.impl();
  if (w.part_model)
    *w.part_model = model;
  else
    w.part_model = std::make_unique<RodModel>(model);
  w.part_model->simulation.time_step /= count;
  const double dt = w.part_model->simulation.time_step;
  StepReport total;
  w.part_count = 0;
  // Strain rates are taken from equally long parts: the first one has none before it.
  state.previous_nodes.clear();
  for (int part = 0; part < count; ++part) {
    std::array<GripperGoal, 2> part_goals = goals;
    for (const End end : kBothEnds) {
      GripperGoal& goal = part_goals[static_cast<std::size_t>(end)];
      if (goal.moving) goal.pose = approach(endPose(state.nodes, end), goal.pose, model.grippers, dt);
    }
    const StepReport report = stepOnce(*w.part_model, part_goals, state, workspace, record_way_points);
    total.iterations += report.iterations, total.contacts = report.contacts;
    if (report.status != StepReport::Status::converged) total.status = report.status;
    if (!record_way_points) continue;
    for (std::size_t i = 0; i < w.way_point_count; ++i) {
      if (w.parts.size() == w.part_count) w.parts.emplace_back();
      w.parts[w.part_count++] = w.way_points[i];
    }
  }
  return total;
}

/// Halves the parts, to 64 at most, until their error is no more than the tolerance by Richardson's estimate:
/// what halving changes, over 2^order - 1.
StepReport stepToTolerance(const RodModel& model, const std::array<GripperGoal, 2>& goals, RodState& state,
                           RodWorkspace& workspace, bool record_way_points) {
  constexpr int kMostParts = 64;
  RodWorkspace::Impl& w = workspace.impl();
  const double order = isSecondOrder(model.simulation) ? 2 : 1;
  const double allowed = model.simulation.step_tolerance * (std::exp2(order) - 1);
  w.start_state = state;
  StepReport report = stepInParts(1, model, goals, state, workspace, false);
  for (int parts = 2;; parts *= 2) {
    w.coarser = state.nodes;
    state = w.start_state;
    const int iterations = report.iterations;
    report = stepInParts(parts, model, goals, state, workspace, record_way_points);
    report.iterations += iterations;
    if (parts >= kMostParts || maxNodeDistance(w.coarser, state.nodes) <= allowed) break;
  }
  std::swap(w.way_points, w.parts), std::swap(w.way_point_count, w.part_count);
  return report;
}

}  // namespace

StepReport step(const RodModel& model, const std::array<GripperGoal, 2>& goals, RodState& state,
                RodWorkspace& workspace, bool record_way_points) {
  return model.simulation.step_tolerance > 0
             ? stepToTolerance(model, goals, state, workspace, record_way_points)
             : stepOnce(model, goals, state, workspace, record_way_points);
}

}  // namespace tendril
