/// Experiments whose outcome is known from theory; tests/dynamics/validation_test.cpp does some of them,
/// bench/validation.cpp all of them and more.
#pragma once

#include <algorithm>
#include <functional>

#include "dynamics/cosserat.h"
#include "dynamics/scenes.h"

namespace tendril::experiments {

using Goals = std::array<GripperGoal, 2>;

inline const Obstacles& nothing() {
  static const Obstacles none = scenes::nothing();
  return none;
}

/// Every k-th node.
inline RodShape thinned(const RodShape& shape, int elements) {
  const std::size_t every = (shape.size() - 1) / static_cast<std::size_t>(elements);
  RodShape out;
  for (std::size_t i = 0; i < shape.size(); i += every) out.push_back(shape[i]);
  return out;
}

/// A round rod with L = 1 m, nu = 0.4, and what settles it quickly: no inertia, hardly any drag, clamps that
/// give way by nothing that matters. `gravity` is along -z.
inline Scenario settling(double young_modulus, double radius, int elements, double gravity) {
  Scenario s;
  s.rod.radius = radius, s.rod.elements = elements;
  s.rod.c = stiffnessOfRoundRod(young_modulus, young_modulus / 2.8, radius);
  s.environment.gravity = {0, 0, -gravity};
  s.simulation.inertia = false, s.simulation.time_step = 0.5;
  s.simulation.drag = 0.01, s.simulation.stiffness_damping = 0;
  s.simulation.contact_distance = 0.1 * radius;
  s.grippers.max_force = s.grippers.max_torque = 1e3 * s.rod.bendingStiffness();
  return s;
}

inline Goals held(const std::optional<Pose>& first, const std::optional<Pose>& last) {
  Goals goals;
  if (first) goals[0] = {true, false, *first};
  if (last) goals[1] = {true, false, *last};
  return goals;
}

/// Steps until no node moves by more than `still` [L]; the number of steps, or `most`.
inline int settle(const RodModel& model, const Goals& goals, RodShape& shape, int most = 2000,
                  double still = 1e-11) {
  RodState state = RodState::atRest(shape);
  RodWorkspace workspace;
  int steps = 0;
  while (steps < most) {
    const RodShape before = state.nodes;
    step(model, goals, state, workspace);
    ++steps;
    if (maxNodeDistance(before, state.nodes) < still * model.rod.length) break;
  }
  shape = state.nodes;
  return steps;
}

/// A rod a little out of shape, between its ends, by smooth waves of `size` [m] in all directions; the frames
/// turn with the centreline.
inline RodShape disturbed(const RodShape& rest, double size) {
  RodShape shape = rest;
  Random random(1);
  const double last = static_cast<double>(shape.size() - 1);
  for (int wave = 1; wave <= 4; ++wave) {
    const Vector3 d = size * Vector3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    for (std::size_t i = 1; i + 1 < shape.size(); ++i)
      shape[i].position += std::sin(wave * std::numbers::pi * static_cast<double>(i) / last) * d;
  }
  for (std::size_t i = 1; i + 1 < shape.size(); ++i)
    shape[i].rotation = (Quaternion::FromTwoVectors(rest[i + 1].position - rest[i - 1].position,
                                                    shape[i + 1].position - shape[i - 1].position) *
                         shape[i].rotation)
                            .normalized();
  return shape;
}

/// Halves [low, high] until it is narrower than `width` times its middle: `fails(low)` is false,
/// `fails(high)` true.
inline std::pair<double, double> bracket(double low, double high, double width,
                                         const std::function<bool(double)>& fails) {
  while (high - low > width * 0.5 * (low + high)) {
    const double middle = 0.5 * (low + high);
    (fails(middle) ? high : low) = middle;
  }
  return {low, high};
}

/// Whether a small disturbance of a rod at rest grows. Without inertia the nodes' motion in a step only ever
/// falls where it rests stably; where it does not, its least is followed by more. `goals` says what the
/// grippers do in a step that begins with a shape.
inline bool disturbanceGrows(RodModel model, const std::function<Goals(const RodShape&)>& goals,
                             const RodShape& rest) {
  model.newton.tolerance = 1e-11;
  constexpr double kNothing = 3e-11;  // L; smaller motions are those that Newton's tolerance leaves
  RodState state = RodState::atRest(disturbed(rest, 1e-6));
  RodWorkspace workspace;
  double least = std::numeric_limits<double>::infinity(), now = 0;
  for (int k = 1; k <= 5000; ++k) {
    const RodShape before = state.nodes;
    step(model, goals(before), state, workspace);
    now = maxNodeDistance(before, state.nodes);
    if (now > 10 * least) return true;
    if (now < kNothing) return false;
    if (k > 5) least = std::min(least, now);  // the stiff modes are gone, and what lags a step has settled
  }
  return now > least;
}
inline bool disturbanceGrows(const RodModel& model, const Goals& goals, const RodShape& rest) {
  return disturbanceGrows(
      model, [&](const RodShape&) { return goals; }, rest);
}

/// The root mean square distance of the nodes from the plane nearest to them.
inline double distanceFromPlane(const RodShape& shape) {
  Eigen::MatrixXd p(3, shape.size());
  for (std::size_t i = 0; i < shape.size(); ++i) p.col(static_cast<Eigen::Index>(i)) = shape[i].position;
  const Vector3 mean = p.rowwise().mean();
  p.colwise() -= mean;
  const Matrix3 spread = p * p.transpose() / static_cast<double>(shape.size());
  return std::sqrt(std::max(0.0, Eigen::SelfAdjointEigenSolver<Matrix3>(spread).eigenvalues()[0]));
}

// ---------------------------------------------------------------------------------------------- hanging rods

/// Gravity at which rho A g L^3 / EI is `gamma`.
inline double gravityFor(const RodProperties& rod, double gamma) {
  const double mass = rod.density * std::numbers::pi * rod.radius * rod.radius;
  return gamma * rod.bendingStiffness() / (mass * std::pow(rod.length, 3));
}

/// A rod of r = 1 mm, clamped horizontally at its first node, at rest under its weight.
inline RodShape cantilever(double gamma, int elements, Scenario* used = nullptr) {
  Scenario s = settling(1e8, 0.001, elements, 0);
  s.environment.gravity.z() = -gravityFor(s.rod, gamma);
  s.simulation.drag = 1e-3 * -s.environment.gravity.z();  // as slow for a heavy rod as for a light one
  RodModel model(s, nothing());
  model.newton.tolerance = 1e-10;
  RodShape shape = scenes::straight({}, 1, elements);
  settle(model, held(Pose{}, std::nullopt), shape);
  if (used) *used = s;
  return shape;
}

/// A rod of curvature `curvature` [1/L] at rest that hangs from a clamp, its tangent there downward.
inline Scenario curlScenario(double curvature, double gamma, int elements) {
  Scenario s = settling(1e8, 0.001, elements, 0);
  s.environment.gravity.z() = -gravityFor(s.rod, gamma);
  s.simulation.drag = 0.2;
  s.rod.rest_curvature = {{0, 0, curvature}};
  return s;
}
inline Pose curlClamp() { return {expSO3({0, std::numbers::pi / 2, 0}), Vector3::Zero()}; }

/// Its shape at rest in the plane of its curvature (y, z): from its natural arc on, as the weight comes
/// little by little. Where that is unstable it stays planar because nothing disturbs it.
inline RodShape planarCurl(const Scenario& s) {
  RodModel model(s, nothing());
  model.simulation.drag = 1e-3, model.newton.tolerance = 1e-9;
  const double h = s.rod.elementLength();
  Vector6 along = Vector6::Zero();
  along[2] = h * s.rod.restCurvature(0).z(), along[3] = h;
  RodShape shape = {curlClamp()};
  for (int k = 0; k < s.rod.elements; ++k) shape.push_back(shape.back() * expSE3(along));
  const auto flat = [&] {  // what rounding puts out of the plane
    for (Pose& q : shape) {
      q.position.x() = 0;
      const Vector3 tangent = q.rotation * Vector3::UnitX();
      q.rotation = curlClamp().rotation * expSO3({0, 0, std::atan2(tangent.y(), -tangent.z())});
    }
  };
  for (int part = 1; part <= 200; ++part) {
    model.gravity.z() = s.environment.gravity.z() * std::min(1.0, part / 40.0);
    const RodShape before = shape;
    settle(model, held(curlClamp(), std::nullopt), shape, 5, 1e-12);
    flat();
    if (part > 40 && maxNodeDistance(before, shape) < 1e-11) break;
  }
  return shape;
}

/// Whether that shape leaves its plane.
inline bool curlLeavesItsPlane(double curvature, double gamma, int elements) {
  const Scenario s = curlScenario(curvature, gamma, elements);
  return disturbanceGrows(RodModel(s, nothing()), held(curlClamp(), std::nullopt), planarCurl(s));
}

// ---------------------------------------------------------------------------------------------- in motion

/// A rod with L = 1 m, r = 0.01 m, E = 1e8, without any damping.
inline Scenario undamped(Scheme scheme, double dt, int elements) {
  Scenario s = scenes::rodScenario(1e8, elements);
  s.simulation = {.inertia = true,
                  .scheme = scheme,
                  .time_step = dt,
                  .drag = 0,
                  .stiffness_damping = 0,
                  .contact_distance = 0.001};
  s.grippers.max_force = s.grippers.max_torque = 1e3 * s.rod.bendingStiffness();
  return s;
}

/// An element's stiffness: to its shear force it gives way by its bending within, too, the less the tauter it
/// is (src/tendril/dynamics/README.md, section 2).
inline Vector6 elementStiffness(const RodProperties& rod, double stretch) {
  const double h2 = rod.elementLength() * rod.elementLength(), tension = rod.c[3] * std::max(0.0, stretch);
  Vector6 k = rod.c;
  k[4] = 1 / (1 / rod.c[4] + h2 / (12 * rod.c[2] + 1.2 * h2 * tension));
  k[5] = 1 / (1 / rod.c[5] + h2 / (12 * rod.c[1] + 1.2 * h2 * tension));
  return k;
}

/// Elastic, kinetic and potential energy [J].
inline double energyOf(const Scenario& s, const RodState& state) {
  const RodProperties& rod = s.rod;
  const double h = rod.elementLength();

  double sum = 0;
  for (std::size_t i = 0; i < state.nodes.size(); ++i) {
    const bool is_end = i == 0 || i + 1 == state.nodes.size();
    const double mass = rod.density * std::numbers::pi * rod.radius * rod.radius * h * (is_end ? 0.5 : 1);
    const Vector3 w = state.velocities[i].head<3>();
    const Vector3 rotary = rod.radius * rod.radius / 4 * Vector3(2, 1, 1);
    const Vector3 inside = (i == 0 ? h / 6 : is_end ? -h / 6 : 0) * Vector3::UnitX();
    const Vector3 v = state.velocities[i].tail<3>() + state.nodes[i].rotation * w.cross(inside);
    sum += mass / 2 * (v.squaredNorm() + rotary.dot(w.cwiseAbs2()));
    sum -= mass * s.environment.gravity.dot(state.nodes[i] * inside);
    if (i + 1 == state.nodes.size()) break;
    Vector6 u = logSE3(state.nodes[i].inverse() * state.nodes[i + 1]) / h;
    u[3] -= 1;
    sum += h / 2 * elementStiffness(rod, u[3]).dot(u.cwiseAbs2());
  }
  return sum;
}

/// A rod of r = 1 cm, held at both ends under gravity, when its ends have been brought to half its length in
/// two hundred steps and turned against each other by half a turn, and all is at rest.
inline RodShape broughtTogether(double young_modulus, int elements) {
  Scenario s = scenes::rodScenario(young_modulus, elements);
  s.environment.gravity = {0, 0, -9.81};
  s.grippers.max_force = s.grippers.max_torque = 1e3 * s.rod.bendingStiffness();
  RodModel model(s, nothing());
  RodState state = RodState::atRest(scenes::straight({}, 1, elements));
  RodWorkspace workspace;
  constexpr int kSteps = 200;
  Goals goals;
  for (int k = 1; k <= kSteps; ++k) {
    const double part = static_cast<double>(k) / kSteps;
    goals = held(Pose{}, Pose{expSO3({std::numbers::pi * part, 0, 0}), {1 - 0.5 * part, 0, 0}});
    step(model, goals, state, workspace);
  }
  model.simulation.inertia = false, model.simulation.time_step = 0.5, model.simulation.drag = 0.02;
  model.simulation.stiffness_damping = 0, model.newton.tolerance = 1e-9;
  settle(model, goals, state.nodes, 5000);
  return state.nodes;
}

/// A rod whose last end is turned `turns` times in four seconds, then brought to 0.4 L from the first in four
/// more, then held for two. `watch` sees every way point with its time.
inline StepReport twistAndSlacken(double turns, bool self_contact, int elements,
                                  const std::function<void(double, const RodShape&)>& watch) {
  Scenario s = scenes::rodScenario(5e7, elements);
  s.rod.self_contact = self_contact;
  s.simulation.contact_distance = 0.1 * s.rod.radius;
  s.grippers.max_force = s.grippers.max_torque = 1e3 * s.rod.bendingStiffness();
  s.grippers.max_turn = 20;
  const RodModel model(s, nothing());
  RodState state = RodState::atRest(disturbed(scenes::straight({}, 1, elements), 1e-4));
  RodWorkspace workspace;
  StepReport report;
  for (int k = 1; k <= 500; ++k) {
    const double twist = 2 * std::numbers::pi * turns * std::min(1.0, k / 200.0);
    const double nearer = 0.6 * std::clamp(k / 200.0 - 1, 0.0, 1.0);
    report =
        step(model, held(Pose{}, Pose{expSO3({twist, 0, 0}), {1 - nearer, 0, 0}}), state, workspace, true);
    for (const RodShape& way : workspace.wayPoints()) watch(k * s.simulation.time_step, way);
  }
  return report;
}

// ---------------------------------------------------------------------------------------------- buckling

/// A rod bent into a closed circle and twisted by `twist` [rad] in all, both ends held together.
inline RodShape twistedRing(double twist, int elements) {
  RodShape shape;
  const double radius = 1 / (2 * std::numbers::pi);
  for (int i = 0; i <= elements; ++i) {
    const double t = static_cast<double>(i) / elements, angle = 2 * std::numbers::pi * t;
    shape.push_back({(expSO3({0, 0, angle}) * expSO3({twist * t, 0, 0})).normalized(),
                     {radius * std::sin(angle), radius * (1 - std::cos(angle)), 0}});
  }
  return shape;
}

inline bool ringBuckles(double twist, int elements) {
  Scenario s = settling(1e8, 0.001, elements, 0);
  s.simulation.drag = 20;
  const RodShape ring = twistedRing(twist, elements);
  return disturbanceGrows(RodModel(s, nothing()), held(ring.front(), ring.back()), ring);
}

/// Whether a straight rod, clamped at both ends, buckles when its last end is turned by `twist` [rad].
inline bool straightRodBuckles(double twist, int elements) {
  Scenario s = settling(1e8, 0.001, elements, 0);
  s.simulation.drag = 20;
  RodShape shape = scenes::straight({}, 1, elements);
  for (std::size_t i = 0; i < shape.size(); ++i)
    shape[i].rotation = expSO3({twist * static_cast<double>(i) / elements, 0, 0});
  return disturbanceGrows(RodModel(s, nothing()), held(shape.front(), shape.back()), shape);
}

/// A flat section: EI = 1 N m^2 about z, GJ = 1 N m^2, and so stiff else that the load alone does nothing.
inline Scenario flatSection(int elements) {
  Scenario s = settling(1e8, 0.001, elements, 0);
  s.rod.c << 1, 1e4, 1, 1e7, 1e7, 1e7;
  s.grippers.max_force = 1e4, s.grippers.max_torque = 1e4;
  s.simulation.drag = 5 / (s.rod.density * std::numbers::pi * 1e-6);
  return s;
}

/// Whether a cantilever with that section, its stiff way upright, bends sideways under a uniform load
/// [sqrt(EI GJ)/L^3].
inline bool uniformLoadBuckles(double load, int elements) {
  Scenario s = flatSection(elements);
  s.environment.gravity.z() = -load / (s.rod.density * std::numbers::pi * 1e-6);
  return disturbanceGrows(RodModel(s, nothing()), held(Pose{}, std::nullopt),
                          scenes::straight({}, 1, elements));
}

/// The same for a load at the tip [sqrt(EI GJ)/L^2]: a gripper that pulls at its limit toward something far
/// below, and whose frame goes along with the tip's.
inline bool tipLoadBuckles(double load, int elements) {
  Scenario s = flatSection(elements);
  s.grippers.max_force = load, s.grippers.max_torque = 0.05;
  s.grippers.max_speed = s.grippers.max_turn = 1e6;
  const auto pull = [](const RodShape& shape) {
    Goals goals = held(Pose{}, std::nullopt);
    goals[1] = {true, true, {shape.back().rotation, {1, 0, -1e5}}};
    return goals;
  };
  return disturbanceGrows(RodModel(s, nothing()), pull, scenes::straight({}, 1, elements));
}

// ---------------------------------------------------------------------------------------------- friction

/// How fast a rod of 20 elements moves down a slope of angle `slope` after `seconds`, friction coefficient
/// `mu` [m/s]; `across`: it lies across the slope.
inline double speedOnSlope(double slope, double mu, double seconds, bool across, double dt = 0.01) {
  Scenario s = scenes::rodScenario(5e7, 20);
  s.environment.friction = mu;
  s.environment.gravity = {0, 0, -9.81};
  s.simulation.time_step = dt, s.simulation.drag = 0;
  s.simulation.contact_distance = 0.1 * s.rod.radius;
  const Obstacles ground = scenes::obstaclesOf({scenes::block({-9, -9, -1}, {9, 9, 0})});
  RodModel model(s, ground);
  const Pose start = {expSO3({0, 0, across ? std::numbers::pi / 2 : 0}),
                      {0, 0, s.rod.radius + 0.5 * s.simulation.contact_distance}};
  RodState state = RodState::atRest(scenes::straight(start, 1, 20));
  RodWorkspace workspace;
  model.simulation.inertia = false;  // it comes to rest on the level ground
  for (int k = 0; k < 100; ++k) step(model, {}, state, workspace);
  model.simulation.inertia = true;
  model.gravity = 9.81 * Vector3(std::sin(slope), 0, -std::cos(slope));
  state = RodState::atRest(state.nodes);
  for (int k = 0; k < static_cast<int>(std::lround(seconds / dt)); ++k) step(model, {}, state, workspace);
  Vector3 mean = Vector3::Zero();
  for (const Vector6& v : state.velocities)
    mean += v.tail<3>() / static_cast<double>(state.velocities.size());
  return mean.x();
}

/// The force [N, world] in an element that carries no damping.
inline Vector3 forceIn(const RodProperties& rod, const RodShape& shape, std::size_t element) {
  const double h = rod.elementLength();
  const Pose &a = shape[element], &b = shape[element + 1];
  Vector6 u = logSE3(a.inverse() * b) / h;
  const Pose middle = a * expSE3(0.5 * h * u);
  u[3] -= 1;
  return middle.rotation * u.cwiseProduct(elementStiffness(rod, u[3])).tail<3>();
}

/// A cylinder of radius `radius` about the y axis.
inline TriangleMesh drum(double radius, double width, int sides) {
  TriangleMesh mesh = scenes::tube(radius, -width / 2, width / 2, sides);
  for (Vector3& v : mesh.vertices) v = Vector3(v.y(), v.x(), v.z());
  return mesh;
}

struct Capstan {
  double low, high;  // forces in the two free spans, N
  double angle;      // between them, rad
  RodShape shape;
};
/// A rope over a drum of radius 0.1 m: the first end is pulled with a constant force, the last drawn away
/// slowly. The free spans are at -wrap/2 and +wrap/2 from level. `bending` is EI in T r_d^2.
inline Capstan capstan(double mu, double wrap, int elements, int sides, double bending = 0.003,
                       double dt = 0.01) {
  constexpr double kRadius = 0.1, kForce = 1, kSpeed = 0.1;
  Scenario s = settling(1e8, 0.004, elements, 0);
  const double centre = kRadius + s.rod.radius, ei = bending * kForce * centre * centre;
  s.rod.c << ei / 1.4, ei, ei, 1e3, 400, 400;
  s.environment.friction = mu;
  s.simulation.time_step = dt, s.simulation.drag = 0.01;
  s.simulation.contact_distance = 0.2 * s.rod.radius;
  s.grippers.max_force = kForce, s.grippers.max_torque = 0.1 * ei;
  s.grippers.max_speed = 1, s.grippers.max_turn = 100;
  const Obstacles obstacles = scenes::obstaclesOf({drum(kRadius, 0.2, sides)});
  RodModel model(s, obstacles);
  model.newton = {.max_iterations = 200, .tolerance = 1e-9};
  // Straight, round, straight, at the distance where contact begins.
  const double around = centre + 0.9 * s.simulation.contact_distance, arc = around * wrap;
  const double span = 0.5 * (1 - arc);
  const Vector3 first_pull(-std::cos(wrap / 2), 0, -std::sin(wrap / 2)),
      last_pull(std::cos(wrap / 2), 0, -std::sin(wrap / 2));
  RodShape shape;
  for (int i = 0; i <= elements; ++i) {
    const double at = static_cast<double>(i) / elements - span;          // along the arc
    const double angle = std::clamp(at / around, 0.0, wrap) - wrap / 2;  // from the top, toward +x
    const Vector3 tangent(std::cos(angle), 0, -std::sin(angle)), out(std::sin(angle), 0, std::cos(angle));
    const double beyond = at < 0 ? at : std::max(0.0, at - arc);
    shape.push_back({expSO3({0, angle, 0}), around * out + beyond * tangent});
  }
  RodState state = RodState::atRest(shape);
  RodWorkspace workspace;
  Goals goals = held(shape.front(), shape.back());
  Capstan result{0, 0, 0, {}};
  int counted = 0;
  const int steps = static_cast<int>(std::lround(1.0 / dt));
  for (int k = 0; k < steps; ++k) {
    goals[0] = {true, true, {state.nodes.front().rotation, 1e4 * first_pull}};
    goals[1].pose.position = shape.back().position + kSpeed * (k + 1) * dt * last_pull;
    step(model, goals, state, workspace);
    if (k < steps / 2) continue;
    const auto force = [&](std::size_t i) {  // world
      return forceIn(s.rod, state.nodes, i);
    };
    const Vector3 a = force(2), b = force(static_cast<std::size_t>(elements) - 3);
    result.low += a.norm(), result.high += b.norm();
    result.angle += std::acos(std::clamp(a.dot(b) / (a.norm() * b.norm()), -1.0, 1.0));
    ++counted;
  }
  result.low /= counted, result.high /= counted, result.angle /= counted;
  result.shape = state.nodes;
  return result;
}

}  // namespace tendril::experiments
