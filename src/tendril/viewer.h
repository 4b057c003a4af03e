/// tendril/viewer.h: a solution as one self-contained page (three.js inside), which opens without a server.
#pragma once

#include "tendril/geometry.h"
#include "tendril/solution.h"

namespace tendril {

/// Writes the page atomically. `meshes` are the scenario's, loaded, `obstacles` what they are to the rod; the
/// goal's ghost shape is computed by the caller (empty: no ghost). Throws InputError if the page cannot be
/// written.
void writePage(const Solution& solution, std::span<const TriangleMesh> meshes, const Obstacles& obstacles,
               const RodShape& goal_shape, const std::filesystem::path& file);

}  // namespace tendril
