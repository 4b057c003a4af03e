#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <numeric>

#include "tendril/geometry.h"

namespace tendril {
namespace {
namespace fs = std::filesystem;

/// x -> linear x + translation, in double.
struct Affine {
  Matrix3 linear = Matrix3::Identity();
  Vector3 translation = Vector3::Zero();

  [[nodiscard]] Vector3 operator*(const Vector3& x) const { return linear * x + translation; }
  [[nodiscard]] Affine operator*(const Affine& other) const {
    return {linear * other.linear, linear * other.translation + translation};
  }
};

Affine affine(const aiMatrix4x4& m) {
  Affine result;
  result.linear << m.a1, m.a2, m.a3, m.b1, m.b2, m.b3, m.c1, m.c2, m.c3;
  result.translation << m.a4, m.b4, m.c4;
  return result;
}

Vector3 toVector(const aiVector3D& v) { return {v.x, v.y, v.z}; }

/// No area, exactly. On the vertices as read this is no matter of rounding: differences of floats are exact
/// in double, and where the products in the cross product are equal they are rounded alike.
bool hasNoArea(const Vector3& a, const Vector3& b, const Vector3& c) {
  return (b - a).cross(c - a).isZero(0);
}

/// Collects the faces of a scene; a mesh used by several nodes is as many obstacles.
class Collector {
 public:
  explicit Collector(const fs::path& file, const aiScene& scene) : file_(file), scene_(scene) {}

  void addNode(const aiNode& node, const Affine& to_parent) {
    const Affine to_world = to_parent * affine(node.mTransformation);
    for (unsigned i = 0; i < node.mNumMeshes; ++i) addMesh(*scene_.mMeshes[node.mMeshes[i]], to_world);
    for (unsigned i = 0; i < node.mNumChildren; ++i) addNode(*node.mChildren[i], to_world);
  }

  TriangleMesh mesh;

 private:
  void addMesh(const aiMesh& part, const Affine& to_world) {
    const auto offset = static_cast<int>(mesh.vertices.size());
    for (unsigned i = 0; i < part.mNumVertices; ++i) {
      // Adding zero makes -0 and 0 one number, so that they weld.
      const Vector3 v = to_world * toVector(part.mVertices[i]) + Vector3::Zero();
      if (!v.allFinite())
        throw InputError(fmt::format("{}: vertex {} is not finite; repair the mesh.", file_.string(),
                                     static_cast<std::size_t>(offset) + i));
      mesh.vertices.push_back(v);
    }
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;  // a point or a line
      std::array<int, 3> corners;
      std::array<Vector3, 3> as_read;
      for (unsigned k = 0; k < 3; ++k) {
        const unsigned index = face.mIndices[k];
        if (index >= part.mNumVertices)
          throw InputError(fmt::format("{}: face {} names vertex {}; there are {}.", file_.string(), f, index,
                                       part.mNumVertices));
        as_read[k] = toVector(part.mVertices[index]);
        corners[k] = offset + static_cast<int>(index);
      }
      if (hasNoArea(as_read[0], as_read[1], as_read[2]))
        ++mesh.dropped_faces;
      else
        mesh.faces.push_back(corners);
    }
  }

  const fs::path& file_;
  const aiScene& scene_;
};

/// Merges vertices at identical positions into the first of them and renumbers in the order of first
/// appearance.
void weld(TriangleMesh& mesh) {
  const std::vector<Vector3>& v = mesh.vertices;
  std::vector<int> order(v.size());
  std::iota(order.begin(), order.end(), 0);
  const auto at = [&v](int i) -> const Vector3& { return v[static_cast<std::size_t>(i)]; };
  std::sort(order.begin(), order.end(), [&at](int i, int j) {
    for (int k = 0; k < 3; ++k)
      if (at(i)[k] != at(j)[k]) return at(i)[k] < at(j)[k];
    return i < j;
  });
  std::vector<int> first(v.size());  // the first vertex at the same position
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && at(order[i]) == at(order[i - 1]);
    first[static_cast<std::size_t>(order[i])] =
        same ? first[static_cast<std::size_t>(order[i - 1])] : order[i];
  }

  std::vector<Vector3> kept;
  std::vector<int> number(v.size());
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (first[i] == static_cast<int>(i)) {
      number[i] = static_cast<int>(kept.size());
      kept.push_back(v[i]);
    } else {
      number[i] = number[static_cast<std::size_t>(first[i])];
    }
  }
  for (auto& face : mesh.faces)
    for (int& corner : face) corner = number[static_cast<std::size_t>(corner)];
  mesh.welded_vertices = static_cast<int>(v.size() - kept.size());
  mesh.vertices = std::move(kept);
}

void dropFacesWithoutArea(TriangleMesh& mesh) {
  const auto at = [&mesh](int i) -> const Vector3& { return mesh.vertices[static_cast<std::size_t>(i)]; };
  mesh.dropped_faces += static_cast<int>(
      std::erase_if(mesh.faces, [&at](const auto& f) { return hasNoArea(at(f[0]), at(f[1]), at(f[2])); }));
}

}  // namespace

TriangleMesh loadMesh(const fs::path& file, double scale, const Pose& pose) {
  std::error_code error;
  if (!fs::exists(file, error)) throw InputError(fmt::format("{}: no such file.", file.string()));
  if (fs::is_directory(file, error))
    throw InputError(fmt::format("{}: is a folder; name a mesh file.", file.string()));
  if (!std::isfinite(scale) || scale == 0)
    throw InputError(
        fmt::format("{}: scale is {}; it must be a finite number other than 0.", file.string(), scale));

  // Triangulation is the only step asked for: others merge, reorder or drop what is nearly the same.
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(file.string(), aiProcess_Triangulate);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    std::string reason = importer.GetErrorString();
    if (!reason.ends_with('.')) reason += '.';
    throw InputError(fmt::format("{}: cannot be read as a mesh: {}", file.string(), reason));
  }

  Collector collector(file, *scene);
  collector.addNode(*scene->mRootNode, {scale * pose.rotation.toRotationMatrix(), pose.position});
  TriangleMesh mesh = std::move(collector.mesh);
  mesh.origin = pose.position, mesh.rounding = 0x1p-24;
  weld(mesh);
  dropFacesWithoutArea(mesh);
  if (mesh.faces.empty())
    throw InputError(fmt::format("{}: has no faces with an area; name a mesh of triangles.", file.string()));
  return mesh;
}

}  // namespace tendril
