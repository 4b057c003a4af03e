#include "tendril/geometry/flat_patches.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <utility>

#include "tendril/geometry/edge_uses.h"
#include "tendril/geometry/unit.h"

namespace tendril {
namespace {

/// How many times the vertices' rounding counts as none, and what computing adds, by distance from the
/// origin.
constexpr double kRoundings = 4, kComputed = 64 * std::numeric_limits<double>::epsilon();
/// Of twice the area by the longest side squared: a new face is no thinner than that, or than the thinnest of
/// those that it stands for.
constexpr double kThin = 1e-3;
/// Cosine of the largest angle between a face and its patch (a sliver's plane is anything).
constexpr double kTurned = 0.5;
constexpr int kNone = std::numeric_limits<int>::min();  // no patch yet
constexpr int kFits = 32;                               // of a patch's plane
constexpr std::size_t kMostAt = 256;                    // faces at a vertex left out, or beside

std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// Finds the patches of one mesh, then leaves out vertices, in this order.
class Merger {
 public:
  explicit Merger(const TriangleMesh& mesh);
  void findPatches();
  void leaveOutVertices();
  [[nodiscard]] FlatPatches result() const;

 private:
  struct Plane {
    Vector3 normal = Vector3::Zero(), point = Vector3::Zero();
    [[nodiscard]] double heightOf(const Vector3& p) const { return normal.dot(p - point); }
  };
  struct Patch {
    Plane plane;
    double off_plane;  // the most that a vertex is [m]
  };
  using Corners = std::array<int, 3>;
  struct alignas(64) Face {  // in one cache line
    Vector3 area;            // twice, along the normal
    Corners corners;
    Corners across = {-1, -1, -1};  // the other face at each edge of exactly two; -1 at every other
    int patch = kNone;              // ~f of face f: alone
    int seen = 0;                   // in which look
    bool is_gone = false;
    [[nodiscard]] bool has(int v) const {
      return std::find(corners.begin(), corners.end(), v) != corners.end();
    }
  };

  struct Range {
    std::size_t begin = 0, end = 0;
  };

  [[nodiscard]] const Vector3& vertex(int v) const { return vertices_[at(v)]; }
  [[nodiscard]] std::span<const int> facesAt(int v) const {
    return std::span(pool_).subspan(faces_at_[at(v)].begin, faces_at_[at(v)].end - faces_at_[at(v)].begin);
  }
  /// Twice the area, along the normal.
  [[nodiscard]] Vector3 areaOf(int a, int b, int c) const {
    return (vertex(b) - vertex(a)).cross(vertex(c) - vertex(a));
  }
  [[nodiscard]] double thinness(int a, int b, int c) const;
  [[nodiscard]] double fromOrigin(int v) const { return (vertex(v) - origin_).norm(); }
  /// Whether v is on the plane of a patch that reaches so far from the origin.
  [[nodiscard]] bool isOn(const Plane& plane, int v, double reach) const {
    return std::abs(plane.heightOf(vertex(v))) <= tolerance_ * std::max(reach, fromOrigin(v));
  }
  [[nodiscard]] bool continues(int face, std::size_t k, int next, const Plane& plane, double reach) const;
  [[nodiscard]] bool lies(int face, const Plane& plane, double reach) const;
  [[nodiscard]] double reachOf(int face) const;
  void grow(int seed, const Plane& plane, double& reach, std::vector<int>& members);
  [[nodiscard]] Plane fit(const std::vector<int>& members, const Vector3& normal) const;

