/// Contact terms against finite differences, and what must hold of every motion in contact.
#include "tendril/dynamics/contact.h"

#include <gtest/gtest.h>

#include "dynamics/scenes.h"

namespace tendril {
namespace {

using namespace scenes;

/// Two nodes whose segment is placed near a mesh, and the contact potential of that placement.
struct Probe {
  const Obstacles& obstacles;
  contact::Contacts contacts;
  std::vector<beam::Node> nodes{2};

  explicit Probe(const Obstacles& o) : obstacles(o) { contacts.prepare(o, RodProperties{}, {0.005, 3.0}); }

  double energyAt(const std::vector<Vector3>& p) {
    contacts.findCandidates(p, {Vector3::Zero(), Vector3::Zero()});
    EXPECT_TRUE(contacts.evaluate(p));
    return contacts.energy();
  }
};

void expectGradientMatches(const Obstacles& obstacles, const Vector3& p0, const Vector3& p1,
                           std::size_t at_least) {
  Probe probe(obstacles);
  Random random(1);
  const std::vector<Vector3> p = {p0, p1};
  for (std::size_t i = 0; i < 2; ++i) {
    probe.nodes[i].pose = {random.rotation(), p[i]};
    probe.nodes[i].rotation = probe.nodes[i].pose.rotation.toRotationMatrix();
  }
  EXPECT_GT(probe.energyAt(p), 0);
  EXPECT_GE(probe.contacts.activeTerms(), at_least);
  BlockTridiagonal system;
  system.resize(2);
  system.setZero();
  probe.contacts.addDerivatives(probe.nodes, system);
  const double step = 1e-8;
  for (std::size_t i = 0; i < 2; ++i) {
    const Vector3 gradient = -(probe.nodes[i].rotation * system.rhs(i).tail<3>());
    for (int k = 0; k < 3; ++k) {
      std::vector<Vector3> plus = p, minus = p;
      plus[i][k] += step, minus[i][k] -= step;
      const double difference = (probe.energyAt(plus) - probe.energyAt(minus)) / (2 * step);
      EXPECT_NEAR(difference, gradient[k], 2e-5 * (gradient.norm() + 1e-3)) << "node " << i << " axis " << k;
    }
  }
}

TEST(Contact, GradientIsTheDerivativeOfTheEnergyAtFacesEdgesAndVertices) {
  const Obstacles o = obstaclesOf({block({-1, -1, -1}, {0, 0, 0})});
  expectGradientMatches(o, {-0.5, -0.4, 0.012}, {-0.45, -0.4, 0.013}, 2);   // two nodes over a face
  expectGradientMatches(o, {-0.1, -0.52, 0.026}, {0.1, -0.5, 0.0}, 1);      // across an edge
  expectGradientMatches(o, {0.05, -0.05, 0.013}, {-0.05, 0.06, 0.008}, 1);  // past the corner
  expectGradientMatches(o, {0.008, 0.006, 0.009}, {0.1, 0.1, 0.15}, 1);     // a node before the corner
}

TEST(Contact, GradientIsTheDerivativeOfTheEnergyNearlyParallelToAnEdge) {
  const Obstacles o = obstaclesOf({block({-1, -1, -1}, {0, 0, 0})});
  for (const double tilt : {1e-4, 1e-3, 5e-3})  // radians from the edge's direction
    expectGradientMatches(o, {-0.05, 0.009, 0.0088}, {0.03, 0.009 + 0.08 * tilt, 0.0088 - 0.05 * tilt}, 2);
}

/// A vertex at the origin where ridges and valleys meet: a closed fan of faces whose rim goes up and down.
TriangleMesh ridgesAndValleys(Random& random) {
  constexpr int kSides = 7;
  TriangleMesh mesh;
  mesh.vertices.emplace_back(0, 0, 0);
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2 * std::numbers::pi * (i + random.uniform(-0.3, 0.3)) / kSides;
    mesh.vertices.emplace_back(0.1 * std::cos(angle), 0.1 * std::sin(angle), random.uniform(-0.05, 0.05));
    mesh.faces.push_back({0, i + 1, (i + 1) % kSides + 1});
  }
  return mesh;
}

TEST(Contact, EnergyHasNoJumpsAndItsGradientIsItsDerivativeWhereRidgesAndValleysMeet) {
  Random random(3);
  int near = 0;
  for (int way = 0; way < 300; ++way) {
    const Obstacles o = obstaclesOf({ridgesAndValleys(random)});
    Probe probe(o);
    // A segment that slides and turns over the vertex; every fifth begins along an edge.
    const auto somewhere = [&](double half) {
      const double x = random.uniform(-half, half), y = random.uniform(-half, half);
      return Vector3(x, y, random.uniform(-half, half));
    };
    Vector3 along = somewhere(1).normalized();
    if (way % 5 == 0) along = o.vertices()[static_cast<std::size_t>(1 + way % 7)].normalized();
    Vector3 middle = somewhere(0.02);
    middle.z() = std::abs(middle.z()) + 0.01;
    const double length = random.uniform(0.01, 0.1);
    const std::vector<Vector3> from = {middle - length * random.uniform() * along, middle + length * along};
    const Vector3 v0 = somewhere(1), v1 = way % 2 == 0 ? v0 : somewhere(1);
    constexpr double kStep = 1e-6;
    const auto at = [&](double x) -> std::vector<Vector3> { return {from[0] + x * v0, from[1] + x * v1}; };
    std::vector<double> energies;
    for (int k = 0; k < 3000; ++k) {
      const double x = k * kStep;
      const std::vector<Vector3> p = at(x), still(2, Vector3::Zero());
      probe.contacts.findCandidates(p, still);
      if (!probe.contacts.evaluate(p) || probe.contacts.leastGap() < 0.0005) break;
      energies.push_back(probe.contacts.energy());
      near += energies.back() > 0;
    }
    for (std::size_t k = 3; k < energies.size(); ++k) {
      const double a = energies[k - 2] - energies[k - 3], b = energies[k - 1] - energies[k - 2],
                   c = energies[k] - energies[k - 1];
      const double jump = std::abs(b) - std::max(std::abs(a), std::abs(c));
      EXPECT_LT(jump, 2e-3 * (energies[k] + 1e-7)) << "way " << way << " step " << k;
    }
    if (energies.size() < 100 || energies[50] <= 0) continue;
    expectGradientMatches(o, at(50 * kStep)[0], at(50 * kStep)[1], 1);
  }
  EXPECT_GT(near, 30000);
}

/// A square of ridges and valleys of every depth, faces of about `size`.
TriangleMesh hills(Random& random, int side, double size) {
  TriangleMesh mesh;
  for (int i = 0; i <= side; ++i)
    for (int j = 0; j <= side; ++j)
      mesh.vertices.emplace_back(size * (i + random.uniform(-0.3, 0.3)),
                                 size * (j + random.uniform(-0.3, 0.3)), size * random.uniform(-0.5, 0.5));
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j) {
      const int a = i * (side + 1) + j, b = a + side + 1;
      mesh.faces.push_back({a, b, a + 1});
      mesh.faces.push_back({a + 1, b, b + 1});
    }
  return mesh;
}

