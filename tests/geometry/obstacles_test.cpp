#include "tendril/geometry.h"

#include <gtest/gtest.h>

#include <thread>

#include "reference.h"

namespace tendril {
namespace {

using namespace reference;

/// Triangles of many sizes in a cube about `centre`.
TriangleMesh soup(Random& random, int faces, const Vector3& centre = Vector3::Zero()) {
  TriangleMesh mesh;
  for (int f = 0; f < faces; ++f) {
    const double size = power(random, -4, -0.5);
    const Vector3 at = centre + vectorIn(random, 1);
    for (int k = 0; k < 3; ++k) mesh.vertices.push_back(at + size * vectorIn(random, 1));
    mesh.faces.push_back({3 * f, 3 * f + 1, 3 * f + 2});
  }
  return mesh;
}

TriangleMesh cube() {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) mesh.vertices.emplace_back(i & 1, (i >> 1) & 1, (i >> 2) & 1);
  mesh.faces = {{0, 1, 3}, {0, 3, 2}, {4, 7, 5}, {4, 6, 7}, {0, 5, 1}, {0, 4, 5},
                {2, 3, 7}, {2, 7, 6}, {0, 2, 6}, {0, 6, 4}, {1, 5, 7}, {1, 7, 3}};
  return mesh;
}

Obstacles of(const TriangleMesh& mesh) { return Obstacles(std::span(&mesh, 1)); }

Vector3 middleOf(const Obstacles& obstacles, std::size_t face) {
  Vector3 sum = Vector3::Zero();
  for (const int v : obstacles.faces()[face].vertices)
    sum += obstacles.vertices()[static_cast<std::size_t>(v)];
  return sum / 3;
}

Aabb boxOf(const Obstacles& obstacles, std::size_t face) {
  Aabb box;
  for (const int v : obstacles.faces()[face].vertices)
    box.include(obstacles.vertices()[static_cast<std::size_t>(v)]);
  return box;
}

bool meet(const Aabb& a, const Aabb& b) {
  return (a.min.array() <= b.max.array()).all() && (b.min.array() <= a.max.array()).all();
}

/// Found: everything that meets the box, ascending, each once, and nothing farther away than single precision
/// explains.
void expectAllFound(const Obstacles& obstacles, const Aabb& box, const std::vector<int>& found) {
  EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
  EXPECT_EQ(std::adjacent_find(found.begin(), found.end()), found.end());
  Aabb wider = box;
  wider.inflate(1e-6 * std::max(box.min.cwiseAbs().maxCoeff(), box.max.cwiseAbs().maxCoeff()));
  for (std::size_t f = 0; f < obstacles.faces().size(); ++f) {
    const Aabb face = boxOf(obstacles, f);
    const bool is_found = std::binary_search(found.begin(), found.end(), static_cast<int>(f));
    EXPECT_TRUE(is_found || !meet(face, box));
    EXPECT_TRUE(!is_found || meet(face, wider));
  }
}

TEST(FacesNear, EqualsATestOfEveryFace) {
  Random random(20);
  for (const double offset : {0.0, 1e4}) {
    for (const int faces : {1, 2, 3, 5, 17, 2000}) {
      const Vector3 centre(offset, -offset, 0.5 * offset);
      const Obstacles obstacles = of(soup(random, faces, centre));
      std::vector<int> found;
      for (int i = 0; i < 60; ++i) {
        Aabb box;
        box.include(centre + vectorIn(random, 1.2));
        box.inflate(i % 10 == 0 ? 0.0 : power(random, -5, 0.3));
        found.clear();
        obstacles.facesNear(box, found);
        expectAllFound(obstacles, box, found);
      }
    }
  }
}

TEST(FacesNear, LeavesOutNoFaceThatComesNearTheCapsule) {
  Random random(22);
  for (const double offset : {0.0, 1e4}) {
    for (const int faces : {1, 2, 3, 5, 17, 2000}) {
      const Vector3 centre(offset, -offset, 0.5 * offset);
      const Obstacles obstacles = of(soup(random, faces, centre));
      std::vector<int> found, in_box;
      for (int i = 0; i < 60; ++i) {
        const Vector3 a = centre + vectorIn(random, 1.2);
        const Vector3 b = i % 7 == 0 ? a : Vector3(a + vectorIn(random, power(random, -4, 0)));
        const Capsule capsule{a, b, i % 10 == 0 ? 0.0 : power(random, -5, 0.3)};
        Aabb box;
        box.include(a), box.include(b), box.inflate(capsule.radius);
        found.clear(), in_box.clear();
        obstacles.facesNear(box, capsule, found);
        obstacles.facesNear(box, in_box);
        EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
        for (const int f : in_box) {
          const Obstacles::Face& face = obstacles.faces()[static_cast<std::size_t>(f)];
          const auto corner = [&](std::size_t k) {
            return obstacles.vertices()[static_cast<std::size_t>(face.vertices[k])];
          };
          if (closestPointsOfSegmentAndTriangle(a, b, corner(0), corner(1), corner(2)).distance <=
              capsule.radius) {
            EXPECT_TRUE(std::binary_search(found.begin(), found.end(), f));
          }
        }
      }
    }
  }
}

TEST(FacesNear, FindsFacesThatTouchTheBoxInOnePoint) {
  Random random(21);
  const Obstacles obstacles = of(soup(random, 500));
  std::vector<int> found;
  for (std::size_t f = 0; f < 500; ++f) {
    const Aabb face = boxOf(obstacles, f);
    Aabb corner;  // shares one corner, and lies outside otherwise
    corner.include(face.max), corner.include(face.max + Vector3(0.1, 0.2, 0.3));
    found.clear();
    obstacles.facesNear(corner, found);
    EXPECT_TRUE(std::binary_search(found.begin(), found.end(), static_cast<int>(f)));
  }
}

TEST(FacesNear, AppendsWithoutTouchingWhatIsThereAndWithoutAllocatingWhenThereIsRoom) {
  const Obstacles obstacles = of(cube());
  std::vector<int> found = {99, 7};
  found.reserve(100);
  const int* memory = found.data();
  Aabb box;
  box.include(Vector3(-1, -1, -1)), box.include(Vector3(2, 2, 2));
  obstacles.facesNear(box, found);
  EXPECT_EQ(found, (std::vector<int>{99, 7, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}));
  EXPECT_EQ(found.data(), memory);
}

TEST(FacesNear, AnEmptyBoxFindsNothingAndAnInfiniteOneFindsAll) {
  const Obstacles obstacles = of(cube());
  std::vector<int> found;
  obstacles.facesNear(Aabb{}, found);
  EXPECT_TRUE(found.empty());
  Aabb everything;
  std::swap(everything.min, everything.max);
  obstacles.facesNear(everything, found);
  EXPECT_EQ(found.size(), 12u);
}

TEST(FacesNear, TakesAThousandEqualFacesAndFacesOverSixtyOrdersOfMagnitude) {
  TriangleMesh equal = cube();
  equal.faces.assign(1000, {0, 1, 3});
  TriangleMesh spread;
  for (int f = 0; f < 200; ++f) {
    const double x = std::ldexp(1.0, f - 100);  // splitting such a row by area gives a list, not a tree
    spread.vertices.insert(spread.vertices.end(),
                           {Vector3(x, 0, 0), Vector3(1.1 * x, 0, 0), Vector3(x, 0.1 * x, 0)});
    spread.faces.push_back({3 * f, 3 * f + 1, 3 * f + 2});
  }
  Random random(22);
  for (const TriangleMesh& mesh : {equal, spread}) {
    const Obstacles obstacles = of(mesh);
    std::vector<int> found;
    for (int i = 0; i < 100; ++i) {
      Aabb box;
      box.include(Vector3::Zero()), box.include(Vector3::Constant(power(random, -30, 30)));
      found.clear();
      obstacles.facesNear(box, found);
      expectAllFound(obstacles, box, found);
    }
  }
}

TEST(FacesNear, ThreadsMayAskAtTheSameTimeAndGetTheSame) {
  Random random(23);
  const Obstacles obstacles = of(soup(random, 3000));
  std::vector<Aabb> boxes(500);
  for (Aabb& box : boxes) box.include(vectorIn(random, 1)), box.inflate(0.05);
  std::vector<int> results[4];
  {
    std::vector<std::jthread> threads;
    for (auto& result : results)
      threads.emplace_back([&] {
        for (const Aabb& box : boxes) obstacles.facesNear(box, result);
      });
  }
  EXPECT_FALSE(results[0].empty());
  for (const auto& result : results) EXPECT_EQ(result, results[0]);
}

TEST(FacesNear, NoObstaclesFindNothing) {
  const Obstacles none{std::span<const TriangleMesh>()};
  std::vector<int> found;
  Aabb box;
  box.include(Vector3::Zero());
  none.facesNear(box, found);
  EXPECT_TRUE(found.empty());
  const std::vector<Vector3> rod = {Vector3::Zero(), Vector3::Ones()};
  EXPECT_EQ(none.clearance(rod, 1).face, -1);
}

// ---------------------------------------------------------------------------------------------- edges

TEST(Edges, EveryFaceNamesTheEdgesThatJoinItsVertices) {
  Random random(24);
  TriangleMesh mesh;
  for (int i = 0; i < 30; ++i) mesh.vertices.push_back(vectorIn(random, 1));
  const auto vertex = [&] { return static_cast<int>(random.bits() % 30); };
  while (mesh.faces.size() < 200) {
    const std::array<int, 3> face = {vertex(), vertex(), vertex()};
    if (face[0] != face[1] && face[1] != face[2] && face[2] != face[0]) mesh.faces.push_back(face);
  }
  const Obstacles obstacles = of(mesh);
  for (const Obstacles::Face& face : obstacles.faces())
    for (std::size_t k = 0; k < 3; ++k) {
      const MeshEdge& edge = obstacles.edges()[static_cast<std::size_t>(face.edges[k])];
      EXPECT_EQ(std::minmax(edge.a, edge.b), std::minmax(face.vertices[k], face.vertices[(k + 1) % 3]));
    }
  std::vector<std::pair<int, int>> pairs;
  for (const MeshEdge& edge : obstacles.edges()) pairs.push_back(std::minmax(edge.a, edge.b));
  std::sort(pairs.begin(), pairs.end());
  EXPECT_EQ(std::adjacent_find(pairs.begin(), pairs.end()), pairs.end()) << "each edge once";
}

TEST(Edges, ACubeHasTwelveConvexEdgesAndSixFlatOnes) {
  const Obstacles obstacles = of(cube());
  ASSERT_EQ(obstacles.edges().size(), 18u);
  const Vector3 centre = Vector3::Constant(0.5);
  int flat = 0;
  for (const MeshEdge& edge : obstacles.edges()) {
    const Vector3 middle = 0.5 * (obstacles.vertices()[static_cast<std::size_t>(edge.a)] +
                                  obstacles.vertices()[static_cast<std::size_t>(edge.b)]);
    if (edge.flat) {
      ++flat;
      EXPECT_EQ(edge.wedge, Vector3::Zero());
    } else {
      EXPECT_NEAR(edge.wedge.norm(), std::sqrt(2), 1e-15);
      EXPECT_LT(edge.wedge.dot(middle - centre), 0) << "into the cube";
    }
  }
  EXPECT_EQ(flat, 6);
}

/// Two faces on the edge from (0,0,0) to (0,1,0): one toward -x, the other turned up from +x by `angle`.
Obstacles hinge(double angle, int faces = 2, double rounding = 0x1p-53) {
  TriangleMesh mesh;
  mesh.rounding = rounding;
  mesh.vertices = {
      {0, 0, 0}, {0, 1, 0}, {-1, 0.3, 0}, {std::cos(angle), 0.6, std::sin(angle)}, {0.2, 0.5, -1}};
  mesh.faces = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}};
  mesh.faces.resize(static_cast<std::size_t>(faces));
  return of(mesh);
}

