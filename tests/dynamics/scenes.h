/// Small models for the tests and benchmarks of the dynamics.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "tendril/dynamics.h"

namespace tendril::scenes {

/// A rod of L = 1 m, r = 0.01 m, rho = 1000 kg/m^3, nu = 0.4.
inline Scenario rodScenario(double young_modulus, int elements) {
  Scenario s;
  s.rod.length = 1, s.rod.radius = 0.01, s.rod.density = 1000, s.rod.elements = elements;
  s.rod.c = stiffnessOfRoundRod(young_modulus, young_modulus / 2.8, s.rod.radius);
  const double ei = s.rod.bendingStiffness();
  s.grippers.max_force = 200 * ei, s.grippers.max_torque = 10 * ei;
  s.simulation.contact_distance = 0.5 * s.rod.radius;
  return s;
}

/// Straight from `from`, along the frame's x axis.
inline RodShape straight(const Pose& from, double length, int elements) {
  RodShape shape(static_cast<std::size_t>(elements) + 1);
  for (std::size_t i = 0; i < shape.size(); ++i) {
    shape[i] = from;
    shape[i].position += from.rotation * Vector3(length * static_cast<double>(i) / elements, 0, 0);
  }
  return shape;
}

inline Obstacles nothing() { return Obstacles(std::span<const TriangleMesh>{}); }

/// The axis-aligned box between two corners, 12 faces.
inline TriangleMesh block(const Vector3& low, const Vector3& high) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices.emplace_back((i & 1) ? high.x() : low.x(), (i & 2) ? high.y() : low.y(),
                               (i & 4) ? high.z() : low.z());
  mesh.faces = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

/// An open prism along x around the x axis with `sides` faces whose inscribed radius is `radius`.
inline TriangleMesh tube(double radius, double from_x, double to_x, int sides = 16) {
  TriangleMesh mesh;
  const double corner = radius / std::cos(std::numbers::pi / sides);
  for (int i = 0; i < sides; ++i) {
    const double angle = 2 * std::numbers::pi * i / sides;
    for (const double x : {from_x, to_x})
      mesh.vertices.emplace_back(x, corner * std::cos(angle), corner * std::sin(angle));
  }
  for (int i = 0; i < sides; ++i) {
    const int a = 2 * i, b = 2 * ((i + 1) % sides);
    mesh.faces.push_back({a, a + 1, b});
    mesh.faces.push_back({b, a + 1, b + 1});
  }
  return mesh;
}

/// The same shape with every face cut into n * n.
inline TriangleMesh refined(const TriangleMesh& mesh, int n) {
  TriangleMesh fine{.vertices = mesh.vertices, .faces = {}};
  std::map<std::array<int, 3>, int> on_edge;  // vertices by the edge's ends, the lower first, and the place
  for (const auto& [a, b, c] : mesh.faces) {
    const auto between = [&](int from, int to, int i) {
      if (from > to) std::swap(from, to), i = n - i;
      if (i == 0 || i == n) return i == 0 ? from : to;
      const auto [vertex, is_new] =
          on_edge.try_emplace({from, to, i}, static_cast<int>(fine.vertices.size()));
      const Vector3 &p = mesh.vertices[static_cast<std::size_t>(from)],
                    &q = mesh.vertices[static_cast<std::size_t>(to)];
      if (is_new) fine.vertices.push_back(p + static_cast<double>(i) / n * (q - p));
      return vertex->second;
    };
    std::vector<std::vector<int>> rows;  // row i, from ab to ac, i of n from a
    for (int i = 0; i <= n; ++i) {
      const int first = between(a, b, i), last = between(a, c, i);
      rows.push_back({first});
      for (int j = 1; j < i; ++j) {
        if (i == n) {
          rows.back().push_back(between(b, c, j));
          continue;
        }
        const Vector3 p = fine.vertices[static_cast<std::size_t>(first)],
                      q = fine.vertices[static_cast<std::size_t>(last)];
        rows.back().push_back(static_cast<int>(fine.vertices.size()));
        fine.vertices.push_back(p + static_cast<double>(j) / i * (q - p));
      }
      if (i > 0) rows.back().push_back(last);
    }
    for (std::size_t i = 0; i + 1 < rows.size(); ++i)
      for (std::size_t j = 0; j <= i; ++j) {
        fine.faces.push_back({rows[i][j], rows[i + 1][j], rows[i + 1][j + 1]});
        if (j < i) fine.faces.push_back({rows[i][j], rows[i + 1][j + 1], rows[i][j + 1]});
      }
  }
  return fine;
}

inline Obstacles obstaclesOf(std::vector<TriangleMesh> meshes) { return Obstacles(meshes); }

/// The smallest distance [m] of a shape's centreline to the meshes, by brute force over all pairs.
inline double bruteForceDistance(const RodShape& shape, const Obstacles& obstacles) {
  double least = std::numeric_limits<double>::infinity();
  const auto v = obstacles.vertices();
  for (const Obstacles::Face& f : obstacles.faces())
    for (std::size_t i = 0; i + 1 < shape.size(); ++i)
      least = std::min(least, closestPointsOfSegmentAndTriangle(shape[i].position, shape[i + 1].position,
                                                                v[static_cast<std::size_t>(f.vertices[0])],
                                                                v[static_cast<std::size_t>(f.vertices[1])],
                                                                v[static_cast<std::size_t>(f.vertices[2])])
                                  .distance);
  return least;
}

}  // namespace tendril::scenes
