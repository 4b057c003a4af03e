/// After the path: random changes of a plan's phases, kept where the exact simulation says they are no worse.
#include <algorithm>
#include <cassert>
#include <cmath>

#include "tendril/planner/extend.h"
#include "tendril/planner/goal.h"

namespace tendril {
namespace {

Pose between(const Pose& a, const Pose& b, double share) {
  return {a.rotation.slerp(share, b.rotation), (1 - share) * a.position + share * b.position};
}

/// A phase as it was carried out.
struct Link {
  Phase phase;
  std::vector<Control> controls;  // times count from the phase's start
  std::int64_t steps = 0;
  RodState after;
  MotionCost cost;
};
using Chain = std::vector<Link>;

MotionCost costOf(const Chain& chain, double time_step) {
  MotionCost total;
  std::int64_t steps = 0;
  for (const Link& link : chain) {
    steps += link.steps;
    total.path += link.cost.path, total.turn += link.cost.turn;
    total.gripper_force = std::max(total.gripper_force, link.cost.gripper_force);
    total.contact_force = std::max(total.contact_force, link.cost.contact_force);
  }
  total.time = static_cast<double>(steps) * time_step;
  return total;
}

bool noneLarger(const MotionCost& a, const MotionCost& b) {
  bool holds = true;
  visitMotionCost([&](const char*, auto member) { holds = holds && a.*member <= b.*member; });
  return holds;
}

/// Sum of the ratios to `reference`; what is zero there does not count.
double relative(const MotionCost& cost, const MotionCost& reference) {
  double sum = 0;
  visitMotionCost([&](const char*, auto member) {
    if (reference.*member > 0) sum += cost.*member / (reference.*member);
  });
  return sum;
}

constexpr double kSlowest = 0.2;  // of a gripper's speed

class Optimizer {
 public:
  Optimizer(const Solution& plan, const Obstacles& obstacles, const OptimizeRequest& request)
      : plan_(plan),
        request_(request),
        model_(plan.scenario, obstacles),
        extend_(model_, extendSettings(model_, plan.scenario.planner, true)),
        goal_(*plan.scenario.goal, goalShape(plan.scenario, obstacles), model_.rod.elements),
        start_(RodState::atRest(plan.trajectory.shapes.front())),
        random_(plan.run.seed) {}

  Improvement run();

 private:
  [[nodiscard]] double elapsed() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun_).count();
  }
  [[nodiscard]] bool stop() const {
    return (request_.cancel && *request_.cancel) || elapsed() > request_.time_limit_s;
  }
  [[nodiscard]] Chain chainOf(const std::vector<Control>& controls);
  /// Carries a link's controls out from `state`; fills in what they cost and where they lead.
  void measureLink(Link& link, RodState state);
  /// The chain whose first `kept` links are `chain_`'s and whose others carry out `phases`, up to the goal.
  /// Empty if it does not get there within the plan's time, or if time is up.
  [[nodiscard]] Chain carriedOut(std::size_t kept, const std::vector<Phase>& phases);
  /// A random change of chain_, from link `first` on: all phases from there.
  [[nodiscard]] std::vector<Phase> changed(std::size_t& first);
  [[nodiscard]] std::size_t index(std::size_t size) {
    return std::min(size - 1, static_cast<std::size_t>(random_.uniform() * static_cast<double>(size)));
  }
  [[nodiscard]] const RodState& before(std::size_t link) const {
    return link == 0 ? start_ : chain_[link - 1].after;
  }

  std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
  const Solution& plan_;
  const OptimizeRequest& request_;
  RodModel model_;
  Extend extend_;
  GoalTest goal_;
  RodState start_;
  Random random_;
  RodWorkspace workspace_;
  Chain chain_;
  MotionCost first_cost_;
  std::int64_t first_steps_ = 0;
};

