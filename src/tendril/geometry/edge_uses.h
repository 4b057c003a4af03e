/// Which faces use which edges. Private to the module.
#pragma once

#include <algorithm>
#include <array>
#include <numeric>
#include <span>
#include <tuple>
#include <vector>

namespace tendril {

/// One face's use of an edge: from corner k to the next.
struct EdgeUse {
  int a, b;  // vertices, a <= b
  int face, k;
};

/// All uses of edges by the faces 0 to count - 1, sorted by a, b, face, k. `corners(face)` are its vertices,
/// of 0 to vertices - 1.
template <class CornersOf>
std::vector<EdgeUse> edgeUses(std::size_t count, const CornersOf& corners, std::size_t vertices) {
  // Counted by a; each a's, mostly a few, then sorted.
  std::vector<std::size_t> begin(vertices + 1);  // of the uses of the edges from a
  const auto forEachUse = [&](const auto& visit) {
    for (std::size_t f = 0; f < count; ++f) {
      const std::array<int, 3>& c = corners(f);
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [a, b] = std::minmax(c[k], c[(k + 1) % 3]);
        visit(EdgeUse{a, b, static_cast<int>(f), static_cast<int>(k)});
      }
    }
  };
  forEachUse([&](const EdgeUse& use) { ++begin[static_cast<std::size_t>(use.a) + 1]; });
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<EdgeUse> uses(3 * count);
  std::vector<std::size_t> end(begin.begin(), begin.end() - 1);
  forEachUse([&](const EdgeUse& use) { uses[end[static_cast<std::size_t>(use.a)]++] = use; });
  for (std::size_t a = 0; a < vertices; ++a)
    std::sort(uses.data() + begin[a], uses.data() + end[a], [](const EdgeUse& x, const EdgeUse& y) {
      return std::tie(x.b, x.face, x.k) < std::tie(y.b, y.face, y.k);
    });
  return uses;
}

/// Hands the uses of each edge in turn to `visit`.
template <class Visit>
void forEachEdge(const std::vector<EdgeUse>& uses, const Visit& visit) {
  for (std::size_t first = 0, last = 0; first < uses.size(); first = last) {
    while (last < uses.size() && uses[last].a == uses[first].a && uses[last].b == uses[first].b) ++last;
    visit(std::span(uses).subspan(first, last - first));
  }
}

}  // namespace tendril
