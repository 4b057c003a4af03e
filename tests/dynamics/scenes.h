/// Small models for the tests and benchmarks of the dynamics.
#pragma once

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

}  // namespace tendril::scenes