/// A phase is written as one control, or as several where its gripper creeps or waits for a step.
Chain Optimizer::chainOf(const std::vector<Control>& controls) {
  Chain chain;
  bool only_slow = true;  // the last link so far
  for (Control control : controls) {
    const int steps = stepCount(control, model_.simulation.time_step);
    const bool slow = steps == 1;
    const auto continues = [&](const Link& link) {
      if (control.held != link.controls.front().held) return false;
      if (!control.moving) return true;
      const Pose &a = control.target, &b = link.phase.target;
      return *control.moving == link.phase.moving &&
             (slow || only_slow || (a.position == b.position && a.rotation.coeffs() == b.rotation.coeffs()));
    };
    if (chain.empty() || !continues(chain.back())) {
      const End moving = control.moving.value_or(control.held[0] ? End::first : End::last);
      chain.emplace_back().phase = {
          .moving = moving, .hold_other = control.isHeld(other(moving)), .target = control.target};
      only_slow = true;
    }
    Link& link = chain.back();
    if (control.moving && (only_slow || !slow)) link.phase.target = control.target;
    only_slow = only_slow && slow;
    const double dt = model_.simulation.time_step;
    control.start_s = static_cast<double>(link.steps) * dt;
    link.steps += steps;
    control.end_s = static_cast<double>(link.steps) * dt;
    link.controls.push_back(control);
  }
  for (std::size_t k = 0; k < chain.size(); ++k) measureLink(chain[k], k == 0 ? start_ : chain[k - 1].after);
  return chain;
}

void Optimizer::measureLink(Link& link, RodState state) {
  link.cost = {};
  for (const Control& control : link.controls) {
    ControlRunner runner(model_, control, state);
    for (int k = stepCount(control, model_.simulation.time_step); k > 0; --k) {
      const std::array<Pose, 2> from = {state.nodes.front(), state.nodes.back()};
      runner.advance(state, workspace_);
      const Quantities q = measure(model_, state, workspace_);
      for (const End end : kBothEnds) {
        const auto e = static_cast<std::size_t>(end);
        link.cost.gripper_force = std::max(link.cost.gripper_force, q.gripper_force[e].norm());
        if (!control.held[e]) continue;
        const Pose& to = endPose(state.nodes, end);
        link.cost.path += (to.position - from[e].position).norm();
        link.cost.turn += angleBetween(from[e].rotation, to.rotation);
      }
      for (const ContactForce& contact : q.contacts)
        link.cost.contact_force = std::max(link.cost.contact_force, contact.force.norm());
      for (const SelfContactForce& contact : q.self_contacts)
        link.cost.contact_force = std::max(link.cost.contact_force, contact.force.norm());
    }
  }
  link.after = std::move(state);
}

Chain Optimizer::carriedOut(std::size_t kept, const std::vector<Phase>& phases) {
  Chain chain(chain_.begin(), chain_.begin() + static_cast<std::ptrdiff_t>(kept));
  RodState state = before(kept);
  std::int64_t steps = 0;
  for (const Link& link : chain) steps += link.steps;
  bool reached = goal_(state.nodes);
  for (std::size_t k = 0; k < phases.size() && !reached; ++k) {
    TrajectoryRecorder recorder(model_, state.nodes);
    ExtendReport report = extend_(
        {{phases[k]}}, state, workspace_,
        [&] { return steps + recorder.steps() >= first_steps_ || goal_(state.nodes) || stop(); }, &recorder);
    reached = goal_(state.nodes);
    if (report.cancelled && !reached) return {};
    if (recorder.steps() == 0) continue;
    steps += recorder.steps();
    Link& link = chain.emplace_back();
    link.phase = phases[k], link.controls = std::move(report.controls), link.steps = recorder.steps();
  }
  if (!reached) return {};
  for (std::size_t k = kept; k < chain.size(); ++k) {
    if (stop()) return {};
    measureLink(chain[k], k == 0 ? start_ : chain[k - 1].after);
  }
  return chain;
}