  /// The faces about a vertex, side by side: faces[i] between rim[i] and rim[i + 1]. All around, the rim's
  /// last is its first again.
  struct Star {
    std::vector<int> rim, faces;
    [[nodiscard]] bool isClosed() const { return rim.front() == rim.back(); }
  };
  [[nodiscard]] bool starOf(int v, Star& star) const;
  [[nodiscard]] bool leaveOut(int v);
  /// Twice the area of a b c across the plane of a face, with a sign.
  [[nodiscard]] double orientation(int face, int a, int b, int c) const {
    const Face& f = faces_[at(face)];
    return (f.patch < 0 ? f.area : patches_[at(f.patch)].plane.normal).dot(areaOf(a, b, c));
  }
  /// The worst of the new faces' shapes if all at `v` went to `to`; 0 if that cannot be.
  [[nodiscard]] double shapeIfMovedTo(int v, int to, const Star& star) const;
  /// Puts `to` in the place of v in all faces at v; those at both are gone.
  void move(int v, int to);

  std::span<const Vector3> vertices_;
  std::vector<Face> faces_;
  std::vector<Range> faces_at_;  // of each vertex, in pool_
  std::vector<int> pool_;
  Vector3 origin_;
  double tolerance_;  // by the distance from the origin

  std::vector<Patch> patches_;
  int look_ = 0;

