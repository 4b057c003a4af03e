/// Random meshes to move a rod among, in units of the rod's length: ordinary, and as bad as CAD soups get.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "tendril/geometry.h"

namespace tendril::soak {

enum class WorldKind {
  soup,
  tube,
  random_tube,
  flat_coarse,
  flat_fine,
  terrain,
  corner,
  slivers,
  duplicates,
  fans,
  sheets,
  spikes
};
inline constexpr std::array<const char*, 12> kWorldNames = {
    "soup",   "tube",    "random tube", "flat, coarse", "flat, fine",   "terrain",
    "corner", "slivers", "duplicates",  "non-manifold", "close sheets", "spikes"};

struct World {
  TriangleMesh mesh;
  std::optional<Pose> start;  // of a straight rod's first node; none: anywhere it is free
};

inline double logUniform(Random& random, double low, double high) {
  return low * std::pow(high / low, random.uniform());
}
inline int between(Random& random, int low, int high) {
  return low + static_cast<int>(random.uniform() * (high - low + 1));
}
inline bool chance(Random& random, double p) { return random.uniform() < p; }
inline Vector3 inCube(Random& random, double half) {
  const double x = random.uniform(-half, half), y = random.uniform(-half, half);
  return {x, y, random.uniform(-half, half)};
}
inline Vector3 direction(Random& random) { return random.rotation() * Vector3::UnitX(); }

class Builder {
 public:
  explicit Builder(Random& random) : random_(random) {}

  int vertex(const Vector3& p) {
    mesh_.vertices.push_back(p);
    return static_cast<int>(mesh_.vertices.size()) - 1;
  }
  /// A face in a random order of its corners; none where it has no area.
  void face(int a, int b, int c) {
    const auto at = [&](int i) { return mesh_.vertices[static_cast<std::size_t>(i)]; };
    if (!((at(b) - at(a)).cross(at(c) - at(a)).norm() > 0)) return;
    std::array<int, 3> corners = {a, b, c};
    std::rotate(corners.begin(), corners.begin() + between(random_, 0, 2), corners.end());
    if (chance(random_, 0.5)) std::swap(corners[0], corners[1]);
    mesh_.faces.push_back(corners);
  }
  void triangle(const Vector3& a, const Vector3& b, const Vector3& c) {
    const int i = vertex(a), j = vertex(b);
    face(i, j, vertex(c));
  }
  /// The points at(i, j), i <= columns, j <= rows, as squares of two faces, the diagonal this way or that.
  template <class At>
  void grid(int columns, int rows, At&& at) {
    const int first = static_cast<int>(mesh_.vertices.size());
    for (int i = 0; i <= columns; ++i)
      for (int j = 0; j <= rows; ++j) vertex(at(i, j));
    const auto index = [&](int i, int j) { return first + i * (rows + 1) + j; };
    for (int i = 0; i < columns; ++i)
      for (int j = 0; j < rows; ++j) {
        const int a = index(i, j), b = index(i + 1, j), c = index(i + 1, j + 1), d = index(i, j + 1);
        if (chance(random_, 0.5))
          face(a, b, c), face(a, c, d);
        else
          face(a, b, d), face(b, c, d);
      }
  }
  void soup(int count, double half, double smallest, double largest) {
    for (int k = 0; k < count; ++k) {
      const Vector3 at = inCube(random_, half);
      const double size = logUniform(random_, smallest, largest);
      const Vector3 b = at + size * direction(random_);
      triangle(at, b, at + size * direction(random_));
    }
  }
  /// Repeats every face up to `most` times, with the same vertices or with their copies.
  void repeatFaces(int most) {
    const std::size_t count = mesh_.faces.size();
    for (std::size_t f = 0; f < count; ++f)
      for (int k = between(random_, 0, most); k > 0; --k) {
        std::array<int, 3> corners = mesh_.faces[f];
        if (chance(random_, 0.5))
          for (int& corner : corners)
            corner = vertex(Vector3(mesh_.vertices[static_cast<std::size_t>(corner)]));
        face(corners[0], corners[1], corners[2]);
      }
  }
  /// An open tube along x, bent in the plane of x and y after half of its length if `bend` [rad] is not zero.
  /// Nothing of it is nearer to its axis than `radius` but for the bend.
  void tube(double radius, double from, double to, int rings, int sides, double bend, bool jitter) {
    const double corner = radius / std::cos(std::numbers::pi / sides) * (jitter ? 1.1 : 1);
    const double middle = 0.5 * (from + to), half = to - middle;
    std::vector<double> places(static_cast<std::size_t>(rings) + 1);
    for (int i = 0; i <= rings; ++i)
      places[static_cast<std::size_t>(i)] = from + (to - from) * (i == 0       ? 0
                                                                  : i == rings ? 1
                                                                  : jitter     ? random_.uniform()
                                                                           : static_cast<double>(i) / rings);
    std::sort(places.begin(), places.end());
    const int first = static_cast<int>(mesh_.vertices.size());
    for (const double x : places)
      for (int k = 0; k < sides; ++k) {
        const double shift = jitter ? random_.uniform(-0.1, 0.1) : 0;
        const double angle = 2 * std::numbers::pi * (k + shift) / sides;
        const double rho = corner * (jitter ? random_.uniform(1.0, 1.3) : 1);
        Vector3 axis(x, 0, 0), across(0, 1, 0);
        if (bend != 0 && x > middle) {
          const double turn = bend * (x - middle) / half, bend_radius = half / bend;
          axis = {middle + bend_radius * std::sin(turn), bend_radius * (1 - std::cos(turn)), 0};
          across = {-std::sin(turn), std::cos(turn), 0};
        }
        vertex(axis + rho * (std::cos(angle) * across + std::sin(angle) * Vector3::UnitZ()));
      }
    for (int i = 0; i < rings; ++i)
      for (int k = 0; k < sides; ++k) {
        const int next = (k + 1) % sides;
        const int a = first + i * sides + k, b = first + i * sides + next, c = b + sides, d = a + sides;
        if (chance(random_, jitter ? 0.5 : 1))
          face(a, b, c), face(a, c, d);
        else
          face(a, b, d), face(b, c, d);
      }
  }
  TriangleMesh take() { return std::move(mesh_); }

