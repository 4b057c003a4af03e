#include "tendril/planner.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <numbers>

#include "commands.h"
#include "common.h"

namespace tendril::app {
namespace {

struct Options {
  std::string scenario, folder, planner = "tendril";
  std::uint64_t seed = 1;
  double time_limit_s = 1200, optimize_s = 0;
  int threads = 1;
  bool quantities = false, json = false;
};

/// Accepts a finite number of seconds, positive or at least not negative.
CLI::Validator seconds(bool zero_too) {
  return {[zero_too](const std::string& text) -> std::string {
            double seconds = 0;
            const bool valid = CLI::detail::lexical_cast(text, seconds) && std::isfinite(seconds) &&
                               (seconds > 0 || (zero_too && seconds == 0));
            return valid ? "" : text + " is not a " + (zero_too ? "" : "positive ") + "number of seconds";
          },
          zero_too ? ">= 0" : "> 0"};
}

/// One line on standard error, rewritten in place; nothing at all unless that is a terminal.
class ProgressLine {
 public:
  ~ProgressLine() {
    if (shown_) fmt::print(stderr, "\r\x1b[K");
  }
  void show(const PlanProgress& progress) {
    if (!terminal_) return;
    shown_ = true;
    fmt::print(stderr, "\r\x1b[K{:.1f} s, {} states, {} steps, nearest to the goal {:.3g} m",
               progress.elapsed_s, progress.states, progress.steps, progress.nearest_m);
    std::fflush(stderr);
  }
  void show(const MotionCost& best, double elapsed_s) {
    if (!terminal_) return;
    shown_ = true;
    fmt::print(stderr, "\r\x1b[K{:.1f} s, the motion takes {:.4g} s, gripper force up to {:.4g} N", elapsed_s,
               best.time, best.gripper_force);
    std::fflush(stderr);
  }