  Star star_;
  std::vector<int> touched_, queued_;
  std::map<std::pair<int, int>, std::vector<int>> left_out_;  // along an edge, in no order
  double aside_ = 0;                                          // the most that one of them is off it [m]
};

Merger::Merger(const TriangleMesh& mesh)
    : vertices_(mesh.vertices),
      faces_(mesh.faces.size()),
      faces_at_(vertices_.size()),
      pool_(3 * faces_.size()),
      origin_(mesh.origin),
      tolerance_(kRoundings * mesh.rounding + kComputed),
      touched_(vertices_.size()),
      queued_(vertices_.size()) {
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    const auto& [a, b, c] = faces_[f].corners = mesh.faces[f];
    faces_[f].area = areaOf(a, b, c);
    for (const int v : faces_[f].corners) ++faces_at_[at(v)].end;
  }
  std::size_t end = 0;
  for (Range& range : faces_at_) {
    const std::size_t count = range.end;
    range = {end, end}, end += count;
  }
  for (std::size_t f = 0; f < faces_.size(); ++f)
    for (const int v : faces_[f].corners) pool_[faces_at_[at(v)].end++] = static_cast<int>(f);
  const auto corners = [this](std::size_t f) -> const Corners& { return faces_[f].corners; };
  forEachEdge(edgeUses(faces_.size(), corners, vertices_.size()), [this](std::span<const EdgeUse> uses) {
    if (uses.size() != 2) return;
    faces_[at(uses[0].face)].across[at(uses[0].k)] = uses[1].face;
    faces_[at(uses[1].face)].across[at(uses[1].k)] = uses[0].face;
  });
}

double Merger::thinness(int a, int b, int c) const {
  const double longest2 =
      std::max({(vertex(b) - vertex(a)).squaredNorm(), (vertex(c) - vertex(b)).squaredNorm(),
                (vertex(a) - vertex(c)).squaredNorm()});
  return areaOf(a, b, c).norm() / longest2;
}

// ------------------------------------------------------------------------------------------------ patches

/// Whether `next`, beyond edge k of `face`, goes on in the plane and does not fold back.
bool Merger::continues(int face, std::size_t k, int next, const Plane& plane, double reach) const {
  const int a = faces_[at(face)].corners[k], b = faces_[at(face)].corners[(k + 1) % 3];
  const Corners& corners = faces_[at(next)].corners;
  const auto of_a = static_cast<std::size_t>(std::find(corners.begin(), corners.end(), a) - corners.begin());
  const bool same_way = corners[(of_a + 1) % 3] == b;
  const int apex = corners[(of_a + (same_way ? 2 : 1)) % 3];
  const double side = plane.normal.dot(faces_[at(face)].area),
               other = plane.normal.dot(faces_[at(next)].area);
  return (same_way ? side * other < 0 : side * other > 0) &&
         std::abs(other) > kTurned * faces_[at(next)].area.norm() && isOn(plane, apex, reach);
}

bool Merger::lies(int face, const Plane& plane, double reach) const {
  const Face& f = faces_[at(face)];
  return std::abs(plane.normal.dot(f.area)) > kTurned * f.area.norm() &&
         std::all_of(f.corners.begin(), f.corners.end(), [&](int v) { return isOn(plane, v, reach); });
}

double Merger::reachOf(int face) const {
  const Corners& corners = faces_[at(face)].corners;
  return std::max({fromOrigin(corners[0]), fromOrigin(corners[1]), fromOrigin(corners[2])});
}

/// The faces of no patch yet that go on from the seed in the plane, which is known to reach so far.
void Merger::grow(int seed, const Plane& plane, double& reach, std::vector<int>& members) {
  members.clear();
  if (!lies(seed, plane, reach)) return;
  members.push_back(seed);
  faces_[at(seed)].seen = ++look_;
  for (std::size_t i = 0; i < members.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const int face = members[i], next = faces_[at(face)].across[k];
      if (next < 0 || faces_[at(next)].patch != kNone || faces_[at(next)].seen == look_) continue;
      if (!continues(face, k, next, plane, reach)) continue;
      faces_[at(next)].seen = look_;
      members.push_back(next);
      reach = std::max(reach, reachOf(next));
    }
}

/// The plane across the sum of the faces' areas (which their common border alone determines: the rounding of
/// what is inside is no matter), halfway between the highest and the lowest.
Merger::Plane Merger::fit(const std::vector<int>& members, const Vector3& normal) const {
  Vector3 sum = Vector3::Zero();
  for (const int f : members)
    sum += faces_[at(f)].area.dot(normal) < 0 ? Vector3(-faces_[at(f)].area) : faces_[at(f)].area;
  Plane plane{unit(sum), vertex(faces_[at(members[0])].corners[0])};
  double low = 0, high = 0;
  for (const int f : members)
    for (const int v : faces_[at(f)].corners) {
      const double height = plane.heightOf(vertex(v));
      low = std::min(low, height), high = std::max(high, height);
    }
  plane.point += 0.5 * (low + high) * plane.normal;
  return plane;
}

void Merger::findPatches() {
  std::vector<int> members, more;
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    if (faces_[f].patch != kNone) continue;
    const int seed = static_cast<int>(f);
    Plane plane{unit(faces_[f].area), vertex(faces_[f].corners[0])};
    double reach = reachOf(seed);
    grow(seed, plane, reach, members);
    // The seed's plane carries its rounding far beyond it; that of all it reaches is better, and reaches
    // farther.
    for (int i = 0; i < kFits && members.size() > 1; ++i) {
      const Plane fitted = fit(members, plane.normal);
      grow(seed, fitted, reach, more);
      if (more.size() < members.size()) break;
      const bool is_all = more.size() == members.size();
      plane = fitted, std::swap(members, more);
      if (is_all) break;
    }
    if (members.size() < 2) {
      faces_[f].patch = ~seed;
      continue;
    }
    double off_plane = 0;
    for (const int m : members) {
      faces_[at(m)].patch = static_cast<int>(patches_.size());
      for (const int v : faces_[at(m)].corners)
        off_plane = std::max(off_plane, std::abs(plane.heightOf(vertex(v))));
    }
    patches_.push_back({plane, off_plane});
  }
}

// ----------------------------------------------------------------------------------------------- vertices