double distanceToAllFaces(const std::vector<Vector3>& rod, const Obstacles& obstacles) {
  double least = std::numeric_limits<double>::infinity();
  for (const Obstacles::Face& face : obstacles.faces()) {
    const auto corner = [&](std::size_t k) {
      return obstacles.vertices()[static_cast<std::size_t>(face.vertices[k])];
    };
    for (std::size_t i = 0; i + 1 < rod.size(); ++i)
      least = std::min(
          least,
          closestPointsOfSegmentAndTriangle(rod[i], rod[i + 1], corner(0), corner(1), corner(2)).distance);
  }
  return least;
}

TEST(Contact, AMotionThatPassesTheFilterStaysClearOfEveryFaceOfHillsAndValleys) {
  Random random(41);
  const double radius = RodProperties{}.radius;
  int cut = 0, touched = 0;
  for (const double size : {0.2, 1.0, 6.0})  // of the radius
    for (int scene = 0; scene < 60; ++scene) {
      const Obstacles o = obstaclesOf({hills(random, 10, size * radius)});
      contact::Contacts contacts;
      contacts.prepare(o, RodProperties{}, {0.1 * radius, 3.0});
      const auto somewhere = [&](double half) -> Vector3 {
        return {random.uniform(-half, half), random.uniform(-half, half), random.uniform(-half, half)};
      };
      const Vector3 middle = 5 * size * radius * Vector3(1, 1, 0);
      std::vector<Vector3> at = {middle + Vector3(-2 * radius, 0, 0), middle,
                                 middle + Vector3(2 * radius, 0, 0)};
      for (Vector3& p : at) p += somewhere(0.3 * radius) + (1.5 + 0.6 * size) * radius * Vector3::UnitZ();
      if (distanceToAllFaces(at, o) < 1.01 * radius) continue;
      // Down onto the hills, step by step, each cut back to what is free; what was found for one motion
      // serves the next.
      for (int step = 0; step < 8; ++step) {
        std::vector<Vector3> motion(3);
        for (Vector3& d : motion) d = somewhere(0.3 * radius) - 0.4 * radius * Vector3::UnitZ();
        contacts.findCandidates(at, motion);
        const double fraction = contacts.freeFraction(at, motion, {0.1, 0.1 * radius});
        cut += fraction < 1;
        for (int k = 1; k <= 4; ++k) {
          std::vector<Vector3> then = at;
          for (std::size_t i = 0; i < 3; ++i) then[i] += 0.25 * k * fraction * motion[i];
          ASSERT_GT(distanceToAllFaces(then, o), radius);
        }
        for (std::size_t i = 0; i < 3; ++i) at[i] += fraction * motion[i];
        ASSERT_TRUE(contacts.evaluate(at));
        touched += contacts.activeTerms() > 0;
      }
    }
  EXPECT_GT(cut, 200);
  EXPECT_GT(touched, 200);
}

