#include "tendril/planner/spaces.h"

#include <ompl/base/ProjectionEvaluator.h>

#include <cmath>

namespace tendril::ompl_spaces {
namespace {

const State& rodOf(const ob::State* state) { return *static_cast<const State*>(state); }
State& rodOf(ob::State* state) { return *static_cast<State*>(state); }

/// Draws stable equilibria at rest.
class Sampler : public ob::StateSampler {
 public:
  Sampler(const ob::StateSpace* space, RodSampler& sampler) : ob::StateSampler(space), sampler_(sampler) {}
  void sampleUniform(ob::State* state) override {
    State& s = rodOf(state);
    if (const Equilibrium* sample = sampler_.next()) s.rod = RodState::atRest(sample->nodes);
  }
  void sampleUniformNear(ob::State* state, const ob::State*, double) override { sampleUniform(state); }
  void sampleGaussian(ob::State* state, const ob::State*, double) override { sampleUniform(state); }

 private:
  RodSampler& sampler_;
};

/// The rod's middle and its direction there: what grid- and cell-based planners look at.
class Projection : public ob::ProjectionEvaluator {
 public:
  Projection(const ob::StateSpace* space, const Box& workspace) : ob::ProjectionEvaluator(space) {
    for (int i = 0; i < 3; ++i) cellSizes_.push_back((workspace.max[i] - workspace.min[i]) / 20);
  }
  [[nodiscard]] unsigned int getDimension() const override { return 3; }
  void project(const ob::State* state, Eigen::Ref<Eigen::VectorXd> projection) const override {
    const RodShape& nodes = rodOf(state).rod.nodes;
    projection = nodes[nodes.size() / 2].position;
  }
};

/// Undirected planners aim at the ends of a stable sample, or of the goal.
class RandomControl : public oc::ControlSampler {
 public:
  RandomControl(const ControlSpace* space, RodSampler& sampler)
      : oc::ControlSampler(space), control_space_(space), sampler_(sampler) {}
  void sample(oc::Control* control) override {
    if (!control_space_->aimsAtGoal(shape_)) {
      const Equilibrium* sample = sampler_.next();
      if (!sample) return;
      shape_ = sample->nodes;
    }
    static_cast<ControlValue*>(control)->extension =
        algorithm1(control_space_->leadingEnd(), {shape_.front(), shape_.back()});
  }

