#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <string>

#include "tendril/geometry.h"

namespace tendril {
namespace {
namespace fs = std::filesystem;

/// A folder of its own for each test, removed afterwards.
class LoadMesh : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path write(const std::string& name, const std::string& content) const {
    writeFileAtomically(folder_ / name, content);
    return folder_ / name;
  }
  std::string messageOf(const fs::path& file) const {
    try {
      static_cast<void>(loadMesh(file));
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  }

  fs::path folder_ =
      fs::temp_directory_path() / ("tendril-load-mesh-" + std::to_string(::getpid()) + "-" +
                                   testing::UnitTest::GetInstance()->current_test_info()->name());
};

/// The tetrahedron of all files below.
const std::vector<Vector3> kTetrahedron = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}};

double distanceToVertices(const Vector3& v, const TriangleMesh& mesh) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Vector3& w : mesh.vertices) nearest = std::min(nearest, (v - w).norm());
  return nearest;
}

/// Four faces and four vertices, those expected.
void expectTetrahedron(const TriangleMesh& mesh, const std::vector<Vector3>& expected = kTetrahedron,
                       double tolerance = 0) {
  ASSERT_EQ(mesh.vertices.size(), 4u);
  EXPECT_EQ(mesh.faces.size(), 4u);
  for (const Vector3& v : expected) EXPECT_LE(distanceToVertices(v, mesh), tolerance) << v.transpose();
  for (const auto& face : mesh.faces)
    for (const int v : face) EXPECT_TRUE(v >= 0 && v < 4);
  EXPECT_EQ(mesh.dropped_faces, 0);
}

const char* const kObj = "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

const char* const kPly =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 2 0\n0 0 3\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

const char* const kOff = "OFF\n4 4 6\n0 0 0\n1 0 0\n0 2 0\n0 0 3\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

