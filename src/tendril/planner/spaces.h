/// The rod in OMPL's terms: state space (metric (6)), control space, EXTEND as propagator, samplers, goal
/// region. Private to planner, and included only by its .cpp files.
#pragma once

#include <ompl/base/goals/GoalSampleableRegion.h>
#include <ompl/control/ControlSpace.h>
#include <ompl/control/DirectedControlSampler.h>
#include <ompl/control/SpaceInformation.h>
#include <ompl/control/StatePropagator.h>

#include "tendril/planner/extend.h"
#include "tendril/planner/goal.h"
#include "tendril/statics.h"

namespace tendril::ompl_spaces {

namespace ob = ompl::base;
namespace oc = ompl::control;

/// A rod in motion as an OMPL state.
struct State : ob::State {
  RodState rod;
};

/// SE(3) x A_stable and all that lies between: any rod of a fixed number of elements. Distance (6).
class StateSpace : public ob::StateSpace {
 public:
  /// `sampler` gives the stable, contact-free rods that uniform samples are drawn from.
  StateSpace(std::size_t nodes, const Box& workspace, RodSampler& sampler);

  [[nodiscard]] unsigned int getDimension() const override;
  [[nodiscard]] double getMaximumExtent() const override;
  [[nodiscard]] double getMeasure() const override;
  void enforceBounds(ob::State*) const override {}
  [[nodiscard]] bool satisfiesBounds(const ob::State* state) const override;
  void copyState(ob::State* destination, const ob::State* source) const override;
  [[nodiscard]] double distance(const ob::State* a, const ob::State* b) const override;
  [[nodiscard]] bool equalStates(const ob::State* a, const ob::State* b) const override;
  void interpolate(const ob::State* from, const ob::State* to, double t, ob::State* state) const override;
  [[nodiscard]] ob::StateSamplerPtr allocDefaultStateSampler() const override;
  [[nodiscard]] ob::State* allocState() const override;
  void freeState(ob::State* state) const override;
  void registerProjections() override;

 private:
  std::size_t nodes_;
  Box workspace_;
  RodSampler& sampler_;
};

/// How controls are drawn.
struct Aim {
  bool random_order;  // which gripper leads is drawn; else it is the first, as Algorithm 1 prints it
  double goal_bias;   // probability that an undirected control aims at the goal
  RodShape goal;
};

/// An OMPL control: one extension. It lasts one OMPL step whatever its simulated time.
struct ControlValue : oc::Control {
  Extension extension;
};

class ControlSpace : public oc::ControlSpace {
 public:
  ControlSpace(const ob::StateSpacePtr& states, RodSampler& sampler, Random& random, Aim aim);

  [[nodiscard]] unsigned int getDimension() const override;
  [[nodiscard]] oc::Control* allocControl() const override;
  void freeControl(oc::Control* control) const override;
  void copyControl(oc::Control* destination, const oc::Control* source) const override;
  [[nodiscard]] bool equalControls(const oc::Control* a, const oc::Control* b) const override;
  void nullControl(oc::Control* control) const override;
  [[nodiscard]] oc::ControlSamplerPtr allocDefaultControlSampler() const override;

  [[nodiscard]] End leadingEnd() const;
  /// Whether the next undirected control aims at the goal; if so `shape` is it.
  [[nodiscard]] bool aimsAtGoal(RodShape& shape) const;

 private:
  RodSampler& sampler_;
  Random& random_;
  Aim aim_;
};

/// Counts what the simulator did for the planner, and tells it when to stop.
struct Work {
  std::function<bool()> stop;
  std::int64_t extends = 0, steps = 0;
  double simulated_time = 0;  // s

  void count(std::int64_t more_steps, const RodModel& model) {
    steps += more_steps;
    simulated_time += static_cast<double>(more_steps) * model.simulation.time_step;
  }
};

/// EXTEND as OMPL's state propagator: depends on state and control alone.
class Propagator : public oc::StatePropagator {
 public:
  Propagator(const oc::SpaceInformationPtr& si, const RodModel& model, const ExtendSettings& settings,
             Work& work);
  void propagate(const ob::State* state, const oc::Control* control, double duration,
                 ob::State* result) const override;

 private:
  const RodModel& model_;
  Extend extend_;
  Work& work_;
  mutable RodWorkspace workspace_;
};

/// Directed sampling: Algorithm 1 toward the sample's ends.
class DirectedSampler : public oc::DirectedControlSampler {
 public:
  explicit DirectedSampler(const oc::SpaceInformation* si) : oc::DirectedControlSampler(si) {}
  unsigned int sampleTo(oc::Control* control, const ob::State* source, ob::State* destination) override;
  unsigned int sampleTo(oc::Control* control, const oc::Control* previous, const ob::State* source,
                        ob::State* destination) override;
};

/// The goal region of gripper frames (and shape, if asked).
class Goal : public ob::GoalSampleableRegion {
 public:
  Goal(const ob::SpaceInformationPtr& si, const GoalTest& test);
  [[nodiscard]] double distanceGoal(const ob::State* state) const override;
  [[nodiscard]] bool isSatisfied(const ob::State* state) const override;
  [[nodiscard]] bool isSatisfied(const ob::State* state, double* distance) const override;
  void sampleGoal(ob::State* state) const override;
  [[nodiscard]] unsigned int maxSampleCount() const override { return 1; }

 private:
  const GoalTest& test_;
};

}  // namespace tendril::ompl_spaces
