#include "sfm/surface/hole_filling.hpp"

#include <gtest/gtest.h>

#include "sfm/surface/mesh_topology.hpp"
#include "tests/unit/sfm/surface/mesh_examples.hpp"

namespace trigmesh {
namespace {

/// A sheet of 20 x 20 with the squares whose middle is within `radius` of the centre missing.
TriangleMesh sheet_with_hole(float radius) {
  TriangleMesh mesh = test::make_sheet(20);
  std::vector<std::uint8_t> keep;
  for (const auto& face : mesh.faces) {
    const Eigen::Vector3f middle =
        0.5F * (mesh.positions[face[0]] + mesh.positions[face[2]]) - Eigen::Vector3f(10, 10, 0);
    keep.push_back(middle.norm() > radius ? 1 : 0);
  }
  keep_faces(keep, mesh);
  return mesh;
}

TEST(HoleFilling, ClosesASmallHoleInItsPlane) {
  TriangleMesh mesh = sheet_with_hole(4.0F);
  const FilledHoles holes = fill_holes(12.0F, 1.0F, mesh);
  EXPECT_EQ(holes.filled_count, 1U);
  ASSERT_EQ(holes.open.size(), 1U);  // the outer border
  EXPECT_NEAR(holes.open[0].perimeter, 80.0F, 1e-3F);
  const MeshTopology topology = analyze_topology(mesh);
  EXPECT_EQ(topology.boundary_edges, 80U);
  EXPECT_EQ(topology.non_manifold_edges, 0U);
  double area = 0.0;
  for (const double a : find_components(mesh).areas) {
    area += a;
  }
  EXPECT_NEAR(area, 400.0, 0.1);
  for (const Eigen::Vector3f& normal : vertex_normals(mesh)) {
    EXPECT_GT(normal.z(), 0.99F);
  }
  EXPECT_EQ(mesh.colors.size(), mesh.positions.size());
  EXPECT_EQ(mesh.normals.size(), mesh.positions.size());
}

TEST(HoleFilling, LeavesAndReportsALargeHole) {
  TriangleMesh mesh = sheet_with_hole(6.0F);
  const std::size_t faces = mesh.faces.size();
  const FilledHoles holes = fill_holes(12.0F, 1.0F, mesh);
  EXPECT_EQ(holes.filled_count, 0U);
  EXPECT_EQ(mesh.faces.size(), faces);
  ASSERT_EQ(holes.open.size(), 2U);
  EXPECT_NEAR((holes.open[1].center_in_world - Eigen::Vector3f(10, 10, 0)).norm(), 0.0F, 0.6F);
  EXPECT_NEAR(holes.open[1].diameter, 17.0F, 1.0F);
}

TEST(HoleFilling, DoesNotUseAnEdgeTwiceWhereHolesTouchInTwoVertices) {
  // Two diamonds at right angles with the short diagonal 0-1 in common, a fin on each border edge.
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0.5, 2, 0}, {0.5, -2, 0}, {0.5, 0, 2}, {0.5, 0, -2}};
  const std::vector<BoundaryLoop> borders = {{0, 2, 1, 3}, {0, 4, 1, 5}};
  for (const BoundaryLoop& border : borders) {
    for (std::size_t k = 0; k < border.size(); ++k) {
      const std::uint32_t from = border[k];
      const std::uint32_t to = border[(k + 1) % border.size()];
      const auto tip = static_cast<std::uint32_t>(mesh.positions.size());
      mesh.positions.emplace_back(5.0F * (mesh.positions[from] + mesh.positions[to]) -
                                  Eigen::Vector3f(4.5F, 0.0F, 0.0F));
      mesh.faces.push_back({to, from, tip});
    }
  }
  const FilledHoles holes = fill_holes(6.0F, 10.0F, mesh);
  EXPECT_EQ(holes.filled_count, 1U);
  EXPECT_EQ(analyze_topology(mesh).non_manifold_edges, 0U);
}

}  // namespace
}  // namespace trigmesh