std::string asciiStl() {
  std::string text = "solid t\n";
  for (const auto& face : {std::array{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const int v : face)
      text += "vertex " + std::to_string(kTetrahedron[static_cast<std::size_t>(v)].x()) + " " +
              std::to_string(kTetrahedron[static_cast<std::size_t>(v)].y()) + " " +
              std::to_string(kTetrahedron[static_cast<std::size_t>(v)].z()) + "\n";
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid t\n";
}

template <class T>
void append(std::string& bytes, T value) {
  char buffer[sizeof(T)];
  std::memcpy(buffer, &value, sizeof(T));
  bytes.append(buffer, sizeof(T));
}

std::string binaryStl() {
  std::string bytes(80, ' ');
  append<std::uint32_t>(bytes, 4);
  for (const auto& face : {std::array{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}) {
    for (int i = 0; i < 3; ++i) append(bytes, 0.0f);
    for (const int v : face)
      for (int i = 0; i < 3; ++i)
        append(bytes, static_cast<float>(kTetrahedron[static_cast<std::size_t>(v)][i]));
    append<std::uint16_t>(bytes, 0);
  }
  return bytes;
}

/// A glTF with two nodes that use one mesh: the first as it is, the second moved by (10, 0, 0) below a turn
/// of 90 degrees about z.
void writeGltf(const fs::path& folder) {
  std::string bytes;
  for (const Vector3& v : kTetrahedron)
    for (int i = 0; i < 3; ++i) append(bytes, static_cast<float>(v[i]));
  for (const int index : {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3})
    append<std::uint16_t>(bytes, static_cast<std::uint16_t>(index));
  writeFileAtomically(folder / "t.bin", bytes);
  writeFileAtomically(folder / "t.gltf",
                      R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
 "nodes": [{"mesh": 0}, {"rotation": [0, 0, 0.70710678118654752, 0.70710678118654752], "children": [2]},
           {"mesh": 0, "translation": [10, 0, 0]}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
 "buffers": [{"uri": "t.bin", "byteLength": 72}],
 "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 24}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 2, 3]},
               {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"}]})");
}

std::string collada(const std::string& unit, const std::string& up, const std::string& node_transform) {
  return R"(<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
 <asset>)" +
         unit + "<up_axis>" + up + R"(</up_axis></asset>
 <library_geometries><geometry id="g"><mesh>
  <source id="p"><float_array id="pa" count="12">0 0 0 1 0 0 0 2 0 0 0 3</float_array>
   <technique_common><accessor source="#pa" count="4" stride="3">
    <param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
  <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
  <triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles>
 </mesh></geometry></library_geometries>
 <library_visual_scenes><visual_scene id="s"><node id="n">)" +
         node_transform + R"(<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
 <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>)";
}

TEST_F(LoadMesh, ReadsTheSameTetrahedronFromEveryFormat) {
  expectTetrahedron(loadMesh(write("t.obj", kObj)));
  expectTetrahedron(loadMesh(write("t.ply", kPly)));
  expectTetrahedron(loadMesh(write("t.off", kOff)));
  expectTetrahedron(loadMesh(write("ascii.stl", asciiStl())));
  expectTetrahedron(loadMesh(write("binary.stl", binaryStl())));
  expectTetrahedron(loadMesh(write("t.dae", collada("<unit meter=\"1\"/>", "Y_UP", ""))), kTetrahedron, 1e-6);
}

TEST_F(LoadMesh, WeldsTheCornersThatAFormatWithoutIndicesRepeats) {
  const TriangleMesh mesh = loadMesh(write("t.stl", binaryStl()));
  EXPECT_EQ(mesh.welded_vertices, 12 - 4);
}

TEST_F(LoadMesh, AppliesNodeTransformsAndRepeatsInstancedMeshes) {
  writeGltf(folder_);
  const TriangleMesh mesh = loadMesh(folder_ / "t.gltf");
  EXPECT_EQ(mesh.faces.size(), 8u);
  ASSERT_EQ(mesh.vertices.size(), 8u);
  // turned by 90 degrees about z after the move: (x, y, z) -> (-y, x + 10, z)
  for (const Vector3& v : kTetrahedron) {
    EXPECT_EQ(distanceToVertices(v, mesh), 0);
    EXPECT_LT(distanceToVertices(Vector3(-v.y(), v.x() + 10, v.z()), mesh), 1e-5) << v.transpose();
  }
}

TEST_F(LoadMesh, AppliesUnitUpAxisAndNodeOfCollada) {
  const std::string metre = "<unit meter=\"1\"/>", centimetre = "<unit meter=\"0.01\"/>";
  const TriangleMesh moved =
      loadMesh(write("moved.dae", collada(metre, "Y_UP", "<translate>1 2 3</translate>")));
  expectTetrahedron(moved, {{1, 2, 3}, {2, 2, 3}, {1, 4, 3}, {1, 2, 6}}, 1e-6);
  const TriangleMesh small = loadMesh(write("small.dae", collada(centimetre, "Y_UP", "")));
  expectTetrahedron(small, {{0, 0, 0}, {.01, 0, 0}, {0, .02, 0}, {0, 0, .03}}, 1e-8);
  // what is up in the file becomes y, Assimp's convention
  const TriangleMesh turned = loadMesh(write("turned.dae", collada(metre, "Z_UP", "")));
  expectTetrahedron(turned, {{0, 0, 0}, {1, 0, 0}, {0, 0, -2}, {0, 3, 0}}, 1e-6);
}

TEST_F(LoadMesh, MapsVerticesByScaleThenRotationThenTranslationInDouble) {
  const Pose pose{Quaternion(Eigen::AngleAxisd(std::numbers::pi / 3, Vector3(1, 2, 3).normalized())),
                  {0.1, 0.2, 0.3}};
  const TriangleMesh mesh = loadMesh(write("t.obj", kObj), 1e-3, pose);
  std::vector<Vector3> expected;
  for (const Vector3& v : kTetrahedron) expected.push_back(pose.position + pose.rotation * (1e-3 * v));
  expectTetrahedron(mesh, expected, 1e-16);
}

TEST_F(LoadMesh, WeldsOnlyIdenticalPositions) {
  // vertices 1 and 4 are identical (but for the sign of zero), 2 and 5 are one float apart
  const TriangleMesh mesh = loadMesh(
      write("t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv -0 0 0\nv 1.0000001 0 0\nv 0 0 1\nf 1 2 3\nf 4 5 6\n"));
  EXPECT_EQ(mesh.vertices.size(), 5u);
  EXPECT_EQ(mesh.welded_vertices, 1);
  ASSERT_EQ(mesh.faces.size(), 2u);
  EXPECT_EQ(mesh.faces[0][0], mesh.faces[1][0]);
  EXPECT_NE(mesh.faces[0][1], mesh.faces[1][1]);
}

TEST_F(LoadMesh, DropsAndCountsFacesWithoutAreaAndKeepsTheThinnest) {
  // face 1 repeats a position, face 2 is three points on a line, face 3 is thin
  const TriangleMesh mesh =
      loadMesh(write("t.ply",
                     "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\n"
                     "property float z\nelement face 4\nproperty list uchar int vertex_indices\n"
                     "end_header\n0 0 0\n1 0 0\n0 1 0\n0.3 0 0\n0 0 0\n0.5 1e-7 0\n"
                     "3 0 1 2\n3 0 4 1\n3 0 3 1\n3 0 1 5\n"));
  EXPECT_EQ(mesh.faces.size(), 2u);
  EXPECT_EQ(mesh.dropped_faces, 2);
  const Pose turned{Quaternion(Eigen::AngleAxisd(1, Vector3(1, 2, 3).normalized())), {1, 2, 3}};
  EXPECT_EQ(loadMesh(folder_ / "t.ply", 0.7, turned).dropped_faces, 2) << "seen before the turn rounds them";
}

TEST_F(LoadMesh, TriangulatesPolygonsWithoutMovingAVertex) {
  const TriangleMesh mesh =
      loadMesh(write("t.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 5 5 5\nv 6 6 6\nf 1 2 3 4\nl 5 6\n"));
  ASSERT_EQ(mesh.faces.size(), 2u);
  double area = 0;
  for (const auto& [a, b, c] : mesh.faces) {
    const auto at = [&](int i) { return mesh.vertices[static_cast<std::size_t>(i)]; };
    area += 0.5 * (at(b) - at(a)).cross(at(c) - at(a)).norm();
  }
  EXPECT_DOUBLE_EQ(area, 1);
}

TEST_F(LoadMesh, SaysWhatIsWrongWithAFileAndNamesIt) {
  EXPECT_EQ(messageOf(folder_ / "none.stl"), (folder_ / "none.stl").string() + ": no such file.");
  EXPECT_EQ(messageOf(folder_), folder_.string() + ": is a folder; name a mesh file.");
  for (const auto& [name, content] : {std::pair{"text.txt", "hello"},
                                      {"text.obj", "hello"},
                                      {"text.stl", "hello"},
                                      {"empty.stl", ""},
                                      {"empty.obj", ""},
                                      {"empty.ply", ""},
                                      {"text.ply", "hello"},
                                      {"text.gltf", "hello"},
                                      {"points.obj", "v 0 0 0\nv 1 0 0\n"},
                                      {"flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"}}) {
    const std::string message = messageOf(write(name, content));
    EXPECT_NE(message, "no error") << name;
    EXPECT_TRUE(message.starts_with((folder_ / name).string() + ": ")) << message;
    EXPECT_TRUE(message.ends_with(".")) << message;
  }
}

TEST_F(LoadMesh, RefusesVerticesThatAreNotFinite) {
  const std::string message = messageOf(write("t.obj", "v 0 0 0\nv 1e60 0 0\nv 0 1 0\nf 1 2 3\n"));
  EXPECT_NE(message.find("is not finite"), std::string::npos) << message;
  EXPECT_THROW(static_cast<void>(loadMesh(write("u.obj", kObj), 0.0)), InputError);
  EXPECT_THROW(static_cast<void>(loadMesh(write("u.obj", kObj), std::nan(""))), InputError);
}

TEST_F(LoadMesh, GivesTheSameMeshEveryTime) {
  const fs::path file = write("t.stl", binaryStl());
  const TriangleMesh first = loadMesh(file), second = loadMesh(file);
  EXPECT_EQ(first.vertices, second.vertices);
  EXPECT_EQ(first.faces, second.faces);
}

}  // namespace
}  // namespace tendril
