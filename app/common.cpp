#include "common.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cassert>
#include <csignal>
#include <cstring>

#include "tendril/dynamics.h"
#include "tendril/planner.h"
#include "tendril/viewer.h"

namespace tendril::app {
namespace fs = std::filesystem;

namespace {

const std::chrono::steady_clock::time_point process_start = std::chrono::steady_clock::now();

std::atomic<bool> cancelled = false;
static_assert(std::atomic<bool>::is_always_lock_free, "the signal handler stores to it");

std::string hostName() {
  std::array<char, 256> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "unknown";
}

}  // namespace

std::chrono::steady_clock::time_point processStart() { return process_start; }

double secondsSinceStart() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - process_start).count();
}

World loadWorld(const Scenario& scenario) {
  std::vector<TriangleMesh> meshes = loadMeshes(scenario);
  Obstacles obstacles(meshes);
  return {std::move(meshes), std::move(obstacles)};
}

World loadWorld(const Solution& solution) {
  const std::vector<std::string> hashes = meshHashes(solution.scenario);
  for (std::size_t i = 0; i < hashes.size(); ++i)
    if (i >= solution.mesh_sha256.size() || hashes[i] != solution.mesh_sha256[i])
      throw InputError(
          fmt::format("{}: this is not the mesh the solution was made with (its sha256 differs); restore "
                      "that file or plan again.",
                      solution.scenario.meshPath(solution.scenario.environment.meshes[i]).string()));
  return loadWorld(solution.scenario);
}

void requireWritable(const fs::path& folder) {
  std::error_code error;
  fs::path existing = fs::absolute(folder, error);
  while (existing.has_relative_path() && !fs::exists(existing, error)) existing = existing.parent_path();
  if (!fs::is_directory(existing, error))
    throw InputError(
        fmt::format("{}: is not a folder, so nothing can be written to {}; name another with -o.",
                    existing.string(), folder.string()));
  if (access(existing.c_str(), W_OK | X_OK) != 0)
    throw InputError(fmt::format("{}: cannot be written to: {}; name another folder with -o.",
                                 existing.string(), std::strerror(errno)));
}

fs::path outputFolder(const std::string& given, const Scenario& scenario) {
  fs::path folder = given;
  if (given.empty()) {
    std::string name = scenario.name;
    for (char& letter : name)
      if (letter == '/' || letter == '\0') letter = '-';
    if (name.empty() || name == "." || name == "..") name = "plan";
    folder = fs::path("out") / name;
  }
  requireWritable(folder);
  return folder;
}

void stamp(Solution& solution) {
  solution.run.version = TENDRIL_VERSION;
  solution.run.host = hostName();
  solution.mesh_sha256 = meshHashes(solution.scenario);
}

void measureMotion(Solution& solution, const World& world) {
  const RodModel model(solution.scenario, world.obstacles);
  SimulationResult result =
      simulate(model, solution.trajectory.shapes.front(), solution.controls, nullptr, true);
  assert(result.trajectory.shapes.size() == solution.trajectory.shapes.size());
  solution.quantities = std::move(result.quantities);
}

void writePageOf(const Solution& solution, const World& world, const fs::path& file) {
  RodShape goal;
  if (solution.scenario.goal) {
    try {
      goal = goalShape(solution.scenario, world.obstacles);
    } catch (const InputError&) {
      goal.clear();  // a goal that holds no rod has no ghost; only planning needs it
    }
  }
  writePage(solution, world.meshes, world.obstacles, goal, file);
}

Written writeSolutionAndPage(const Solution& solution, const World& world, const fs::path& folder) {
  Written written{folder / "solution.json", folder / "view.html"};
  writeSolution(solution, written.solution);
  writePageOf(solution, world, written.page);
  return written;
}

const std::atomic<bool>& cancelFlag() {
  static const bool installed = [] {
    struct sigaction action {};
    action.sa_handler = [](int) { cancelled.store(true); };
    action.sa_flags = static_cast<int>(SA_RESETHAND);  // the second signal acts as if there were no handler
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    return true;
  }();
  static_cast<void>(installed);
  return cancelled;
}

void printJson(const nlohmann::json& object) { fmt::print("{}\n", object.dump()); }

nlohmann::json toJson(const Equilibrium& equilibrium, bool with_nodes) {
  nlohmann::json json = {
      {"wrench", std::vector<double>(equilibrium.wrench.begin(), equilibrium.wrench.end())},
      {"base", tendril::toJson(equilibrium.base)},
      {"end", tendril::toJson(equilibrium.nodes.back())},
      {"energy_j", equilibrium.energy},
      {"weight_energy_j", equilibrium.weight_energy},
      {"stable", equilibrium.stability == Stability::stable},
      {"first_conjugate_t", nullptr}};
  if (equilibrium.first_conjugate_t) json["first_conjugate_t"] = *equilibrium.first_conjugate_t;
  if (with_nodes) json["nodes"] = nodesToJson(equilibrium.nodes);
  return json;
}

std::string describe(const Equilibrium& equilibrium) {
  const Vector6& a = equilibrium.wrench;
  const Vector3& p = equilibrium.nodes.back().position;
  std::string line = fmt::format(
      "wrench [{:.6g} {:.6g} {:.6g}] N m [{:.6g} {:.6g} {:.6g}] N, end at [{:.6g} {:.6g} {:.6g}] m, {:.6g} "
      "J, ",
      a[0], a[1], a[2], a[3], a[4], a[5], p[0], p[1], p[2], equilibrium.energy);
  if (equilibrium.weight_energy != 0)
    line += fmt::format("{:+.6g} J of its weight, ", equilibrium.weight_energy);
  switch (equilibrium.stability) {
    case Stability::stable:
      return line + "stable";
    case Stability::marginal:
      return line + "marginal: stability is lost at the very end";
    case Stability::unstable:
      return line +
             fmt::format("unstable from {:.6g} of its length on", equilibrium.first_conjugate_t.value_or(0));
  }
  return line;
}

void addQuantities(nlohmann::json& summary, const Solution& solution) {
  if (solution.quantities.empty()) return;
  nlohmann::json& list = summary["extremes"] = nlohmann::json::object();
  for (const Extreme& extreme : extremes(solution.quantities, solution.scenario.rod)) {
    list[extreme.name] = {{"value", extreme.value}, {"time_s", extreme.time}};
    if (extreme.s) list[extreme.name]["s_m"] = *extreme.s;
  }
  summary["quantities"] = tendril::toJson(solution.quantities);
}

void printExtremes(const Solution& solution) {
  for (const Extreme& extreme : extremes(solution.quantities, solution.scenario.rod))
    fmt::print("{} {:.4g} at {:.4g} s{}\n", extreme.name, extreme.value, extreme.time,
               extreme.s ? fmt::format(", {:.4g} m along the rod", *extreme.s) : "");
}

nlohmann::json toJson(const VerificationReport& report) {
  nlohmann::json checks = nlohmann::json::array();
  for (const Check& check : report.checks)
    checks.push_back({{"name", check.name}, {"passed", check.passed}, {"message", check.message}});
  return {{"valid", report.valid()}, {"smallest_clearance_m", report.smallest_clearance}, {"checks", checks}};
}

}  // namespace tendril::app
