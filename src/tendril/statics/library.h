/// A library of stable weightless rods of one stiffness, from which rods between given ends are found.
/// Private to the statics.
#pragma once

#include <memory>

#include "tendril/statics/batch.h"

namespace tendril::statics {

/// A stable rod, where it ends and its energy, in the rod's own units, from a first node at the origin.
struct LibraryRod {
  Vector6 a;
  Pose end;
  double energy;
};
struct Library {
  std::vector<LibraryRod> rods;
  std::vector<Matrix6> jacobians;  // of each: J(1), as NaturalEnd has it
};

/// The library for a rod, whose weight does not matter: read from memory or disk, or built and put there.
/// Thread-safe; what is returned depends on the rod alone.
[[nodiscard]] std::shared_ptr<const Library> libraryFor(const NaturalRod& rod);

}  // namespace tendril::statics
