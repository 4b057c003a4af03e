#include "tendril/planner/contact_rrt.h"

#include <ompl/control/PathControl.h>

#include <algorithm>
#include <cmath>

#include "tendril/planner/strategies.h"

namespace tendril {

namespace ob = ompl::base;
namespace oc = ompl::control;

namespace {

constexpr double kFailed = 0.9;    // a growth that ends at more than this of its old distance has failed
constexpr double kNovelty = 0.01;  // L: a state this near another adds nothing
constexpr double kArrived = 0.05;  // L: whoever follows has arrived within this

}  // namespace

ContactRrt::ContactRrt(const oc::SpaceInformationPtr& si, const RodModel& model,
                       std::vector<StrategyShare> strategies, const ContactRrtSettings& settings,
                       Random& random)
    : ob::Planner(si, "ContactRRT"),
      control_si_(si.get()),
      model_(model),
      strategies_(std::move(strategies)),
      settings_(settings),
      random_(random) {}

ContactRrt::~ContactRrt() {
  clearTree(forward_);
  clearTree(from_goal_);
}

void ContactRrt::clearTree(Tree& tree) {
  for (const Node& node : tree.nodes) {
    si_->freeState(node.state);
    if (node.control) control_si_->freeControl(node.control);
  }
  tree.nodes.clear();
  tree.index.clear();
}

void ContactRrt::clear() {
  Planner::clear();
  clearTree(forward_);
  clearTree(from_goal_);
  extends_ = goal_growths_ = 0;
  solution_ = -1;
}

int ContactRrt::add(Tree& tree, State* state, ControlValue* control, int parent) {
  const int k = static_cast<int>(tree.nodes.size());
  tree.nodes.push_back({state, control, parent});
  tree.index.add(state->rod.nodes);
  return k;
}

bool ContactRrt::grow(Tree& tree, int from, const RodShape& target, const ExtendStrategy::Steps& steps,
                      const Stop& stop) {
  const double before = meanNodeDistance(tree.shape(from), target);
  const auto& goal = *pdef_->getGoal();
  int at = from;
  while (extends_ < settings_.extends && !stop()) {
    std::optional<Extension> extension = steps(tree.shape(at));
    if (!extension) break;
    auto* control = static_cast<ControlValue*>(control_si_->allocControl());
    control->extension = std::move(*extension);
    auto* state = static_cast<State*>(si_->allocState());
    control_si_->getStatePropagator()->propagate(tree.nodes[static_cast<std::size_t>(at)].state, control,
                                                 control_si_->getPropagationStepSize(), state);
    ++extends_;
    const bool reached = &tree == &forward_ && goal.isSatisfied(state);
    if (!reached && tree.index.hasWithin(state->rod.nodes, kNovelty * model_.rod.length)) {
      si_->freeState(state);
      control_si_->freeControl(control);
      break;
    }
    at = add(tree, state, control, at);
    if (reached) {
      solution_ = at;
      return true;
    }
  }
  if (meanNodeDistance(tree.shape(at), target) > kFailed * before) tree.index.fail(from);
  return false;
}

const ExtendStrategy& ContactRrt::drawStrategy() {
  double total = 0;
  for (const StrategyShare& s : strategies_) total += s.share;
  double u = random_.uniform(0, total);
  for (const StrategyShare& s : strategies_)
    if ((u -= s.share) < 0) return *s.strategy;
  return *strategies_.back().strategy;
}

bool ContactRrt::growTowardSample(const Stop& stop) {
  ob::State* sample = si_->allocState();
  sampler_->sampleUniform(sample);
  const RodShape target = static_cast<State*>(sample)->rod.nodes;
  si_->freeState(sample);
  const int from = nearest(forward_, target);
  return grow(forward_, from, target, drawStrategy().begin(model_.rod, forward_.shape(from), target, random_),
              stop);
}

ExtendStrategy::Steps ContactRrt::follow(int goal_node) {
  // What was pulled out by one end goes back in with the other one first.
  const auto leading = [this](int node) {
    const ControlValue* control = from_goal_.nodes[static_cast<std::size_t>(node)].control;
    return control ? other(control->extension.phases.front().moving)
                   : (random_.uniform() < 0.5 ? End::last : End::first);
  };
  const bool place_both = random_.uniform() < 0.5;
  return [this, leading, place_both, node = goal_node, begun = false,
          end = leading(goal_node)](const RodShape& now) mutable -> std::optional<Extension> {
    if (std::exchange(begun, true)) {
      const Vector3 wanted = endPose(from_goal_.shape(node), end).position;
      if ((endPose(now, end).position - wanted).norm() > kArrived * model_.rod.length) return std::nullopt;
      const int next = from_goal_.nodes[static_cast<std::size_t>(node)].parent;
      if (next < 0) return std::nullopt;
      if (from_goal_.nodes[static_cast<std::size_t>(next)].control) end = leading(next);
      node = next;
      const RodShape& aim = from_goal_.shape(node);
      const bool last = from_goal_.nodes[static_cast<std::size_t>(node)].parent < 0;
      Extension extension = algorithm1(end, {aim.front(), aim.back()});
      if (!place_both && !last) extension.phases.pop_back();
      return extension;
    }
    const RodShape& aim = from_goal_.shape(node);
    return algorithm1(end, {aim.front(), aim.back()});
  };
}

bool ContactRrt::growTowardGoal(const Stop& stop) {
  const int aim = static_cast<int>(random_.uniform() * static_cast<double>(from_goal_.nodes.size()));
  const RodShape target = from_goal_.shape(aim);
  return grow(forward_, nearest(forward_, target), target, follow(aim), stop);
}

void ContactRrt::growFromGoal(const RodShape& start, const Stop& stop) {
  const int growth = goal_growths_++;
  if (growth < 2) {                // straight out, by either end
    constexpr double kWay = 1.35;  // L
    const double piece = pieceOf(model_.rod);
    const End end = growth == 0 ? End::last : End::first;
    grow(from_goal_, 0, start, along(model_.rod, end, piece, static_cast<int>(std::ceil(kWay / piece))),
         stop);
    return;
  }
  RodShape target = start;
  if (random_.uniform() < 0.5) {
    ob::State* sample = si_->allocState();
    sampler_->sampleUniform(sample);
    target = static_cast<State*>(sample)->rod.nodes;
    si_->freeState(sample);
  }
  const End end = random_.uniform() < 0.5 ? End::last : End::first;
  grow(from_goal_, nearest(from_goal_, target), target, lead(model_.rod, end, endPose(target, end)), stop);
}

ob::PlannerStatus ContactRrt::solve(const Stop& stop) {
  checkValidity();
  sampler_ = si_->allocStateSampler();
  const auto* goal = pdef_->getGoal()->as<ob::GoalSampleableRegion>();
  while (const ob::State* start = pis_.nextStart()) {
    auto* state = static_cast<State*>(si_->cloneState(start));
    const int k = add(forward_, state, nullptr, -1);
    if (solution_ < 0 && goal->isSatisfied(state)) solution_ = k;
  }
  if (forward_.nodes.empty()) return ob::PlannerStatus::INVALID_START;
  auto* goal_state = static_cast<State*>(si_->allocState());
  goal->sampleGoal(goal_state);
  add(from_goal_, goal_state, nullptr, -1);
  const RodShape start = forward_.shape(0);

  int goal_extends = 0;
  while (solution_ < 0 && extends_ < settings_.extends && !stop()) {
    if (goal_extends < settings_.goal_extends && 4 * goal_extends <= extends_ - goal_extends) {
      const int before = extends_;
      growFromGoal(start, stop);
      goal_extends += std::max(1, extends_ - before);
    } else if (random_.uniform() < settings_.goal_bias) {
      growTowardGoal(stop);
    } else {
      growTowardSample(stop);
    }
  }

  const bool exact = solution_ >= 0;
  int end = solution_;
  double distance = 0;
  if (!exact) {
    end = 0, distance = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < forward_.nodes.size(); ++k) {
      const double d = static_cast<const ompl_spaces::Goal*>(goal)->distanceGoal(forward_.nodes[k].state);
      if (d < distance) distance = d, end = static_cast<int>(k);
    }
  }
  std::vector<int> chain;
  for (int k = end; k >= 0; k = forward_.nodes[static_cast<std::size_t>(k)].parent) chain.push_back(k);
  auto path = std::make_shared<oc::PathControl>(si_);
  for (auto k = chain.rbegin(); k != chain.rend(); ++k) {
    const Node& node = forward_.nodes[static_cast<std::size_t>(*k)];
    if (node.control)
      path->append(node.state, node.control, control_si_->getPropagationStepSize());
    else
      path->append(node.state);
  }
  pdef_->addSolutionPath(path, !exact, distance, getName());
  return exact ? ob::PlannerStatus::EXACT_SOLUTION : ob::PlannerStatus::APPROXIMATE_SOLUTION;
}

void ContactRrt::getPlannerData(ob::PlannerData& data) const {
  Planner::getPlannerData(data);
  for (std::size_t k = 0; k < forward_.nodes.size(); ++k) {
    const Node& node = forward_.nodes[k];
    if (node.parent < 0)
      data.addStartVertex(ob::PlannerDataVertex(node.state));
    else
      data.addEdge(ob::PlannerDataVertex(forward_.nodes[static_cast<std::size_t>(node.parent)].state),
                   ob::PlannerDataVertex(node.state));
  }
  if (solution_ >= 0) data.markGoalState(forward_.nodes[static_cast<std::size_t>(solution_)].state);
}

}  // namespace tendril
