/// tendril/scenario.h: a scenario file as plain data: read, checked, nothing computed. See docs/scenario.md.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "tendril/rod.h"

namespace tendril {

/// A mesh named by a scenario; vertices become rotation (scale v) + position, in metres.
struct MeshReference {
  std::string file;  // as written; relative to the scenario's folder
  double scale = 1.0;
  Pose pose;
};

/// An axis-aligned box [m].
struct Box {
  Vector3 min = Vector3::Constant(-1), max = Vector3::Constant(1);
  [[nodiscard]] bool contains(const Vector3& p) const {
    return (p.array() >= min.array()).all() && (p.array() <= max.array()).all();
  }
};

struct Environment {
  std::vector<MeshReference> meshes;
  Box workspace;                      // every node stays inside; samples are drawn here
  double friction = 0.0;              // Coulomb coefficient between rod and obstacles
  Vector3 gravity = Vector3::Zero();  // m/s^2
};

/// Which ends a plan may hold at once.
enum class Grasp { both, first, last };
[[nodiscard]] const char* name(Grasp grasp);

struct GripperLimits {
  std::vector<Grasp> grasps = {Grasp::both, Grasp::first, Grasp::last};
  double max_speed = 1.0;   // m/s
  double max_turn = 4.0;    // rad/s
  double max_force = 0.0;   // N; default 200 EI/L^2, filled in on reading
  double max_torque = 0.0;  // N m; default 10 EI/L, filled in on reading
  [[nodiscard]] bool allows(Grasp grasp) const;
};

enum class Scheme { implicit_euler, second_order };

struct SimulationSettings {
  bool inertia = true;  // false: overdamped settling
  Scheme scheme = Scheme::implicit_euler;
  double time_step = 0.02;           // s
  double drag = 2.0;                 // 1/s, mass-proportional: a free motion decays as exp(-drag t)
  double stiffness_damping = 0.002;  // s, Rayleigh beta
  double contact_distance = 0.0;     // m, the barrier's reach dhat; default filled in on reading
  int newton_iterations = 30;        // the most a step may take
  double newton_tolerance =
      1e-3;                     // L, rad: the motion of the last iteration, whose error is about its square
  double step_tolerance = 0.0;  // m: error of a step; 0: every step is one of time_step
};

/// The goal region: every state whose two gripper frames lie within `position` (and `angle`) of the goal's
/// and, where `shape` is given, whose every node lies within it of the goal's shape.
struct Goal {
  Placement placement;
  double position_tolerance = 0.05;       // m
  std::optional<double> angle_tolerance;  // rad, of the whole frame, twist included
  std::optional<double> shape_tolerance;  // m
};

/// Settings of the planner, see docs/scenario.md for each. Defaults are what `--planner tendril` was tuned
/// for.
struct PlannerSettings {
  double goal_bias = 0.3;        // probability of aiming at the goal
  int extend_limit = 0;          // EXTENDs after which planning gives up; 0: only the time limit
  double reach_fraction = 0.01;  // epsilon of Algorithm 1 as a fraction of L
  double phase_limit_s = 3.0;    // simulated time one phase of EXTEND may take
  double stall_fraction = 0.2;   // a phase ends when no node moves faster than this fraction of max_speed
  double explore_time_step_s = 0.05;  // time step of the coarse exploration
  int explore_elements = 12;          // elements of the coarse exploration; 0: the rod's own
  int explore_newton_iterations = 5;  // Newton iterations a coarse step may take
  int goal_extends = 60;              // extensions an attempt spends on the goal's surroundings
  int attempt_extends = 300;          // extensions of the first attempts
  double failure_penalty = 1.0;       // what a failed growth adds to a state's distance, in multiples of it
  double along_share = 0.25;          // share of growths along an end's tangent
  double sample_moment = 6.283185307179586;  // half-width of the box of a: moments, EI/L
  double sample_force = 40.0;                // half-width of the box of a: forces, EI/L^2
};

/// Calls visit(key, field, low, high, unit, meaning) for every setting, so that reader, writer and docs
/// agree.
template <class Settings, class Visit>
void visitPlannerSettings(Settings& s, Visit&& visit) {
  visit("goal_bias", s.goal_bias, 0.0, 1.0, "-", "probability of aiming at the goal");
  visit("extend_limit", s.extend_limit, 0, 1000000000, "-",
        "EXTENDs after which planning gives up; 0: only the time limit");
  visit("reach_fraction", s.reach_fraction, 1e-6, 1.0, "L",
        "a gripper has arrived within this of its target");
  visit("phase_limit_s", s.phase_limit_s, 1e-3, 1e3, "s", "simulated time one phase of EXTEND may take");
  visit("stall_fraction", s.stall_fraction, 0.0, 1.0, "max_speed",
        "a phase ends when no node moves faster than this; 0: never; the planner paper has none");
  visit("explore_time_step_s", s.explore_time_step_s, 1e-4, 1.0, "s", "time step of the coarse exploration");
  visit("explore_elements", s.explore_elements, 0, 1000, "-",
        "elements of the coarse exploration; 0: the rod's own");
  visit("explore_newton_iterations", s.explore_newton_iterations, 1, 100, "-",
        "Newton iterations a coarse step may take");
  visit("goal_extends", s.goal_extends, 0, 1000000, "-",
        "extensions an attempt spends, one in four, on pulling the rod out of the goal: where it comes by "
        "are aims");
  visit("attempt_extends", s.attempt_extends, 1, 1000000000, "-",
        "extensions of the first attempts; later ones have 1, 2, 4 ... times as many (Luby's sequence)");
  visit("failure_penalty", s.failure_penalty, 0.0, 1000.0, "-",
        "what each failed growth adds to a state's distance as the tree sees it, in multiples of it");
  visit("along_share", s.along_share, 0.0, 1.0, "-",
        "share of growths that pull or push an end along its own tangent; the others are Algorithm 1's");
  visit("sample_moment", s.sample_moment, 0.0, 100.0, "EI/L", "half-width of the sampling box of a, moments");
  visit("sample_force", s.sample_force, 0.0, 1000.0, "EI/L^2", "half-width of the sampling box of a, forces");
}

struct Scenario {
  std::string name, summary;
  RodProperties rod;
  Environment environment;
  GripperLimits grippers;
  SimulationSettings simulation;
  std::optional<Placement> start;  // needs pose and wrench, or both grippers
  std::optional<Pose> start_pose;  // start.pose if there is one, even without a wrench
  std::optional<Goal> goal;
  PlannerSettings planner;