/// False if the faces at v are not one fan, side by side.
bool Merger::starOf(int v, Star& star) const {
  const std::span<const int> faces = facesAt(v);
  star.rim.clear(), star.faces.clear();
  const auto others = [&](int face) {
    const Corners& c = faces_[at(face)].corners;
    const auto k = static_cast<std::size_t>(std::find(c.begin(), c.end(), v) - c.begin());
    return std::pair(c[(k + 1) % 3], c[(k + 2) % 3]);
  };
  const auto uses = [&](int rim) {
    return std::count_if(faces.begin(), faces.end(), [&](int f) {
      const auto [a, b] = others(f);
      return a == rim || b == rim;
    });
  };
  int first = others(faces[0]).first;
  for (const int f : faces)
    for (const int rim : {others(f).first, others(f).second}) {
      const auto count = uses(rim);
      if (rim == v || count > 2) return false;
      if (count == 1) first = rim;
    }
  star.rim.push_back(first);
  for (int previous = -1; star.faces.size() < faces.size();) {
    const int here = star.rim.back();
    const auto next = std::find_if(faces.begin(), faces.end(), [&](int f) {
      const auto [a, b] = others(f);
      return f != previous && (a == here || b == here);
    });
    if (next == faces.end()) return false;
    const auto [a, b] = others(*next);
    if (a == b) return false;
    star.faces.push_back(previous = *next);
    star.rim.push_back(a == here ? b : a);
    if (star.rim.back() == first) break;
  }
  return star.faces.size() == faces.size();
}

double Merger::shapeIfMovedTo(int v, int to, const Star& star) const {
  // What is next to both must be next to them in a face of both, or faces would fall together.
  const auto begin = star.rim.begin(), end = star.rim.end() - (star.isClosed() ? 1 : 0);
  const auto of_to = std::find(begin, end, to) - begin, count = end - begin;
  for (const int f : facesAt(to))
    for (const int other : faces_[at(f)].corners) {
      if (other == v || other == to) continue;
      const auto where = std::find(begin, end, other) - begin;
      if (where == count) continue;
      const auto apart = std::abs(where - of_to);
      if (apart != 1 && !(star.isClosed() && apart == count - 1)) return 0;
    }

  double worst = std::numeric_limits<double>::infinity(), worst_before = worst;
  for (std::size_t i = 0; i < star.faces.size(); ++i) {
    const int a = star.rim[i], b = star.rim[i + 1], face = star.faces[i];
    worst_before = std::min(worst_before, thinness(v, a, b));
    if (a == to || b == to) continue;
    if (!(orientation(face, to, a, b) * orientation(face, v, a, b) > 0)) return 0;
    worst = std::min(worst, thinness(to, a, b));
  }
  return std::isfinite(worst) && worst >= std::min(kThin, worst_before) ? worst : 0;
}

void Merger::move(int v, int to) {
  const Range from = faces_at_[at(v)], before = faces_at_[at(to)];
  const std::size_t begin = pool_.size();
  for (std::size_t i = before.begin; i < before.end; ++i)
    if (const int f = pool_[i]; !faces_[at(f)].has(v)) pool_.push_back(f);
  for (std::size_t i = from.begin; i < from.end; ++i) {
    const int f = pool_[i];
    if (Corners& corners = faces_[at(f)].corners; !faces_[at(f)].has(to)) {
      std::replace(corners.begin(), corners.end(), v, to);
      pool_.push_back(f);
      continue;
    }
    faces_[at(f)].is_gone = true;
    for (const int other : faces_[at(f)].corners) {
      if (other == v || other == to) continue;
      Range& range = faces_at_[at(other)];
      const auto first = pool_.begin() + static_cast<std::ptrdiff_t>(range.begin),
                 last = pool_.begin() + static_cast<std::ptrdiff_t>(range.end);
      range.end -= static_cast<std::size_t>(last - std::remove(first, last, f));
    }
  }
  faces_at_[at(to)] = {begin, pool_.size()};
  faces_at_[at(v)] = {};
}

