#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sfm/exchange/ply.hpp"

namespace trigmesh {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

using Face = std::array<std::uint32_t, 3>;

TriangleMesh tetrahedron() {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.normals = {{-0.6F, -0.8F, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.colors = {{1, 2, 3}, {255, 0, 0}, {0, 255, 0}, {0, 0, 255}};
  mesh.faces = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return mesh;
}

void expect_same(const TriangleMesh& actual, const TriangleMesh& expected) {
  EXPECT_EQ(actual.positions, expected.positions);
  EXPECT_EQ(actual.normals, expected.normals);
  EXPECT_EQ(actual.colors, expected.colors);
  EXPECT_EQ(actual.faces, expected.faces);
}

std::string ascii(const std::string& faces, const std::string& face_lines) {
  return "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
         "property float z\n" +
         faces + "end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n" + face_lines;
}

constexpr const char* kOneFace = "element face 1\nproperty list uchar int vertex_index\n";

TEST(MeshPly, ReadsBackExactlyWhatWasWritten) {
  const auto read = read_mesh_ply(write_mesh_ply(tetrahedron()));
  ASSERT_TRUE(read.has_value()) << read.error().message;
  expect_same(*read, tetrahedron());
}

TEST(MeshPly, LeavesOutWhatTheMeshDoesNotHave) {
  TriangleMesh mesh = tetrahedron();
  mesh.normals.clear();
  mesh.colors.clear();
  const std::string bytes = write_mesh_ply(mesh);
  const std::string end = "end_header\n";
  EXPECT_EQ(bytes.size() - bytes.find(end) - end.size(), 4U * 12U + 4U * 13U);
  const auto read = read_mesh_ply(bytes);
  ASSERT_TRUE(read.has_value()) << read.error().message;
  expect_same(*read, mesh);
}

TEST(MeshPly, ReadsBackAnEmptyMesh) {
  const auto read = read_mesh_ply(write_mesh_ply({}));
  ASSERT_TRUE(read.has_value()) << read.error().message;
  EXPECT_TRUE(read->positions.empty() && read->faces.empty());
}

TEST(MeshPly, HasVerticesThatReadAsPoints) {
  const auto read = read_ply(write_mesh_ply(tetrahedron()));
  ASSERT_TRUE(read.has_value()) << read.error().message;
  ASSERT_EQ(read->size(), 4U);
  EXPECT_EQ((*read)[1].color_rgb, tetrahedron().colors[1]);
}

TEST(MeshPly, CutsPolygonsIntoFans) {
  const auto read = read_mesh_ply(ascii(kOneFace, "4 0 1 2 3\n"));
  ASSERT_TRUE(read.has_value()) << read.error().message;
  EXPECT_THAT(read->faces, ElementsAre(Face{0, 1, 2}, Face{0, 2, 3}));
}

TEST(MeshPly, StepsOverForeignPropertiesOfFaces) {
  const auto read = read_mesh_ply(
      ascii("element face 1\nproperty uchar flags\nproperty list uchar float texcoord\n"
            "property list uchar uint vertex_indices\nproperty int page\n",
            "7 2 0.5 0.5 3 2 1 0 9\n"));
  ASSERT_TRUE(read.has_value()) << read.error().message;
  EXPECT_THAT(read->faces, ElementsAre(Face{2, 1, 0}));
}

TEST(MeshPly, TakesFacesBeforeVertices) {
  const auto read = read_mesh_ply(
      "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_index\n"
      "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
      "3 2 1 0\n0 0 0\n1 0 0\n0 1 0\n");
  ASSERT_TRUE(read.has_value()) << read.error().message;
  EXPECT_THAT(read->faces, ElementsAre(Face{2, 1, 0}));
}

TEST(MeshPly, RefusesWhatIsNoMesh) {
  for (const auto& [bytes, text] : std::vector<std::pair<std::string, std::string>>{
           {ascii("", ""), "lacks vertices or faces"},
           {ascii("element face 1\nproperty float a\n", "1\n"), "vertex_indices"},
           {ascii(std::string(kOneFace) + kOneFace, "3 0 1 2\n3 0 1 2\n"), "two elements"},
           {ascii(kOneFace, "3 0 1 4\n"), "vertex 4, there are 4"},
           {ascii(kOneFace, "3 0 1 -1\n"), "no vertex number"},
           {ascii(kOneFace, "3 0 1 1.5\n"), "no vertex number"},
           {ascii(kOneFace, "3 0 1 4294967296\n"), "no vertex number"},
           {ascii(kOneFace, "2 0 1\n"), "fewer than three"},
           {ascii(kOneFace, "0\n"), "fewer than three"},
           {ascii(kOneFace, "-3 0 1 2\n"), "negative"},
           {ascii(kOneFace, "1000000 0 1 2\n"), "longer than the file"},
           {ascii("element face 1000000\nproperty list uchar int vertex_index\n", "3 0 1 2\n"),
            "too short"}}) {
    const auto read = read_mesh_ply(bytes);
    ASSERT_FALSE(read.has_value()) << bytes;
    EXPECT_EQ(read.error().code, ErrorCode::kCorruptData);
    EXPECT_THAT(read.error().message, HasSubstr(text));
  }
}

TEST(MeshPly, RefusesEveryTruncation) {
  const std::string whole = write_mesh_ply(tetrahedron());
  for (std::size_t length = 0; length < whole.size(); ++length) {
    EXPECT_FALSE(read_mesh_ply(whole.substr(0, length)).has_value()) << length;
  }
}

}  // namespace
}  // namespace trigmesh
