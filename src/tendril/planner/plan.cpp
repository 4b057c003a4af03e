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
#include <bit>
#include <cassert>
#include <cmath>
#include <deque>
#include <future>
#include <mutex>

#include "tendril/planner.h"
#include "tendril/planner/contact_rrt.h"
#include "tendril/planner/shortfall.h"
#include "tendril/planner/strategies.h"

namespace tendril {
namespace {

namespace ob = ompl::base;
namespace oc = ompl::control;
using ompl_spaces::ControlValue;
using ompl_spaces::State;

/// How a planner of that name goes about it.
struct Method {
  bool tendril = false;       // explore with a coarser rod, then replay exactly; begin anew now and then
  bool random_order = false;  // which gripper leads is drawn, not fixed
};

Method methodOf(const std::string& planner) {
  return {.tendril = planner == "tendril", .random_order = planner != "paper"};
}

/// OMPL's planner of that name.
ob::PlannerPtr omplPlanner(const std::string& name, const oc::SpaceInformationPtr& si, double goal_bias) {
  if (name == "paper" || name == "RRT") {
    auto rrt = std::make_shared<oc::RRT>(si);
    rrt->setGoalBias(goal_bias);
    rrt->setNearestNeighbors<ompl::NearestNeighborsLinear>();  // < 0.1 % of the time
    return rrt;
  }
  if (name == "KPIECE1") {
    auto planner = std::make_shared<oc::KPIECE1>(si);
    planner->setGoalBias(goal_bias);
    return planner;
  }
  if (name == "EST") {
    auto planner = std::make_shared<oc::EST>(si);
    planner->setGoalBias(goal_bias);
    planner->setRange(0.5 * si->getStateSpace()->getMaximumExtent());
    return planner;
  }
  if (name == "SST") {
    auto planner = std::make_shared<oc::SST>(si);
    planner->setGoalBias(goal_bias);
    return planner;
  }
  assert(name == "PDST");
  auto planner = std::make_shared<oc::PDST>(si);
  planner->setGoalBias(goal_bias);
  return planner;
}

/// The rod to explore with: `elements`, but not so few that one turns by more than 1 rad at rest, nor more
/// than the rod's own.
RodProperties coarseRod(const RodProperties& rod, int elements) {
  return withElements(rod,
                      std::min(std::max(elements, static_cast<int>(std::ceil(restTurn(rod)))), rod.elements));
}

/// The scenario to explore with a rod of so many elements (0: its own), in longer, less exact steps.
Scenario coarseScenario(const Scenario& scenario, int elements) {
  Scenario coarse = scenario;
  if (elements > 0) coarse.rod = coarseRod(scenario.rod, elements);
  SimulationSettings& simulation = coarse.simulation;
  simulation.time_step = std::max(scenario.planner.explore_time_step_s, simulation.time_step);
  simulation.newton_iterations = scenario.planner.explore_newton_iterations;
  simulation.step_tolerance = 0;
  return coarse;
}

/// A state reached by the exact simulation, with the extensions that lead to it from the start.
struct Root {
  std::vector<Extension> chain;
  RodState state;
};

/// What exploring found: extensions that continue a root's chain.
struct Exploration {
  bool exact = false;
  std::vector<Extension> chain;
  double distance = std::numeric_limits<double>::infinity();  // (6) of the chain's end to the goal
  unsigned int states = 0;
};

/// One planning problem at one resolution.
class Explorer {
 public:
  Explorer(const Scenario& scenario, const Obstacles& obstacles, const RodShape& goal_shape,
           const PlanRequest& request, Random& random, ompl_spaces::Work& work)
      : model_(scenario, obstacles),
        obstacles_(obstacles),
        request_(request),
        method_(methodOf(request.planner)),
        random_(random),
        work_(work),
        sampler_(scenario.rod, samplingSpace(scenario, obstacles), random.bits()),
        goal_(*scenario.goal, goal_shape, scenario.rod.elements),
        settings_(scenario.planner) {}

  RodModel& model() { return model_; }
  [[nodiscard]] const GoalTest& goal() const { return goal_; }
  [[nodiscard]] ExtendSettings extendSettings() const {
    return tendril::extendSettings(model_, settings_, method_.tendril);
  }

  /// Explores from the roots with at most `extends` extensions (planner tendril).
  Exploration explore(const std::vector<Root>& roots, int extends);
  /// Leaves out, one by one, the extensions without which the chain from `start` still reaches the goal at
  /// this resolution.
  [[nodiscard]] std::vector<Extension> shortened(const RodShape& start, std::vector<Extension> chain);