TEST(Contact, WhatWasFoundForOneMotionGivesTheNextPlacesTheirEnergyToTheBit) {
  Random random(42);
  const double radius = RodProperties{}.radius;
  const Obstacles o = obstaclesOf({hills(random, 30, 0.4 * radius)});
  int in_contact = 0;
  contact::Contacts kept;
  for (int scene = 0; scene < 100; ++scene) {
    kept.prepare(o, RodProperties{}, {0.5 * radius, 3.0});
    std::vector<Vector3> at = {Vector3(4 * radius, 6 * radius, random.uniform(1.3, 1.7) * radius),
                               Vector3(8 * radius, 6 * radius, random.uniform(1.3, 1.7) * radius)};
    std::vector<Vector3> motion(2), still(2, Vector3::Zero());
    for (int step = 0; step < 10; ++step) {
      for (Vector3& d : motion)
        d = 0.05 * radius * Vector3(random.uniform(-4, 4), random.uniform(-1, 1), random.uniform(-1, 1));
      kept.findCandidates(at, motion);
      for (std::size_t i = 0; i < 2; ++i) at[i] += motion[i];
      contact::Contacts fresh;
      fresh.prepare(o, RodProperties{}, {0.5 * radius, 3.0});
      fresh.findCandidates(at, still);
      const bool free = fresh.evaluate(at);
      ASSERT_EQ(kept.evaluate(at), free);
      if (!free) break;
      ASSERT_EQ(kept.energy(), fresh.energy());
      in_contact += fresh.activeTerms() > 0;
    }
  }
  EXPECT_GT(in_contact, 200);
}

TEST(Contact, ASharpEdgePushesASegmentAcrossItAsMuchAsTheEdgeOfASheet) {
  // Two faces that meet at an angle along the y axis, at 0 a doubled sheet; a segment that lies across the
  // edge, tilted so little that its normal is nearly that of the upper face, its ends beyond reach of both.
  const auto blade = [](double angle, bool both) {
    TriangleMesh mesh;
    mesh.vertices = {{0, -1, 0}, {0, 1, 0}, {-1, 0, 0}, {-std::cos(angle), 0, -std::sin(angle)}};
    mesh.faces = {{0, 1, 2}};
    if (both) mesh.faces.push_back({0, 3, 1});
    return mesh;
  };
  for (const double angle : {0.0, 0.01, 0.3, 1.5})
    for (const double tilt : {0.04, 0.3, 1.0}) {
      const Vector3 along(std::cos(tilt), 0, -std::sin(tilt)),
          above = 0.0105 * Vector3(std::sin(tilt), 0, std::cos(tilt));
      const std::vector<Vector3> segment = {above - 0.3 * along, above + 0.3 * along};
      const Obstacles sheet = obstaclesOf({blade(angle, false)}), sharp = obstaclesOf({blade(angle, true)});
      Probe at_sheet(sheet), at_sharp(sharp);
      const double expected = at_sheet.energyAt(segment);
      EXPECT_GT(expected, 0);
      EXPECT_DOUBLE_EQ(at_sharp.energyAt(segment), expected) << angle << " " << tilt;
    }
}

