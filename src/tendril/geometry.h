/// tendril/geometry.h: meshes, distances with their normals, the broad phase, continuous collision detection.
///
/// All distances are double precision. Embree builds the tree (single precision, boxes rounded outward) and
/// nothing else: what it returns are candidates.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "tendril/base.h"

namespace tendril {

/// A welded triangle soup in metres, world frame.
struct TriangleMesh {
  std::vector<Vector3> vertices;
  std::vector<std::array<int, 3>> faces;
  /// A vertex is off by `rounding` times its distance from `origin` at most: files are read in single
  /// precision, each about an origin of its own.
  Vector3 origin = Vector3::Zero();
  double rounding = 0x1p-53;
  int welded_vertices = 0;  // identical vertices merged on loading
  int dropped_faces = 0;    // faces without area dropped on loading
};

/// Loads whatever Assimp reads (node transforms applied, triangulated), maps each vertex v to R (scale v) + t
/// in double, welds identical vertices and drops faces without area (or with a repeated vertex). Throws
/// InputError naming the file: missing, unreadable, no faces, a non-finite vertex.
[[nodiscard]] TriangleMesh loadMesh(const std::filesystem::path& file, double scale = 1.0,
                                    const Pose& pose = {});

// ---------------------------------------------------------------------------------------------- distances

/// Which part of a triangle or of an edge the closest point lies on.
enum class Feature : std::uint8_t { vertex0, vertex1, vertex2, edge01, edge12, edge20, face };

struct PointTriangle {
  double distance;  // m, >= 0
  Vector3 closest;  // on the triangle
  Feature feature;
};
/// Closest point of triangle abc to p (Ericson 2005, 5.1.5), in every Voronoi region, degenerate triangles
/// included.
[[nodiscard]] PointTriangle closestPointOnTriangle(const Vector3& p, const Vector3& a, const Vector3& b,
                                                   const Vector3& c);

struct PointSegment {
  double distance;  // m
  double t;         // parameter in [0, 1] of the closest point a + t (b - a)
};
[[nodiscard]] PointSegment closestPointOnSegment(const Vector3& p, const Vector3& a, const Vector3& b);

struct SegmentSegment {
  double distance;  // m
  double s, t;      // parameters in [0, 1] of the closest points p0 + s (p1 - p0) and q0 + t (q1 - q0)
};
/// Robust for parallel and degenerate segments (Ericson 2005, 5.1.9).
[[nodiscard]] SegmentSegment closestPointsOfSegments(const Vector3& p0, const Vector3& p1, const Vector3& q0,
                                                     const Vector3& q1);

struct SegmentTriangle {
  double distance;      // m; 0 where they intersect
  double s;             // parameter on the segment
  Vector3 on_triangle;  // the triangle's closest point
};
[[nodiscard]] SegmentTriangle closestPointsOfSegmentAndTriangle(const Vector3& p0, const Vector3& p1,
                                                                const Vector3& a, const Vector3& b,
                                                                const Vector3& c);

// ---------------------------------------------------------------------------------------------- the
// obstacles

/// An axis-aligned box [m].
struct Aabb {
  Vector3 min = Vector3::Constant(std::numeric_limits<double>::infinity());
  Vector3 max = Vector3::Constant(-std::numeric_limits<double>::infinity());
  void include(const Vector3& p) { min = min.cwiseMin(p), max = max.cwiseMax(p); }
  void inflate(double margin) { min.array() -= margin, max.array() += margin; }
};

/// The points within `radius` of the segment ab [m].
struct Capsule {
  Vector3 a, b;
  double radius;
  /// Whether a ball comes near it; true for a ball that just does not, by no more than rounding.
  [[nodiscard]] bool meets(const Vector3& center, double ball_radius) const {
    const Vector3 along = b - a, from_a = center - a;
    const double length2 = along.squaredNorm();
    const double t = length2 > 0 ? std::clamp(from_a.dot(along) / length2, 0.0, 1.0) : 0;
    const double reach = (radius + ball_radius) * (1 + 1e-9) + 1e-14 * center.cwiseAbs().maxCoeff();
    return (from_a - t * along).squaredNorm() <= reach * reach;
  }
};

/// An edge of the obstacles, with what decides whether a rod can touch it (see `wedge`).
struct MeshEdge {
  int a, b;  // vertices
  /// For an edge of exactly two faces: the sum of the two unit in-face directions that point away from the
  /// edge. A rod on the side wedge . n > 0 (n from edge to rod) sits in a valley, where faces are nearer than
  /// the edge. No orientation of the mesh is needed. Zero for every other edge, for one that is flat, for one
  /// of a face whose height over it is next to nothing, and where rounding may have made the valley.
  Vector3 wedge;
  bool flat;  // inside a flat patch: the edge is no feature at all
};

/// All obstacles of a scenario: one soup with its edges and its broad phase. Immutable; safe to share among
/// threads.
class Obstacles {
 public:
  /// Throws InputError if a mesh has no faces or a vertex index is out of range.
  explicit Obstacles(std::span<const TriangleMesh> meshes);
  ~Obstacles();
  Obstacles(Obstacles&&) noexcept;
  Obstacles& operator=(Obstacles&&) noexcept;

