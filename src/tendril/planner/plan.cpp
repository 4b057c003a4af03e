#include <fmt/format.h>
#include <ompl/base/objectives/PathLengthOptimizationObjective.h>
#include <ompl/control/PathControl.h>
#include <ompl/control/planners/est/EST.h>
#include <ompl/control/planners/kpiece/KPIECE1.h>
#include <ompl/control/planners/pdst/PDST.h>
#include <ompl/control/planners/rrt/RRT.h>
#include <ompl/control/planners/sst/SST.h>
#include <ompl/datastructures/NearestNeighborsLinear.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include <algorithm>
#include <cmath>
#include <ctime>

#include "tendril/planner.h"
#include "tendril/planner/spaces.h"

namespace tendril {
namespace {

namespace ob = ompl::base;
namespace oc = ompl::control;
using ompl_spaces::ControlValue;
using ompl_spaces::State;

/// How a planner of that name goes about it.
struct Method {
  bool coarse = false;        // explore with a coarser rod, then replay exactly
  bool random_order = false;  // which gripper leads is drawn, not fixed
  bool penalise_failures = false;
  bool stops_when_stalled = false;
  double goal_bias = 0.05;
};

Method methodOf(const std::string& planner, const PlannerSettings& settings) {
  if (planner == "tendril")
    return {.coarse = true,
            .random_order = true,
            .penalise_failures = true,
            .stops_when_stalled = true,
            .goal_bias = settings.goal_bias};
  if (planner == "paper") return {.goal_bias = settings.goal_bias};
  return {.random_order = true, .goal_bias = settings.goal_bias};
}

ob::PlannerPtr makePlanner(const std::string& name, const oc::SpaceInformationPtr& si, const Method& method) {
  if (name == "tendril" || name == "paper" || name == "RRT") {
    auto rrt = std::make_shared<oc::RRT>(si);
    rrt->setGoalBias(method.goal_bias);
    // Exact whatever the distance: the penalised one is no metric, and the search is < 0.1 % of the time.
    rrt->setNearestNeighbors<ompl::NearestNeighborsLinear>();
    return rrt;
  }
  if (name == "KPIECE1") {
    auto planner = std::make_shared<oc::KPIECE1>(si);
    planner->setGoalBias(method.goal_bias);
    return planner;
  }
  if (name == "EST") {
    auto planner = std::make_shared<oc::EST>(si);
    planner->setGoalBias(method.goal_bias);
    planner->setRange(0.5 * si->getStateSpace()->getMaximumExtent());
    return planner;
  }
  if (name == "SST") {
    auto planner = std::make_shared<oc::SST>(si);
    planner->setGoalBias(method.goal_bias);
    return planner;
  }
  if (name == "PDST") {
    auto planner = std::make_shared<oc::PDST>(si);
    planner->setGoalBias(method.goal_bias);
    return planner;
  }
  throw InputError(
      fmt::format("unknown planner \"{}\"; use one of: {}.", name, fmt::join(plannerNames(), ", ")));
}

/// The rod to explore with: `elements`, but not so few that one turns by more than 1 rad at rest, nor more
/// than the rod's own.
RodProperties coarseRod(const RodProperties& rod, int elements) {
  double turn = 0;  // rad, of the whole rod if it were curved as much as where it is curved most
  for (int k = 0; k < rod.elements; ++k) turn = std::max(turn, rod.restCurvature(k).norm() * rod.length);
  return withElements(rod, std::min(std::max(elements, static_cast<int>(std::ceil(turn))), rod.elements));
}

/// A state reached by the exact simulation, with the EXTENDs that lead to it from the start.
struct Root {
  std::vector<ExtendControl> chain;
  RodState state;
};

/// What exploring found: EXTENDs that continue a root's chain.
struct Exploration {
  bool exact = false;
  std::vector<ExtendControl> chain;
  unsigned int states = 0;
};

/// One planning problem at one resolution.
class Explorer {
 public:
  Explorer(const Scenario& scenario, const Obstacles& obstacles, const RodShape& goal_shape,
           const Method& method, const std::string& planner, Random& random, ompl_spaces::Work& work)
      : model_(scenario, obstacles),
        obstacles_(obstacles),
        method_(method),
        planner_(planner),
        random_(random),
        work_(work),
        sampler_(scenario.rod, samplingSpace(scenario, obstacles), random.bits()),
        goal_(*scenario.goal, goal_shape, scenario.rod.elements),
        settings_(scenario.planner) {}

