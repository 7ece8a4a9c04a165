#include "sfm/texture/face_splitting.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "sfm/texture/mesh_topology.hpp"
#include "tests/unit/sfm/texture/painted_scene.hpp"

namespace trigmesh {
namespace {

/// Sum of the faces' areas as seen from +z; faces that were turned over count negative.
double signed_area(const TriangleMesh& mesh) {
  double area = 0.0;
  for (const auto& face : mesh.faces) {
    const Eigen::Vector3d a = mesh.positions[face[0]].cast<double>();
    const Eigen::Vector3d b = mesh.positions[face[1]].cast<double>();
    const Eigen::Vector3d c = mesh.positions[face[2]].cast<double>();
    area += 0.5 * (b - a).cross(c - a).z();
  }
  return area;
}

std::size_t open_side_count(const TriangleMesh& mesh) {
  std::size_t count = 0;
  for (const auto& neighbors : face_neighbors(mesh)) {
    count += static_cast<std::size_t>(std::count(neighbors.begin(), neighbors.end(), kNoFace));
  }
  return count;
}

TEST(SplitFaces, OneFaceBecomesFour) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}};
  mesh.normals.assign(3, Eigen::Vector3f::UnitZ());
  mesh.colors = {{0, 0, 0}, {100, 0, 0}, {0, 200, 0}};
  mesh.faces = {{0, 1, 2}};
  const std::vector<std::uint32_t> wanted{0};
  const TriangleMesh split = split_faces(mesh, wanted);
  ASSERT_EQ(split.positions.size(), 6U);
  EXPECT_EQ(split.normals.size(), 6U);
  EXPECT_EQ(split.positions[3], Eigen::Vector3f(1, 0, 0));
  EXPECT_EQ(split.colors[3][0], 50);
  EXPECT_EQ(split.faces.size(), 4U);
  EXPECT_DOUBLE_EQ(signed_area(split), 2.0);
}

TEST(SplitFaces, LeavesNoCrackWhateverIsSplit) {
  const TriangleMesh mesh = square_mesh(1.0, 3, 0.0);
  for (std::uint32_t pattern = 1; pattern < 4096; pattern += 37) {
    std::vector<std::uint32_t> wanted;
    for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
      if ((pattern >> (f % 12) & 1U) != 0) {
        wanted.push_back(f);
      }
    }
    const TriangleMesh split = split_faces(mesh, wanted);
    EXPECT_NEAR(signed_area(split), 4.0, 1e-6);
    // A crack would open sides inside; the border's own may be cut in two.
    std::size_t border = 0;
    for (std::size_t f = 0; f < split.faces.size(); ++f) {
      for (std::size_t side = 0; side < 3; ++side) {
        const Eigen::Vector3f middle = 0.5F * (split.positions[split.faces[f][side]] +
                                               split.positions[split.faces[f][(side + 1) % 3]]);
        border += middle.head<2>().cwiseAbs().maxCoeff() > 0.999F ? 1U : 0U;
      }
    }
    EXPECT_EQ(open_side_count(split), border);
  }
}

TEST(SplitFaces, NothingWantedNothingChanged) {
  const TriangleMesh mesh = square_mesh(1.0, 2, 0.0);
  const TriangleMesh split = split_faces(mesh, {});
  EXPECT_EQ(split.faces, mesh.faces);
  EXPECT_EQ(split.positions.size(), mesh.positions.size());
}

}  // namespace
}  // namespace trigmesh