/// Leaves out v if it is inside a patch, or between patches or at the border of one on a straight line.
bool Merger::leaveOut(int v) {
  const std::span<const int> faces = facesAt(v);
  if (faces.size() < 2 || faces.size() > kMostAt) return false;
  const int patch = faces_[at(faces[0])].patch;
  int other = patch;
  for (const int f : faces)
    if (const int p = faces_[at(f)].patch; p != patch && p != other) {
      if (other != patch) return false;
      other = p;
    }
  Star& star = star_;
  if (!starOf(v, star)) return false;
  // What is done at a hub takes the time of looking at all its faces.
  if (std::any_of(star.rim.begin(), star.rim.end(), [&](int rim) { return facesAt(rim).size() > kMostAt; }))
    return false;

  std::vector<int> ends;  // of the edges at v that are no patch's inside
  const std::size_t count = star.faces.size();
  if (!star.isClosed()) ends = {star.rim.front(), star.rim.back()};
  for (std::size_t i = star.isClosed() ? 0 : 1; i < count; ++i) {
    const std::size_t before = (i + count - 1) % count;
    const int f = star.faces[before], g = star.faces[i];
    const bool is_inside = faces_[at(f)].patch >= 0 && faces_[at(f)].patch == faces_[at(g)].patch &&
                           orientation(f, v, star.rim[before], star.rim[before + 1]) *
                                   orientation(g, v, star.rim[i], star.rim[i + 1]) >
                               0;
    if (!is_inside) ends.push_back(star.rim[i]);
  }
  if (ends.size() != 0 && ends.size() != 2) return false;

  double aside = 0;
  std::vector<int> along;
  if (!ends.empty()) {
    along.push_back(v);
    for (const auto& side : {std::minmax(v, ends[0]), std::minmax(v, ends[1]), std::minmax(ends[0], ends[1])})
      if (const auto found = left_out_.find(side); found != left_out_.end())
        along.insert(along.end(), found->second.begin(), found->second.end());
    for (const int w : along)
      aside = std::max(aside, closestPointOnSegment(vertex(w), vertex(ends[0]), vertex(ends[1])).distance);
    if (!(aside <= tolerance_ * std::max(fromOrigin(ends[0]), fromOrigin(ends[1])))) return false;
  }

  int to = -1;
  double best = 0;
  for (const int candidate :
       ends.empty() ? std::span<const int>(star.rim).first(count) : std::span<const int>(ends))
    if (const double shape = shapeIfMovedTo(v, candidate, star); shape > best) best = shape, to = candidate;
  if (to < 0) return false;
  move(v, to);
  if (!ends.empty()) {
    left_out_.erase(std::minmax(v, ends[0])), left_out_.erase(std::minmax(v, ends[1]));
    left_out_[std::minmax(ends[0], ends[1])] = std::move(along);
    aside_ = std::max(aside_, aside);
  }
  return true;
}

/// Round by round, neighbours not in the same one: what is left then is spread evenly, and not all at one
/// end.
void Merger::leaveOutVertices() {
  std::vector<int> now, next;
  for (std::size_t v = 0; v < vertices_.size(); ++v) now.push_back(static_cast<int>(v));
  for (int round = 1; !now.empty(); ++round, std::swap(now, next)) {
    next.clear();
    const auto again = [&](int v) {
      if (std::exchange(queued_[at(v)], round) != round) next.push_back(v);
    };
    for (const int v : now) {
      if (touched_[at(v)] == round) {
        again(v);
      } else if (leaveOut(v)) {
        for (const int rim : star_.rim) touched_[at(rim)] = round, again(rim);
      }
    }
  }
}

FlatPatches Merger::result() const {
  FlatPatches out;
  for (const Face& face : faces_) {
    out.patch_of.push_back(face.patch);
    if (!face.is_gone) out.faces.push_back({face.corners, face.patch});
  }
  // With d and e the most that a vertex is off the plane of its patch and off the edge it lies on: a point of
  // the mesh is within d + e of the patch's outline, filled in its plane, from which a segment is no nearer
  // than its nodes and the outline's edges are, less d. Twice that d for valleys, whose edges do not count.
  double deviation = 0;
  for (const Patch& patch : patches_) {
    out.off_plane.push_back(patch.off_plane);
    deviation = std::max(deviation, 4 * patch.off_plane);
  }
  out.deviation = deviation + aside_;
  return out;
}

}  // namespace

FlatPatches flatPatches(const TriangleMesh& mesh) {
  Merger merger(mesh);
  merger.findPatches();
  merger.leaveOutVertices();
  return merger.result();
}

}  // namespace tendril
