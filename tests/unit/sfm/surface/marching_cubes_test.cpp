#include "sfm/surface/marching_cubes.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "sfm/surface/mesh_topology.hpp"

namespace trigmesh {
namespace {

/// All blocks of [-2, 2)^3 blocks with `distance(voxel position)` in voxels / 3.
template <typename Distance>
VoxelGrid make_grid(const Distance& distance) {
  std::vector<BlockKey> keys;
  for (int z = -2; z < 2; ++z) {
    for (int y = -2; y < 2; ++y) {
      for (int x = -2; x < 2; ++x) {
        keys.push_back(*block_key({x, y, z}));
      }
    }
  }
  VoxelGrid grid(0.5, keys);
  for (std::size_t b = 0; b < grid.size(); ++b) {
    for (int v = 0; v < 512; ++v) {
      const Eigen::Vector3i at =
          8 * block_position(grid.key(b)) + Eigen::Vector3i(v % 8, v / 8 % 8, v / 64);
      const auto i = static_cast<std::size_t>(v);
      grid.block(b).distance[i] = std::clamp(distance(at.cast<float>()) / 3.0F, -1.0F, 1.0F);
      grid.block(b).weight[i] = 1.0F;
    }
  }
  return grid;
}

TEST(MarchingCubes, MakesAClosedSphereAcrossBlocks) {
  const VoxelGrid grid =
      make_grid([](const Eigen::Vector3f& p) { return p.norm() - 9.3F; });
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
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform(-1.0F, 1.0F);
  const VoxelGrid grid = make_grid([&](const Eigen::Vector3f& p) {
    return p.cwiseAbs().maxCoeff() > 13.0F ? 1.0F : uniform(random);
  });
  SerialExecutor serial;
  const MeshTopology topology = analyze_topology(extract_surface(grid, 0.5F, serial));
  EXPECT_EQ(topology.boundary_edges, 0U);
  EXPECT_EQ(topology.non_manifold_edges, 0U);
}

TEST(MarchingCubes, SaysNothingWhereNothingIsKnown) {
  VoxelGrid grid = make_grid([](const Eigen::Vector3f& p) { return p.z() + 0.5F; });
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