const MeshEdge& hingeEdge(const Obstacles& obstacles) { return obstacles.edges()[0]; }

TEST(Edges, AValleyOpensTowardItsWedgeWhateverTheOrientationOfTheFaces) {
  for (const double angle : {0.1, 1.0, 2.0, 3.0}) {
    EXPECT_GT(hingeEdge(hinge(angle)).wedge.z(), 0);
    EXPECT_LT(hingeEdge(hinge(-angle)).wedge.z(), 0);
    EXPECT_NEAR(hingeEdge(hinge(angle)).wedge.norm(), 2 * std::sin(angle / 2), 1e-14);
    EXPECT_FALSE(hingeEdge(hinge(angle)).flat);
  }
}

TEST(Edges, FlatMeansCoplanarToTheVerticesRoundingOnOppositeSides) {
  const auto is_flat = [](double angle, double rounding) {
    return hingeEdge(hinge(angle, 2, rounding)).flat;
  };
  EXPECT_TRUE(is_flat(0, 0x1p-53));
  EXPECT_TRUE(is_flat(1e-15, 0x1p-53));
  EXPECT_FALSE(is_flat(1e-13, 0x1p-53));
  EXPECT_TRUE(is_flat(1e-7, 0x1p-24));
  EXPECT_FALSE(is_flat(1e-6, 0x1p-24));
  const Obstacles folded = hinge(std::numbers::pi);  // the second face lies on the first
  EXPECT_FALSE(hingeEdge(folded).flat);
  EXPECT_NEAR(hingeEdge(folded).wedge.norm(), 2, 1e-14);
}

