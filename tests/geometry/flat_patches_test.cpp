/// What is flat is taken in few faces, and nothing of the mesh is lost by it.
#include "tendril/geometry/flat_patches.h"

#include <gtest/gtest.h>

#include <map>
#include <numbers>
#include <set>

#include "reference.h"

namespace tendril {
namespace {

using namespace reference;

using Edge = std::pair<int, int>;

/// A box of n * n squares a side.
TriangleMesh box(int n, const Vector3& size = {1, 1, 1}) {
  TriangleMesh mesh;
  std::map<std::array<int, 3>, int> known;
  const auto vertex = [&](const std::array<int, 3>& at) {
    const auto [found, is_new] = known.try_emplace(at, static_cast<int>(mesh.vertices.size()));
    if (is_new) mesh.vertices.emplace_back(Vector3(at[0], at[1], at[2]).cwiseProduct(size) / n);
    return found->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const int side : {0, n})
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          const auto corner = [&](int di, int dj) {
            std::array<int, 3> at{};
            at[axis] = side, at[(axis + 1) % 3] = i + di, at[(axis + 2) % 3] = j + dj;
            return vertex(at);
          };
          mesh.faces.push_back({corner(0, 0), corner(1, 0), corner(1, 1)});
          mesh.faces.push_back({corner(0, 0), corner(1, 1), corner(0, 1)});
        }
  return mesh;
}

void turn(TriangleMesh& mesh, const Quaternion& by) {
  for (Vector3& v : mesh.vertices) v = by * v;
}
void roundToSinglePrecision(TriangleMesh& mesh) {
  for (Vector3& v : mesh.vertices) v = v.cast<float>().cast<double>();
  mesh.rounding = 0x1p-24;
}
double extentOf(const TriangleMesh& mesh) {
  Aabb all;
  for (const Vector3& v : mesh.vertices) all.include(v);
  return (all.max - all.min).norm();
}

Vector3 anyPointOf(Random& random, const TriangleMesh& mesh, const std::array<int, 3>& face) {
  double x = random.uniform(), y = random.uniform();
  if (x + y > 1) x = 1 - x, y = 1 - y;
  const auto corner = [&](std::size_t k) { return mesh.vertices[static_cast<std::size_t>(face[k])]; };
  return corner(0) + x * (corner(1) - corner(0)) + y * (corner(2) - corner(0));
}
/// Whether some face is no farther from p; asked twice where a sliver's closest point is not exact.
bool isWithin(double distance, const Vector3& p, const TriangleMesh& mesh,
              const std::vector<std::array<int, 3>>& faces) {
  const auto any = [&](auto distance_to) {
    return std::any_of(faces.begin(), faces.end(), [&](const std::array<int, 3>& f) {
      const auto corner = [&](std::size_t k) { return mesh.vertices[static_cast<std::size_t>(f[k])]; };
      return distance_to(corner(0), corner(1), corner(2)) <= distance;
    });
  };
  return any([&](const Vector3& a, const Vector3& b, const Vector3& c) {
           return closestPointOnTriangle(p, a, b, c).distance;
         }) ||
         any([&](const Vector3& a, const Vector3& b, const Vector3& c) { return pointTriangle(p, a, b, c); });
}
std::vector<std::array<int, 3>> facesOf(const FlatPatches& flat) {
  std::vector<std::array<int, 3>> faces;
  for (const FlatPatches::Face& face : flat.faces) faces.push_back(face.vertices);
  return faces;
}

/// The faces that are left and the mesh's are one surface, to within the deviation.
void expectTheSameSurface(Random& random, const TriangleMesh& mesh, const FlatPatches& flat) {
  const double within = flat.deviation + 1e-14 * extentOf(mesh);
  const std::vector<std::array<int, 3>> faces = facesOf(flat);
  for (const std::array<int, 3>& face : mesh.faces)
    EXPECT_TRUE(isWithin(within, anyPointOf(random, mesh, face), mesh, faces));
  for (const std::array<int, 3>& face : faces)
    EXPECT_TRUE(isWithin(within, anyPointOf(random, mesh, face), mesh, mesh.faces));
}

double areaOf(const TriangleMesh& mesh, const std::vector<std::array<int, 3>>& faces) {
  double sum = 0;
  for (const auto& [a, b, c] : faces) {
    const auto at = [&](int v) { return mesh.vertices[static_cast<std::size_t>(v)]; };
    sum += 0.5 * (at(b) - at(a)).cross(at(c) - at(a)).norm();
  }
  return sum;
}

TEST(FlatPatches, ABoxHasTwelveFacesHoweverFineItIsCut) {
  Random random(40);
  for (const int n : {1, 2, 3, 7, 30}) {
    for (const bool turned : {false, true}) {
      TriangleMesh mesh = box(n, {1, 0.3, 2});
      if (turned) turn(mesh, random.rotation());
      const FlatPatches flat = flatPatches(mesh);
      EXPECT_EQ(flat.faces.size(), 12u) << n;
      EXPECT_EQ(flat.off_plane.size(), 6u);
      EXPECT_LT(flat.deviation, 1e-13);
      EXPECT_NEAR(areaOf(mesh, facesOf(flat)), 2 * (0.3 + 0.6 + 2), 1e-12);
      expectTheSameSurface(random, mesh, flat);
    }
  }
}

TEST(FlatPatches, SinglePrecisionIsFlatAndItsRoundingIsTold) {
  Random random(41);
  for (int i = 0; i < 40; ++i) {
    TriangleMesh mesh = box(12);
    turn(mesh, random.rotation());
    const double far = i < 20 ? 0 : 30;  // from the file's origin
    for (Vector3& v : mesh.vertices) v += far * Vector3(1, 2, -2) / 3;
    roundToSinglePrecision(mesh);
    const FlatPatches flat = flatPatches(mesh);
    EXPECT_EQ(flat.faces.size(), 12u);
    EXPECT_EQ(flat.off_plane.size(), 6u);
    EXPECT_GT(flat.deviation, 1e-9 * (1 + far));
    EXPECT_LT(flat.deviation, 1e-6 * (1 + far));
    expectTheSameSurface(random, mesh, flat);
  }
}

TEST(FlatPatches, AShallowReliefStaysAsItIsThoughTheMeshReachesAKilometre) {
  // Dents of 50 um in a sheet of 40 mm near the file's origin, and a floor in the same file.
  Random random(46);
  TriangleMesh mesh;
  for (int i = 0; i <= 40; ++i)
    for (int j = 0; j <= 40; ++j) mesh.vertices.emplace_back(1e-3 * i, 1e-3 * j, random.uniform(0, 5e-5));
  for (int i = 0; i < 40; ++i)
    for (int j = 0; j < 40; ++j) {
      const int a = 41 * i + j;
      mesh.faces.push_back({a, a + 41, a + 42});
      mesh.faces.push_back({a, a + 42, a + 1});
    }
  const std::size_t relief = mesh.faces.size();
  const int floor = static_cast<int>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), {{-1e3, -1e3, -1}, {1e3, -1e3, -1}, {0, 1e3, -1}});
  mesh.faces.push_back({floor, floor + 1, floor + 2});
  roundToSinglePrecision(mesh);
  const FlatPatches flat = flatPatches(mesh);
  EXPECT_EQ(flat.faces.size(), relief + 1);
  EXPECT_LT(flat.deviation, 1e-7);
}