  RodModel& model() { return model_; }
  [[nodiscard]] const GoalTest& goal() const { return goal_; }
  [[nodiscard]] ExtendSettings extendSettings() const {
    return {
        .other_end = OtherEnd::let_go,
        .reach = settings_.reach_fraction * model_.rod.length,
        .phase_limit = settings_.phase_limit_s,
        .stall_speed = method_.stops_when_stalled ? settings_.stall_fraction * model_.grippers.max_speed : 0};
  }

  Exploration explore(const std::vector<Root>& roots);
  /// Leaves out, one by one, the EXTENDs without which the chain from `start` still reaches the goal at this
  /// resolution.
  [[nodiscard]] std::vector<ExtendControl> shortened(const RodShape& start, std::vector<ExtendControl> chain);

 private:
  RodModel model_;
  const Obstacles& obstacles_;
  Method method_;
  std::string planner_;
  Random& random_;
  ompl_spaces::Work& work_;
  RodSampler sampler_;
  GoalTest goal_;
  PlannerSettings settings_;
};

Exploration Explorer::explore(const std::vector<Root>& roots) {
  const auto nodes = static_cast<std::size_t>(model_.rod.elements) + 1;
  auto states =
      std::make_shared<ompl_spaces::StateSpace>(nodes, model_.workspace, sampler_, method_.penalise_failures);
  auto controls = std::make_shared<ompl_spaces::ControlSpace>(
      states, sampler_, random_,
      ompl_spaces::Aim{
          .random_order = method_.random_order, .goal_bias = method_.goal_bias, .goal = goal_.shape()});
  auto si = std::make_shared<oc::SpaceInformation>(states, controls);
  si->setStateValidityChecker([](const ob::State*) { return true; });  // EXTEND never leaves the free space
  si->setStatePropagator(std::make_shared<ompl_spaces::Propagator>(si, model_, extendSettings(), work_));
  si->setPropagationStepSize(1);
  si->setMinMaxControlDuration(1, 1);
  const double too_near = method_.penalise_failures ? 0.01 * model_.rod.length : 0;
  si->setDirectedControlSamplerAllocator([too_near](const oc::SpaceInformation* space) {
    return std::make_shared<ompl_spaces::DirectedSampler>(space, too_near);
  });
  si->setup();

  auto problem = std::make_shared<ob::ProblemDefinition>(si);
  std::vector<std::size_t> root_of_start;
  std::vector<Vector3> positions(nodes);
  for (std::size_t k = 0; k < roots.size(); ++k) {
    ob::State* state = si->allocState();
    RodState& rod = static_cast<State*>(state)->rod;
    const RodState& reached = roots[k].state;
    rod = reached.nodes.size() == nodes ? reached
                                        : RodState::atRest(resample(reached.nodes, model_.rod.elements));
    for (std::size_t i = 0; i < nodes; ++i) positions[i] = rod.nodes[i].position;
    // The chords of a coarser rod may cut a corner; such a root is left out.
    if (obstacles_.clearance(positions, model_.rod.radius).segment < 0) {
      problem->addStartState(state);
      root_of_start.push_back(k);
    }
    si->freeState(state);
  }
  if (root_of_start.empty()) return {};
  problem->setGoal(std::make_shared<ompl_spaces::Goal>(si, goal_));
  // Planners that improve a path (SST) stop at the first: any cost will do.
  auto objective = std::make_shared<ob::PathLengthOptimizationObjective>(si);
  objective->setCostThreshold(objective->infiniteCost());
  problem->setOptimizationObjective(objective);

  const ob::PlannerPtr planner = makePlanner(planner_, si, method_);
  planner->setProblemDefinition(problem);
  planner->setup();
  const ob::PlannerStatus status = planner->solve(ob::PlannerTerminationCondition(work_.stop));

  Exploration result;
  result.exact = status == ob::PlannerStatus::EXACT_SOLUTION;
  ob::PlannerData data(si);
  planner->getPlannerData(data);
  result.states = data.numVertices();
  if (!problem->hasSolution()) return result;
  auto* path = problem->getSolutionPath()->as<oc::PathControl>();
  for (unsigned int k = 0; k < problem->getStartStateCount(); ++k)
    if (si->equalStates(problem->getStartState(k), path->getState(0))) {
      result.chain = roots[root_of_start[k]].chain;
      break;
    }
  for (const oc::Control* control : path->getControls())
    result.chain.push_back(static_cast<const ControlValue*>(control)->extend);
  return result;
}

std::vector<ExtendControl> Explorer::shortened(const RodShape& start, std::vector<ExtendControl> chain) {
  const Extend extend(model_, extendSettings());
  RodWorkspace workspace;
  RodState before = RodState::atRest(resample(start, model_.rod.elements));
  for (std::size_t k = 0; k + 1 < chain.size() && !work_.stop();) {
    // Does the goal come without EXTEND k? The chain may even end earlier.
    RodState state = before;
    std::size_t end = k + 1;
    bool reached = goal_(state.nodes);
    for (; end < chain.size() && !reached; ++end) {
      work_.count(extend(chain[end], state, workspace, work_.stop).steps, model_);
      reached = goal_(state.nodes);
    }
    if (reached) {
      chain.resize(end);
      chain.erase(chain.begin() + static_cast<std::ptrdiff_t>(k));
    } else {
      work_.count(extend(chain[k], before, workspace, work_.stop).steps, model_);
      ++k;
    }
  }
  return chain;
}

/// The exact simulation of a chain of EXTENDs, written down up to the goal if it gets there.
struct Replay {
  bool reached = false;
  std::vector<Control> controls;
  Trajectory trajectory;
  std::vector<Root> roots;  // the states after each EXTEND
  std::int64_t steps = 0;
  double nearest = 0;  // distance (6) of the last state to the goal
};

Replay replayExactly(const RodModel& model, const ExtendSettings& settings, const GoalTest& goal,
                     const RodShape& start, const std::vector<ExtendControl>& chain,
                     const std::function<bool()>& stop) {
  Replay replay;
  const Extend extend(model, settings);
  RodState state = RodState::atRest(start);
  RodWorkspace workspace;
  TrajectoryRecorder recorder(model, start);
  replay.reached = goal(state.nodes);
  for (std::size_t k = 0; k < chain.size() && !replay.reached; ++k) {
    const ExtendReport report = extend(chain[k], state, workspace, stop, &recorder);
    replay.controls.insert(replay.controls.end(), report.controls.begin(), report.controls.end());
    if (report.cancelled) break;
    replay.roots.push_back({{chain.begin(), chain.begin() + static_cast<std::ptrdiff_t>(k) + 1}, state});
    replay.reached = goal(state.nodes);
  }
  replay.nearest = goal.distance(state.nodes);
  replay.steps = recorder.steps();
  replay.trajectory = recorder.take();
  return replay;
}

double cpuSeconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace

const std::vector<std::string>& plannerNames() {
  static const std::vector<std::string> names = {"tendril", "paper", "RRT", "KPIECE1", "EST", "SST", "PDST"};
  return names;
}

Solution plan(const Scenario& scenario, const Obstacles& obstacles, const PlanRequest& request) {
  const std::vector<std::string>& names = plannerNames();
  if (std::find(names.begin(), names.end(), request.planner) == names.end())
    throw InputError(
        fmt::format("unknown planner \"{}\"; use one of: {}.", request.planner, fmt::join(names, ", ")));
  const double cpu_before = cpuSeconds();
  const auto elapsed = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - request.started).count();
  };
  const RodShape start = startShape(scenario, obstacles), goal_shape = goalShape(scenario, obstacles);
  const Method method = methodOf(request.planner, scenario.planner);

