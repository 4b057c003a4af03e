/// A soak of the dynamics: random rods among random meshes, every recorded motion held to its claims by the
/// verification's own distances. Build with -DTENDRIL_BENCHMARKS=ON, run
///   build/release/bench/bench_soak [contact steps [seed [threads (at most 2)]]]
///   build/release/bench/bench_soak --episode NUMBER [seed]       one episode, every remarkable step
///   build/release/bench/bench_soak --passages                    rods pulled through tubes
/// The counts depend on the number of steps and the seed alone. SIGINT and SIGTERM end the run with a report
/// of what was done; a line every 2048 episodes tells how far it is.
#include <fmt/format.h>

#include <csignal>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <map>
#include <thread>

#include "dynamics/passages.h"
#include "dynamics/scenes.h"
#include "soak_worlds.h"
#include "tendril/dynamics/workspace.h"
#include "tendril/verification/clearance.h"
#include "tendril/verification/motion.h"
#include "tendril/verification/trajectory_checks.h"

namespace {

using namespace tendril;
using namespace tendril::soak;

constexpr std::array<const char*, 3> kPlaceNames = {"near 0", "scaled", "far from 0"};
constexpr std::array<const char*, 3> kNewtonNames = {"1 to 3", "30, 1e-4", "100, 1e-7"};

std::atomic<bool> interrupted = false;

/// Seconds of a processor: of this thread, or of all threads.
double secondsOf(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// What happened, in numbers that add up.
struct Tally {
  std::int64_t episodes = 0, steps = 0, contact_steps = 0, motions = 0, crowded = 0;
  std::int64_t penetrations = 0, undecided = 0, not_finite = 0, other_claims = 0;
  // Stalled steps: where the start's gap is within rounding; with an element that turns by all it may; in
  // balance, the force left over being below 1e-3 of the gripper's; that moved; none of these.
  std::int64_t at_rounding = 0, balanced = 0, stalled_moving = 0, stalled = 0;
  std::int64_t at_turn_limit = 0;
  // Windows in which a gripper should have moved and the rod did not: held up; at an element's limits;
  // pressed to gaps within rounding; with all steps converged; cut short, where uncut steps converge; none of
  // these.
  std::int64_t held_up = 0, at_limits = 0, rounded = 0, at_rest = 0, cut_short = 0, jams = 0;
  std::array<std::int64_t, 9> iterations{};                    // 0, 1, 2, 3, 4-5, 6-10, 11-30, 31-100, more
  double least_gap = std::numeric_limits<double>::infinity();  // over r
  double step_s = 0, check_s = 0;

  void add(const Tally& o) {
    episodes += o.episodes, steps += o.steps, contact_steps += o.contact_steps, motions += o.motions;
    crowded += o.crowded;
    penetrations += o.penetrations, undecided += o.undecided, not_finite += o.not_finite;
    other_claims += o.other_claims;
    at_rounding += o.at_rounding, stalled_moving += o.stalled_moving, balanced += o.balanced;
    stalled += o.stalled, at_turn_limit += o.at_turn_limit;
    held_up += o.held_up, at_limits += o.at_limits, rounded += o.rounded, at_rest += o.at_rest;
    cut_short += o.cut_short, jams += o.jams;
    for (std::size_t i = 0; i < iterations.size(); ++i) iterations[i] += o.iterations[i];
    least_gap = std::min(least_gap, o.least_gap);
    step_s += o.step_s, check_s += o.check_s;
  }
  void countIterations(int n) {
    constexpr std::array<int, 8> kUpTo = {0, 1, 2, 3, 5, 10, 30, 100};
    ++iterations[static_cast<std::size_t>(std::lower_bound(kUpTo.begin(), kUpTo.end(), n) - kUpTo.begin())];
  }
};

verification::FaceTree treeOf(const TriangleMesh& mesh) {
  std::vector<verification::Face> faces;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    verification::Face face;
    for (std::size_t c = 0; c < 3; ++c)
      face.corners[c] = mesh.vertices[static_cast<std::size_t>(mesh.faces[f][c])];
    face.normal =
        (face.corners[1] - face.corners[0]).cross(face.corners[2] - face.corners[0]).stableNormalized();
    face.mesh = 0, face.number = static_cast<int>(f);
    faces.push_back(face);
  }
  return verification::FaceTree(std::move(faces));
}

/// One rod in one world, and what is asked of it.
struct Episode {
  WorldKind kind;
  std::size_t place, newton;
  Scenario scenario;
  NewtonSettings settings;
  TriangleMesh mesh;
  RodShape start;
};

/// None if no free place was found for the rod.
std::optional<Episode> makeEpisode(Random& random) {
  Episode e;
  e.kind = static_cast<WorldKind>(between(random, 0, static_cast<int>(kWorldNames.size()) - 1));
  const double r = logUniform(random, 0.003, 0.04);
  World world = makeWorld(e.kind, r, random);

  // The rod, in units of L first.
  Scenario& s = e.scenario;
  const double p = random.uniform();
  e.place = p < 0.7 ? 0 : p < 0.85 ? 1 : 2;
  const double scale = e.place == 1 ? logUniform(random, 1e-6, 1e6) : 1;
  const Vector3 offset =
      e.place == 2 ? Vector3(logUniform(random, 10, 1e6) * direction(random)) : Vector3::Zero();
  const int elements = static_cast<int>(std::round(logUniform(random, 8, 80)));
  const double young = scale * scale * logUniform(random, 1e6, 1e9);  // so that time scales with nothing
  s.rod.length = scale, s.rod.radius = scale * r, s.rod.elements = elements;
  s.rod.density = logUniform(random, 500, 8000);
  s.rod.c = stiffnessOfRoundRod(young, young / 2.8, s.rod.radius);
  s.rod.self_contact = chance(random, 0.3);
  const bool curved = chance(random, 0.15);
  if (curved) s.rod.rest_curvature = {inCube(random, 4) / scale};
  const double ei = s.rod.bendingStiffness();
  s.grippers.max_force = 200 * ei / (scale * scale) * logUniform(random, 0.1, 30);
  s.grippers.max_torque = 10 * ei / scale * logUniform(random, 0.1, 30);
  s.grippers.max_force = std::min(s.grippers.max_force, 0.1 * s.rod.c[3]);
  s.grippers.max_torque = std::min(s.grippers.max_torque, 2 * s.rod.c[0] / s.rod.elementLength());
  s.grippers.max_speed = scale * logUniform(random, 0.05, 5);
  s.grippers.max_turn = logUniform(random, 0.2, 20);
  s.environment.friction = chance(random, 0.3) ? 0 : random.uniform();
  if (chance(random, 0.6)) s.environment.gravity = logUniform(random, 1, 30) * scale * direction(random);
  if (chance(random, 0.5)) s.environment.gravity = 9.81 * scale * -Vector3::UnitZ();
  s.simulation.inertia = chance(random, 0.9);
  s.simulation.scheme = chance(random, 0.5) ? Scheme::implicit_euler : Scheme::second_order;
  s.simulation.time_step = logUniform(random, 0.002, 0.05);
  s.simulation.drag = chance(random, 0.5) ? 2 : logUniform(random, 0.01, 10);
  s.simulation.stiffness_damping = chance(random, 0.5) ? 0.002 : chance(random, 0.3) ? 0 : 0.02;
  s.simulation.contact_distance =
      s.rod.radius * (chance(random, 0.5) ? 0.1 : logUniform(random, e.place == 2 ? 0.05 : 0.003, 1));
  const double n = random.uniform();
  e.newton = n < 0.6 ? 0 : n < 0.96 ? 1 : 2;
  if (e.newton == 0) e.settings = {between(random, 1, 3), 1e-4};
  if (e.newton == 2) e.settings = {100, 1e-7};

  // The mesh, turned or not, scaled, moved.
  const Quaternion turn = chance(random, 0.5) ? random.rotation() : Quaternion::Identity();
  const Pose whole{turn, offset};
  for (Vector3& v : world.mesh.vertices) v = whole * (scale * v);
  s.environment.gravity = turn * s.environment.gravity;
  e.mesh = std::move(world.mesh);
  if (e.mesh.faces.empty()) return {};

  // A free place, by the verification's distances, with a gap of 2 % of the radius.
  const verification::FaceTree tree = treeOf(e.mesh);
  RodProperties thicker = s.rod;
  thicker.radius *= 1.02;
  for (int tries = 0; tries < 100; ++tries) {
    Pose from = world.start.value_or(Pose{});
    if (!world.start) from = {random.rotation(), inCube(random, 0.8)};
    if (world.start && tries > 0) from.position += 0.1 * tries * r * Vector3::UnitZ();
    from.position *= scale;
    e.start = scenes::straight(whole * from, scale, elements);
    if (verification::isClear(e.start, thicker, tree)) return e;
  }
  return {};
}

/// The smallest gap of any of the shapes: distance of centreline and mesh, less r, by the
/// verification's own search and distances; `limit` [m] is what is looked for.
double leastGap(std::span<const RodShape> shapes, const RodProperties& rod,
                const verification::FaceTree& tree, double limit) {
  std::vector<const verification::Face*> near;
  double least = limit;
  for (const RodShape& shape : shapes)
    for (std::size_t i = 0; i + 1 < shape.size(); ++i) {
      const Vector3 &a = shape[i].position, &b = shape[i + 1].position;
      verification::Bounds box;
      box.include(a), box.include(b);
      tree.facesNear(box, rod.radius + least, near);
      for (const verification::Face* f : near)
        least = std::min(
            least,
            verification::segmentToTriangle(a, b, f->corners[0], f->corners[1], f->corners[2]).distance -
                rod.radius);
    }
  return least;
}

/// What one gripper is to do next: push at the mesh, go anywhere, or go on along the rod.
Control nextControl(const Episode& e, const RodState& state, Random& random) {
  Control control;
  const double p = random.uniform();
  control.held = p < 0.4    ? std::array{true, true}
                 : p < 0.6  ? std::array{true, false}
                 : p < 0.85 ? std::array{false, true}
                            : std::array{false, false};
  if (!control.held[0] && !control.held[1]) return control;
  const End end = control.held[0] && (!control.held[1] || chance(random, 0.5)) ? End::first : End::last;
  if (chance(random, 0.9)) control.moving = end;
  const double length = e.scenario.rod.length;
  const Pose now = endPose(state.nodes, end);
  control.target.rotation = chance(random, 0.5) ? random.rotation() : now.rotation;
  const double q = random.uniform();
  if (q < 0.7) {  // at a corner of a face, or behind it
    const auto& face =
        e.mesh.faces[static_cast<std::size_t>(random.uniform() * static_cast<double>(e.mesh.faces.size()))];
    const Vector3 at =
        e.mesh.vertices[static_cast<std::size_t>(face[static_cast<std::size_t>(between(random, 0, 2))])];
    const Vector3 way = at - now.position;
    control.target.position =
        now.position + way.normalized() * std::min(way.norm() + 0.3 * length, 1.5 * length);
  } else if (q < 0.85) {
    control.target.position = now.position + inCube(random, 0.8 * length);
  } else {
    control.target.position = now.position + now.rotation * Vector3(random.uniform(-1, 1) * length, 0, 0);
  }
  return control;
}

/// Whether an element is as long or as short as a motion may make it.
bool atStretchLimit(const RodShape& shape, double h) {
  for (std::size_t i = 0; i + 1 < shape.size(); ++i) {
    const double length = (shape[i + 1].position - shape[i].position).norm() / h;
    if (length > kMostStretch - 0.005 || length < kLeastStretch + 0.005) return true;
  }
  return false;
}

/// Whether an element turns by about as much as it may.
bool atTurnLimit(const RodShape& shape) {
  for (std::size_t i = 0; i + 1 < shape.size(); ++i)
    if (angleBetween(shape[i].rotation, shape[i + 1].rotation) > kMostTurn - 0.01) return true;
  return false;
}

/// The largest force on a node that the last iteration found left over, in units of the grippers'.
double forceLeft(const RodModel& model, RodWorkspace& workspace) {
  double force = 0;
  for (const Vector6& g : workspace.impl().gradient) force = std::max(force, g.tail<3>().norm());
  return force / model.grippers.max_force;
}

enum class Standstill { held_up, converging, otherwise };

/// Why a gripper stood still for 12 steps, by the same steps solved to the end: held up if no node goes a
/// tenth of what the gripper may and what is left over is below 1 % of its force (a straight rod that is
/// pressed along itself stands still until rounding has grown to a buckle); else whether all of them
/// converge.
Standstill whyStill(const RodModel& model, const Control& control, RodState state) {
  RodModel exact = model;
  exact.newton = {300, 1e-8};
  RodWorkspace workspace;
  ControlRunner runner(exact, control, state);
  const RodShape before = state.nodes;
  bool converged = true;
  for (int k = 0; k < 12; ++k)
    converged = runner.advance(state, workspace).status == StepReport::Status::converged && converged;
  const double travel = model.grippers.max_speed * model.simulation.time_step;
  if (maxNodeDistance(before, state.nodes) <= 0.1 * 12 * travel && forceLeft(exact, workspace) <= 0.01)
    return Standstill::held_up;
  return converged ? Standstill::converging : Standstill::otherwise;
}

/// The largest coordinate of mesh and rod [m].
double largestCoordinate(const TriangleMesh& mesh, const RodShape& shape) {
  double largest = 0;
  for (const Vector3& v : mesh.vertices) largest = std::max(largest, v.cwiseAbs().maxCoeff());
  for (const Pose& q : shape) largest = std::max(largest, q.position.cwiseAbs().maxCoeff());
  return largest;
}

/// Runs one episode. `tell` prints what is remarkable.
Tally runEpisode(const Episode& e, Random& random, std::uint64_t number, bool tell) {
  Tally tally;
  tally.episodes = 1;
  const Obstacles obstacles(std::span(&e.mesh, 1));
  RodModel model(e.scenario, obstacles);
  model.newton = e.settings;
  const double length = model.rod.length, travel = model.grippers.max_speed * model.simulation.time_step;
  RodState state = RodState::atRest(e.start);
  RodWorkspace workspace;
  TrajectoryRecorder recorder(model, e.start);
  const auto remark = [&](const std::string& what) {
    if (tell)
      fmt::print("episode {} ({}, {}) step {}: {}\n", number, kWorldNames[static_cast<std::size_t>(e.kind)],
                 kPlaceNames[e.place], recorder.steps(), what);
  };
  const verification::FaceTree tree = treeOf(e.mesh);
  double clock = secondsOf(CLOCK_THREAD_CPUTIME_ID);
  std::int64_t remarks = 0;
  bool finite = true;
  for (int controls = between(random, 3, 8); controls > 0 && finite; --controls) {
    Control control = nextControl(e, state, random);
    const int steps = between(random, 20, 60);
    control.start_s = 0, control.end_s = steps * model.simulation.time_step;
    ControlRunner runner(model, control, state);
    RodState window = state;
    int window_steps = 0;
    bool window_converged = true;
    for (int k = 0; k < steps && finite; ++k) {
      const RodShape before = state.nodes;
      const StepReport report = recorder.advance(runner, control, state, workspace);
      ++tally.steps;
      tally.contact_steps += report.contacts > 0;
      tally.crowded += report.contacts > 500;
      tally.countIterations(report.iterations);
      for (std::size_t i = 0; i < state.nodes.size(); ++i)
        finite = finite && state.nodes[i].position.allFinite() &&
                 state.nodes[i].rotation.coeffs().allFinite() && state.velocities[i].allFinite();
      if (!finite) {
        ++tally.not_finite;
        remark("not finite");
        break;
      }
      const double moved = maxNodeDistance(before, state.nodes);
      if (report.status == StepReport::Status::stalled) {
        const double force = forceLeft(model, workspace);
        if (report.iterations == 0)
          ++tally.at_rounding;
        else if (atTurnLimit(state.nodes))
          ++tally.at_turn_limit;
        else if (force < 1e-3)
          ++tally.balanced;
        else if (moved > 1e-6 * length)
          ++tally.stalled_moving;
        else
          ++tally.stalled;
        if (++remarks < 30)
          remark(fmt::format("stalled after {} iterations, {} contacts, moved {:.2g} L, force left {:.2g}",
                             report.iterations, report.contacts, moved / length, force));
      }
      // A gripper that should be moving, and a rod that does not.
      const double way =
          control.moving ? (control.target.position - endPose(state.nodes, *control.moving).position).norm()
                         : 0;
      window_converged = window_converged && report.status == StepReport::Status::converged;
      if (++window_steps == 12) {
        const double gone = maxNodeDistance(window.nodes, state.nodes);
        if (way > 0.1 * length + 12 * travel && gone < 1e-3 * 12 * travel) {
          const Standstill why = whyStill(model, control, window);
          // Collision detection takes 64 eps of the coordinates of either body for nothing.
          const double rounding =
              128 * std::numeric_limits<double>::epsilon() * largestCoordinate(e.mesh, state.nodes);
          const auto told = [&](std::int64_t& count, const char* what) {
            ++count;
            if (++remarks < 30)
              remark(fmt::format("{}: {} contacts, status {}, moved {:.2g} of the way", what, report.contacts,
                                 static_cast<int>(report.status), gone / (12 * travel)));
          };
          if (why == Standstill::held_up)
            ++tally.held_up;
          else if (atStretchLimit(state.nodes, model.rod.elementLength()) || atTurnLimit(state.nodes))
            told(tally.at_limits, "at the limits of an element");
          else if (leastGap(std::span(&state.nodes, 1), model.rod, tree, 4 * rounding) < 4 * rounding)
            told(tally.rounded, "pressed to within rounding");
          else if (window_converged)
            told(tally.at_rest, "all steps converged");
          else if (e.newton == 0 && why == Standstill::converging)
            told(tally.cut_short, "cut short");
          else
            told(tally.jams, "jammed");
        }
        window = state, window_steps = 0, window_converged = true;
      }
    }
  }
  tally.step_s += secondsOf(CLOCK_THREAD_CPUTIME_ID) - clock;
  if (!finite) return tally;

  clock = secondsOf(CLOCK_THREAD_CPUTIME_ID);
  Trajectory motion = recorder.take();
  tally.motions = std::ssize(motion.shapes) - 1;
  // The required distance is the radius less 1e-8 L.
  std::vector<verification::Clearance> results = {
      verification::checkClearance(motion, model.rod, tree, {"mesh"})};
  if (model.rod.self_contact) results.push_back(verification::checkSelfContact(motion, model.rod));
  for (const verification::Clearance& c : results)
    if (!c.check.passed) {
      ++(c.check.message.find("cannot be shown") != std::string::npos ? tally.undecided : tally.penetrations);
      remark(c.check.name + ": " + c.check.message);
    }
  for (const Check& check :
       {verification::checkStretch(motion, model.rod), verification::checkSteps(motion, model.rod),
        verification::checkQuaternions(motion)})
    if (!check.passed) {
      ++tally.other_claims;
      remark(check.name + ": " + check.message);
    }
  tally.least_gap =
      leastGap(motion.shapes, model.rod, tree, model.simulation.contact_distance) / model.rod.radius;
  tally.check_s += secondsOf(CLOCK_THREAD_CPUTIME_ID) - clock;
  return tally;
}

struct Numbered {
  Tally tally;
  std::size_t kind = 0, place = 0, newton = 0;
};

Numbered run(std::uint64_t seed, std::uint64_t number, bool tell) {
  Random random((seed << 32) + number);
  const auto episode = makeEpisode(random);
  if (!episode) return {};
  Numbered result{runEpisode(*episode, random, number, tell), static_cast<std::size_t>(episode->kind),
                  episode->place, episode->newton};
  return result;
}

void printHeader() {
  fmt::print(
      "{:<13}{:>9}{:>10}{:>10}{:>10}{:>8}{:>8}{:>6}{:>6}{:>9}{:>6}{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}{:>6}{:>"
      "6}"
      "{:>10}{:>7}{:>7}\n",
      "", "episodes", "steps", "contact", "motions", "penetr.", "undec.", "NaN", "other", "rounding", "half",
      "balance", "moving", "stalled", "held up", "limits", "rounded", "at rest", "cut", "jams", "gap/r",
      "us/st", "us/ck");
}
void print(const char* name, const Tally& t) {
  const double steps = static_cast<double>(std::max<std::int64_t>(t.steps, 1));
  fmt::print(
      "{:<13}{:>9}{:>10}{:>10}{:>10}{:>8}{:>8}{:>6}{:>6}{:>9}{:>6}{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}{:>6}{:>"
      "6}"
      "{:>10.2g}{:>7.0f}{:>7.0f}\n",
      name, t.episodes, t.steps, t.contact_steps, t.motions, t.penetrations, t.undecided, t.not_finite,
      t.other_claims, t.at_rounding, t.at_turn_limit, t.balanced, t.stalled_moving, t.stalled, t.held_up,
      t.at_limits, t.rounded, t.at_rest, t.cut_short, t.jams, t.least_gap, 1e6 * t.step_s / steps,
      1e6 * t.check_s / steps);
}

int runSoak(std::int64_t contact_steps, std::uint64_t seed, int threads) {
  constexpr std::uint64_t kRound = 32;  // episodes between two looks at how many there have been
  std::array<Tally, kWorldNames.size()> kinds;
  std::array<Tally, 3> places, newtons;
  Tally all;
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { interrupted = true; });
  for (std::uint64_t first = 0; all.contact_steps < contact_steps && !interrupted; first += kRound) {
    std::array<Numbered, kRound> results;
    std::atomic<std::uint64_t> next = 0;
    const auto work = [&] {
      for (std::uint64_t i = next++; i < kRound; i = next++) results[i] = run(seed, first + i, true);
    };
    std::vector<std::jthread> pool;
    for (int i = 1; i < threads; ++i) pool.emplace_back(work);
    work();
    pool.clear();
    for (const Numbered& r : results) {
      kinds[r.kind].add(r.tally), places[r.place].add(r.tally), newtons[r.newton].add(r.tally);
      all.add(r.tally);
    }
    if ((first / kRound + 1) % 64 == 0) {
      fmt::print("after {} episodes and {:.0f} s of a processor:\n", first + kRound,
                 secondsOf(CLOCK_PROCESS_CPUTIME_ID));
      printHeader();
      print("", all);
    }
    std::fflush(stdout);
  }
  const double spent = secondsOf(CLOCK_PROCESS_CPUTIME_ID);
  fmt::print(
      "\nseed {}, {} threads, {:.0f} s of a processor, {:.0f} steps/s of which {:.0f} in contact, checks "
      "included\n\n",
      seed, threads, spent, static_cast<double>(all.steps) / spent,
      static_cast<double>(all.contact_steps) / spent);
  printHeader();
  for (std::size_t i = 0; i < kinds.size(); ++i) print(kWorldNames[i], kinds[i]);
  fmt::print("\n");
  for (std::size_t i = 0; i < 3; ++i) print(kPlaceNames[i], places[i]);
  fmt::print("\n");
  for (std::size_t i = 0; i < 3; ++i) print(kNewtonNames[i], newtons[i]);
  fmt::print("\n");
  print("all", all);
  fmt::print("\niterations per step  {:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}\n", 0, 1, 2, 3, "4-5",
             "6-10", "11-30", "31-100", "more");
  const auto histogram = [](const char* name, const Tally& t) {
    fmt::print("{:<21}", name);
    for (const std::int64_t n : t.iterations)
      fmt::print("{:>8.2f}%",
                 100 * static_cast<double>(n) / static_cast<double>(std::max<std::int64_t>(t.steps, 1)));
    fmt::print("\n");
  };
  for (std::size_t i = 0; i < 3; ++i) histogram(kNewtonNames[i], newtons[i]);
  const std::int64_t still =
      all.at_limits + all.rounded + all.at_rest + all.cut_short + all.jams;  // and not held up
  return all.penetrations + all.undecided + all.not_finite + all.other_claims + all.stalled_moving +
                     all.stalled + still ==
                 0
             ? 0
             : 1;
}

