/// Rods pulled through tubes hardly wider than they are: do they pass, stick for a physical reason, or jam?
#pragma once

#include "dynamics/scenes.h"

namespace tendril::passages {

inline constexpr double kFrom = 0.05, kLong = 0.5;  // where the tube begins and how long it is, L
inline constexpr double kTubeRadius = 1.2;          // of r, inscribed

/// One way of pulling.
struct Pull {
  double bend = 0;  // rad, what a bent tube turns by over its length; 0: straight
  double friction = 0;
  double force = 1, speed = 1;  // times 200 EI/L^2 and 1 L/s
  double time_step = 0.02;      // s
  int elements = 20;
  double contact_distance = 0.1;  // of r
};

/// The line along which the gripper is led: x, then the tube's axis, then on straight.
struct Way {
  double bend;

  [[nodiscard]] Pose at(double s) const {
    if (bend == 0 || s <= kFrom) return {Quaternion::Identity(), {s, 0, 0}};
    const double radius = kLong / bend, turn = bend * std::min(s - kFrom, kLong) / kLong;
    const Quaternion rotation = expSO3({0, 0, turn});
    const Vector3 on_arc(kFrom + radius * std::sin(turn), radius * (1 - std::cos(turn)), 0);
    return {rotation, on_arc + rotation * Vector3(std::max(0.0, s - kFrom - kLong), 0, 0)};
  }
  /// Where along the way the point is.
  [[nodiscard]] double place(const Vector3& p) const {
    if (bend == 0 || p.x() <= kFrom) return p.x();
    const double radius = kLong / bend;
    const double turn = std::atan2(p.x() - kFrom, radius - p.y());
    if (turn <= bend) return kFrom + radius * turn;
    const Pose end = at(kFrom + kLong);
    return kFrom + kLong + (end.rotation.conjugate() * (p - end.position)).x();
  }
};

/// The tube around the way, of 24 faces and rings 0.02 L apart; its bend is a polygon whose inside is as
/// wide.
inline Obstacles tubeAround(const Way& way, double rod_radius) {
  constexpr int kSides = 24;
  const int rings = way.bend == 0 ? 1 : static_cast<int>(kLong / 0.02);
  const double corner = kTubeRadius * rod_radius / std::cos(std::numbers::pi / kSides);
  TriangleMesh mesh;
  for (int i = 0; i <= rings; ++i) {
    const Pose axis = way.at(kFrom + kLong * i / rings);
    for (int k = 0; k < kSides; ++k) {
      const double angle = 2 * std::numbers::pi * k / kSides;
      mesh.vertices.emplace_back(axis * (corner * Vector3(0, std::cos(angle), std::sin(angle))));
    }
  }
  for (int i = 0; i < rings; ++i)
    for (int k = 0; k < kSides; ++k) {
      const int a = i * kSides + k, b = i * kSides + (k + 1) % kSides;
      mesh.faces.push_back({a, a + kSides, b});
      mesh.faces.push_back({b, a + kSides, b + kSides});
    }
  return scenes::obstaclesOf({mesh});
}

enum class Outcome { passed, sticks, jams };

struct Passage {
  Outcome outcome = Outcome::jams;
  double reached = 0;  // of the way that carries the first node out of the tube
  std::int64_t steps = 0, stalls = 0;
  double iterations = 0;  // per step
  // Of a rod that stands still: the gripper's pull, what it needs against contacts and friction, and what
  // friction could bear at most, N over the gripper's largest force.
  double pull = 0, residual = 0, friction = 0, friction_limit = 0;
};

/// Pulls a rod of L = 1 m, r = 0.01 m by its last end through the tube, its first end free.
inline Passage pullThrough(const Pull& pull) {
  Scenario s = scenes::rodScenario(5e7, pull.elements);
  s.simulation.contact_distance = pull.contact_distance * s.rod.radius;
  s.simulation.time_step = pull.time_step;
  s.environment.friction = pull.friction;
  s.grippers.max_force *= pull.force, s.grippers.max_torque *= pull.force;
  s.grippers.max_speed = pull.speed;
  s.grippers.max_turn = 4 * pull.speed;
  const Way way{pull.bend};
  const Obstacles tube = tubeAround(way, s.rod.radius);
  const RodModel model(s, tube);
  RodState state = RodState::atRest(scenes::straight({Quaternion::Identity(), {-1, 0, 0}}, 1, pull.elements));
  RodWorkspace workspace;
  const double out = kFrom + kLong + 1.05, travel = pull.speed * pull.time_step;
  const double longest = 4 * out / pull.speed + 1;

  Passage result;
  std::int64_t still = 0, iterations = 0;
  StepReport report;
  const std::int64_t steps = static_cast<std::int64_t>(longest / pull.time_step);
  const std::int64_t patience =
      static_cast<std::int64_t>(std::max(0.3 / pull.speed, 20 * pull.time_step) / pull.time_step);
  while (result.steps < steps && still < patience) {
    const double place = way.place(state.nodes.back().position);
    std::array<GripperGoal, 2> goals;
    goals[1] = {true, true,
                approach(state.nodes.back(), way.at(place + travel), model.grippers, pull.time_step)};
    const RodShape before = state.nodes;
    report = step(model, goals, state, workspace);
    ++result.steps, iterations += report.iterations;
    result.stalls += report.status == StepReport::Status::stalled;
    still = maxNodeDistance(before, state.nodes) < 0.02 * travel ? still + 1 : 0;
    if (way.place(state.nodes.front().position) > kFrom + kLong) {
      result.outcome = Outcome::passed;
      break;
    }
  }
  result.iterations = static_cast<double>(iterations) / static_cast<double>(result.steps);
  result.reached = (way.place(state.nodes.front().position) + 1) / (kFrom + kLong + 1);
  if (result.outcome == Outcome::passed) return result;

  // It sticks if the rod as a whole is in balance and friction is what holds it. The model keeps every
  // friction force within Coulomb's cone.
  const Quantities q = measure(model, state, workspace);
  Vector3 sum = q.gripper_force[1];
  for (const ContactForce& c : q.contacts)
    sum += c.force, result.friction_limit += pull.friction * c.force.norm();
  for (const ContactForce& f : q.friction) sum += f.force, result.friction += f.force.norm();
  const double unit = model.grippers.max_force;
  result.pull = q.gripper_force[1].norm() / unit, result.residual = sum.norm() / unit;
  result.friction /= unit, result.friction_limit /= unit;
  if (result.residual < 0.05 && result.friction > 0.8 * result.pull) result.outcome = Outcome::sticks;
  return result;
}

}  // namespace tendril::passages
