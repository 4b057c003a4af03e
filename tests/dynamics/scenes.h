/// Small models for the tests and benchmarks of the dynamics.
#pragma once

#include <cmath>
#include <limits>
#include <numbers>

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
