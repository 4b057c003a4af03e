/// Where a stored motion comes near the obstacles, for the page.
#pragma once

#include <cstdint>
#include <vector>

#include "tendril/geometry.h"
#include "tendril/solution.h"

namespace tendril::viewer {

/// Of every `stride`-th stored state, what was found within reach.
struct Contacts {
  int stride = 1;
  double reach = 0;                    // m: gaps are known up to this
  std::vector<std::uint32_t> offsets;  // points of the k-th searched state: offsets[k] to offsets[k + 1]
  std::vector<float> points;           // points x 3, m, world: on the obstacles, gap <= contact distance
  std::vector<float> gaps;             // m, smallest gap of each searched state; infinite beyond reach
};

/// Searches every segment of every stored state, or of every stride-th one where that would be more than
/// `most_segments`. A gap is the distance of centreline and mesh less the radius.
[[nodiscard]] Contacts findContacts(const Solution& solution, const Obstacles& obstacles,
                                    std::size_t most_segments = 200'000);

}  // namespace tendril::viewer
