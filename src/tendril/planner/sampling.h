/// Sampling on SE(3) x A_stable, clear of the meshes and of itself. Private to planner.
#pragma once

#include "tendril/geometry.h"
#include "tendril/scenario.h"
#include "tendril/statics.h"

namespace tendril {

/// Draws stable equilibria whose base is uniform in the workspace (and over all rotations) and whose whole
/// shape is inside it, clear of the meshes and of itself.
class StableSampler {
 public:
  StableSampler(const RodProperties& rod, const Box& workspace, const Obstacles& obstacles,
                const SamplingBox& box, Random& random)
      : rod_(rod),
        workspace_(workspace),
        obstacles_(obstacles),
        box_(box),
        random_(random),
        integrator_(rod) {}

  /// Replaces `shape`. False if kMostDraws draws found none.
  [[nodiscard]] bool sample(RodShape& shape);

 private:
  static constexpr int kMostDraws = 10000;

  RodProperties rod_;
  Box workspace_;
  const Obstacles& obstacles_;
  SamplingBox box_;
  Random& random_;
  EquilibriumIntegrator integrator_;
  std::vector<Vector3> positions_;
};

}  // namespace tendril
