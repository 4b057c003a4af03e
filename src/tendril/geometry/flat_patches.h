/// The flat pieces of a mesh, cut no finer than they must be. Private to the module.
#pragma once

#include <array>
#include <vector>

#include "tendril/geometry.h"

namespace tendril {

/// A mesh's faces in flat patches, with the vertices left out that lie inside a patch or on a straight side
/// of one. The vertices are the mesh's own, and every face stands where one of the mesh's stood, in order.
struct FlatPatches {
  struct Face {
    std::array<int, 3> vertices;
    int patch;  // as in patch_of
  };
  std::vector<Face> faces;
  /// Of each face of the mesh, those included that are gone: the number of its patch; ~f of face f where it
  /// is alone in its plane.
  std::vector<int> patch_of;
  std::vector<double> off_plane;  // of each patch: the most that a vertex is off its plane [m]
  /// What is kept r + deviation away by its nodes from the faces and by its segments from all edges but those
  /// inside a patch, is r away from the mesh [m].
  double deviation = 0;
};

/// What is within a few times the rounding of the mesh's vertices of a plane or a line, is on it.
[[nodiscard]] FlatPatches flatPatches(const TriangleMesh& mesh);

}  // namespace tendril