  ompl::msg::noOutputHandler();
  Random random(request.seed);
  ompl::RNG::setSeed(static_cast<std::uint_fast32_t>(random.bits() % 0xFFFFFFFEULL) + 1);

  // Everything that takes long asks `stop`.
  enum class Reason { none, time, extends, cancelled } reason = Reason::none;
  ompl_spaces::Work work;
  std::int64_t states = 0;
  double nearest = meanNodeDistance(start, goal_shape), last_report = 0;
  const auto interrupted = [&] { return request.cancel && *request.cancel; };
  work.stop = [&] {
    if (reason != Reason::none) return true;
    const double now = elapsed();
    if (interrupted())
      reason = Reason::cancelled;
    else if (now > request.time_limit_s)
      reason = Reason::time;
    else if (scenario.planner.extend_limit > 0 && work.extends >= scenario.planner.extend_limit)
      reason = Reason::extends;
    if (request.on_progress && now > last_report + 0.2) {
      last_report = now;
      request.on_progress({now, states + work.extends, work.steps, nearest});
    }
    return reason != Reason::none;
  };

  Scenario coarse = scenario;
  if (method.coarse) {
    if (scenario.planner.explore_elements > 0)
      coarse.rod = coarseRod(scenario.rod, scenario.planner.explore_elements);
    coarse.simulation.time_step =
        std::max(scenario.planner.explore_time_step_s, scenario.simulation.time_step);
    coarse.simulation.newton_iterations = scenario.planner.explore_newton_iterations;
    coarse.simulation.step_tolerance = 0;
  }
  Explorer explorer(coarse, obstacles, goal_shape, method, request.planner, random, work);
  Explorer exact(scenario, obstacles, goal_shape, method, request.planner, random, work);