TEST(FlatPatches, AHubOfManyFacesIsNoTrouble) {
  // Blades about an axis, every one cut in three about its middle: time that grows with the square of their
  // number would be minutes.
  constexpr int kBlades = 20'000;
  TriangleMesh mesh;
  mesh.vertices.emplace_back(0, 0, 0);
  for (int i = 0; i < kBlades; ++i) {
    const double angle = 2 * std::numbers::pi * i / kBlades, up = i % 2;
    const int a = static_cast<int>(mesh.vertices.size());
    mesh.vertices.emplace_back(std::cos(angle), std::sin(angle), up);
    mesh.vertices.emplace_back(std::cos(angle), std::sin(angle), up + 1);
    mesh.vertices.push_back((mesh.vertices[static_cast<std::size_t>(a)] + mesh.vertices.back()) / 3);
    mesh.faces.insert(mesh.faces.end(), {{0, a, a + 2}, {a, a + 1, a + 2}, {a + 1, 0, a + 2}});
  }
  const FlatPatches flat = flatPatches(mesh);
  EXPECT_EQ(flat.off_plane.size(), std::size_t{kBlades});
}

TEST(FlatPatches, WhatIsCurvedStaysAsItIs) {
  // A sphere of rings: no two neighbouring squares are in one plane, the two halves of each are.
  TriangleMesh mesh;
  constexpr int kRings = 20, kSides = 40;
  for (int i = 1; i < kRings; ++i)
    for (int k = 0; k < kSides; ++k) {
      const double down = std::numbers::pi * i / kRings, around = 2 * std::numbers::pi * k / kSides;
      mesh.vertices.emplace_back(std::sin(down) * std::cos(around), std::sin(down) * std::sin(around),
                                 std::cos(down));
    }
  for (int i = 0; i + 2 < kRings; ++i)
    for (int k = 0; k < kSides; ++k) {
      const int a = i * kSides + k, b = i * kSides + (k + 1) % kSides;
      mesh.faces.push_back({a, b, a + kSides});
      mesh.faces.push_back({b, b + kSides, a + kSides});
    }
  const FlatPatches flat = flatPatches(mesh);
  EXPECT_EQ(facesOf(flat), mesh.faces);
  EXPECT_EQ(flat.off_plane.size(), std::size_t{(kRings - 2) * kSides});
  EXPECT_LT(flat.deviation, 1e-14);
}