std::vector<Phase> Optimizer::changed(std::size_t& first) {
  std::vector<Phase> phases;
  for (const Link& link : chain_) phases.push_back(link.phase);
  std::size_t k = index(phases.size());
  if (random_.uniform() < 0.5) {  // where a force is largest
    const auto force = random_.uniform() < 0.5 ? &MotionCost::gripper_force : &MotionCost::contact_force;
    const auto less = [&](const Link& a, const Link& b) { return a.cost.*force < b.cost.*force; };
    k = static_cast<std::size_t>(std::max_element(chain_.begin(), chain_.end(), less) - chain_.begin());
  }
  first = k;
  const auto at = phases.begin() + static_cast<std::ptrdiff_t>(k);
  const Pose begin = endPose(before(k).nodes, at->moving);
  const auto next =
      std::find_if(at + 1, phases.end(), [&](const Phase& p) { return p.moving == at->moving; });
  const double share = random_.uniform(), speed = random_.uniform(kSlowest, 1);
  switch (index(7)) {
    case 0: {  // leaves out a run
      auto end = at + 1;
      while (end != phases.end() && random_.uniform() < 0.5) ++end;
      phases.erase(at, end);
      break;
    }
    case 1:  // takes less of a phase
      at->target = between(begin, at->target, share);
      break;
    case 2:  // cuts the corner to the gripper's next target
      if (next != phases.end()) at->target = between(at->target, next->target, share);
      break;
    case 3:  // one phase for two
      if (next != phases.end()) at->target = between(at->target, next->target, share), phases.erase(next);
      break;
    case 4: {  // straight to the goal, after part of a phase
      at->target = between(begin, at->target, share);
      phases.erase(at + 1, phases.end());
      const End leading = random_.uniform() < 0.5 ? End::first : End::last;
      const Extension aim = algorithm1(leading, {goal_.shape().front(), goal_.shape().back()});
      phases.insert(phases.end(), aim.phases.begin(), aim.phases.end());
      break;
    }
    case 5:  // slower, or at full speed again
      at->speed = at->speed < 1 && random_.uniform() < 0.5 ? 1 : speed;
      break;
    default: {  // one half slower
      Phase half = *at;
      half.target = between(begin, at->target, share);
      (random_.uniform() < 0.5 ? half.speed : at->speed) = speed;
      phases.insert(at, half);
    }
  }
  phases.erase(phases.begin(), phases.begin() + static_cast<std::ptrdiff_t>(first));
  return phases;
}

Improvement Optimizer::run() {
  Improvement result;
  chain_ = chainOf(plan_.controls);
  result.before = result.after = first_cost_ = costOf(chain_, model_.simulation.time_step);
  for (const Link& link : chain_) first_steps_ += link.steps;
  while (!chain_.empty() && result.candidates < request_.candidates && !stop()) {
    ++result.candidates;
    std::size_t first = 0;
    const std::vector<Phase> phases = changed(first);
    Chain candidate = carriedOut(first, phases);
    if (candidate.empty()) continue;
    const MotionCost cost = costOf(candidate, model_.simulation.time_step);
    if (!noneLarger(cost, first_cost_) || relative(cost, first_cost_) >= relative(result.after, first_cost_))
      continue;
    chain_ = std::move(candidate);
    result.after = cost;
    ++result.accepted;
    if (request_.on_progress) request_.on_progress(cost, elapsed());
  }

  result.solution = plan_;
  if (result.accepted == 0) return result;
  result.solution.controls.clear();
  std::int64_t steps = 0;
  const double dt = model_.simulation.time_step;
  for (const Link& link : chain_)
    for (Control control : link.controls) {
      const int length = stepCount(control, dt);
      control.start_s = static_cast<double>(steps) * dt;
      control.end_s = static_cast<double>(steps += length) * dt;
      result.solution.controls.push_back(control);
    }
  SimulationResult motion = simulate(model_, start_.nodes, result.solution.controls);
  assert(goal_(motion.final_state.nodes));
  result.solution.trajectory = std::move(motion.trajectory);
  result.solution.run.planner["optimize_candidates"] = result.candidates;
  return result;
}

}  // namespace

Improvement optimize(const Solution& plan, const Obstacles& obstacles, const OptimizeRequest& request) {
  assert(plan.status == PlanStatus::solved && plan.scenario.goal);
  return Optimizer(plan, obstacles, request).run();
}

}  // namespace tendril
