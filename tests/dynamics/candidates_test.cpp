/// What may come near the rod and is looked at no further: nothing of any mesh may come nearer for that.
#include <gtest/gtest.h>

#include "dynamics/scenes.h"
#include "tendril/dynamics/contact.h"
#include "tendril/verification/distance.h"

namespace tendril {
namespace {

Vector3 somewhere(Random& random, double half) {
  const double x = random.uniform(-half, half), y = random.uniform(-half, half);
  return {x, y, random.uniform(-half, half)};
}
int oneOf(Random& random, int count) {
  return static_cast<int>(random.bits() % static_cast<std::uint64_t>(count));
}
double power(Random& random, double low, double high) { return std::pow(10, random.uniform(low, high)); }

/// A vertex amid ridges, valleys and faces of one plane: a corner, a spike, a saddle; now and then open.
TriangleMesh fan(Random& random) {
  TriangleMesh mesh;
  mesh.vertices.emplace_back(0, 0, 0);
  const int sides = 3 + oneOf(random, 6), style = oneOf(random, 4);
  const double tall = power(random, -4, 0.7);
  for (int i = 0; i < sides; ++i) {
    const double heights[] = {random.uniform(-1, 1), random.uniform(0.7, 1.3), i % 2 == 0 ? -1.0 : 1.0,
                              oneOf(random, 3) - 1.0};
    const double angle = 2 * std::numbers::pi * (i + random.uniform(-0.35, 0.35)) / sides;
    const double far = oneOf(random, 4) == 0 ? power(random, -3, 0) : random.uniform(0.5, 1.5);
    mesh.vertices.emplace_back(far * std::cos(angle), far * std::sin(angle), tall * heights[style]);
  }
  const int faces = sides - (oneOf(random, 4) == 0 ? 1 : 0);
  for (int i = 0; i < faces; ++i) mesh.faces.push_back({0, i + 1, (i + 1) % sides + 1});
  return mesh;
}

/// Faces on the same few vertices: edges of one, of two and of many faces, doubled faces, faces of two
/// corners.
TriangleMesh soup(Random& random) {
  TriangleMesh mesh;
  const int count = 4 + oneOf(random, 4), faces = 2 + oneOf(random, 7);
  const double flat = oneOf(random, 2) == 0 ? 1 : power(random, -3, 0);
  for (int i = 0; i < count; ++i)
    mesh.vertices.push_back(somewhere(random, 1).cwiseProduct(Vector3(1, 1, flat)));
  for (int i = 0; i < faces; ++i) {
    const int a = oneOf(random, count), b = oneOf(random, count), c = oneOf(random, count);
    mesh.faces.push_back({a, b, c});
    if (oneOf(random, 8) == 0) mesh.faces.push_back({b, a, c});
  }
  return mesh;
}

/// A sheet folded along x: strips down to a millionth wide, valleys or ridges or both.
TriangleMesh strips(Random& random) {
  TriangleMesh mesh;
  const int count = 2 + oneOf(random, 6), parts = 1 + oneOf(random, 3), style = oneOf(random, 3);
  const double half = power(random, -1, 1), bend = power(random, -5, 0.2);
  std::vector<Vector3> profile = {Vector3::Zero()};
  for (double angle = 0; static_cast<int>(profile.size()) <= count;) {
    const double width = oneOf(random, 2) == 0 ? power(random, -6, 0) : random.uniform(0.3, 1.5);
    profile.push_back(profile.back() + width * Vector3(0, std::cos(angle), std::sin(angle)));
    angle += (style == 2 ? oneOf(random, 2) : style) == 0 ? bend : -bend;
  }
  for (int j = 0; j <= parts; ++j)
    for (const Vector3& p : profile)
      mesh.vertices.emplace_back(p - 0.5 * profile.back() + half * (2.0 * j / parts - 1) * Vector3::UnitX());
  for (int j = 0; j < parts; ++j)
    for (int i = 0; i < count; ++i) {
      const int a = j * (count + 1) + i, b = a + count + 1;
      mesh.faces.push_back({a, a + 1, b});
      mesh.faces.push_back({a + 1, b + 1, b});
    }
  return mesh;
}

/// Steps of a few heights, with faces left out.
TriangleMesh steps(Random& random) {
  TriangleMesh mesh;
  const int side = 2 + oneOf(random, 3);
  const double tall = power(random, -3, 0.3);
  for (int i = 0; i <= side; ++i)
    for (int j = 0; j <= side; ++j)
      mesh.vertices.emplace_back(i - 0.5 * side, j - 0.5 * side, tall * oneOf(random, 3));
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j) {
      const int a = i * (side + 1) + j, b = a + side + 1;
      mesh.faces.push_back({a, b, a + 1});
      if (oneOf(random, 8) > 0) mesh.faces.push_back({a + 1, b, b + 1});
    }
  return mesh;
}

/// Any of these, with faces cut in two at a point of an edge and a sliver between, down to no area at all.
TriangleMesh slivers(Random& random) {
  const TriangleMesh base = oneOf(random, 2) == 0 ? fan(random) : strips(random);
  TriangleMesh mesh{.vertices = base.vertices, .faces = {}};
  const double aside = oneOf(random, 6) == 0 ? 0 : power(random, -17, -1);
  for (const auto& [a, b, c] : base.faces) {
    if (oneOf(random, 2) == 0) {
      mesh.faces.push_back({a, b, c});
      continue;
    }
    const Vector3 &from = base.vertices[static_cast<std::size_t>(a)],
                  along = base.vertices[static_cast<std::size_t>(b)] - from;
    const int v = static_cast<int>(mesh.vertices.size());
    mesh.vertices.emplace_back(from + random.uniform(0.2, 0.8) * along +
                               somewhere(random, aside * along.norm()));
    mesh.faces.insert(mesh.faces.end(), {{a, v, c}, {v, b, c}, {a, b, v}});
  }
  return mesh;
}

/// Any of these, cut finer: every face into n * n, with the corners off by what single precision leaves, or
/// more.
TriangleMesh cutUp(Random& random) {
  TriangleMesh (*const makers[])(Random&) = {fan, strips, steps, soup};
  const TriangleMesh fine = scenes::refined(makers[oneOf(random, 4)](random), 2 + oneOf(random, 3));
  TriangleMesh mesh = fine;
  const double off = oneOf(random, 3) == 0 ? 0 : power(random, -9, -5);
  for (Vector3& v : mesh.vertices) v += somewhere(random, off);
  return mesh;
}

struct Nearest {
  double distance;
  Vector3 away;  // from the mesh to the rod
};
Nearest nearestOfAllFaces(const std::vector<Vector3>& rod, const TriangleMesh& mesh) {
  Nearest best{std::numeric_limits<double>::infinity(), Vector3::Zero()};
  for (const std::array<int, 3>& face : mesh.faces) {
    const auto corner = [&](std::size_t k) -> const Vector3& {
      return mesh.vertices[static_cast<std::size_t>(face[k])];
    };
    for (std::size_t i = 0; i + 1 < rod.size(); ++i) {
      const verification::ClosestPair pair =
          verification::segmentToTriangle(rod[i], rod[i + 1], corner(0), corner(1), corner(2));
      if (pair.distance < best.distance) best = {pair.distance, pair.a - pair.b};
    }
  }
  return best;
}

std::vector<Vector3> moved(std::vector<Vector3> rod, const std::vector<Vector3>& motion, double part) {
  for (std::size_t i = 0; i < rod.size(); ++i) rod[i] += part * motion[i];
  return rod;
}

/// A rod of a few elements near a place of the mesh, at a gap down to 1e-7 of the barrier's reach.
struct Placed {
  double radius, reach;
  std::vector<Vector3> rod;
};
Placed placeNear(Random& random, const TriangleMesh& mesh) {
  Placed placed;
  placed.radius = power(random, -2, 0.5);
  placed.reach = placed.radius * (oneOf(random, 2) == 0 ? 0.5 : power(random, -3, 0));
  const double element = std::max(0.3 * placed.radius, power(random, -1, 1));
  const int elements = 1 + oneOf(random, 3);
  const auto& face = mesh.faces[static_cast<std::size_t>(oneOf(random, static_cast<int>(mesh.faces.size())))];
  const auto corner = [&](std::size_t k) -> const Vector3& {
    return mesh.vertices[static_cast<std::size_t>(face[k])];
  };
  const Vector3 side = corner(1) - corner(0);
  const Vector3 target = corner(0) + (oneOf(random, 3) == 0 ? 0 : random.uniform()) * side;
  Vector3 along = somewhere(random, 1).normalized();
  if (oneOf(random, 4) == 0 && side.norm() > 0)
    along = (side.normalized() + somewhere(random, power(random, -9, -1))).normalized();
  const Vector3 away = along.cross(somewhere(random, 1)).normalized();
  const double first = -random.uniform() * elements;
  for (int i = 0; i <= elements; ++i)
    placed.rod.push_back(target + placed.radius * away + (first + i) * element * along +
                         somewhere(random, element * power(random, -6, -0.7)));
  const double gap = placed.reach * power(random, -7, 0.5);
  for (int i = 0; i < 10; ++i) {
    const Nearest near = nearestOfAllFaces(placed.rod, mesh);
    if (near.distance > placed.radius && near.distance < placed.radius + 1.3 * gap) return placed;
    const Vector3 out = near.distance > 1e-9 * placed.radius ? near.away.normalized() : away;
    for (Vector3& p : placed.rod) p += (placed.radius + gap - near.distance) * out;
  }
  placed.rod.clear();
  return placed;
}

/// Moves about the mesh, several times with what was found for the first motion; all that may be moved of
/// each keeps the rod off every face of the mesh as it was given, and the barrier sees what is nearest.
void expectNothingIsLost(TriangleMesh (*make)(Random&), std::uint64_t seed) {
  Random random(seed);
  int cut = 0, touched = 0;
  for (int scene = 0; scene < 400; ++scene) {
    TriangleMesh mesh = make(random);
    const Quaternion turn = oneOf(random, 3) == 0 ? Quaternion::Identity() : random.rotation();
    const Vector3 aside = somewhere(random, oneOf(random, 3) > 0 ? 0 : power(random, 0, 4));
    for (Vector3& v : mesh.vertices) v = turn * v + aside;
    if (oneOf(random, 2) == 0) mesh.origin = aside, mesh.rounding = power(random, -12, -4);
    const Obstacles o = scenes::obstaclesOf({mesh});
    auto [radius, reach, at] = placeNear(random, mesh);
    if (at.empty()) continue;
    const double rounding = 1e-9 * radius + 1e-13 * (aside.norm() + 20);
    RodProperties rod;
    rod.radius = radius;
    contact::Contacts contacts;
    contacts.prepare(o, rod, {reach, 3.0});
    const double far = oneOf(random, 2) == 0 ? reach * power(random, -1, 1) : radius * power(random, -1, 1);
    const Vector3 toward = -random.uniform(0, 1.2) * nearestOfAllFaces(at, mesh).away.normalized();
    const Vector3 common = far * (toward + somewhere(random, 0.5));
    const double tilt = oneOf(random, 3) == 0 ? 0 : far * power(random, -3, 0);
    const std::vector<Vector3> start = at;
    std::vector<Vector3> first(at.size());
    for (Vector3& d : first) d = common + somewhere(random, tilt);
    std::vector<Vector3> motion = first;
    for (int call = 0; call < 4; ++call) {
      contacts.findCandidates(at, motion);
      const double fraction = contacts.freeFraction(at, motion, 0);
      cut += fraction < 1;
      for (const double part : {random.uniform(), random.uniform(), 1.0}) {
        const std::vector<Vector3> then = moved(at, motion, fraction * part);
        const double gap = nearestOfAllFaces(then, mesh).distance - radius;
        ASSERT_GT(gap, -rounding) << "scene " << scene << " call " << call;
        if (gap > reach - rounding || !contacts.evaluate(then)) continue;
        ASSERT_LT(contacts.leastGap(), gap + rounding) << "scene " << scene << " call " << call;
        ++touched;
      }
      // Then from somewhere on the way to somewhere about it.
      at = moved(at, motion, fraction * random.uniform());
      if (nearestOfAllFaces(at, mesh).distance <= radius) break;
      const double part = random.uniform();
      for (std::size_t i = 0; i < at.size(); ++i)
        motion[i] = start[i] + part * first[i] + somewhere(random, 0.2 * reach) - at[i];
    }
  }
  EXPECT_GT(cut, 500);
  EXPECT_GT(touched, 1000);
}

TEST(Candidates, NothingIsLostAboutAVertexOfRidgesAndValleys) { expectNothingIsLost(fan, 1); }
TEST(Candidates, NothingIsLostAmongDoubledFacesAndEdgesOfAnyNumberOfFaces) { expectNothingIsLost(soup, 2); }
TEST(Candidates, NothingIsLostInValleysOfNarrowStrips) { expectNothingIsLost(strips, 3); }
TEST(Candidates, NothingIsLostOnStepsWithHoles) { expectNothingIsLost(steps, 4); }
TEST(Candidates, NothingIsLostOfMeshesCutFine) { expectNothingIsLost(cutUp, 6); }
TEST(Candidates, NothingIsLostAmongSlivers) { expectNothingIsLost(slivers, 5); }

TEST(Candidates, ASliverOnARidgeDoesNotHideIt) {
  // The ridge of a roof, from y = -1 to 1, with a corner of the right side's faces all but on it: which way
  // the sliver between points is rounding.
  Random random(6);
  int cut = 0;
  for (int scene = 0; scene < 500; ++scene) {
    const double h = scene % 5 == 0 ? 0 : power(random, -17, -8), fall = power(random, -3, -0.3);
    TriangleMesh mesh;
    mesh.vertices = {{0, -1, 0}, {0, 1, 0}, {h, 0.3, -h * fall}, {-1, 0, -fall}, {1, 0, -fall}};
    mesh.faces = {{0, 1, 3}, {0, 2, 1}, {0, 4, 2}, {2, 4, 1}};
    const Quaternion turn = random.rotation();
    for (Vector3& v : mesh.vertices) v = turn * v;
    const Obstacles o = scenes::obstaclesOf({mesh});
    const double radius = RodProperties{}.radius;
    for (int k = 0; k < 10; ++k) {
      contact::Contacts contacts;
      contacts.prepare(o, RodProperties{}, {0.05 * radius, 3.0});
      const double half = radius * random.uniform(1, 10), y = random.uniform(-0.8, 0.1);
      const double z = radius * (1 + power(random, -6, -1.3));
      const std::vector<Vector3> at = {turn * Vector3(-half, y, z), turn * Vector3(half, y, z)},
                                 motion(2, turn * Vector3(0, 0, -radius * power(random, -6, 0)));
      contacts.findCandidates(at, motion);
      const double fraction = contacts.freeFraction(at, motion, 0);
      cut += fraction < 1;
      ASSERT_GT(nearestOfAllFaces(moved(at, motion, fraction), mesh).distance, radius * (1 - 1e-9));
    }
  }
  EXPECT_GT(cut, 1000);
}

}  // namespace
}  // namespace tendril