 private:
  Random& random_;
  TriangleMesh mesh_;
};

/// A random world of the kind for a rod of radius r, in units of L.
inline World makeWorld(WorldKind kind, double r, Random& random) {
  Builder build(random);
  World world;
  const auto lying = [&](double height) {  // above the plane z = 0
    return Pose{expSO3({0, 0, random.uniform(-3, 3)}), Vector3(0.1, -0.2, height)};
  };
  switch (kind) {
    case WorldKind::soup:
      build.soup(between(random, 10, 200), 0.7, 0.02, 0.8);
      break;
    case WorldKind::tube:
    case WorldKind::random_tube: {
      const bool jitter = kind == WorldKind::random_tube;
      const double from = random.uniform(-0.2, 1.05), to = from + random.uniform(0.2, 0.9);
      build.tube(r * random.uniform(1.1, 2.2), from, to, between(random, jitter ? 3 : 1, 30),
                 between(random, 5, 24), from > 0.4 && chance(random, 0.6) ? random.uniform(-1.2, 1.2) : 0,
                 jitter);
      world.start = Pose{};
      break;
    }
    case WorldKind::flat_coarse:
      build.grid(1, 1, [](int i, int j) { return Vector3(4.0 * i - 2, 4.0 * j - 2, 0); });
      if (chance(random, 0.5))
        build.grid(1, 1, [](int i, int j) { return Vector3(1.2, 4.0 * i - 2, 4.0 * j - 2); });
      world.start = lying(r * random.uniform(1.05, 5));
      break;
    case WorldKind::flat_fine: {
      const int n = between(random, 20, 60);
      const double cell = std::max(logUniform(random, 0.2, 5) * r, 0.3 / n);
      build.grid(n, n, [&](int i, int j) { return Vector3(cell * (i - 0.5 * n), cell * (j - 0.5 * n), 0); });
      world.start = lying(r * random.uniform(1.05, 5));
      break;
    }
    case WorldKind::terrain: {
      const int n = between(random, 6, 40);
      const double height = logUniform(random, 0.1 * r, 0.3);
      build.grid(n, n, [&](int i, int j) {
        return Vector3(2.4 * i / n - 1.2, 2.4 * j / n - 1.2, height * random.uniform());
      });
      world.start = lying(height + 1.2 * r);
      break;
    }
    case WorldKind::corner: {
      const double open = random.uniform(0.2, 3);  // the angle between the two walls
      const Vector3 u(std::cos(0.5 * open), std::sin(0.5 * open), 0), v(u.x(), -u.y(), 0);
      for (const Vector3& w : {u, v})
        build.grid(3, 3, [&](int i, int j) -> Vector3 { return 0.7 * i * w + Vector3(0, 0, 0.7 * j); });
      build.triangle({-2, 0, -0.001 * r}, {2, -2.5, -0.001 * r}, {2, 2.5, -0.001 * r});
      break;
    }
    case WorldKind::slivers:
      for (int k = between(random, 30, 200); k > 0; --k) {
        const Vector3 a = inCube(random, 0.7), along = logUniform(random, 0.05, 1.5) * direction(random);
        const Vector3 c =
            a + random.uniform(-0.1, 1.1) * along + logUniform(random, 1e-12, 1e-2) * direction(random);
        build.triangle(a, a + along, c);
      }
      break;
    case WorldKind::duplicates:
      if (chance(random, 0.5)) {
        build.soup(between(random, 10, 60), 0.7, 0.05, 0.8);
      } else {
        const int n = between(random, 1, 12);
        build.grid(n, n, [&](int i, int j) { return Vector3(2.0 * i / n - 1, 2.0 * j / n - 1, 0); });
        world.start = lying(r * random.uniform(1.05, 5));
      }
      build.repeatFaces(5);
      break;
    case WorldKind::fans:
      for (int k = between(random, 3, 20); k > 0; --k) {
        const int a = build.vertex(inCube(random, 0.6));
        const int b = build.vertex(inCube(random, 0.6));
        for (int sheets = between(random, 3, 8); sheets > 0; --sheets)
          build.face(a, b, build.vertex(inCube(random, 0.7)));
      }
      break;
    case WorldKind::sheets: {
      const int n = between(random, 1, 16);
      const double apart = r * logUniform(random, 1e-3, 2), size = random.uniform(0.3, 1.5);
      for (const double z : {0.0, -apart})
        build.grid(n, n, [&](int i, int j) {
          return Vector3(size * (static_cast<double>(i) / n - 0.5), size * (static_cast<double>(j) / n - 0.5),
                         z);
        });
      world.start = lying(r * random.uniform(1.05, 5));
      break;
    }
    case WorldKind::spikes:
      for (int k = between(random, 5, 40); k > 0; --k) {
        const Vector3 foot(random.uniform(-0.8, 0.8), random.uniform(-0.8, 0.8), 0);
        const double width = logUniform(random, 0.2 * r, 0.2);
        const int tip = build.vertex(foot + Vector3(0, 0, logUniform(random, r, 0.3)));
        std::array<int, 4> base;
        for (int i = 0; i < 4; ++i)
          base[static_cast<std::size_t>(i)] =
              build.vertex(foot + width * Vector3(std::cos(1.6 * i), std::sin(1.6 * i), 0));
        for (std::size_t i = 0; i < 4; ++i) build.face(tip, base[i], base[(i + 1) % 4]);
      }
      world.start = lying(0.3 + 1.2 * r);
      break;
  }
  world.mesh = build.take();
  return world;
}

}  // namespace tendril::soak