TEST(Contact, CoplanarAndConcaveEdgesAreNoFeatures) {
  // A rod lying on the diagonal of a face: only its two nodes feel the plane.
  const Obstacles flat = obstaclesOf({block({-1, -1, -1}, {0, 0, 0})});
  Probe probe(flat);
  probe.energyAt({{-0.5, -0.45, 0.012}, {-0.45, -0.5, 0.012}});
  for (const contact::Term& term : probe.contacts.terms()) EXPECT_FALSE(term.on_segment);
  // Inside a tube its lengthwise edges are concave.
  const Obstacles pipe = obstaclesOf({tube(0.013, -1, 1)});
  Probe inside(pipe);
  inside.energyAt({{-0.05, 0.0005, 0.0}, {0.05, -0.0005, 0.0003}});
  EXPECT_GT(inside.contacts.activeTerms(), 0U);
  for (const contact::Term& term : inside.contacts.terms()) EXPECT_FALSE(term.on_segment);
}

/// Pushes and pulls a rod about near obstacles, with random targets beyond them.
template <class Check>
void struggle(const Obstacles& obstacles, const RodShape& start, double friction, Check&& check) {
  Scenario s = rodScenario(5e7, static_cast<int>(start.size()) - 1);
  s.environment.friction = friction;
  s.simulation.contact_distance = 0.1 * s.rod.radius;
  const RodModel model(s, obstacles);
  RodState state = RodState::atRest(start);
  RodWorkspace workspace;
  Random random(7);
  for (int k = 0; k < 12; ++k) {
    Control control;
    control.moving = k % 2 == 0 ? End::first : End::last;
    control.held = k % 3 == 0 ? std::array{true, true}
                              : std::array{control.moving == End::first, control.moving == End::last};
    control.target = {random.rotation(),
                      {random.uniform(-0.8, 0.8), random.uniform(-0.6, 0.6), random.uniform(-0.6, 0.6)}};
    ControlRunner runner(model, control, state);
    for (int i = 0; i < 40; ++i) {
      const RodShape before = state.nodes;
      runner.advance(state, workspace, true);
      check(before, workspace.wayPoints(), state.nodes);
    }
  }
}

TEST(Contact, NoMotionBetweenWayPointsEverPenetrates) {
  const Obstacles o =
      obstaclesOf({block({-0.3, -0.3, -0.5}, {0.3, 0.3, -0.02}), block({0.45, -1, -1}, {0.5, 1, 1})});
  double least = std::numeric_limits<double>::infinity();
  int touching = 0;
  struggle(o, straight({Quaternion::Identity(), {-0.6, 0, 0.05}}, 1, 20), 0.3,
           [&](const RodShape& before, std::span<const RodShape> way, const RodShape& after) {
             ASSERT_FALSE(way.empty());
             EXPECT_EQ(maxNodeDistance(way.back(), after), 0);
             RodShape from = before, between = before;
             for (const RodShape& to : way) {
               for (const double t : {0.25, 0.5, 0.75, 1.0}) {
                 for (std::size_t i = 0; i < from.size(); ++i)
                   between[i].position = (1 - t) * from[i].position + t * to[i].position;
                 const double distance = bruteForceDistance(between, o);
                 least = std::min(least, distance);
                 touching += distance < 0.0115;
               }
               EXPECT_LE(maxNodeDistance(from, to), 0.25);
               from = to;
             }
           });
  EXPECT_GE(least, 0.01 - 1e-12);
  EXPECT_GT(touching, 100);  // the test is about contact
}

