/// Clearance of a rod from the meshes and from itself, over a whole motion or for one shape.
#pragma once

#include <string>

#include "tendril/rod.h"
#include "tendril/verification.h"
#include "tendril/verification/face_tree.h"

namespace tendril::verification {

/// What a motion was proved to keep, or where the proof failed.
struct Clearance {
  Check check;
  double smallest = 0;  // m; see VerificationReport::smallest_clearance
};

/// distance(centreline, mesh) >= r - 1e-8 L at every moment between the first state and the last.
/// `mesh_names` is for the message. The trajectory has at least one state, every state the same number of
/// nodes, every number finite.
[[nodiscard]] Clearance checkClearance(const Trajectory& trajectory, const RodProperties& rod,
                                       const FaceTree& faces, const std::vector<std::string>& mesh_names);

/// distance >= 2r - 1e-8 L at every moment between any two elements that are farther apart along the rod than
/// pi r.
[[nodiscard]] Clearance checkSelfContact(const Trajectory& trajectory, const RodProperties& rod);

/// Whether a shape at rest is clear of the meshes and, if the rod may not pass through itself, of itself.
[[nodiscard]] bool isClear(const RodShape& shape, const RodProperties& rod, const FaceTree& faces);

/// The number of elements between two that must keep apart: the smallest k with k h > pi r.
[[nodiscard]] std::size_t elementsBetween(const RodProperties& rod);

}  // namespace tendril::verification
