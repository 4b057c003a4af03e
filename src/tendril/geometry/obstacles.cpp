#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <numeric>

#include "tendril/geometry.h"
#include "tendril/geometry/box_tree.h"

namespace tendril {
namespace {

std::span<const Vector3> checkedVertices(const TriangleMesh& mesh, std::size_t number) {
  if (mesh.faces.empty())
    throw InputError(fmt::format("obstacle mesh {}: has no faces; leave it out.", number));
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    if (!mesh.vertices[i].allFinite())
      throw InputError(fmt::format("obstacle mesh {}: vertex {} is not finite.", number, i));
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    for (const int v : mesh.faces[f])
      if (v < 0 || static_cast<std::size_t>(v) >= mesh.vertices.size())
        throw InputError(fmt::format("obstacle mesh {}: face {} names vertex {}; there are {}.", number, f, v,
                                     mesh.vertices.size()));
  return mesh.vertices;
}

/// Height of a face over its edge, by the distance of its apex from the nearer end, below which its direction
/// is not trusted: `along` is off by 1e-16, hence the direction by that over this.
constexpr double kThin = 1e-9;

/// The unit vector in the plane of edge ab and apex c, perpendicular to the edge, toward the apex; zero if
/// the three lie on one line, or so nearly that rounding has a say in where it points.
Vector3 directionIntoFace(const Vector3& a, const Vector3& b, const Vector3& c) {
  const Vector3 along = (b - a).stableNormalized();
  const Vector3 from_a = c - a, from_b = c - b;
  Vector3 into =
      from_a.squaredNorm() < from_b.squaredNorm() ? from_a : from_b;  // the shorter: less cancellation
  const double length = into.stableNorm();
  into -= into.dot(along) * along;
  into -= into.dot(along) * along;  // what rounding left along the edge
  if (!(into.stableNorm() > kThin * length)) return Vector3::Zero();
  return into.stableNormalized();
}

/// One face's use of an edge.
struct EdgeUse {
  int a, b;  // vertices, a <= b
  int face, k;
};

/// |wedge| below which two faces count as coplanar: the sine of the angle between them.
constexpr double kFlat = 1e-7;

/// What is asked of many triangles: whether they may come near a capsule.
class NearCapsule {
 public:
  explicit NearCapsule(const Capsule& capsule)
      : a_(capsule.a), along_(capsule.b - capsule.a), radius_(capsule.radius) {
    const double length2 = along_.squaredNorm();
    length_ = std::sqrt(length2);
    inverse_ = length2 > std::numeric_limits<double>::min() ? 1 / length2 : 0;
  }

  /// False if a plane across the way d from the axis to the middle of the triangle lies between the two; true
  /// where they are apart by no more than rounding. `corner(k)` is asked for where the ball around it does
  /// not settle it.
  template <class Corner>
  [[nodiscard]] bool mayMeet(const Obstacles::FaceBound& bound, const Corner& corner) const {
    const Vector3 from_a = bound.center - a_;
    const double t = std::clamp(from_a.dot(along_) * inverse_, 0.0, 1.0);
    const Vector3 foot = a_ + t * along_, d = bound.center - foot;
    const double reach =
        radius_ + 1e-12 * (radius_ + bound.radius + length_) + 1e-14 * bound.center.cwiseAbs().maxCoeff();
    const double distance2 = d.squaredNorm(), slope = d.dot(along_);
    const double ahead = std::max(-t * slope, (1 - t) * slope);  // the axis beyond its foot, in 1/|d|
    const auto beyond = [&](double height) {
      return height > 0 && height * height > reach * reach * distance2;
    };
    if (beyond(distance2 - std::sqrt(distance2) * bound.radius - ahead)) return false;
    return !beyond(std::min({d.dot(corner(0) - foot), d.dot(corner(1) - foot), d.dot(corner(2) - foot)}) -
                   ahead);
  }

 private:
  Vector3 a_, along_;
  double radius_, length_, inverse_;
};

}  // namespace

struct Obstacles::Data {
  std::vector<Vector3> vertices;
  std::vector<Face> faces;
  std::vector<MeshEdge> edges;
  Aabb bounds;  // of all vertices
  BoxTree tree{{}};
  std::vector<FaceBound> face_bounds;

