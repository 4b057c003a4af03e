#include "tendril/planner/sampling.h"

#include <algorithm>

namespace tendril {

bool StableSampler::sample(RodShape& shape) {
  for (int draw = 0; draw < kMostDraws; ++draw) {
    const Equilibrium rod = sampleStable(integrator_, rod_, box_, random_);
    Pose base;
    for (int i = 0; i < 3; ++i) base.position[i] = random_.uniform(workspace_.min[i], workspace_.max[i]);
    base.rotation = random_.rotation();
    const Pose placed = base * rod.base.inverse();
    shape.resize(rod.nodes.size());
    positions_.resize(rod.nodes.size());
    for (std::size_t i = 0; i < shape.size(); ++i) {
      shape[i] = placed * rod.nodes[i];
      positions_[i] = shape[i].position;
    }
    const bool inside = std::all_of(positions_.begin(), positions_.end(),
                                    [&](const Vector3& p) { return workspace_.contains(p); });
    if (inside && obstacles_.clearance(positions_, rod_.radius).segment < 0) return true;
  }
  return false;
}

}  // namespace tendril
