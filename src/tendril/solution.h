/// tendril/solution.h: a plan as data, and its file format. See docs/solution.md.
#pragma once

#include <nlohmann/json.hpp>

#include "tendril/quantities.h"
#include "tendril/scenario.h"

namespace tendril {

enum class PlanStatus { solved, time_limit, iteration_limit, cancelled, simulated };
[[nodiscard]] const char* name(PlanStatus status);

/// How a solution came about.
struct Provenance {
  std::string version;
  std::uint64_t seed = 0;
  int threads = 1;
  nlohmann::json planner = nlohmann::json::object();  // {"name": ..., settings ...}
  double wall_time = 0;                               // of loading and planning, s
  double cpu_time = 0;                                // of planning; of a simulation, of the whole process, s
  std::int64_t iterations = 0, states = 0, steps = 0;
  double simulated_time = 0;  // s
  std::string host;
};

/// What keeps a rod from its goal; docs/solution.md says what each means, src/tendril/planner/README.md how
/// it is told.
enum class Limit { force, torque, bend, clearance, workspace, shape, time };
inline constexpr std::array kLimits = {Limit::force,     Limit::torque, Limit::bend, Limit::clearance,
                                       Limit::workspace, Limit::shape,  Limit::time};
[[nodiscard]] const char* name(Limit limit);

/// A contact of the rod with a face of a mesh.
struct FaceContact {
  double s = 0;                        // m, arc length at rest
  Vector3 position = Vector3::Zero();  // m, world, on the mesh
  Vector3 force = Vector3::Zero();     // N, on the rod, world
  std::string mesh;                    // as the scenario names it
  std::int64_t face = 0;               // its number in the mesh
};

/// What the motion that came nearest lacks to the goal, and what stops it there when its grippers carry on
/// toward the goal.
struct Shortfall {
  double distance = 0;                      // m, (6) of the last state to the goal's shape
  double largest_distance = 0;              // m, of one node
  std::array<double, 2> end_distance = {};  // m, of either end to its pose at the goal
  std::array<double, 2> end_angle = {};     // rad, likewise
  std::optional<Limit> limit;               // none: there was no time to find out
  std::optional<End> gripper;               // that does not get to its pose
  std::optional<Vector3> position;          // m, world: where the rod is stuck
  std::optional<double> gripper_force;      // N, what that gripper then exerts
  std::optional<double> gripper_torque;     // N m, likewise
  std::optional<FaceContact> contact;       // the strongest then
  std::optional<double> clearance;          // m, the smallest of the rod's surface then
  std::optional<double> bend_radius;        // m, the smallest of the centreline then
  std::optional<double> bend_radius_s;      // m, where along the rod
};

/// Calls visit(key, member) for every part of a Shortfall, so that reader, writer and docs agree.
template <class Visit>
void visitShortfall(Visit&& visit) {
  visit("distance_m", &Shortfall::distance);
  visit("largest_distance_m", &Shortfall::largest_distance);
  visit("end_distance_m", &Shortfall::end_distance);
  visit("end_angle_rad", &Shortfall::end_angle);
  visit("limit", &Shortfall::limit);
  visit("gripper", &Shortfall::gripper);
  visit("position_m", &Shortfall::position);
  visit("gripper_force_n", &Shortfall::gripper_force);
  visit("gripper_torque_n_m", &Shortfall::gripper_torque);
  visit("contact", &Shortfall::contact);
  visit("clearance_m", &Shortfall::clearance);
  visit("bend_radius_m", &Shortfall::bend_radius);
  visit("bend_radius_s_m", &Shortfall::bend_radius_s);
}

struct Solution {
  PlanStatus status = PlanStatus::simulated;
  Scenario scenario;                     // with scenario.file resolved to an absolute path
  std::vector<std::string> mesh_sha256;  // as recorded in the file
  Provenance run;
  std::optional<Shortfall> shortfall;  // of a problem that was not solved; none: not in the file
  std::vector<Control> controls;
  Trajectory trajectory;
  std::vector<Quantities> quantities;  // of every step if they were asked for, else empty: not in the file
};

/// Writes solution.json atomically; scenario.file is stored relative to its folder, numbers with 17
/// significant digits.
void writeSolution(const Solution& solution, const std::filesystem::path& file);
/// Reads and checks a solution. `scenario_override` replaces where the scenario (and so its meshes) is looked
/// for; its contents still come from the solution. Throws InputError with file, key and what is wrong.
[[nodiscard]] Solution readSolution(const std::filesystem::path& file,
                                    const std::optional<std::filesystem::path>& scenario_override = {});
/// sha256 of every mesh file of a scenario, in order. Throws InputError if one is missing.
[[nodiscard]] std::vector<std::string> meshHashes(const Scenario& scenario);

/// One array per quantity, named as in visitQuantities, with one element per step.
[[nodiscard]] nlohmann::ordered_json toJson(std::span<const Quantities> quantities);

/// One key per part, named as in visitShortfall.
[[nodiscard]] nlohmann::ordered_json toJson(const Shortfall& shortfall);

/// One row x y z qw qx qy qz per node.
[[nodiscard]] nlohmann::ordered_json nodesToJson(const RodShape& shape);

}  // namespace tendril
