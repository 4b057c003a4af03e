/// What is measured of a step, against the statics, closed forms, balances of force, moment and energy, and
/// brute force.
#include "tendril/quantities.h"

#include <gtest/gtest.h>

#include "dynamics/scenes.h"
#include "tendril/statics.h"

namespace tendril {
namespace {

using namespace scenes;

/// The scenario of a rod that settles, with grippers that hardly give.
Scenario settlingScenario(double young_modulus, int elements) {
  Scenario s = rodScenario(young_modulus, elements);
  s.simulation.inertia = false;
  s.simulation.drag = 0.1;
  s.simulation.time_step = 0.5;
  s.grippers.max_force = 1e6, s.grippers.max_torque = 1e6;
  return s;
}

double massOf(const RodProperties& rod) {
  return rod.density * std::numbers::pi * rod.radius * rod.radius * rod.length;
}

/// A rod on its way; `control` is carried out from where it is.
struct Motion {
  RodModel model;
  RodState state;
  RodWorkspace workspace;

  Motion(const Scenario& s, const Obstacles& o, RodShape start)
      : model(s, o), state(RodState::atRest(std::move(start))) {
    model.newton = {.max_iterations = 200, .tolerance = 1e-9};
  }
  Quantities now() { return measure(model, state, workspace); }
  /// Until nothing moves more than 1e-10 L in a step.
  Quantities settle(const Control& control) {
    ControlRunner runner(model, control, state);
    for (int k = 0; k < 2000; ++k) {
      const RodShape before = state.nodes;
      runner.advance(state, workspace);
      if (maxNodeDistance(before, state.nodes) < 1e-10) return now();
    }
    ADD_FAILURE() << "it does not settle";
    return now();
  }
};

Control holding(bool first, bool last) {
  Control control;
  control.held = {first, last};
  return control;
}

template <class List>
Vector3 sum(const List& contacts) {
  Vector3 out = Vector3::Zero();
  for (const auto& c : contacts) out += c.force;
  return out;
}

TEST(Quantities, HangingRodPullsAtItsGripperWithItsWeight) {
  Scenario s = settlingScenario(5e7, 20);
  s.environment.gravity = {0, 0, -9.81};
  const Obstacles o = nothing();
  const double weight = 9.81 * massOf(s.rod);
  Motion motion(s, o, straight({expSO3({0, std::numbers::pi / 2, 0}), Vector3::Zero()}, 1, 20));
  const Quantities q = motion.settle(holding(true, false));
  EXPECT_LT((q.gripper_force[0] - Vector3(0, 0, weight)).norm(), 1e-6 * weight);
  EXPECT_LT(q.gripper_moment[0].norm(), 1e-6 * weight);
  EXPECT_EQ(q.gripper_force[1], Vector3::Zero());  // nobody holds it
  // Tension is the weight below: an element's, which it carries between its nodes.
  for (int k = 0; k < 20; ++k) {
    const Vector3& n = q.internal_force[static_cast<std::size_t>(k)];
    EXPECT_NEAR(n.x(), weight * (1 - (k + 0.5) / 20), 2e-3 * weight);
    EXPECT_NEAR(q.strain[static_cast<std::size_t>(k)].x(), n.x() / s.rod.c[3], 1e-12);
  }
  EXPECT_FALSE(q.clearance);
}

TEST(Quantities, WrenchesAndEnergyOfAHeldRodAreThoseOfTheStatics) {
  // In the middles of the elements mu(t) = Ad_q(t)^T a; they converge with the square of the element length.
  Vector6 a;
  a << 0.3, 0.5, 0.9, -1.5, 1.0, 0.6;
  const Pose base{expSO3({0.3, -0.4, 0.5}), {0.1, 0.2, 0.3}};
  const Obstacles o = nothing();
  double last_error = 0;
  for (const int elements : {20, 40}) {
    const Scenario s = settlingScenario(5e7, elements);
    Equilibrium rough, fine;
    ASSERT_EQ(EquilibriumIntegrator(s.rod).solve(base, a, rough), ChartStatus::equilibrium);
    ASSERT_EQ(EquilibriumIntegrator(withElements(s.rod, 2 * elements)).solve(base, a, fine),
              ChartStatus::equilibrium);
    ASSERT_EQ(fine.stability, Stability::stable);
    Motion motion(s, o, rough.nodes);
    const Quantities q = motion.settle(holding(true, true));
    const auto wrenchAt = [&](const Pose& node) -> Vector6 {
      return adjoint(base.inverse() * node).transpose() * a;
    };
    double error = 0;
    for (std::size_t k = 0; k < static_cast<std::size_t>(elements); ++k) {
      const Vector6 mu = wrenchAt(fine.nodes[2 * k + 1]);
      error = std::max({error, (q.internal_moment[k] - mu.head<3>()).norm() / a.head<3>().norm(),
                        (q.internal_force[k] - mu.tail<3>()).norm() / a.tail<3>().norm()});
    }
    EXPECT_LT(error, elements == 20 ? 8e-3 : 2e-3);
    if (elements == 40) {
      EXPECT_GT(last_error / error, 3.3);
    }
    last_error = error;

    // The first gripper holds against what lies beyond it, the last pulls what lies before it.
    const Vector6 mu = wrenchAt(rough.nodes.back());
    const Quaternion& end = rough.nodes.back().rotation;
    const double near = elements == 20 ? 8e-3 : 2e-3;
    EXPECT_LT((q.gripper_force[0] + base.rotation * a.tail<3>()).norm(), near * a.tail<3>().norm());
    EXPECT_LT((q.gripper_moment[0] + base.rotation * a.head<3>()).norm(), near * a.head<3>().norm());
    EXPECT_LT((q.gripper_force[1] - end * mu.tail<3>()).norm(), near * a.tail<3>().norm());
    EXPECT_LT((q.gripper_moment[1] - end * mu.head<3>()).norm(), near * a.head<3>().norm());

    EXPECT_NEAR(q.twist + q.bending + q.stretch + q.shear, fine.energy, near * fine.energy);
    EXPECT_GT(q.bending, q.twist);
    EXPECT_GT(q.twist, 100 * q.stretch);
  }
}

TEST(Quantities, ClampedCantileverCarriesTheWeightBeyondEverySection) {
  Scenario s = settlingScenario(1e8, 40);
  s.environment.gravity = {0, 0, -9.81};
  const Obstacles o = nothing();
  Motion motion(s, o, straight({}, 1, 40));
  const Quantities q = motion.settle(holding(true, false));
  const RodShape& nodes = motion.state.nodes;
  const Vector3 share = massOf(s.rod) / 40 * s.environment.gravity;  // the weight of an element
  const double force = 40 * share.norm(), moment = force / 2;
  for (std::size_t k = 0; k < 40; ++k) {
    // The weights of the half element and of the whole ones beyond, by their own middles.
    const auto along = [&](std::size_t i, double t) {
      const Vector6 step = t * logSE3(nodes[i].inverse() * nodes[i + 1]);
      return nodes[i] * expSE3(step);
    };
    const Pose middle = along(k, 0.5);
    Vector3 n = 0.5 * share, m = (along(k, 0.75).position - middle.position).cross(n);
    for (std::size_t i = k + 1; i < 40; ++i)
      n += share, m += (along(i, 0.5).position - middle.position).cross(share);
    EXPECT_LT((middle.rotation * q.internal_force[k] - n).norm(), 1e-3 * force) << k;
    EXPECT_LT((middle.rotation * q.internal_moment[k] - m).norm(), 1e-3 * moment) << k;
  }
  EXPECT_LT((q.gripper_force[0] + 40 * share).norm(), 1e-6 * force);
}

/// The masses that stand for the rod's, in the axes of their nodes: those of the ends sit h/6 inside.
struct NodeMass {
  double mass;
  Vector3 at;
};
std::vector<NodeMass> nodeMasses(const RodProperties& rod) {
  const double share = massOf(rod) / rod.elements, inside = rod.elementLength() / 6;
  std::vector<NodeMass> out(static_cast<std::size_t>(rod.elements) + 1, {share, Vector3::Zero()});
  out.front() = {share / 2, {inside, 0, 0}}, out.back() = {share / 2, {-inside, 0, 0}};
  return out;
}

/// The resultant force and moment about the origin of all that acts on the rod, inertia and drag left out.
struct Resultant {
  Vector3 force = Vector3::Zero(), moment = Vector3::Zero();
  double size = 0;  // N, of the forces in it
  void add(const Vector3& f, const Vector3& at) { force += f, moment += at.cross(f), size += f.norm(); }
};
Resultant resultant(const Scenario& s, const RodState& state, const Quantities& q) {
  Resultant out;
  const std::vector<NodeMass> masses = nodeMasses(s.rod);
  for (std::size_t i = 0; i < state.nodes.size(); ++i)
    out.add(masses[i].mass * s.environment.gravity, state.nodes[i] * masses[i].at);
  for (const End end : kBothEnds) {
    const auto e = static_cast<std::size_t>(end);
    out.add(q.gripper_force[e], endPose(state.nodes, end).position);
    out.moment += q.gripper_moment[e];
  }
  for (const ContactForce& c : q.contacts) out.add(c.force, c.position);
  for (const ContactForce& c : q.friction) out.add(c.force, c.position);
  return out;
}

TEST(Quantities, ForcesAndMomentsOnARodPressedOnAFloorBalance) {
  Scenario s = rodScenario(5e7, 30);
  s.environment.gravity = {0, 0, -9.81};
  s.environment.friction = 0.3;
  s.simulation.drag = 20;
  const Obstacles o = obstaclesOf({block({-2, -2, -1}, {2, 2, 0})});
  Motion motion(s, o, straight({Quaternion::Identity(), {-0.5, 0.1, 0.03}}, 1, 30));
  Control press = holding(true, true);
  press.moving = End::last;
  press.target = {expSO3({0, -0.5, 0}), {0.45, 0.1, 0.03}};
  const Quantities q = motion.settle(press);
  const Resultant all = resultant(s, motion.state, q);
  EXPECT_GT(sum(q.contacts).z(), 1);
  EXPECT_GT(all.size, 10);
  EXPECT_LT(all.force.norm(), 1e-6 * all.size);
  EXPECT_LT(all.moment.norm(), 1e-6 * all.size);
  for (const ContactForce& c : q.contacts) {
    EXPECT_NEAR(c.position.z(), 0, 1e-12);  // on the floor
    EXPECT_LT(c.force.head<2>().norm(), 1e-12 * c.force.norm());
    const auto node = static_cast<std::size_t>(std::lround(c.s * 30));
    EXPECT_LT((motion.state.nodes[node].position - c.position).head<2>().norm(), 1e-12);
  }
}

TEST(Quantities, ForcesOnARodInMotionAreItsChangeOfMomentumAndItsDrag) {
  Scenario s = rodScenario(5e7, 16);
  s.rod.self_contact = true;
  s.environment.gravity = {0, 0, -9.81};
  s.environment.friction = 0.3;
  const Obstacles o =
      obstaclesOf({block({-0.3, -0.3, -0.5}, {0.3, 0.3, -0.02}), block({0.45, -1, -1}, {0.5, 1, 1})});
  Motion motion(s, o, straight({Quaternion::Identity(), {-0.6, 0, 0.05}}, 1, 16));
  Random random(3);
  const double dt = s.simulation.time_step;
  const std::vector<NodeMass> masses = nodeMasses(s.rod);
  int balanced = 0, touching = 0, rubbing = 0;
  for (int k = 0; k < 12; ++k) {
    Control control = holding(k % 4 != 1, k % 4 != 0);
    control.moving = control.held[0] ? End::first : End::last;
    control.target = {random.rotation(),
                      {random.uniform(-0.4, 0.8), random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.05)}};
    ControlRunner runner(motion.model, control, motion.state);
    for (int i = 0; i < 30; ++i) {
      const RodState before = motion.state;
      if (runner.advance(motion.state, motion.workspace).status != StepReport::Status::converged) continue;
      const Quantities q = motion.now();
      Vector3 change = Vector3::Zero();
      for (std::size_t j = 0; j < masses.size(); ++j) {
        const auto& [mass, at] = masses[j];
        const Vector3 w = before.velocities[j].head<3>();
        const Vector3 v = before.velocities[j].tail<3>() + before.nodes[j].rotation * w.cross(at);
        const Vector3 v_now = (motion.state.nodes[j] * at - before.nodes[j] * at) / dt;
        change += mass * ((v_now - v) / dt + s.simulation.drag * v_now);
      }
      const Resultant all = resultant(s, motion.state, q);
      EXPECT_LT((all.force - change).norm(), 1e-5 * all.size) << k << " " << i;
      ++balanced, touching += !q.contacts.empty(), rubbing += sum(q.friction).norm() > 0.01;
      ASSERT_TRUE(q.clearance);
      EXPECT_NEAR(*q.clearance, bruteForceDistance(motion.state.nodes, o) - s.rod.radius, 1e-12);
    }
  }
  EXPECT_GT(balanced, 120);
  EXPECT_GT(touching, 50);
  EXPECT_GT(rubbing, 30);
}

/// A rod laid across an inclined plane, after it has come down on it.
Motion onASlope(const Scenario& s, const Obstacles& o) {
  Motion motion(s, o, straight({Quaternion::Identity(), {-0.5, 0, 0.0107}}, 1, 10));
  for (int k = 0; k < 50; ++k) step(motion.model, {}, motion.state, motion.workspace);
  return motion;
}

TEST(Quantities, FrictionIsCoulombsOnASlopeAndHoldsTheRodBelowItsAngle) {
  for (const bool slides : {true, false}) {
    const double angle = slides ? 0.6 : 0.2, mu = 0.3;
    Scenario s = rodScenario(5e7, 10);
    s.environment.friction = mu;
    s.environment.gravity = 9.81 * Vector3(0, std::sin(angle), -std::cos(angle));
    s.simulation.drag = 0;
    s.simulation.contact_distance = 0.001;
    const Obstacles o = obstaclesOf({block({-3, -3, -1}, {3, 30, 0})});
    const double weight = 9.81 * massOf(s.rod);
    Motion motion = onASlope(s, o);
    Quantities before = motion.now();
    for (int k = 0; k < 20; ++k) {
      step(motion.model, {}, motion.state, motion.workspace);
      Quantities q = motion.now();
      EXPECT_LE(sum(q.friction).norm(), mu * sum(before.contacts).norm() * (1 + 1e-9));
      for (const ContactForce& f : q.friction) {
        EXPECT_NEAR(f.force.z(), 0, 1e-12);
        EXPECT_LE(f.force.y(), 0);  // up the slope
      }
      if (slides) {
        EXPECT_NEAR(sum(q.friction).norm(), mu * sum(before.contacts).norm(), 1e-9);
      }
      before = std::move(q);
    }
    EXPECT_NEAR(sum(before.contacts).z(), weight * std::cos(angle), 1e-3 * weight);
    EXPECT_NEAR(-sum(before.friction).y(), slides ? mu * weight * std::cos(angle) : weight * std::sin(angle),
                1e-2 * weight);
  }
}

TEST(Quantities, RodBentToACircleHasTheBendRadiusLOverTwoPi) {
  const int elements = 40;
  Scenario s = rodScenario(5e7, elements);
  const Obstacles o = nothing();
  RodShape circle(elements + 1);
  for (int i = 0; i <= elements; ++i) {
    Vector6 xi;
    xi << 0, 0, 2 * std::numbers::pi, 1, 0, 0;
    circle[static_cast<std::size_t>(i)] = expSE3(xi * (static_cast<double>(i) / elements));
  }
  Motion motion(s, o, circle);
  ControlRunner(motion.model, holding(true, true), motion.state).advance(motion.state, motion.workspace);
  Quantities q = motion.now();
  ASSERT_TRUE(q.bend_radius);
  EXPECT_NEAR(*q.bend_radius, 1 / (2 * std::numbers::pi), 1e-3);  // the grippers give a little
  EXPECT_NEAR(q.internal_moment[20].z(), 2 * std::numbers::pi * s.rod.bendingStiffness(), 1e-2);

  // At rest in that shape it is bent as much, and carries nothing.
  s.rod.rest_curvature = {{0, 0, 2 * std::numbers::pi}};
  Motion easy(s, o, circle);
  ControlRunner(easy.model, holding(true, true), easy.state).advance(easy.state, easy.workspace);
  q = easy.now();
  EXPECT_NEAR(*q.bend_radius, 1 / (2 * std::numbers::pi), 1e-9);
  for (std::size_t k = 0; k < elements; ++k) {
    EXPECT_LT((q.curvature[k] - Vector3(0, 0, 2 * std::numbers::pi)).norm(), 1e-6);
    EXPECT_LT(q.internal_moment[k].norm(), 1e-6);
    EXPECT_LT(q.strain[k].norm(), 1e-6);
  }
}

TEST(Quantities, RodPulledPastWhatGuardsItsLengthHoldsItsGrippersInBalance) {
  // Beyond a stretch of 0.15 elements are guarded, with a stiffness of 10 EA/h at first and a wall at 0.24:
  // that adds to the force EA u the derivative of 5 EA e^2/(1 - e/0.09), e = u - 0.15.
  const Scenario s = settlingScenario(5e7, 20);
  const Obstacles o = nothing();
  const double ea = s.rod.c[3];
  const Pose base{expSO3({0.3, -0.4, 0.5}), {0.1, 0.2, 0.3}};
  Motion motion(s, o, straight(base, 1.2, 20));
  const Quantities q = motion.settle(holding(true, true));
  const double u = (motion.state.nodes.back().position - motion.state.nodes.front().position).norm() - 1;
  EXPECT_NEAR(u, 0.2, 1e-6);  // the clamps give a little
  const double e = u - 0.15, left = 1 - e / 0.09;
  const double force = u + 5 * (2 * e - e * e / 0.09) / (left * left);
  for (const Vector3& n : q.internal_force) EXPECT_LT((n - Vector3(force * ea, 0, 0)).norm(), 1e-5 * ea);
  EXPECT_LT((q.gripper_force[1] - base.rotation * Vector3(force * ea, 0, 0)).norm(), 1e-5 * ea);
  EXPECT_NEAR(q.stretch, (0.5 * u * u + 5 * e * e / left) * ea, 1e-5 * ea);
}

TEST(Quantities, StraightRodHasNoBendRadius) {
  const Obstacles o = nothing();
  Motion motion(rodScenario(5e7, 8), o, straight({}, 1, 8));
  step(motion.model, {}, motion.state, motion.workspace);
  EXPECT_FALSE(motion.now().bend_radius);
}

TEST(Quantities, StrandsThatTouchPushEachOtherApart) {
  Scenario s = rodScenario(5e7, 24);
  s.rod.self_contact = true;
  const Obstacles o = nothing();
  Motion motion(s, o, straight({Quaternion::Identity(), {-0.5, 0, 0}}, 1, 24));
  int touching = 0;
  for (const Pose& target :
       {Pose{expSO3({0, 0, 2.5}), {0.0, 0.3, 0.04}}, Pose{expSO3({0, 0, 3.1}), {-0.45, 0.08, 0.08}},
        Pose{expSO3({0, 0, 3.1}), {-0.45, -0.08, -0.08}}}) {
    Control control = holding(true, true);
    control.moving = End::last, control.target = target;
    ControlRunner runner(motion.model, control, motion.state);
    for (int k = 0; k < 80; ++k) {
      runner.advance(motion.state, motion.workspace);
      for (const SelfContactForce& c : motion.now().self_contacts) {
        const auto at = [&](double place) -> Vector3 {
          const double i = std::min(std::floor(place * 24), 23.0), t = place * 24 - i;
          const auto k0 = static_cast<std::size_t>(i);
          return (1 - t) * motion.state.nodes[k0].position + t * motion.state.nodes[k0 + 1].position;
        };
        const Vector3 apart = at(c.s[0]) - at(c.s[1]);
        EXPECT_GT(c.force.dot(apart), 0.99 * c.force.norm() * apart.norm() - 1e-12);
        EXPECT_LT(apart.norm(), 2 * s.rod.radius + s.simulation.contact_distance);
        EXPECT_LT((c.position - 0.5 * (at(c.s[0]) + at(c.s[1]))).norm(), 1e-12);
        ++touching;
      }
    }
  }
  EXPECT_GE(touching, 5);
}

TEST(Quantities, EnergyOfAFallingRodIsThatOfItsMass) {
  Scenario s = rodScenario(5e7, 10);
  s.environment.gravity = {0, 0, -9.81};
  s.simulation.drag = 0;
  const Obstacles o = nothing();
  Motion motion(s, o, straight({Quaternion::Identity(), {0, 0, 2}}, 1, 10));
  const double mass = massOf(s.rod), dt = s.simulation.time_step;
  for (int k = 1; k <= 10; ++k) {
    step(motion.model, {}, motion.state, motion.workspace);
    const Quantities q = motion.now();
    const double v = 9.81 * k * dt, fallen = 9.81 * dt * dt * k * (k + 1) / 2;  // implicit Euler
    EXPECT_NEAR(q.kinetic, 0.5 * mass * v * v, 1e-9);
    EXPECT_NEAR(q.gravity, mass * 9.81 * (2 - fallen), 1e-9);
    EXPECT_NEAR(q.twist + q.bending + q.stretch + q.shear, 0, 1e-12);
    EXPECT_EQ(q.contact, 0);
  }
}

TEST(Quantities, EnergyOfAFreeRodSumsUpAndNeverGrows) {
  Scenario s = rodScenario(5e7, 20);
  const Obstacles o = nothing();
  Motion motion(s, o, straight({}, 1, 20));
  Random random(3);
  for (Vector6& v : motion.state.velocities)
    for (int i = 3; i < 6; ++i) v[i] = random.uniform(-0.5, 0.5);
  QuantitiesRecorder recorder(motion.model, motion.state, motion.workspace);
  double start = 0;
  for (std::size_t i = 0; i <= 20; ++i)
    start += 0.5 * (i == 0 || i == 20 ? 0.5 : 1) * massOf(s.rod) / 20 *
             motion.state.velocities[i].tail<3>().squaredNorm();
  for (int k = 0; k < 100; ++k) {
    step(motion.model, {}, motion.state, motion.workspace);
    recorder.record(0.02 * (k + 1), k + 1, motion.state, motion.workspace);
  }
  double before = start;
  for (const Quantities& q : recorder.take()) {
    EXPECT_NEAR(q.kinetic + q.twist + q.bending + q.stretch + q.shear + q.gravity + q.contact, q.total,
                1e-12 * start);
    EXPECT_LT(q.total, before);
    EXPECT_NEAR(q.dissipated, start - q.total, 1e-12 * start);
    before = q.total;
  }
  EXPECT_LT(before, 0.2 * start);
}

TEST(Quantities, WorkOfAGripperThatLiftsARodIsItsWeightTimesTheHeight) {
  Scenario s = rodScenario(5e7, 10);
  s.environment.gravity = {0, 0, -9.81};
  s.simulation.drag = 0;
  s.simulation.stiffness_damping = 0.02;
  s.grippers.max_speed = 0.1;
  const Obstacles o = nothing();
  const RodShape start = straight({expSO3({0, std::numbers::pi / 2, 0}), Vector3::Zero()}, 1, 10);
  Control wait = holding(true, false), lift = wait;
  wait.end_s = 1;
  lift.start_s = 1, lift.end_s = 4, lift.moving = End::first;
  lift.target = {start[0].rotation, {0, 0, 0.2}};
  const RodModel model(s, o);
  const SimulationResult result = simulate(model, start, std::array{wait, lift}, nullptr, true);
  ASSERT_EQ(result.quantities.size(), 200U);
  const Quantities &before = result.quantities[49], &after = result.quantities.back();
  const double height = result.final_state.nodes[0].position.z() -
                        result.trajectory.shapes[static_cast<std::size_t>(before.state)][0].position.z();
  const double expected = massOf(s.rod) * 9.81 * height;
  EXPECT_GT(height, 0.19);
  EXPECT_NEAR(after.gripper_work[0] - before.gripper_work[0], expected, 1e-2 * expected);
  EXPECT_NEAR(after.gravity - before.gravity, expected, 1e-3 * expected);
  EXPECT_EQ(after.gripper_work[1], 0);
  EXPECT_GE(after.dissipated, before.dissipated);
}

TEST(Quantities, SecondOrderSchemeLosesLittleOfTheEnergyOfAnUndampedSwing) {
  Scenario s = rodScenario(1e8, 20);
  s.environment.gravity = {0, 0, -9.81};
  s.simulation = {.inertia = true,
                  .scheme = Scheme::second_order,
                  .time_step = 0.001,
                  .drag = 0,
                  .stiffness_damping = 0,
                  .contact_distance = 0.005};
  const Obstacles o = nothing();
  Motion motion(s, o, straight({}, 1, 20));
  QuantitiesRecorder recorder(motion.model, motion.state, motion.workspace);
  ControlRunner runner(motion.model, holding(true, false), motion.state);
  for (int k = 0; k < 300; ++k) {
    runner.advance(motion.state, motion.workspace);
    recorder.record(0.001 * (k + 1), k + 1, motion.state, motion.workspace);
  }
  const std::vector<Quantities> all = recorder.take();
  EXPECT_GT(all.back().kinetic, 0.1);
  EXPECT_LT(std::abs(all.back().dissipated), 0.03 * all.back().kinetic);
}

TEST(Quantities, MeasuringChangesNoBitOfTheMotionAndGivesTheSameBitsAgain) {
  Scenario s = rodScenario(5e7, 16);
  s.environment.friction = 0.3;
  s.environment.gravity = {0, 0, -9.81};
  s.rod.self_contact = true;
  const Obstacles o = obstaclesOf({block({-0.3, -0.3, -0.5}, {0.3, 0.3, -0.02})});
  const RodModel model(s, o);
  Control drop = holding(true, true);
  drop.moving = End::last, drop.end_s = 1, drop.target = {expSO3({0, 1, 2}), {-0.3, 0.2, 0.1}};
  const auto run = [&](bool measured) {
    return simulate(model, straight({Quaternion::Identity(), {-0.6, 0, 0.05}}, 1, 16), std::array{drop},
                    nullptr, measured);
  };
  const SimulationResult plain = run(false), a = run(true), b = run(true);
  EXPECT_TRUE(plain.quantities.empty());
  ASSERT_EQ(plain.trajectory.shapes.size(), a.trajectory.shapes.size());
  for (std::size_t k = 0; k < a.trajectory.shapes.size(); ++k)
    for (std::size_t i = 0; i <= 16; ++i) {
      EXPECT_EQ(plain.trajectory.shapes[k][i].position, a.trajectory.shapes[k][i].position);
      EXPECT_EQ(plain.trajectory.shapes[k][i].rotation.coeffs(), a.trajectory.shapes[k][i].rotation.coeffs());
    }
  ASSERT_EQ(a.quantities.size(), 50U);
  ASSERT_EQ(b.quantities.size(), 50U);
  bool touched = false;
  for (std::size_t k = 0; k < 50; ++k) {
    const Quantities &p = a.quantities[k], &q = b.quantities[k];
    EXPECT_EQ(p.time, a.trajectory.time_s[static_cast<std::size_t>(p.state)]);
    EXPECT_EQ(p.total, q.total);
    if (k > 0) {
      EXPECT_GE(p.dissipated, a.quantities[k - 1].dissipated) << k;
    }
    EXPECT_EQ(p.dissipated, q.dissipated);
    EXPECT_EQ(p.internal_force, q.internal_force);
    EXPECT_EQ(p.gripper_force, q.gripper_force);
    EXPECT_EQ(sum(p.contacts), sum(q.contacts));
    EXPECT_EQ(sum(p.friction), sum(q.friction));
    touched = touched || !p.contacts.empty();
  }
  EXPECT_TRUE(touched);
}

}  // namespace
}  // namespace tendril