  // Explore, replay what was found exactly, and where the replay departs, explore on from the states it
  // passed. A replay that keeps departing means the coarse rod misleads: then explore with the exact one,
  // whose replay is itself.
  constexpr int kCoarseAttempts = 4;
  constexpr double kLastReplay = 0.5;  // s
  std::vector<Root> roots = {{{}, RodState::atRest(start)}};
  Replay best;
  best.nearest = std::numeric_limits<double>::infinity();
  bool solved = exact.goal()(start);
  for (int attempt = 0; !solved && !work.stop(); ++attempt) {
    const bool coarsely = method.coarse && attempt < kCoarseAttempts;
    const Exploration found = (coarsely ? explorer : exact).explore(roots);
    states += found.states;
    // An approximate motion is replayed even when time is up or the user has had enough, for it is what the
    // caller gets; but not for longer than kLastReplay.
    const double deadline = elapsed() + kLastReplay;
    const std::function<bool()> stop = [&] {
      if (reason == Reason::none) return work.stop();
      return reason == Reason::extends ? interrupted() : elapsed() > deadline;
    };
    const std::vector<ExtendControl> chain =
        coarsely && found.exact ? explorer.shortened(start, found.chain) : found.chain;
    Replay replay = replayExactly(exact.model(), exact.extendSettings(), exact.goal(), start, chain, stop);
    work.count(replay.steps, exact.model());
    solved = replay.reached;
    nearest = std::min(nearest, replay.nearest);
    for (Root& root : replay.roots)
      if (root.chain.size() > 0) roots.push_back(root);
    if (solved || replay.nearest < best.nearest) best = std::move(replay);
    if (!coarsely && found.states == 0) break;
  }
  if (best.trajectory.shapes.empty())
    best = replayExactly(exact.model(), exact.extendSettings(), exact.goal(), start, {}, interrupted);

  Solution solution;
  solution.status = solved                        ? PlanStatus::solved
                    : reason == Reason::cancelled ? PlanStatus::cancelled
                    : reason == Reason::extends   ? PlanStatus::iteration_limit
                                                  : PlanStatus::time_limit;
  solution.scenario = scenario;
  solution.controls = std::move(best.controls);
  solution.trajectory = std::move(best.trajectory);
  solution.run.seed = request.seed;
  solution.run.threads = request.threads;
  solution.run.planner["name"] = request.planner;
  PlannerSettings settings = scenario.planner;
  visitPlannerSettings(settings,
                       [&](const char* key, auto& value, auto&&...) { solution.run.planner[key] = value; });
  solution.run.iterations = work.extends;
  solution.run.states = states;
  solution.run.steps = work.steps;
  solution.run.simulated_time = work.simulated_time;
  solution.run.wall_time = elapsed();
  solution.run.cpu_time = cpuSeconds() - cpu_before;
  return solution;
}

}  // namespace tendril