/// Rods pulled through a straight and a bent tube in every way: how many pass, stick, jam.
int runPassages() {
  struct Count {
    int passed = 0, sticks = 0, jams = 0;
    std::int64_t steps = 0, stalls = 0;
    double iterations = 0;
  };
  std::map<std::string, Count> counts;
  int jams = 0;
  for (const double bend : {0.0, 0.5, 1.0})
    for (const double friction : {0.0, 0.2, 0.5})
      for (const double force : {1.0, 10.0})
        for (const double speed : {1.0, 5.0})
          for (const double time_step : {0.002, 0.01, 0.02, 0.05})
            for (const int elements : {12, 20, 40})
              for (const double distance : {0.02, 0.1, 0.19}) {
                const passages::Pull pull{bend, friction, force, speed, time_step, elements, distance};
                const passages::Passage p = passages::pullThrough(pull);
                const auto note = [&](const std::string& name) {
                  Count& c = counts[name];
                  ++(p.outcome == passages::Outcome::passed   ? c.passed
                     : p.outcome == passages::Outcome::sticks ? c.sticks
                                                              : c.jams);
                  c.steps += p.steps, c.stalls += p.stalls;
                  c.iterations += p.iterations * static_cast<double>(p.steps);
                };
                note(fmt::format("1 bend {:g} rad", bend)), note(fmt::format("2 friction {:g}", friction));
                note(fmt::format("3 force x{:g}", force)), note(fmt::format("4 speed x{:g}", speed));
                note(fmt::format("5 time step {:>2g} ms", 1e3 * time_step)),
                    note(fmt::format("6 N = {}", elements));
                note(fmt::format("7 contact distance {:g} r", distance)), note("8 all");
                jams += p.outcome == passages::Outcome::jams;
                if (p.outcome == passages::Outcome::passed) continue;
                fmt::print(
                    "{}: bend {:g}, friction {:g}, force x{:g}, speed x{:g}, {:g} ms, N = {}, distance {:g} "
                    "r: "
                    "{:.0f} % of the way, pull {:.2f}, residual {:.2g}, friction {:.2f} of at most {:.2f}, "
                    "{} stalls of {} steps\n",
                    p.outcome == passages::Outcome::sticks ? "sticks" : "JAMS", bend, friction, force, speed,
                    1e3 * time_step, elements, distance, 100 * p.reached, p.pull, p.residual, p.friction,
                    p.friction_limit, p.stalls, p.steps);
                std::fflush(stdout);
              }
  fmt::print("\n{:<24}{:>8}{:>8}{:>8}{:>10}{:>8}{:>18}\n", "", "pass", "stick", "jam", "steps", "stalls",
             "iterations a step");
  for (const auto& [name, c] : counts)
    fmt::print("{:<24}{:>8}{:>8}{:>8}{:>10}{:>8}{:>18.2f}\n", name.substr(2), c.passed, c.sticks, c.jams,
               c.steps, c.stalls, c.iterations / static_cast<double>(c.steps));
  return jams;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::strcmp(argv[1], "--passages") == 0) return runPassages() == 0 ? 0 : 1;
  if (argc > 2 && std::strcmp(argv[1], "--episode") == 0) {
    printHeader();
    print("",
          run(argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 1, std::strtoull(argv[2], nullptr, 10), true)
              .tally);
    return 0;
  }
  const std::int64_t contact_steps = argc > 1 ? std::atoll(argv[1]) : 100000;
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  return runSoak(contact_steps, seed, argc > 3 ? std::clamp(std::atoi(argv[3]), 1, 2) : 1);
}