/// A rod of five elements bent so that its first and last element nearly touch, the rest far away.
std::vector<Vector3> hairpin(double angle, double lift) {
  return {{0, 0, 0},
          {0.1, 0, 0},
          {0.4, 0.3, -0.3},
          {0.4, -0.3, 0.3},
          {0.1, 0.003, 0.022 + lift},
          {0.1 - 0.1 * std::cos(angle), 0.003 + 0.1 * std::sin(angle), 0.022}};
}

TEST(Contact, SelfContactGradientIsTheDerivativeOfTheEnergyCrossingAndNearlyParallel) {
  const double radius = 0.01;
  for (const double angle : {0.5, 0.01, 0.001}) {
    contact::SelfContacts contacts;
    contacts.prepare(radius, 0.1, {0.005, 3.0});
    const std::vector<Vector3> p = hairpin(angle, 0.0005), still(p.size(), Vector3::Zero());
    const auto energy_at = [&](const std::vector<Vector3>& at) {
      contacts.findCandidates(at, still);
      EXPECT_TRUE(contacts.evaluate(at));
      return contacts.energy();
    };
    Random random(2);
    std::vector<beam::Node> nodes(p.size());
    for (std::size_t i = 0; i < p.size(); ++i) {
      nodes[i].pose = {random.rotation(), p[i]};
      nodes[i].rotation = nodes[i].pose.rotation.toRotationMatrix();
    }
    EXPECT_GT(energy_at(p), 0) << angle;
    BlockTridiagonal system;
    system.resize(p.size());
    system.setZero();
    contacts.addDerivatives(nodes, system);
    for (std::size_t i = 0; i < p.size(); ++i) {
      const Vector3 gradient = -(nodes[i].rotation * system.rhs(i).tail<3>());
      for (int k = 0; k < 3; ++k) {
        std::vector<Vector3> plus = p, minus = p;
        plus[i][k] += 1e-8, minus[i][k] -= 1e-8;
        EXPECT_NEAR((energy_at(plus) - energy_at(minus)) / 2e-8, gradient[k],
                    2e-5 * (gradient.norm() + 1e-3));
      }
    }
  }
}

/// Two strands that cross a little apart, with the second order of their contact.
struct CrossingStrands {
  contact::SelfContacts contacts;
  std::vector<Vector3> p = {{0, 0, 0},        {0.1, 0, 0},           {0.4, 0.3, -0.3},
                            {0.4, -0.3, 0.3}, {0.04, -0.05, 0.0202}, {0.06, 0.05, 0.0202}};
  BlockTridiagonal system;
  contact::SelfContacts::Term term{};

  CrossingStrands() {
    contacts.prepare(0.01, 0.1, {0.005, 3.0});
    (void)energyAt(p);
    EXPECT_EQ(contacts.terms().size(), 1U);
    term = contacts.terms()[0];
    std::vector<beam::Node> nodes(p.size());
    for (std::size_t i = 0; i < p.size(); ++i) nodes[i].pose.position = p[i], nodes[i].rotation.setIdentity();
    system.resize(p.size());
    system.setZero();
    contacts.addDerivatives(nodes, system);
  }
  [[nodiscard]] double energyAt(const std::vector<Vector3>& at) {
    contacts.findCandidates(at, std::vector<Vector3>(at.size(), Vector3::Zero()));
    EXPECT_TRUE(contacts.evaluate(at));
    return contacts.energy();
  }
  /// The second derivative of the energy while the nodes move by v, by differences.
  [[nodiscard]] double needed(const std::vector<Vector3>& v) {
    const double step = 1e-5;
    std::vector<Vector3> plus = p, minus = p;
    for (std::size_t i = 0; i < p.size(); ++i) plus[i] += step * v[i], minus[i] -= step * v[i];
    return (energyAt(plus) - 2 * energyAt(p) + energyAt(minus)) / (step * step);
  }
  [[nodiscard]] double stiffness(const std::vector<Vector3>& v) {
    double sum = 0;
    for (std::size_t i = 0; i < p.size(); ++i) {
      sum += v[i].dot(system.diagonal(i).bottomRightCorner<3, 3>() * v[i]);
      if (i + 1 < p.size()) sum += 2 * v[i].dot(system.upper(i).bottomRightCorner<3, 3>() * v[i + 1]);
    }
    return sum;
  }
};