TEST(FlatPatches, HolesAndBordersOfASheetKeepTheirShape) {
  // A sheet of 12 * 12 squares without the middle 4 * 4: eight corners, eight faces at least.
  Random random(42);
  TriangleMesh mesh;
  for (int i = 0; i <= 12; ++i)
    for (int j = 0; j <= 12; ++j) mesh.vertices.emplace_back(i, j, 0);
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j) {
      if (i >= 4 && i < 8 && j >= 4 && j < 8) continue;
      const int a = 13 * i + j;
      mesh.faces.push_back({a, a + 13, a + 14});
      mesh.faces.push_back({a, a + 14, a + 1});
    }
  turn(mesh, random.rotation());
  const FlatPatches flat = flatPatches(mesh);
  EXPECT_EQ(flat.faces.size(), 8u);
  EXPECT_NEAR(areaOf(mesh, facesOf(flat)), 144 - 16, 1e-10);
  expectTheSameSurface(random, mesh, flat);
}

TEST(FlatPatches, SheetsThatMeetInALineAndSheetsFoldedFlatStayApart) {
  // Three sheets on one line: their common edges stay. A sheet folded onto itself: two patches.
  Random random(43);
  TriangleMesh three, folded;
  for (double j = 0; j <= 4; ++j) {
    three.vertices.insert(three.vertices.end(), {{0, j, 0}, {1, j, 0}, {-1, j, 0}, {0, j, 1}});
    folded.vertices.insert(folded.vertices.end(), {{0, j, 0}, {1, j, 0}, {1, j, 0}});
  }
  for (int j = 0; j < 4; ++j) {
    for (int k = 1; k < 4; ++k) {
      three.faces.push_back({4 * j, 4 * j + k, 4 * j + 4});
      three.faces.push_back({4 * j + k, 4 * j + 4 + k, 4 * j + 4});
    }
    for (int k = 1; k < 3; ++k) {
      folded.faces.push_back({3 * j, 3 * j + k, 3 * j + 3});
      folded.faces.push_back({3 * j + k, 3 * j + 3 + k, 3 * j + 3});
    }
  }
  const FlatPatches of_three = flatPatches(three), of_folded = flatPatches(folded);
  EXPECT_EQ(of_three.off_plane.size(), 3u);
  EXPECT_EQ(of_folded.off_plane.size(), 2u);
  expectTheSameSurface(random, three, of_three);
  expectTheSameSurface(random, folded, of_folded);
  std::map<Edge, int> uses;
  for (const auto& face : facesOf(of_three))
    for (std::size_t k = 0; k < 3; ++k) ++uses[std::minmax(face[k], face[(k + 1) % 3])];
  for (int j = 0; j < 4; ++j) EXPECT_EQ((uses[{4 * j, 4 * j + 4}]), 3);
}

/// Faces on a few vertices of a small lattice: coplanar, doubled, folded, without area, of two corners; edges
/// of any number of faces.
TriangleMesh lattice(Random& random) {
  TriangleMesh mesh;
  const auto oneOf = [&](int count) {
    return static_cast<int>(random.bits() % static_cast<std::uint64_t>(count));
  };
  const int high = 1 + oneOf(2), vertices = 4 + oneOf(20), faces = 2 + oneOf(30);
  for (int i = 0; i < vertices; ++i) mesh.vertices.emplace_back(oneOf(4), oneOf(4), oneOf(high));
  for (int i = 0; i < faces; ++i) mesh.faces.push_back({oneOf(vertices), oneOf(vertices), oneOf(vertices)});
  return mesh;
}

