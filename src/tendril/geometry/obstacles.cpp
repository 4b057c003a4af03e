#include <fmt/format.h>

#include <algorithm>
#include <cassert>

#include "tendril/geometry.h"
#include "tendril/geometry/box_tree.h"
#include "tendril/geometry/edge_uses.h"
#include "tendril/geometry/flat_patches.h"
#include "tendril/geometry/unit.h"

namespace tendril {
namespace {

void check(const TriangleMesh& mesh, std::size_t number) {
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
}

/// Height of a face over its edge, by the distance of its apex from the nearer end, below which its direction
/// is not trusted: `along` is off by 1e-16, hence the direction by that over this.
constexpr double kNoHeight = 1e-9;

/// The way from an edge into one of its faces: a unit vector in the face, perpendicular to the edge, and how
/// high the apex is above it. Zero if the three corners lie on one line, or so nearly that rounding has a say
/// in where it points.
struct WayIn {
  Vector3 direction = Vector3::Zero();
  double height = 0;
};
WayIn wayIntoFace(const Vector3& a, const Vector3& b, const Vector3& c) {
  const Vector3 along = unit(b - a);
  const Vector3 from_a = c - a, from_b = c - b;
  Vector3 into =
      from_a.squaredNorm() < from_b.squaredNorm() ? from_a : from_b;  // the shorter: less cancellation
  const double length = lengthOf(into);
  into -= into.dot(along) * along;
  into -= into.dot(along) * along;  // what rounding left along the edge
  const double height = lengthOf(into);
  if (!(height > kNoHeight * length)) return {};
  return {into / height, height};
}

/// |wedge|, the sine of the angle between two faces, below which it is never trusted.
constexpr double kNoWedge = 1e-7;

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
  std::vector<int> patch;  // of each face; of one that is alone in its plane, ~ its number in its mesh
  std::vector<MeshEdge> edges;
  Aabb bounds;  // of all vertices
  BoxTree tree{{}};
  std::vector<FaceBound> face_bounds;
  double deviation = 0;

  /// A face of a mesh as it was given.
  struct Original {
    int patch;
    std::array<int, 3> vertices;
    int number;  // in its mesh
  };
  std::vector<Original> originals;  // of the patches
  std::vector<double> off_plane;    // of each patch: the most that a vertex is off its plane [m]

  [[nodiscard]] const Vector3& vertex(int i) const { return vertices[static_cast<std::size_t>(i)]; }
  [[nodiscard]] const Vector3& corner(const Face& face, int k) const {
    return vertex(face.vertices[static_cast<std::size_t>(k % 3)]);
  }

  void add(const TriangleMesh& mesh, std::size_t number);
  void findEdges();
  [[nodiscard]] MeshEdge edge(std::span<const EdgeUse> uses) const;
};

void Obstacles::Data::add(const TriangleMesh& mesh, std::size_t number) {
  const auto shifted = [](const std::array<int, 3>& corners, int offset) {
    return std::array{corners[0] + offset, corners[1] + offset, corners[2] + offset};
  };
  check(mesh, number);
  const int first_vertex = static_cast<int>(vertices.size());
  vertices.insert(vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
  const FlatPatches flat = flatPatches(mesh);
  const int first_patch = static_cast<int>(off_plane.size());
  off_plane.insert(off_plane.end(), flat.off_plane.begin(), flat.off_plane.end());
  const auto numberOf = [&](int patch_in_mesh) {
    return patch_in_mesh < 0 ? patch_in_mesh : first_patch + patch_in_mesh;
  };
  for (const FlatPatches::Face& face : flat.faces) {
    faces.push_back({shifted(face.vertices, first_vertex), {}, static_cast<int>(number)});
    patch.push_back(numberOf(face.patch));
  }
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    if (flat.patch_of[f] >= 0)
      originals.push_back(
          {numberOf(flat.patch_of[f]), shifted(mesh.faces[f], first_vertex), static_cast<int>(f)});
  deviation = std::max(deviation, flat.deviation);
}

void Obstacles::Data::findEdges() {
  const auto corners = [this](std::size_t f) -> const std::array<int, 3>& { return faces[f].vertices; };
  edges.reserve(2 * faces.size());
  forEachEdge(edgeUses(faces.size(), corners, vertices.size()), [this](std::span<const EdgeUse> uses) {
    for (const EdgeUse& use : uses)
      faces[static_cast<std::size_t>(use.face)].edges[static_cast<std::size_t>(use.k)] =
          static_cast<int>(edges.size());
    edges.push_back(edge(uses));
  });
}

MeshEdge Obstacles::Data::edge(std::span<const EdgeUse> uses) const {
  MeshEdge result{uses[0].a, uses[0].b, Vector3::Zero(), false};
  if (uses.size() != 2) return result;
  WayIn into[2];
  int patches[2];
  for (std::size_t i = 0; i < 2; ++i) {
    const Face& face = faces[static_cast<std::size_t>(uses[i].face)];
    into[i] = wayIntoFace(vertex(result.a), vertex(result.b), corner(face, uses[i].k + 2));
    patches[i] = patch[static_cast<std::size_t>(uses[i].face)];
  }
  const bool known = into[0].height > 0 && into[1].height > 0;
  const bool folded = known && into[0].direction.dot(into[1].direction) > 0;
  result.flat = patches[0] >= 0 && patches[0] == patches[1] && !folded;
  if (result.flat || !known) return result;
  double tilt = 0;  // of the faces against their patches' planes, at most
  for (std::size_t i = 0; i < 2; ++i)
    if (patches[i] >= 0) tilt += 2 * off_plane[static_cast<std::size_t>(patches[i])] / into[i].height;
  // The directions cancel exactly when the faces are coplanar and on opposite sides.
  const Vector3 wedge = into[0].direction + into[1].direction;
  if (wedge.norm() > std::max(kNoWedge, 2 * tilt)) result.wedge = wedge;
  return result;
}

Obstacles::Obstacles(std::span<const TriangleMesh> meshes) {
  auto data = std::make_unique<Data>();
  for (std::size_t m = 0; m < meshes.size(); ++m) data->add(meshes[m], m);
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
    data->face_bounds[f] = {center, radius, sharp ? Vector3(Vector3::Zero()) : unit(normal)};
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

double Obstacles::deviation() const { return data_->deviation; }

int Obstacles::faceInMesh(int face, const Vector3& point) const {
  const auto f = static_cast<std::size_t>(face);
  int found = ~data_->patch[f];
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [patch, corners, number] : data_->originals) {
    if (patch != data_->patch[f]) continue;
    const double distance = closestPointOnTriangle(point, data_->vertex(corners[0]),
                                                   data_->vertex(corners[1]), data_->vertex(corners[2]))
                                .distance;
    if (distance < least) least = distance, found = number;
  }
  return found;
}

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
