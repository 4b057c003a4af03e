/// tendril/quantities.h: what people ask of a motion: curvature and bend radius, strains, internal wrench,
/// gripper wrenches, contacts, clearance, energies. Plain data, one record per simulation step; the dynamics
/// measure it, the solution file keeps it (docs/solution.md).
#pragma once

#include <span>

#include "tendril/rod.h"

namespace tendril {

/// A force on the rod where it touches an obstacle.
struct ContactForce {
  double s;          // m, arc length at rest
  Vector3 position;  // m, world
  Vector3 force;     // N, on the rod, world
};

/// The force between two parts of the rod that touch.
struct SelfContactForce {
  std::array<double, 2> s;  // m, arc length at rest of either part
  Vector3 position;         // m, world, halfway between their centrelines
  Vector3 force;            // N, on the first part, world; the second has the opposite
};

/// What holds at the end of one simulation step. What belongs to an element is that of its middle,
/// s = (k + 1/2) h, in the frame of that middle.
struct Quantities {
  double time = 0;         // s
  std::int64_t state = 0;  // the stored state of the trajectory

  // Per element.
  std::vector<Vector3> curvature;        // 1/m: twist, bending, bending; the rest curvature included
  std::vector<Vector3> strain;           // -: stretch, shear, shear
  std::vector<Vector3> internal_moment;  // N m: elastic, of what lies beyond s on what lies before it
  std::vector<Vector3> internal_force;   // N, likewise; the first component is tension
  std::optional<double> bend_radius;     // m, the smallest of the centreline; none: the rod is straight
  std::optional<double> bend_radius_s;   // m, where

  // Per end: what the gripper does to the rod, about the end's node, world. Zero where none holds it.
  std::array<Vector3, 2> gripper_moment = {Vector3::Zero(), Vector3::Zero()};  // N m
  std::array<Vector3, 2> gripper_force = {Vector3::Zero(), Vector3::Zero()};   // N
  std::array<double, 2> gripper_work = {0, 0};                                 // J, since the start

  std::vector<ContactForce> contacts;  // normal forces, at the obstacle's surface
  std::vector<ContactForce> friction;  // tangential forces, at the centreline
  std::vector<SelfContactForce> self_contacts;
  std::optional<double> clearance;  // m, of the rod's surface from the obstacles; none: there are none

  // J.
  double kinetic = 0;
  double twist = 0, bending = 0, stretch = 0, shear = 0;  // elastic
  double gravity = 0;                                     // from the world's origin
  double contact = 0;                                     // of the barriers
  double total = 0;
  double dissipated = 0;  // work of both grippers less the gain of `total`, since the start
};

/// Calls visit(key, member) for every quantity, so that reader, writer and docs agree.
template <class Visit>
void visitQuantities(Visit&& visit) {
  visit("time_s", &Quantities::time);
  visit("state", &Quantities::state);
  visit("curvature_1_m", &Quantities::curvature);
  visit("strain", &Quantities::strain);
  visit("internal_moment_n_m", &Quantities::internal_moment);
  visit("internal_force_n", &Quantities::internal_force);
  visit("bend_radius_m", &Quantities::bend_radius);
  visit("bend_radius_s_m", &Quantities::bend_radius_s);
  visit("gripper_moment_n_m", &Quantities::gripper_moment);
  visit("gripper_force_n", &Quantities::gripper_force);
  visit("gripper_work_j", &Quantities::gripper_work);
  visit("contacts", &Quantities::contacts);
  visit("friction", &Quantities::friction);
  visit("self_contacts", &Quantities::self_contacts);
  visit("clearance_m", &Quantities::clearance);
  visit("energy_kinetic_j", &Quantities::kinetic);
  visit("energy_twist_j", &Quantities::twist);
  visit("energy_bending_j", &Quantities::bending);
  visit("energy_stretch_j", &Quantities::stretch);
  visit("energy_shear_j", &Quantities::shear);
  visit("energy_gravity_j", &Quantities::gravity);
  visit("energy_contact_j", &Quantities::contact);
  visit("energy_total_j", &Quantities::total);
  visit("dissipated_j", &Quantities::dissipated);
}

/// The largest or smallest value of one quantity during a motion, and where.
struct Extreme {
  const char* name;  // with its unit, as in `smallest_bend_radius_m`
  double value;
  double time;              // s
  std::optional<double> s;  // m along the rod, where it has a place
};
/// The extremes an engineer asks for first, of the first step that reaches them: bend radius, tension,
/// compression, internal moment, gripper force and moment, contact force, clearance. What never occurs (no
/// contact, no obstacles, no compression) is left out.
[[nodiscard]] std::vector<Extreme> extremes(std::span<const Quantities> motion, const RodProperties& rod);

}  // namespace tendril