TEST(Contact, StrandsThatTiltOnEachOtherAreAsStiffAsTheirEnergySays) {
  CrossingStrands strands;
  // Tilts about the contact, which leave the distance as it is to first order.
  for (const auto& [element, s] :
       {std::pair{strands.term.i, strands.term.s}, {strands.term.j, strands.term.t}}) {
    const auto i = static_cast<std::size_t>(element);
    std::vector<Vector3> v(strands.p.size(), Vector3::Zero());
    v[i] = -s * strands.term.normal, v[i + 1] = (1 - s) * strands.term.normal;
    const double needed = strands.needed(v);
    EXPECT_GT(needed, 0);
    EXPECT_GE(strands.stiffness(v), needed);
    EXPECT_LE(strands.stiffness(v), 4 * needed);
  }
}

TEST(Contact, AStrandThatTiltsWhileTheOtherSlidesAlongItIsNoSofterThanTheirEnergySays) {
  CrossingStrands strands;
  const auto i = static_cast<std::size_t>(strands.term.i), j = static_cast<std::size_t>(strands.term.j);
  int stiff = 0;
  for (const bool first : {true, false})
    for (const double slide : {-3.0, -1.0, -0.3, 0.3, 1.0, 3.0}) {  // of the tilt's displacement
      const std::size_t tilting = first ? i : j, sliding = first ? j : i;
      const double s = first ? strands.term.s : strands.term.t;
      std::vector<Vector3> v(strands.p.size(), Vector3::Zero());
      v[tilting] = -s * strands.term.normal, v[tilting + 1] = (1 - s) * strands.term.normal;
      v[sliding] = v[sliding + 1] = slide * (strands.p[tilting + 1] - strands.p[tilting]).normalized();
      const double needed = strands.needed(v);
      EXPECT_GE(strands.stiffness(v), needed) << slide;
      stiff += needed > 0;
    }
  EXPECT_GE(stiff, 6);
}

TEST(Contact, RodNeverPassesThroughItself) {
  // Both ends are pulled across each other into a knot-to-be and on; without self-contact the strands would
  // cross.
  Scenario s = rodScenario(5e7, 24);
  s.rod.self_contact = true;
  s.simulation.contact_distance = 0.2 * s.rod.radius;
  const Obstacles o = nothing();
  const RodModel model(s, o);
  RodState state = RodState::atRest(straight({Quaternion::Identity(), {-0.5, 0, 0}}, 1, 24));
  RodWorkspace workspace;
  double least = std::numeric_limits<double>::infinity();
  const auto go = [&](End end, const Pose& target, int steps) {
    Control control;
    control.held = {true, true}, control.moving = end, control.target = target;
    ControlRunner runner(model, control, state);
    for (int k = 0; k < steps; ++k) {
      runner.advance(state, workspace);
      for (std::size_t i = 0; i + 1 < state.nodes.size(); ++i)
        for (std::size_t j = i + 3; j + 1 < state.nodes.size(); ++j)
          least =
              std::min(least, closestPointsOfSegments(state.nodes[i].position, state.nodes[i + 1].position,
                                                      state.nodes[j].position, state.nodes[j + 1].position)
                                  .distance);
    }
  };
  go(End::last, {expSO3({0, 0, 2.5}), {0.0, 0.3, 0.04}}, 80);
  go(End::last, {expSO3({0, 0, 3.1}), {-0.45, 0.08, 0.08}}, 80);
  go(End::last, {expSO3({0, 0, 3.1}), {-0.45, -0.08, -0.08}},
     80);  // the straight way leads through the other strand
  EXPECT_GT(least, 0.02);
  EXPECT_LT(least, 0.0225) << state.nodes.back().position.transpose();  // it did touch
}