  std::filesystem::path file;  // where it was read (absolute, normalised)
  std::string sha256;          // of the file's bytes

  // Kept so that toJson writes the file's own form; exactly one is set.
  struct Moduli {
    double young_modulus, shear_modulus;  // Pa
    std::optional<double> poisson_ratio;
    double shear_correction = 1.0;
  };
  std::optional<Moduli> moduli;

  /// The mesh's path, resolved against the scenario's folder.
  [[nodiscard]] std::filesystem::path meshPath(const MeshReference& mesh) const;
};

/// Reads and checks a scenario file. Throws InputError: file, line, key, what is wrong, the nearest valid
/// key.
[[nodiscard]] Scenario readScenario(const std::filesystem::path& file);
/// The same from text; `file` is what messages and relative mesh paths refer to. Sets sha256 of the text.
[[nodiscard]] Scenario parseScenario(const std::string& text, const std::filesystem::path& file);
/// The same from JSON that is part of another document; `where` names it in messages ("out/solution.json:
/// scenario"). Leaves `file` and `sha256` empty.
[[nodiscard]] Scenario scenarioFromJson(const nlohmann::json& json, const std::string& where);
/// The scenario with every default filled in, in the scenario format; parseScenario(toJson(s).dump()) gives s
/// back, every number bit for bit.
[[nodiscard]] nlohmann::ordered_json toJson(const Scenario& scenario);
/// {position_m: [x, y, z], orientation_wxyz: [w, x, y, z]}
[[nodiscard]] nlohmann::ordered_json toJson(const Pose& pose);

/// Reads {"controls": [...]}: times ascending without gaps from 0, held ends allowed by `grippers`, `moving`
/// held or null.
[[nodiscard]] std::vector<Control> readControls(const std::filesystem::path& file,
                                                const GripperLimits& grippers);
/// The list alone, from JSON that is part of another document. Judges types and poses, not whether the
/// controls agree with each other or with a scenario. `where` as above.
[[nodiscard]] std::vector<Control> controlsFromJson(const nlohmann::json& list, const std::string& where);
[[nodiscard]] nlohmann::ordered_json toJson(const Control& control);

}  // namespace tendril