TEST(Edges, BoundaryAndThreefoldEdgesAreFeaturesWithoutAWedge) {
  for (const int faces : {1, 3}) {
    const Obstacles obstacles = hinge(1.0, faces);
    EXPECT_EQ(hingeEdge(obstacles).wedge, Vector3::Zero());
    EXPECT_FALSE(hingeEdge(obstacles).flat);
  }
}

TEST(Edges, AnEdgeIsNearestOnlyWhereItsWedgePointsAway) {
  Random random(25);
  int nearest_is_edge = 0;
  for (int i = 0; i < 200; ++i) {
    const Obstacles obstacles = hinge(random.uniform(-3, 3));
    const auto v = obstacles.vertices();
    for (int k = 0; k < 100; ++k) {
      const Vector3 p(random.uniform(-0.3, 0.3), random.uniform(0.2, 0.8), random.uniform(-0.3, 0.3));
      const PointTriangle first = closestPointOnTriangle(p, v[0], v[1], v[2]);
      const PointTriangle second = closestPointOnTriangle(p, v[0], v[1], v[3]);
      if (first.feature != Feature::edge01 || second.feature != Feature::edge01) continue;
      ++nearest_is_edge;
      EXPECT_LE(hingeEdge(obstacles).wedge.dot(p - first.closest), 1e-15);
    }
  }
  EXPECT_GT(nearest_is_edge, 1000);
}