 private:
  [[nodiscard]] ob::PlannerPtr makePlanner(const oc::SpaceInformationPtr& si, int extends);

  RodModel model_;
  const Obstacles& obstacles_;
  const PlanRequest& request_;
  Method method_;
  Random& random_;
  ompl_spaces::Work& work_;
  RodSampler sampler_;
  GoalTest goal_;
  PlannerSettings settings_;
};

ob::PlannerPtr Explorer::makePlanner(const oc::SpaceInformationPtr& si, int extends) {
  if (!method_.tendril) return omplPlanner(request_.planner, si, settings_.goal_bias);
  std::vector<StrategyShare> strategies = builtInStrategies(settings_.along_share);
  strategies.insert(strategies.end(), request_.strategies.begin(), request_.strategies.end());
  return std::make_shared<ContactRrt>(si, model_, std::move(strategies),
                                      ContactRrtSettings{.goal_bias = settings_.goal_bias,
                                                         .goal_extends = settings_.goal_extends,
                                                         .failure_penalty = settings_.failure_penalty,
                                                         .extends = extends},
                                      random_);
}

Exploration Explorer::explore(const std::vector<Root>& roots, int extends) {
  const auto nodes = static_cast<std::size_t>(model_.rod.elements) + 1;
  auto states = std::make_shared<ompl_spaces::StateSpace>(nodes, model_.workspace, sampler_);
  auto controls = std::make_shared<ompl_spaces::ControlSpace>(
      states, sampler_, random_,
      ompl_spaces::Aim{
          .random_order = method_.random_order, .goal_bias = settings_.goal_bias, .goal = goal_.shape()});
  auto si = std::make_shared<oc::SpaceInformation>(states, controls);
  si->setStateValidityChecker([](const ob::State*) { return true; });  // EXTEND never leaves the free space
  si->setStatePropagator(std::make_shared<ompl_spaces::Propagator>(si, model_, extendSettings(), work_));
  si->setPropagationStepSize(1);
  si->setMinMaxControlDuration(1, 1);
  si->setDirectedControlSamplerAllocator([](const oc::SpaceInformation* space) {
    return std::make_shared<ompl_spaces::DirectedSampler>(space);
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
    if (obstacles_.clearance(positions, model_.rod.radius + obstacles_.deviation()).segment < 0) {
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

  const ob::PlannerPtr planner = makePlanner(si, extends);
  planner->setProblemDefinition(problem);
  planner->setup();
  const ob::PlannerStatus status = planner->solve(ob::PlannerTerminationCondition(work_.stop));

  Exploration result;
  result.exact = status == ob::PlannerStatus::EXACT_SOLUTION;
  ob::PlannerData data(si);
  planner->getPlannerData(data);
  result.states = data.numVertices();
  if (!problem->hasSolution()) return result;
  result.distance = result.exact ? 0 : problem->getSolutionDifference();
  auto* path = problem->getSolutionPath()->as<oc::PathControl>();
  for (unsigned int k = 0; k < problem->getStartStateCount(); ++k)
    if (si->equalStates(problem->getStartState(k), path->getState(0))) {
      result.chain = roots[root_of_start[k]].chain;
      break;
    }
  for (const oc::Control* control : path->getControls())
    result.chain.push_back(static_cast<const ControlValue*>(control)->extension);
  return result;
}

std::vector<Extension> Explorer::shortened(const RodShape& start, std::vector<Extension> chain) {
  const Extend extend(model_, extendSettings());
  RodWorkspace workspace;
  const auto carryOut = [&](const Extension& extension, RodState& state) {
    const std::int64_t steps = extend(extension, state, workspace, work_.stop).steps;
    work_.count(steps, model_);
    return steps;
  };
  const RodState begin = RodState::atRest(resample(start, model_.rod.elements));
  // What it may cost: the chain itself a few times.
  constexpr std::int64_t kRepetitions = 3;
  std::int64_t allowed = 0;
  RodState state = begin;
  for (const Extension& extension : chain) allowed += kRepetitions * carryOut(extension, state);

  for (std::size_t size = std::bit_floor(chain.size()); size > 0; size /= 2) {
    RodState before = begin;
    for (std::size_t k = 0; k + size < chain.size() && allowed > 0 && !work_.stop();) {
      // Does the goal come without extensions k to k + size - 1? The chain may even end earlier.
      state = before;
      std::size_t end = k + size;
      bool reached = goal_(state.nodes);
      for (; end < chain.size() && !reached; ++end) {
        allowed -= carryOut(chain[end], state);
        reached = goal_(state.nodes);
      }
      if (reached) {
        chain.resize(end);
        chain.erase(chain.begin() + static_cast<std::ptrdiff_t>(k),
                    chain.begin() + static_cast<std::ptrdiff_t>(k + size));
      } else {
        for (const std::size_t next = k + size; k < next; ++k) allowed -= carryOut(chain[k], before);
      }
    }
  }
  return chain;
}

/// The exact simulation of a chain of extensions, written down up to the goal if it gets there.
struct Replay {
  bool reached = false;
  std::vector<Control> controls;
  Trajectory trajectory;
  std::vector<Root> roots;  // the states after each extension
  std::int64_t steps = 0;
  double nearest = std::numeric_limits<double>::infinity();  // distance (6) of the last state to the goal
};

Replay replayExactly(const RodModel& model, const ExtendSettings& settings, const GoalTest& goal,
                     const RodShape& start, const std::vector<Extension>& chain,
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

/// Why planning ended without a plan.
enum class Reason { none, time, extends, cancelled };

/// Says when to stop; asked by all threads.
class Supervisor {
 public:
  explicit Supervisor(const PlanRequest& request) : request_(request) {}

  [[nodiscard]] double elapsed() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - request_.started).count();
  }
  [[nodiscard]] bool interrupted() const { return request_.cancel && *request_.cancel; }
  [[nodiscard]] Reason reason() const { return reason_; }
  void giveUp(Reason reason) {
    Reason none = Reason::none;
    reason_.compare_exchange_strong(none, reason);
  }
  bool stop() {
    if (reason_ != Reason::none) return true;
    if (interrupted())
      giveUp(Reason::cancelled);
    else if (elapsed() > request_.time_limit_s)
      giveUp(Reason::time);
    return reason_ != Reason::none;
  }

 private:
  const PlanRequest& request_;
  std::atomic<Reason> reason_ = Reason::none;
};

/// What an attempt came to.
struct Outcome {
  bool solved = false;
  Replay replay;                 // the plan, or the exact replay that came nearest
  std::vector<Extension> chain;  // not solved: the explored chain that came nearest, `distance` from the goal
  double distance = std::numeric_limits<double>::infinity();
  std::int64_t states = 0;
};

/// The problem and what is needed to attempt it.
struct Problem {
  const Scenario& scenario;
  Scenario coarse, finer;  // what attempts explore
  const Obstacles& obstacles;
  const PlanRequest& request;
  RodShape start, goal;
};

/// Explores, replays exactly what was found, and where the replay departs, explores on from the states it
/// passed. At the scenario's own resolution the replay is the exploration itself, but where the rod snaps.
Outcome attempt(const Problem& problem, const Scenario& explored, int extends, std::uint64_t seed,
                ompl_spaces::Work& work) {
  constexpr int kExplorations = 3;
  Random random(seed);
  Explorer exact(problem.scenario, problem.obstacles, problem.goal, problem.request, random, work);
  const bool exactly = &explored == &problem.scenario;
  std::optional<Explorer> coarse;
  if (!exactly) coarse.emplace(explored, problem.obstacles, problem.goal, problem.request, random, work);
  Explorer& explorer = exactly ? exact : *coarse;

  Outcome outcome;
  std::vector<Root> roots = {{{}, RodState::atRest(problem.start)}};
  for (int k = 0; k < kExplorations && !outcome.solved && !work.stop(); ++k) {
    Exploration found = explorer.explore(roots, extends);
    outcome.states += found.states;
    if (!found.exact) {
      if (found.distance < outcome.distance)
        outcome.distance = found.distance, outcome.chain = std::move(found.chain);
      break;
    }
    const std::vector<Extension> chain =
        exactly ? found.chain : explorer.shortened(problem.start, std::move(found.chain));
    Replay replay =
        replayExactly(exact.model(), exact.extendSettings(), exact.goal(), problem.start, chain, work.stop);
    work.count(replay.steps, exact.model());
    outcome.solved = replay.reached;
    roots.insert(roots.end(), replay.roots.begin(), replay.roots.end());
    if (outcome.solved || replay.nearest < outcome.replay.nearest) outcome.replay = std::move(replay);
  }
  return outcome;
}

/// Luby's sequence 1 1 2 1 1 2 4 1 1 2 ..., from k = 0 (Luby, Sinclair and Zuckerman 1993): restarts that are
/// within a logarithm of the best there are, whatever the distribution.
int luby(int k) {
  int size = 1;
  while (size < k + 1) size = 2 * size + 1;
  while (size - 1 != k) {
    size = (size - 1) / 2;
    k %= size;
  }
  return (size + 1) / 2;
}

/// Attempts number 0, 1, 2, ..., as many at once as there are threads. The result is that of the first in
/// this order that succeeds, so it does not depend on the threads.
class Portfolio {
 public:
  Portfolio(const Problem& problem, Supervisor& supervisor) : problem_(problem), supervisor_(supervisor) {}

  Outcome run();

  std::int64_t extends = 0, steps = 0, states = 0;  // of the attempts up to the one that succeeded
  double simulated_time = 0;

 private:
  struct Attempt {
    ompl_spaces::Work work;
    Outcome outcome;
    bool done = false;
  };
  void work(bool reports);
  void dropAllButNearest(int number);
  void report(const ompl_spaces::Work& current);

  const Problem& problem_;
  Supervisor& supervisor_;
  std::mutex mutex_;
  std::deque<Attempt> attempts_;  // guarded by mutex_
  std::atomic<int> first_solved_ = std::numeric_limits<int>::max();
  std::int64_t granted_ = 0;  // extensions, guarded by mutex_
  int nearest_ = -1;          // the failed attempt whose motion is kept, guarded by mutex_
  double last_report_ = 0;
};

Outcome Portfolio::run() {
  std::vector<std::future<void>> others;
  for (int k = 1; k < problem_.request.threads; ++k)
    others.push_back(std::async(std::launch::async, [this] { work(false); }));
  work(true);
  for (std::future<void>& thread : others) thread.get();
  // Whoever was not stopped and did not succeed has used up what extend_limit grants.
  if (first_solved_ == std::numeric_limits<int>::max()) supervisor_.giveUp(Reason::extends);

  Outcome best;
  for (std::size_t k = 0; k < attempts_.size() && static_cast<int>(k) <= first_solved_; ++k) {
    Attempt& attempt = attempts_[k];
    extends += attempt.work.extends, steps += attempt.work.steps, states += attempt.outcome.states;
    simulated_time += attempt.work.simulated_time;
    if (attempt.outcome.solved) return std::move(attempt.outcome);
    if (attempt.outcome.replay.nearest < best.replay.nearest) best.replay = std::move(attempt.outcome.replay);
    if (attempt.outcome.distance < best.distance)
      best.distance = attempt.outcome.distance, best.chain = std::move(attempt.outcome.chain);
  }
  return best;
}

/// Tells the caller how it is going, a few times a second.
void Portfolio::report(const ompl_spaces::Work& current) {
  const double now = supervisor_.elapsed();
  if (!problem_.request.on_progress || now < last_report_ + 0.2) return;
  last_report_ = now;
  PlanProgress progress{now, current.extends, current.steps, meanNodeDistance(problem_.start, problem_.goal)};
  const std::lock_guard lock(mutex_);
  for (const Attempt& attempt : attempts_) {
    if (!attempt.done) continue;
    progress.states += attempt.outcome.states, progress.steps += attempt.work.steps;
    progress.nearest_m =
        std::min({progress.nearest_m, attempt.outcome.distance, attempt.outcome.replay.nearest});
  }
  problem_.request.on_progress(progress);
}

void Portfolio::work(bool reports) {
  const bool tendril = methodOf(problem_.request.planner).tendril;
  const std::int64_t limit = problem_.scenario.planner.extend_limit > 0
                                 ? problem_.scenario.planner.extend_limit
                                 : std::numeric_limits<std::int64_t>::max();
  while (!supervisor_.stop()) {
    int number = 0, most = 0;
    Attempt* mine = nullptr;
    {
      const std::lock_guard lock(mutex_);
      number = static_cast<int>(attempts_.size());
      if (number > first_solved_ || (!tendril && number > 0)) return;
      const std::int64_t left = limit - granted_;
      if (left <= 0) return;  // others may still be at work on what was granted
      constexpr std::int64_t kMost = std::numeric_limits<int>::max();
      most = static_cast<int>(std::min(
          {left, kMost,
           tendril ? std::int64_t{problem_.scenario.planner.attempt_extends} * luby(number / 2) : kMost}));
      granted_ += most;
      mine = &attempts_.emplace_back();
    }
    mine->work.stop = [this, mine, number, most, tendril, reports] {
      if (reports) report(mine->work);
      return supervisor_.stop() || first_solved_ < number || (!tendril && mine->work.extends >= most);
    };
    // A coarse rod may mislead: it jams where its elements are too long for a bend. So every other attempt
    // has the rod's own elements, and a few of these its own steps, too.
    constexpr int kExact = 8;
    const Scenario& explored = !tendril || number % kExact == kExact - 1 ? problem_.scenario
                               : number % 2 == 1                         ? problem_.finer
                                                                         : problem_.coarse;
    // Every attempt has its own randomness, the same whoever makes it.
    Outcome outcome = attempt(
        problem_, explored, most,
        Random(problem_.request.seed + 0x9E3779B97F4A7C15ULL * static_cast<std::uint64_t>(number)).bits(),
        mine->work);
    const std::lock_guard lock(mutex_);
    outcome.replay.roots.clear();  // were for this attempt's own explorations
    mine->outcome = std::move(outcome);
    mine->done = true;
    if (mine->outcome.solved)
      first_solved_ = std::min<int>(first_solved_, number);
    else
      dropAllButNearest(number);
  }
}

/// Of the failed attempts only the motion that came nearest is kept: many attempts would fill the memory.
void Portfolio::dropAllButNearest(int number) {
  const auto nearest = [this](int k) {
    return std::pair(attempts_[static_cast<std::size_t>(k)].outcome.replay.nearest, k);
  };
  int worse = number;
  if (nearest_ < 0 || nearest(number) < nearest(nearest_)) worse = std::exchange(nearest_, number);
  if (worse >= 0) attempts_[static_cast<std::size_t>(worse)].outcome.replay.trajectory = {};
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
  const PlannerSettings& settings = scenario.planner;
  const Problem problem{.scenario = scenario,
                        .coarse = coarseScenario(scenario, settings.explore_elements),
                        .finer = coarseScenario(scenario, 0),
                        .obstacles = obstacles,
                        .request = request,
                        .start = startShape(scenario, obstacles),
                        .goal = goalShape(scenario, obstacles)};

  ompl::msg::noOutputHandler();
  Random random(request.seed);
  ompl::RNG::setSeed(static_cast<std::uint_fast32_t>(random.bits() % 0xFFFFFFFEULL) + 1);

  Supervisor supervisor(request);
  Portfolio portfolio(problem, supervisor);
  Outcome outcome = portfolio.run();
  if (!outcome.solved &&
      (outcome.distance < outcome.replay.nearest || outcome.replay.trajectory.shapes.empty())) {
    // The motion that came nearest is what the caller gets, so it is replayed even when time is up or the
    // user has had enough; but not for longer than kLastReplay.
    constexpr double kLastReplay = 0.3;  // s
    const double deadline = supervisor.elapsed() + kLastReplay;
    const bool hurry = supervisor.reason() != Reason::extends;
    const std::function<bool()> stop = [&] {
      return hurry ? supervisor.elapsed() > deadline : supervisor.interrupted();
    };
    ompl_spaces::Work work;
    Explorer exact(scenario, obstacles, problem.goal, request, random, work);
    Replay replay = replayExactly(exact.model(), exact.extendSettings(), exact.goal(), problem.start,
                                  outcome.chain, stop);
    outcome.solved = replay.reached;
    if (replay.reached || replay.nearest < outcome.replay.nearest) outcome.replay = std::move(replay);
  }

  Solution solution;
  solution.status = outcome.solved                             ? PlanStatus::solved
                    : supervisor.reason() == Reason::cancelled ? PlanStatus::cancelled
                    : supervisor.reason() == Reason::extends   ? PlanStatus::iteration_limit
                                                               : PlanStatus::time_limit;
  if (!outcome.solved) {
    constexpr double kProbing = 0.4;  // s, if the time is up already
    const double deadline = supervisor.elapsed() + kProbing;
    const bool hurry = supervisor.reason() != Reason::extends;
    solution.shortfall =
        shortfallOf(scenario, obstacles, GoalTest(*scenario.goal, problem.goal, scenario.rod.elements),
                    outcome.replay.trajectory.shapes.back(),
                    [&] { return hurry ? supervisor.elapsed() > deadline : supervisor.interrupted(); });
  }
  solution.scenario = scenario;
  solution.controls = std::move(outcome.replay.controls);
  solution.trajectory = std::move(outcome.replay.trajectory);
  solution.run.seed = request.seed;
  solution.run.threads = request.threads;
  solution.run.planner["name"] = request.planner;
  visitPlannerSettings(settings,
                       [&](const char* key, auto& value, auto&&...) { solution.run.planner[key] = value; });
  solution.run.iterations = portfolio.extends;
  solution.run.states = portfolio.states;
  solution.run.steps = portfolio.steps;
  solution.run.simulated_time = portfolio.simulated_time;
  solution.run.wall_time = supervisor.elapsed();
  solution.run.cpu_time = cpuSeconds() - cpu_before;
  return solution;
}

}  // namespace tendril
