/// A small scenario that the tests change one thing of, and the message they get for it.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "tendril/scenario.h"

namespace tendril::test {

/// Line 1 is the first line of the text; the tests name lines of it.
inline const std::string kExample = R"(tendril_scenario: 1
name: example
rod:
  length_m: 2.0
  radius_m: 0.01
  density_kg_m3: 1000
  young_modulus_pa: 5.0e7
  poisson_ratio: 0.4
  elements: 40
environment:
  meshes:
    - file: meshes/box.obj
      scale: 0.5
  workspace_m: {min: [-2, -1, -1], max: [2, 1, 1]}
  friction: 0.2
  gravity_m_s2: [0, 0, -9.81]
grippers:
  grasps: [both, first]
  max_speed_m_s: 1
  max_turn_rad_s: 4
start:
  pose: {position_m: [0, 0, 0], orientation_wxyz: [1, 0, 0, 0]}
  wrench: [0, 0, 0.1, 0, 0, 0]
goal:
  grippers:
    first: {position_m: [0, 0, 1], orientation_wxyz: [1, 0, 0, 0]}
    last: {position_m: [1, 0, 1], orientation_wxyz: [0, 1, 0, 0]}
)";

/// The example with the first `from` replaced by `to`.
inline std::string changed(const std::string& from, const std::string& to, std::string text = kExample) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::logic_error("the example does not contain: " + from);
  return text.replace(at, from.size(), to);
}

/// The message parseScenario has for a text; "" if it has none.
inline std::string messageFor(const std::string& text) {
  try {
    (void)parseScenario(text, "scenarios/a.yaml");
    return "";
  } catch (const InputError& e) {
    return e.what();
  }
}

}  // namespace tendril::test