 private:
  const ControlSpace* control_space_;
  RodSampler& sampler_;
  RodShape shape_;
};

bool samePose(const Pose& a, const Pose& b) {
  return a.position == b.position && a.rotation.coeffs() == b.rotation.coeffs();
}

}  // namespace

StateSpace::StateSpace(std::size_t nodes, const Box& workspace, RodSampler& sampler)
    : nodes_(nodes), workspace_(workspace), sampler_(sampler) {
  setName("Rod");
}

unsigned int StateSpace::getDimension() const { return static_cast<unsigned int>(12 * nodes_); }
double StateSpace::getMaximumExtent() const { return (workspace_.max - workspace_.min).norm(); }
double StateSpace::getMeasure() const { return (workspace_.max - workspace_.min).prod(); }

bool StateSpace::satisfiesBounds(const ob::State* state) const {
  for (const Pose& node : rodOf(state).rod.nodes)
    if (!workspace_.contains(node.position)) return false;
  return true;
}

void StateSpace::copyState(ob::State* destination, const ob::State* source) const {
  rodOf(destination).rod = rodOf(source).rod;
}

double StateSpace::distance(const ob::State* a, const ob::State* b) const {
  return meanNodeDistance(rodOf(a).rod.nodes, rodOf(b).rod.nodes);
}

bool StateSpace::equalStates(const ob::State* a, const ob::State* b) const {
  const RodShape &p = rodOf(a).rod.nodes, &q = rodOf(b).rod.nodes;
  return std::equal(p.begin(), p.end(), q.begin(), q.end(), samePose);
}

void StateSpace::interpolate(const ob::State* from, const ob::State* to, double t, ob::State* state) const {
  const RodShape a = rodOf(from).rod.nodes, b = rodOf(to).rod.nodes;
  RodShape shape(a.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    shape[i] = {a[i].rotation.slerp(t, b[i].rotation), (1 - t) * a[i].position + t * b[i].position};
  rodOf(state).rod = RodState::atRest(std::move(shape));
}

ob::StateSamplerPtr StateSpace::allocDefaultStateSampler() const {
  return std::make_shared<Sampler>(this, sampler_);
}

ob::State* StateSpace::allocState() const {
  auto* state = new State;
  state->rod = RodState::atRest(RodShape(nodes_));
  return state;
}
void StateSpace::freeState(ob::State* state) const { delete static_cast<State*>(state); }

void StateSpace::registerProjections() {
  registerDefaultProjection(std::make_shared<Projection>(this, workspace_));
}

ControlSpace::ControlSpace(const ob::StateSpacePtr& states, RodSampler& sampler, Random& random, Aim aim)
    : oc::ControlSpace(states), sampler_(sampler), random_(random), aim_(std::move(aim)) {
  setName("Grippers");
}

unsigned int ControlSpace::getDimension() const { return 13; }
oc::Control* ControlSpace::allocControl() const { return new ControlValue; }
void ControlSpace::freeControl(oc::Control* control) const { delete static_cast<ControlValue*>(control); }
void ControlSpace::copyControl(oc::Control* destination, const oc::Control* source) const {
  static_cast<ControlValue*>(destination)->extension = static_cast<const ControlValue*>(source)->extension;
}
bool ControlSpace::equalControls(const oc::Control* a, const oc::Control* b) const {
  const auto &x = static_cast<const ControlValue*>(a)->extension.phases,
             &y = static_cast<const ControlValue*>(b)->extension.phases;
  return std::equal(x.begin(), x.end(), y.begin(), y.end(), [](const Phase& p, const Phase& q) {
    return p.moving == q.moving && p.hold_other == q.hold_other && samePose(p.target, q.target);
  });
}
void ControlSpace::nullControl(oc::Control* control) const {
  static_cast<ControlValue*>(control)->extension = {};
}
oc::ControlSamplerPtr ControlSpace::allocDefaultControlSampler() const {
  return std::make_shared<RandomControl>(this, sampler_);
}
End ControlSpace::leadingEnd() const {
  return aim_.random_order && random_.uniform() < 0.5 ? End::last : End::first;
}
bool ControlSpace::aimsAtGoal(RodShape& shape) const {
  if (random_.uniform() >= aim_.goal_bias) return false;
  shape = aim_.goal;
  return true;
}

Propagator::Propagator(const oc::SpaceInformationPtr& si, const RodModel& model,
                       const ExtendSettings& settings, Work& work)
    : oc::StatePropagator(si), model_(model), extend_(model, settings), work_(work) {}

void Propagator::propagate(const ob::State* state, const oc::Control* control, double,
                           ob::State* result) const {
  State& out = rodOf(result);
  if (state != result) out.rod = rodOf(state).rod;
  const ExtendReport report =
      extend_(static_cast<const ControlValue*>(control)->extension, out.rod, workspace_, work_.stop);
  ++work_.extends;
  work_.count(report.steps, model_);
}

unsigned int DirectedSampler::sampleTo(oc::Control* control, const ob::State* source,
                                       ob::State* destination) {
  const RodShape& target = rodOf(destination).rod.nodes;
  const auto* space = static_cast<const ControlSpace*>(si_->getControlSpace().get());
  static_cast<ControlValue*>(control)->extension =
      algorithm1(space->leadingEnd(), {target.front(), target.back()});
  si_->getStatePropagator()->propagate(source, control, si_->getPropagationStepSize(), destination);
  return 1;
}
unsigned int DirectedSampler::sampleTo(oc::Control* control, const oc::Control*, const ob::State* source,
                                       ob::State* destination) {
  return sampleTo(control, source, destination);
}

Goal::Goal(const ob::SpaceInformationPtr& si, const GoalTest& test)
    : ob::GoalSampleableRegion(si), test_(test) {
  setThreshold(0);  // membership is isSatisfied's; the distance only ranks approximate solutions
}
double Goal::distanceGoal(const ob::State* state) const { return test_.distance(rodOf(state).rod.nodes); }
bool Goal::isSatisfied(const ob::State* state) const { return test_(rodOf(state).rod.nodes); }
bool Goal::isSatisfied(const ob::State* state, double* distance) const {
  if (distance) *distance = distanceGoal(state);
  return isSatisfied(state);
}
void Goal::sampleGoal(ob::State* state) const { rodOf(state).rod = RodState::atRest(test_.shape()); }

}  // namespace tendril::ompl_spaces
