/// What the planner's tests share: the scenarios of the repository, their obstacles, and equality of motions.
#pragma once

#include <algorithm>

#include "tendril/planner.h"

namespace tendril::scenarios {

/// The scenario `scenarios/NAME.yaml` with `elements` elements.
inline Scenario scenario(const std::string& name, int elements) {
  Scenario s = readScenario(TENDRIL_SOURCE_DIR "/scenarios/" + name + ".yaml");
  s.rod.elements = elements;
  return s;
}

/// Its meshes, loaded and placed. Throws InputError as loadMesh does.
inline Obstacles obstaclesOf(const Scenario& s) { return Obstacles(loadMeshes(s)); }

/// Whether two motions are the same to the last bit.
inline bool sameMotion(const Trajectory& a, const Trajectory& b) {
  const auto same = [](const Pose& p, const Pose& q) {
    return p.position == q.position && p.rotation.coeffs() == q.rotation.coeffs();
  };
  return a.time_s == b.time_s && a.held == b.held &&
         std::equal(a.shapes.begin(), a.shapes.end(), b.shapes.begin(), b.shapes.end(),
                    [&](const RodShape& p, const RodShape& q) {
                      return std::equal(p.begin(), p.end(), q.begin(), q.end(), same);
                    });
}

}  // namespace tendril::scenarios
