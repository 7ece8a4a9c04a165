#include "sfm/surface/marching_cubes.hpp"

#include <gtest/gtest.h>

#include "sfm/surface/mesh_topology.hpp"
#include "tests/unit/sfm/surface/mesh_examples.hpp"

namespace trigmesh {
namespace {

TEST(MarchingCubes, MakesAClosedSphereAcrossBlocks) {
  const VoxelGrid grid = test::make_grid([](const Eigen::Vector3f& p) { return p.norm() - 9.3F; });
  SerialExecutor serial;
  const TriangleMesh mesh = extract_surface(grid, 0.5F, serial);
  ASSERT_GT(mesh.faces.size(), 500U);
  const MeshTopology topology = analyze_topology(mesh);
  EXPECT_EQ(topology.boundary_edges, 0U);
  EXPECT_EQ(topology.non_manifold_edges, 0U);
  EXPECT_EQ(find_components(mesh).areas.size(), 1U);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    EXPECT_NEAR(mesh.positions[v].norm(), 4.65F, 0.02F);
    EXPECT_GT(mesh.normals[v].dot(mesh.positions[v].normalized()), 0.98F);
  }
}

TEST(MarchingCubes, StaysClosedOnNoise) {
  const VoxelGrid grid = test::make_noise(5);
  SerialExecutor serial;
  const MeshTopology topology = analyze_topology(extract_surface(grid, 0.5F, serial));
  EXPECT_EQ(topology.boundary_edges, 0U);
  EXPECT_EQ(topology.non_manifold_edges, 0U);
}

TEST(MarchingCubes, SaysNothingWhereNothingIsKnown) {
  VoxelGrid grid = test::make_grid([](const Eigen::Vector3f& p) { return p.z() + 0.5F; });
  for (std::size_t b = 0; b < grid.size(); ++b) {
    if (block_position(grid.key(b)).x() >= 0) {
      grid.block(b).weight.fill(0.1F);
    }
  }
  SerialExecutor serial;
  const TriangleMesh mesh = extract_surface(grid, 0.5F, serial);
  ASSERT_FALSE(mesh.faces.empty());
  for (const auto& face : mesh.faces) {
    for (const std::uint32_t v : face) {
      EXPECT_LT(mesh.positions[v].x(), 0.0F);
    }
  }
}

}  // namespace
}  // namespace trigmesh