TEST(Edges, SliversOfAspectRatioTenToTheTenGiveUnitDirections) {
  Random random(26);
  for (int i = 0; i < 2000; ++i) {
    TriangleMesh mesh;
    const Corners t = anyTriangle(random, -10);
    mesh.vertices = {t[0], t[1], t[2], vectorIn(random, 1)};
    mesh.faces = {{0, 1, 2}, {1, 0, 3}};
    const Obstacles obstacles = of(mesh);
    const MeshEdge& edge = obstacles.edges()[static_cast<std::size_t>(obstacles.faces()[0].edges[0])];
    EXPECT_TRUE(edge.wedge.allFinite());
    EXPECT_LE(edge.wedge.norm(), 2 + 1e-14);
    EXPECT_NEAR(edge.wedge.dot((t[1] - t[0]).normalized()), 0, 1e-14 + 1e-15 / (t[1] - t[0]).norm());
  }
}

TEST(Edges, FacesWithoutAreaAndRepeatedVerticesAreNoTrouble) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}};
  mesh.faces = {{0, 1, 2}, {0, 1, 3}, {3, 3, 0}, {1, 1, 1}};
  const Obstacles obstacles = of(mesh);
  for (const MeshEdge& edge : obstacles.edges()) EXPECT_TRUE(edge.wedge.allFinite());
}

// ---------------------------------------------------------------------------------------------- clearance