 private:
  bool terminal_ = isatty(STDERR_FILENO) != 0;
  bool shown_ = false;
};

void printFailures(const VerificationReport& report) {
  for (const Check& check : report.checks)
    if (!check.passed) fmt::print(stderr, "tendril: {}: {}\n", check.name, check.message);
}

/// Verifies a plan that claims to be solved; takes the claim back if it does not hold.
VerificationReport verifyClaim(Solution& solution) {
  VerificationReport report = verify(solution);
  if (report.valid()) return report;
  solution.status = PlanStatus::iteration_limit;
  fmt::print(stderr, "tendril: the plan fails verification:\n");
  printFailures(report);
  return report;
}

std::string describe(const Vector3& place) {
  return fmt::format("({:.3g}, {:.3g}, {:.3g}) m", place.x(), place.y(), place.z());
}

/// What may help whatever it is that stopped the search.
const char* moreTime(PlanStatus status) {
  if (status == PlanStatus::cancelled) return "letting it run";
  return status == PlanStatus::iteration_limit ? "a larger planner.extend_limit" : "a longer --time-limit";
}

/// How a gripper that is stuck is held, and what may help besides more time.
std::pair<std::string, const char*> describeHold(const Shortfall& s) {
  const double force = s.gripper_force.value_or(0), torque = s.gripper_torque.value_or(0);
  const std::string radius =
      s.bend_radius ? fmt::format("a radius of {:.3g} m", *s.bend_radius) : "no radius";
  switch (*s.limit) {
    case Limit::torque:
      return {fmt::format("the gripper turns with its largest torque, {:.3g} N m", torque),
              "stronger grippers (grippers.max_torque_n_m)"};
    case Limit::clearance:
      return {fmt::format("the rod is held between opposite sides, with {:.2g} mm of clearance left, and the "
                          "gripper pulls with its largest force, {:.3g} N",
                          1e3 * s.clearance.value_or(0), force),
              "a wider passage or a thinner rod (rod.radius_m)"};
    case Limit::bend:
      return {
          fmt::format("the rod itself resists, bent to {}, and the gripper exerts {:.3g} N and {:.3g} N m",
                      radius, force, torque),
          "stronger grippers (grippers.max_force_n, max_torque_n_m) or a softer rod"};
    default:
      return {fmt::format("the gripper pulls with its largest force, {:.3g} N", force),
              "stronger grippers (grippers.max_force_n)"};
  }
}

/// What stops the rod, and what may help, as sentences.
std::string describeLimit(const Shortfall& s, PlanStatus status) {
  const char* more = moreTime(status);
  if (!s.limit) return fmt::format("There was no time to find out what stops it. Try {}.", more);
  if (*s.limit == Limit::time)
    return fmt::format("Nothing holds it there: it can go on toward the goal. Try {}.", more);
  if (*s.limit == Limit::shape)
    return fmt::format(
        "Its ends get to the goal from there, but the rod then lies in another equilibrium, which is "
        "farthest "
        "from the goal's shape at {}. Try {}, or a larger goal.tolerance.shape_m if another shape will do.",
        describe(*s.position), more);
  if (*s.limit == Limit::workspace)
    return fmt::format(
        "When its {} end goes straight on toward the goal, the rod leaves the workspace at {}. Try {} or a "
        "larger environment.workspace_m.",
        name(*s.gripper), describe(*s.position), more);
  const auto [hold, help] = describeHold(s);
  const bool at_contact = s.contact && *s.limit != Limit::bend;
  std::string text = fmt::format(
      "When its {} end goes straight on toward the goal, it is stuck at {}{}: {}.", name(*s.gripper),
      describe(*s.position),
      at_contact ? fmt::format(" against {} (face {})", s.contact->mesh, s.contact->face) : "", hold);
  if (s.bend_radius && *s.limit != Limit::bend)
    text += fmt::format(" The rod is bent to a radius of {:.3g} m, {:.3g} m along it.", *s.bend_radius,
                        s.bend_radius_s.value_or(0));
  return text + fmt::format(" Try {} or {}.", more, help);
}

/// One paragraph about a motion that did not get to the goal.
std::string describe(const Shortfall& s, const Solution& solution) {
  const auto end = [&](End e) {
    const auto k = static_cast<std::size_t>(e);
    return fmt::format(
        "the {} end {:.3g} m ({:.0f} % of the rod) and {:.0f} degrees from its pose at the goal", name(e),
        s.end_distance[k], 100 * s.end_distance[k] / solution.scenario.rod.length,
        s.end_angle[k] * 180 / std::numbers::pi);
  };
  return fmt::format(
      "No plan was found in {:.3g} s. The motion that came nearest ends with {}, {}, and the rod {:.3g} m "
      "from "
      "the goal's shape on average. {}",
      solution.run.wall_time, end(End::first), end(End::last), s.distance, describeLimit(s, solution.status));
}

/// Improves a verified plan; keeps it as it was if what comes out does not hold.
std::optional<Improvement> improve(Solution& solution, VerificationReport& report, const World& world,
                                   double limit_s) {
  ProgressLine progress;
  OptimizeRequest request;
  request.time_limit_s = limit_s;
  request.cancel = &cancelFlag();
  request.on_progress = [&](const MotionCost& best, double elapsed_s) { progress.show(best, elapsed_s); };
  Improvement improvement = optimize(solution, world.obstacles, request);
  if (improvement.accepted == 0) return improvement;
  Solution improved = std::move(improvement.solution);
  VerificationReport again = verify(improved);
  if (again.valid()) {
    solution = std::move(improved);
    report = std::move(again);
  } else {
    fmt::print(stderr, "tendril: the improved plan fails verification; the plan stays as it was:\n");
    printFailures(again);
    improvement.after = improvement.before;
    improvement.accepted = 0;
  }
  return improvement;
}

void printImprovement(const Improvement& improvement) {
  fmt::print("improved by {} of {} changes:", improvement.accepted, improvement.candidates);
  visitMotionCost([&, separator = " "](const char* key, auto member) mutable {
    fmt::print("{}{} {:.4g} -> {:.4g}", std::exchange(separator, ", "), key, improvement.before.*member,
               improvement.after.*member);
  });
  fmt::print("\n");
}

nlohmann::json costJson(const MotionCost& cost) {
  nlohmann::json json;
  visitMotionCost([&](const char* key, auto member) { json[key] = cost.*member; });
  return json;
}

void printSummary(const Solution& solution, const std::optional<VerificationReport>& report,
                  const std::optional<Improvement>& improvement, const Written& written) {
  const Provenance& run = solution.run;
  fmt::print("{} after {:.2f} s ({:.2f} s of processor time): {} iterations, {} states, {} steps\n",
             name(solution.status), run.wall_time, run.cpu_time, run.iterations, run.states, run.steps);
  fmt::print("the motion: {:.2f} s, {} controls, {} stored states\n", solution.trajectory.time_s.back(),
             solution.controls.size(), solution.trajectory.shapes.size());
  if (improvement) printImprovement(*improvement);
  if (report && report->valid()) {
    if (!solution.scenario.environment.meshes.empty())
      fmt::print("verified; the smallest clearance is at least {:.4g} mm\n",
                 1e3 * report->smallest_clearance);
    else
      fmt::print("verified; there are no obstacles\n");
  } else if (solution.shortfall) {
    fmt::print("{}\n", describe(*solution.shortfall, solution));
  }
  printExtremes(solution);
  fmt::print("{}\n{} (open it in a browser)\n", written.solution.string(), written.page.string());
}

nlohmann::json summaryJson(const Solution& solution, const std::optional<VerificationReport>& report,
                           const std::optional<Improvement>& improvement, const Written& written) {
  const Provenance& run = solution.run;
  nlohmann::json json = {{"status", name(solution.status)},
                         {"solution", written.solution.string()},
                         {"page", written.page.string()},
                         {"wall_time_s", run.wall_time},
                         {"cpu_time_s", run.cpu_time},
                         {"iterations", run.iterations},
                         {"states", run.states},
                         {"steps", run.steps},
                         {"simulated_time_s", run.simulated_time},
                         {"motion_time_s", solution.trajectory.time_s.back()},
                         {"controls", solution.controls.size()},
                         {"verified", report && report->valid()}};
  if (report) json["verification"] = toJson(*report);
  if (solution.shortfall) json["shortfall"] = tendril::toJson(*solution.shortfall);
  if (improvement)
    json["optimization"] = {{"candidates", improvement->candidates},
                            {"accepted", improvement->accepted},
                            {"before", costJson(improvement->before)},
                            {"after", costJson(improvement->after)}};
  addQuantities(json, solution);
  return json;
}

int run(const Options& options) {
  const std::atomic<bool>& cancel = cancelFlag();
  const Scenario scenario = readScenario(options.scenario);
  const std::filesystem::path folder = outputFolder(options.folder, scenario);
  const World world = loadWorld(scenario);

  Solution solution;
  {
    ProgressLine progress;
    PlanRequest request;
    request.planner = options.planner;
    request.seed = options.seed;
    request.time_limit_s = options.time_limit_s;
    request.started = processStart();
    request.threads = options.threads;
    request.cancel = &cancel;
    request.on_progress = [&](const PlanProgress& report) { progress.show(report); };
    solution = plan(scenario, world.obstacles, request);
  }
  stamp(solution);
  std::optional<VerificationReport> report;
  if (solution.status == PlanStatus::solved) report = verifyClaim(solution);
  std::optional<Improvement> improvement;
  if (solution.status == PlanStatus::solved && options.optimize_s > 0)
    improvement = improve(solution, *report, world, options.optimize_s);

  if (options.quantities) measureMotion(solution, world);
  const Written written = writeSolutionAndPage(solution, world, folder);
  if (options.json)
    printJson(summaryJson(solution, report, improvement, written));
  else
    printSummary(solution, report, improvement, written);
  return solution.status == PlanStatus::solved ? 0 : 1;
}

}  // namespace

void addPlan(CLI::App& app, int& status) {
  CLI::App& command =
      *app.add_subcommand("plan", "Plan a scenario; write DIR/solution.json and DIR/view.html");
  auto options = std::make_shared<Options>();
  command.add_option("scenario", options->scenario, "Scenario file")->required()->type_name("SCENARIO");
  command.add_option("-o", options->folder, "Where to write (default: out/<the scenario's name>)")
      ->type_name("DIR");
  command.add_option("--seed", options->seed, "Seed of every random choice")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber)
      ->type_name("N");
  command.add_option("--time-limit", options->time_limit_s, "Limit on loading and planning, in seconds")
      ->capture_default_str()
      ->check(seconds(false))
      ->type_name("S");
  command
      .add_option("--optimize", options->optimize_s,
                  "Seconds to improve the plan after it is found: shorter, less force, never worse")
      ->capture_default_str()
      ->check(seconds(true))
      ->type_name("S");
  command
      .add_option("--threads", options->threads, "Attempts made at once; the plan is the same for any number")
      ->capture_default_str()
      ->check(CLI::Range(1, 1024))
      ->type_name("K");
  command
      .add_option("--planner", options->planner,
                  "One of: " + fmt::format("{}", fmt::join(plannerNames(), ", ")))
      ->capture_default_str()
      ->type_name("P");
  command.add_flag("--quantities", options->quantities,
                   "Measure every step too: strains, forces, contacts, clearance, energies");
  command.add_flag("--json", options->json, "Print one JSON object");
  command.footer("Example: tendril plan scenarios/double-funnel.yaml --seed 1 -o out/double-funnel");
  command.callback([options, &status] { status = run(*options); });
}

}  // namespace tendril::app