TEST(Contact, HeavyRodComesToRestOnAFloorWithinTheBarriersReach) {
  Scenario s = rodScenario(5e7, 20);
  s.environment.gravity = {0, 0, -9.81};
  const Obstacles o = obstaclesOf({block({-2, -2, -1}, {2, 2, 0})});
  const RodModel model(s, o);
  RodState state = RodState::atRest(straight({Quaternion::Identity(), {-0.5, 0.1, 0.05}}, 1, 20));
  RodWorkspace workspace;
  for (int k = 0; k < 300; ++k) step(model, {}, state, workspace);
  for (std::size_t i = 0; i < state.nodes.size(); ++i) {
    EXPECT_GT(state.nodes[i].position.z(), 0.01);
    EXPECT_LT(state.nodes[i].position.z(), 0.01 + s.simulation.contact_distance);
    EXPECT_LT(state.velocities[i].tail<3>().norm(), 1e-3);
  }
}

/// How far a rod laid across the slope of an inclined plane slides in 0.5 s.
double slideDown(double slope_angle, double friction) {
  Scenario s = rodScenario(5e7, 10);
  s.environment.friction = friction;
  s.environment.gravity = 9.81 * Vector3(0, std::sin(slope_angle), -std::cos(slope_angle));
  s.simulation.drag = 0;
  s.simulation.contact_distance = 0.001;
  const Obstacles o = obstaclesOf({block({-3, -3, -1}, {3, 3, 0})});
  const RodModel model(s, o);
  RodState state = RodState::atRest(straight({Quaternion::Identity(), {-0.5, 0, 0.0107}}, 1, 10));
  RodWorkspace workspace;
  for (int k = 0; k < 25; ++k) step(model, {}, state, workspace);  // let it settle
  const double from = state.nodes[5].position.y();
  for (Vector6& v : state.velocities) v.setZero();
  for (int k = 0; k < 25; ++k) step(model, {}, state, workspace);
  return state.nodes[5].position.y() - from;
}

TEST(Contact, RodSticksBelowTheFrictionAngleAndSlidesAboveItByCoulombsLaw) {
  EXPECT_LT(slideDown(std::atan(0.3) - 0.05, 0.3), 0.01);
  const double angle = 0.6, mu = 0.3, time = 0.5;
  const double expected = 0.5 * 9.81 * (std::sin(angle) - mu * std::cos(angle)) * time * time;
  EXPECT_NEAR(slideDown(angle, mu), expected, 0.1 * expected);
}

TEST(Contact, RodIsPulledThroughATubeOfElevenTenthsOfItsRadius) {
  Scenario s = rodScenario(5e7, 20);
  s.simulation.contact_distance = 0.1 * s.rod.radius;
  const Obstacles o = obstaclesOf({tube(1.1 * s.rod.radius, 0.05, 0.6, 24)});
  const RodModel model(s, o);
  RodState state = RodState::atRest(straight({Quaternion::Identity(), {-1, 0, 0}}, 1, 20));
  RodWorkspace workspace;
  Control pull;
  pull.held = {false, true};
  pull.moving = End::last;
  pull.target.position = {1.65, 0, 0};
  ControlRunner runner(model, pull, state);
  for (int k = 0; k < 130; ++k) runner.advance(state, workspace);
  EXPECT_GT(state.nodes.front().position.x(), 0.6);
}

TEST(Contact, ABarrierWiderThanAPassageDoesNotPlugIt) {
  // A tube that leaves 5 % of the radius all round, a contact distance of half the radius; pulled by its tip.
  for (const double friction : {0.0, 0.2}) {
    Scenario s = scenes::rodScenario(5e7, 20);
    s.simulation.contact_distance = 0.5 * s.rod.radius;
    s.environment.friction = friction;
    const Obstacles tube = scenes::obstaclesOf({scenes::tube(1.05 * s.rod.radius, 0, 0.5)});
    const RodModel model(s, tube);
    RodState state = RodState::atRest(scenes::straight({Quaternion::Identity(), {-1.02, 0, 0}}, 1, 20));
    RodWorkspace workspace;
    Control pull;
    pull.held = {false, true}, pull.moving = End::last, pull.target.position = {0.9, 0, 0};
    ControlRunner runner(model, pull, state);
    for (int k = 0; k < 100; ++k) {
      runner.advance(state, workspace);
      ASSERT_GT(scenes::bruteForceDistance(state.nodes, tube), s.rod.radius);
    }
    EXPECT_NEAR(state.nodes.back().position.x(), 0.9, 0.01) << friction;
  }
}

}  // namespace
}  // namespace tendril