/// A sheet with a dent here and there, its squares cut one way or the other, some left out, some doubled.
TriangleMesh sheet(Random& random) {
  TriangleMesh mesh;
  const auto oneOf = [&](int count) {
    return static_cast<int>(random.bits() % static_cast<std::uint64_t>(count));
  };
  const int n = 2 + oneOf(7);
  const double dent = oneOf(3) == 0 ? power(random, -9, 0) : 0,
               off = oneOf(2) == 0 ? power(random, -17, -5) : 0;
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j)
      mesh.vertices.emplace_back(Vector3(i, j, oneOf(6) == 0 ? dent : 0) + off * vectorIn(random, 1));
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const int a = (n + 1) * i + j, b = a + n + 1;
      const bool other = oneOf(2) == 0;
      if (oneOf(12) > 0) mesh.faces.push_back({a, b, other ? a + 1 : b + 1});
      if (oneOf(12) > 0) mesh.faces.push_back({other ? b : a, b + 1, a + 1});
      if (oneOf(20) == 0) mesh.faces.push_back({b, a, b + 1});
    }
  if (mesh.faces.empty()) mesh.faces.push_back({0, 1, n + 1});
  return mesh;
}

TEST(FlatPatches, NoPointOfAnyMeshIsFartherFromItsFacesThanTheDeviation) {
  Random random(44);
  std::size_t before = 0, after = 0;
  for (int i = 0; i < 3000; ++i) {
    TriangleMesh mesh = i % 2 == 0 ? sheet(random) : lattice(random);
    turn(mesh, random.rotation());
    if (i % 3 == 0) roundToSinglePrecision(mesh);
    if (i % 3 == 1) mesh.rounding = power(random, -12, -4);
    const FlatPatches flat = flatPatches(mesh);
    before += mesh.faces.size(), after += flat.faces.size();
    EXPECT_LE(flat.deviation, 25 * (mesh.rounding + 1e-14) * 20);
    expectTheSameSurface(random, mesh, flat);
    ASSERT_FALSE(::testing::Test::HasFailure()) << "mesh " << i;
  }
  EXPECT_LT(after, before * 3 / 4) << "there was something to lose";
}

TEST(FlatPatches, EveryEdgeOfThePatchesOutlineIsStillAnEdge) {
  // An edge that some faces have in common with another patch, or with none, is where the rod can be cut;
  // what was between two patches has to be so still.
  Random random(45);
  for (int i = 0; i < 1000; ++i) {
    const TriangleMesh mesh = sheet(random);
    const FlatPatches flat = flatPatches(mesh);
    const auto outline = [&](const std::vector<std::pair<std::array<int, 3>, int>>& faces) {
      std::map<Edge, std::multiset<int>> patches;
      for (const auto& [face, patch] : faces)
        for (std::size_t k = 0; k < 3; ++k) patches[std::minmax(face[k], face[(k + 1) % 3])].insert(patch);
      std::vector<Edge> edges;
      for (const auto& [edge, of] : patches)
        if (of.size() != 2 || *of.begin() != *of.rbegin()) edges.push_back(edge);
      return edges;
    };
    std::vector<std::pair<std::array<int, 3>, int>> given, left;
    for (std::size_t f = 0; f < mesh.faces.size(); ++f) given.emplace_back(mesh.faces[f], flat.patch_of[f]);
    for (const FlatPatches::Face& face : flat.faces) left.emplace_back(face.vertices, face.patch);
    const std::vector<Edge> now = outline(left);
    for (const auto& [a, b] : outline(given)) {
      const auto at = [&](int v) { return mesh.vertices[static_cast<std::size_t>(v)]; };
      const Vector3 middle = 0.5 * (at(a) + at(b));
      double least = std::numeric_limits<double>::infinity();
      for (const auto& [c, d] : now)
        least = std::min(least, closestPointOnSegment(middle, at(c), at(d)).distance);
      EXPECT_LE(least, flat.deviation + 1e-14 * extentOf(mesh)) << "mesh " << i;
    }
  }
}

}  // namespace
}  // namespace tendril
