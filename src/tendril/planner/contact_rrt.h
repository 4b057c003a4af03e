/// The tree of planner `tendril`: Algorithm 2 with the goal's surroundings explored too. Private to planner.
#pragma once

#include <ompl/base/Planner.h>

#include "tendril/planner/rod_index.h"
#include "tendril/planner/spaces.h"

namespace tendril {

struct ContactRrtSettings {
  double goal_bias = 0;        // probability of aiming at the goal, or at a state of its surroundings
  int goal_extends = 0;        // extensions spent on the goal's surroundings, one in four of all
  double failure_penalty = 0;  // what a failed growth adds to a state's distance, in multiples of it
  int extends = 0;             // extensions after which the tree gives up
};

/// RRT on the rod's state space, with
/// - a second tree that grows from the goal outward: the rod is pulled out of it by simulation. Its states
///   are aims: whoever stands near one follows their way to the goal, the deeper end leading;
/// - failures: the nearest state is the one that minimises d (1 + failure_penalty times the number of failed
///   growths from it);
/// - novelty: a state within 0.01 L of another adds nothing;
/// - strategies (ExtendStrategy) drawn by their shares.
class ContactRrt : public ompl::base::Planner {
 public:
  ContactRrt(const ompl::control::SpaceInformationPtr& si, const RodModel& model,
             std::vector<StrategyShare> strategies, const ContactRrtSettings& settings, Random& random);
  ~ContactRrt() override;

  ompl::base::PlannerStatus solve(const ompl::base::PlannerTerminationCondition& stop) override;
  void clear() override;
  void getPlannerData(ompl::base::PlannerData& data) const override;

 private:
  using State = ompl_spaces::State;
  using ControlValue = ompl_spaces::ControlValue;

  struct Node {
    State* state;
    ControlValue* control;  // that leads here from the parent; null at a root
    int parent;             // -1 at a root
  };
  struct Tree {
    std::vector<Node> nodes;
    RodIndex index;  // of the nodes
    [[nodiscard]] const RodShape& shape(int k) const {
      return nodes[static_cast<std::size_t>(k)].state->rod.nodes;
    }
  };
  using Stop = ompl::base::PlannerTerminationCondition;

  int add(Tree& tree, State* state, ControlValue* control, int parent);
  /// The node that minimises distance (6), failures counted.
  [[nodiscard]] int nearest(const Tree& tree, const RodShape& target) const {
    return tree.index.nearest(target, settings_.failure_penalty);
  }
  /// Carries out `steps` from a node toward `target`; true if it reaches the goal.
  bool grow(Tree& tree, int from, const RodShape& target, const ExtendStrategy::Steps& steps,
            const Stop& stop);
  bool growTowardSample(const Stop& stop);
  bool growTowardGoal(const Stop& stop);
  void growFromGoal(const RodShape& start, const Stop& stop);
  /// Along the parents of a state of the goal's tree, to the goal.
  [[nodiscard]] ExtendStrategy::Steps follow(int goal_node);
  [[nodiscard]] const ExtendStrategy& drawStrategy();
  void clearTree(Tree& tree);

  const ompl::control::SpaceInformation* control_si_;
  const RodModel& model_;
  std::vector<StrategyShare> strategies_;
  ContactRrtSettings settings_;
  Random& random_;
  ompl::base::StateSamplerPtr sampler_;
  Tree forward_, from_goal_;
  int extends_ = 0, goal_growths_ = 0, solution_ = -1;
};

}  // namespace tendril