  [[nodiscard]] const Vector3& vertex(int i) const { return vertices[static_cast<std::size_t>(i)]; }
  [[nodiscard]] const Vector3& corner(const Face& face, int k) const {
    return vertex(face.vertices[static_cast<std::size_t>(k % 3)]);
  }

  void findEdges();
  [[nodiscard]] MeshEdge edge(std::span<const EdgeUse> uses) const;
};

void Obstacles::Data::findEdges() {
  // Sorted by a, b, face, k: counted by a, each then sorted by b with the order of the faces kept.
  std::vector<std::size_t> begin(vertices.size() + 1);  // of the uses of the edges from a
  const auto forEachUse = [this](const auto& visit) {
    for (std::size_t f = 0; f < faces.size(); ++f)
      for (int k = 0; k < 3; ++k) {
        const auto [a, b] = std::minmax(faces[f].vertices[static_cast<std::size_t>(k)],
                                        faces[f].vertices[static_cast<std::size_t>((k + 1) % 3)]);
        visit(EdgeUse{a, b, static_cast<int>(f), k});
      }
  };
  forEachUse([&](const EdgeUse& use) { ++begin[static_cast<std::size_t>(use.a) + 1]; });
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<EdgeUse> uses(3 * faces.size());
  std::vector<std::size_t> end(begin.begin(), begin.end() - 1);
  forEachUse([&](const EdgeUse& use) { uses[end[static_cast<std::size_t>(use.a)]++] = use; });
  for (std::size_t a = 0; a < end.size(); ++a)
    std::stable_sort(uses.data() + begin[a], uses.data() + end[a],
                     [](const EdgeUse& x, const EdgeUse& y) { return x.b < y.b; });

  edges.reserve(2 * faces.size());
  for (std::size_t first = 0, last = 0; first < uses.size(); first = last) {
    while (last < uses.size() && uses[last].a == uses[first].a && uses[last].b == uses[first].b) {
      const EdgeUse& use = uses[last++];
      faces[static_cast<std::size_t>(use.face)].edges[static_cast<std::size_t>(use.k)] =
          static_cast<int>(edges.size());
    }
    edges.push_back(edge(std::span(uses).subspan(first, last - first)));
  }
}

MeshEdge Obstacles::Data::edge(std::span<const EdgeUse> uses) const {
  MeshEdge result{uses[0].a, uses[0].b, Vector3::Zero(), false};
  if (uses.size() != 2) return result;
  Vector3 into[2];
  for (std::size_t i = 0; i < 2; ++i) {
    const Face& face = faces[static_cast<std::size_t>(uses[i].face)];
    into[i] = directionIntoFace(vertex(result.a), vertex(result.b), corner(face, uses[i].k + 2));
    if (into[i].isZero(0)) return result;  // a face (nearly) without area says nothing
  }
  // The directions cancel exactly when the faces are coplanar and on opposite sides.
  result.wedge = into[0] + into[1];
  result.flat = result.wedge.norm() < kFlat;
  if (result.flat) result.wedge.setZero();
  return result;
}

Obstacles::Obstacles(std::span<const TriangleMesh> meshes) {
  auto data = std::make_unique<Data>();
  std::size_t vertices_count = 0, faces_count = 0;
  for (const TriangleMesh& mesh : meshes)
    vertices_count += mesh.vertices.size(), faces_count += mesh.faces.size();
  data->vertices.reserve(vertices_count);
  data->faces.reserve(faces_count);
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const int offset = static_cast<int>(data->vertices.size());
    const std::span<const Vector3> vertices = checkedVertices(meshes[m], m);
    data->vertices.insert(data->vertices.end(), vertices.begin(), vertices.end());
    for (std::size_t f = 0; f < meshes[m].faces.size(); ++f) {
      const auto& [a, b, c] = meshes[m].faces[f];
      data->faces.push_back(
          {{a + offset, b + offset, c + offset}, {}, static_cast<int>(m), static_cast<int>(f)});
    }
  }
  for (const Vector3& v : data->vertices) data->bounds.include(v);
  data->findEdges();
  std::vector<Aabb> boxes(data->faces.size());
  data->face_bounds.resize(boxes.size());
  for (std::size_t f = 0; f < boxes.size(); ++f) {
    const Vector3 &a = data->corner(data->faces[f], 0), &b = data->corner(data->faces[f], 1),
                  &c = data->corner(data->faces[f], 2);
    for (const Vector3& corner : {a, b, c}) boxes[f].include(corner);
    const Vector3 center = a + (b - a) / 3 + (c - a) / 3;
    const double radius = std::max({(a - center).norm(), (b - center).norm(), (c - center).norm()});
    const Vector3 normal = (b - a).cross(c - a);
    const bool sharp = normal.norm() < 1e-5 * std::max((b - a).squaredNorm(), (c - a).squaredNorm());
    data->face_bounds[f] = {center, radius, sharp ? Vector3(Vector3::Zero()) : normal.stableNormalized()};
  }
  data->tree = BoxTree(boxes);
  data_ = std::move(data);
}