TEST(Clearance, EqualsASearchOverEveryFace) {
  Random random(27);
  for (int i = 0; i < 60; ++i) {
    const Obstacles obstacles = of(soup(random, i % 2 == 0 ? 3 : 300));
    const Vector3 start = vectorIn(random, i % 3 == 0 ? 20 : 1.5), turn = 0.2 * vectorIn(random, 1);
    std::vector<Vector3> rod;
    for (int k = 0; k < 8; ++k) rod.push_back(start + k * turn + 0.02 * vectorIn(random, 1));
    double expected = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k + 1 < rod.size(); ++k)
      for (const auto& face : obstacles.faces()) {
        const auto v = [&](std::size_t j) {
          return obstacles.vertices()[static_cast<std::size_t>(face.vertices[j])];
        };
        expected = std::min(expected,
                            closestPointsOfSegmentAndTriangle(rod[k], rod[k + 1], v(0), v(1), v(2)).distance);
      }
    for (const double limit : {std::numeric_limits<double>::infinity(), 2 * expected + 1e-3}) {
      const Obstacles::Clearance found = obstacles.clearance(rod, limit);
      EXPECT_DOUBLE_EQ(found.distance, expected);
      EXPECT_NEAR((found.on_rod - found.on_mesh).norm(), expected, 1e-13);
      ASSERT_TRUE(found.segment >= 0 && found.segment < 7 && found.face >= 0);
      const auto k = static_cast<std::size_t>(found.segment);
      EXPECT_LT(closestPointOnSegment(found.on_rod, rod[k], rod[k + 1]).distance, 1e-13);
    }
    const Obstacles::Clearance none = obstacles.clearance(rod, 0.99 * expected);
    EXPECT_EQ(none.face, -1);
    EXPECT_EQ(none.distance, std::numeric_limits<double>::infinity());
  }
}

// ---------------------------------------------------------------------------------------------- the soup

TEST(Obstacles, KeepTheMeshesApartAndRememberWhereFacesCameFrom) {
  const std::vector<TriangleMesh> meshes = {cube(), cube()};
  const Obstacles obstacles(meshes);
  EXPECT_EQ(obstacles.vertices().size(), 16u);
  EXPECT_EQ(obstacles.edges().size(), 36u);
  ASSERT_EQ(obstacles.faces().size(), 24u);
  for (std::size_t f = 0; f < 24; ++f) {
    EXPECT_EQ(obstacles.faces()[f].mesh, f < 12 ? 0 : 1);
    EXPECT_EQ(obstacles.faceInMesh(static_cast<int>(f), middleOf(obstacles, f)), static_cast<int>(f % 12));
  }
}

TEST(Obstacles, NameTheFaceOfTheMeshThatAPointIsOn) {
  // A sheet of 20 * 20 squares, which is two faces here.
  TriangleMesh mesh;
  for (int i = 0; i <= 20; ++i)
    for (int j = 0; j <= 20; ++j) mesh.vertices.emplace_back(i, j, 0);
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 20; ++j) {
      const int a = 21 * i + j;
      mesh.faces.push_back({a, a + 21, a + 22});
      mesh.faces.push_back({a, a + 22, a + 1});
    }
  const Obstacles obstacles = of(mesh);
  ASSERT_EQ(obstacles.faces().size(), 2u);
  EXPECT_EQ(obstacles.edges().size(), 5u);
  EXPECT_EQ(obstacles.deviation(), 0);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    Vector3 middle = Vector3::Zero();
    for (const int v : mesh.faces[f]) middle += mesh.vertices[static_cast<std::size_t>(v)] / 3;
    for (const int k : {0, 1}) EXPECT_EQ(obstacles.faceInMesh(k, middle), static_cast<int>(f));
  }
}

TEST(Obstacles, RefuseMeshesWithoutFacesWithWrongIndicesAndWithWildVertices) {
  TriangleMesh empty = cube(), wrong = cube(), wild = cube();
  empty.faces.clear();
  wrong.faces[5] = {0, 1, 8};
  wild.vertices[3].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(of(empty), InputError);
  EXPECT_THROW(of(wild), InputError);
  try {
    static_cast<void>(of(wrong));
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()), "obstacle mesh 0: face 5 names vertex 8; there are 8.");
  }
}

TEST(Obstacles, BuildingLeavesDenormalNumbersAlone) {
  const Obstacles obstacles = of(cube());
  volatile double tiny = std::numeric_limits<double>::min();
  EXPECT_GT(tiny / 2, 0) << "the builder must not leave the processor flushing them to zero";
}

}  // namespace
}  // namespace tendril
