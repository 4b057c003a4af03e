/// tendril/viewer.h: a solution as one self-contained page (three.js inside), which opens without a server.
#pragma once

#include "tendril/geometry.h"
#include "tendril/solution.h"

namespace tendril {

/// Writes the page atomically. `meshes` [m, world] are the scenario's, loaded, and are drawn; `obstacles`, of
/// the same meshes, say where the rod touches; the goal's ghost shape [m, world; N + 1 frames] is computed by
/// the caller (empty: no ghost). Throws InputError if the page cannot be written.
void writePage(const Solution& solution, std::span<const TriangleMesh> meshes, const Obstacles& obstacles,
               const RodShape& goal_shape, const std::filesystem::path& file);

}  // namespace tendril