Obstacles::~Obstacles() = default;
Obstacles::Obstacles(Obstacles&&) noexcept = default;
Obstacles& Obstacles::operator=(Obstacles&&) noexcept = default;

std::span<const Vector3> Obstacles::vertices() const { return data_->vertices; }
std::span<const Obstacles::Face> Obstacles::faces() const { return data_->faces; }
std::span<const Obstacles::FaceBound> Obstacles::faceBounds() const { return data_->face_bounds; }
std::span<const MeshEdge> Obstacles::edges() const { return data_->edges; }

void Obstacles::facesNear(const Aabb& box, std::vector<int>& out) const {
  const auto first = static_cast<std::ptrdiff_t>(out.size());
  data_->tree.find(box, out);
  std::sort(out.begin() + first, out.end());
}

void Obstacles::facesNear(const Aabb& box, const Capsule& capsule, std::vector<int>& out) const {
  const auto first = static_cast<std::ptrdiff_t>(out.size());
  data_->tree.find(box, capsule, out);
  const NearCapsule near(capsule);
  out.erase(std::remove_if(out.begin() + first, out.end(),
                           [&](int number) {
                             const auto f = static_cast<std::size_t>(number);
                             return !near.mayMeet(data_->face_bounds[f], [&](int k) -> const Vector3& {
                               return data_->corner(data_->faces[f], k);
                             });
                           }),
            out.end());
  std::sort(out.begin() + first, out.end());
}

Obstacles::Clearance Obstacles::clearance(std::span<const Vector3> polyline, double limit) const {
  Clearance best;
  if (data_->faces.empty() || polyline.size() < 2) return best;

  // Look near first, then twice as far, until something is found or `limit` is reached: what is near is cheap
  // to find, and bounds the rest.
  Aabb all = data_->bounds;
  for (const Vector3& p : polyline) all.include(p);
  const double farthest = (all.max - all.min).norm();  // no distance is longer
  std::vector<int> near;
  for (double radius = farthest / 1024;; radius *= 2) {
    const bool last_round = !(radius < std::min(limit, farthest));
    double bound = last_round ? limit : radius;
    for (std::size_t i = 0; i + 1 < polyline.size(); ++i) {
      Aabb box;
      box.include(polyline[i]), box.include(polyline[i + 1]);
      box.inflate(bound);
      near.clear();
      facesNear(box, near);
      for (const int f : near) {
        const Face& face = data_->faces[static_cast<std::size_t>(f)];
        const SegmentTriangle pair =
            closestPointsOfSegmentAndTriangle(polyline[i], polyline[i + 1], data_->corner(face, 0),
                                              data_->corner(face, 1), data_->corner(face, 2));
        if (pair.distance >= bound) continue;
        bound = pair.distance;
        best = {pair.distance, static_cast<int>(i), f, polyline[i] + pair.s * (polyline[i + 1] - polyline[i]),
                pair.on_triangle};
      }
    }
    if (best.face >= 0 || last_round) return best;
  }
}

}  // namespace tendril