  struct Face {
    std::array<int, 3> vertices;
    std::array<int, 3> edges;  // edge k joins vertices k and k+1 (mod 3): edge01, edge12, edge20
    int mesh;                  // which mesh it came from
  };
  /// A ball around a face, and the unit normal of its plane, exact to 1e-9 rad; zero where an angle of less
  /// than 1e-5 rad does not let it be.
  struct FaceBound {
    Vector3 center;
    double radius;
    Vector3 normal;
  };
  [[nodiscard]] std::span<const Vector3> vertices() const;
  /// Those of the meshes, but what is flat has no more of them than its outline asks for.
  [[nodiscard]] std::span<const Face> faces() const;
  /// How much farther away than asked for a rod must be kept by its nodes from the faces and by its segments
  /// from the edges that are not flat, to be as far as asked for from the meshes [m]. A few times what the
  /// meshes' vertices are off by; 0 where what is flat is exactly so.
  [[nodiscard]] double deviation() const;
  /// The number in its mesh of the mesh's own face that is nearest to `point`, of those in whose flat patch
  /// `face` is. Looks at all of them.
  [[nodiscard]] int faceInMesh(int face, const Vector3& point) const;
  [[nodiscard]] std::span<const FaceBound> faceBounds() const;
  [[nodiscard]] std::span<const MeshEdge> edges() const;

  /// Appends to `out` every face whose bounding box meets `box`, ascending, each once. No false negatives:
  /// the single-precision tree is inflated by its rounding. Allocates only when `out` must grow. Thread-safe.
  void facesNear(const Aabb& box, std::vector<int>& out) const;

  /// The same for the faces that may also come near `capsule`: none that do are left out.
  void facesNear(const Aabb& box, const Capsule& capsule, std::vector<int>& out) const;

  struct Clearance {
    double distance = std::numeric_limits<double>::infinity();  // m, centreline to mesh
    int segment = -1;                                           // index of the polyline segment
    int face = -1;
    Vector3 on_rod = Vector3::Zero(), on_mesh = Vector3::Zero();
  };
  /// The smallest distance of a polyline (at least two points) to the faces if below `limit` [m], which
  /// may be infinite; else distance is infinite and face -1. Of equals the first segment, then the first
  /// face. The meshes themselves may be nearer by `deviation()`.
  [[nodiscard]] Clearance clearance(std::span<const Vector3> polyline, double limit) const;

 private:
  struct Data;
  std::unique_ptr<const Data> data_;
};

// ---------------------------------------------------------------------------------------------- continuous
// detection

/// How much of a gap a motion must leave: a fraction of it in [0, 1), and half of what is within `room` [m].
struct KeptGap {
  double fraction, room;
  KeptGap(double fraction_in, double room_in = 0) : fraction(fraction_in), room(room_in) {}
  [[nodiscard]] double of(double gap) const { return std::max(fraction * gap, 0.5 * std::min(gap, room)); }
};

/// A fraction f in [0, 1], proven and nearly the largest, such that while a point moves from p to p + f d its
/// distance to triangle abc stays >= radius + keep.of(its initial gap), gap = distance - radius. If f > 0
/// that holds in exact arithmetic at every moment, and for p + f d rounded, whatever the input. 1 when free
/// all the way; 0, which promises nothing, when the initial gap is not positive beyond the rounding of the
/// coordinates, or not finite. radius > 0. Conservative advancement with the separating plane
/// at the closest points.
[[nodiscard]] double freeMotionPointTriangle(const Vector3& p, const Vector3& d, const Vector3& a,
                                             const Vector3& b, const Vector3& c, double radius, KeptGap keep);
/// The same for a segment whose ends move by d0, d1, against the fixed edge ab.
[[nodiscard]] double freeMotionSegmentEdge(const Vector3& p0, const Vector3& p1, const Vector3& d0,
                                           const Vector3& d1, const Vector3& a, const Vector3& b,
                                           double radius, KeptGap keep);
/// The same for a segment whose ends move by d0, d1, against a fixed triangle.
[[nodiscard]] double freeMotionSegmentTriangle(const Vector3& p0, const Vector3& p1, const Vector3& d0,
                                               const Vector3& d1, const Vector3& a, const Vector3& b,
                                               const Vector3& c, double radius, KeptGap keep);
/// The same for two moving segments (self-contact).
[[nodiscard]] double freeMotionSegmentSegment(const Vector3& p0, const Vector3& p1, const Vector3& dp0,
                                              const Vector3& dp1, const Vector3& q0, const Vector3& q1,
                                              const Vector3& dq0, const Vector3& dq1, double radius,
                                              KeptGap keep);

}  // namespace tendril
