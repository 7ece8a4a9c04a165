#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "firmware/base/executor.hpp"
#include "sfm/surface/triangle_mesh.hpp"
#include "sfm/surface/voxel_grid.hpp"

namespace trigmesh {

/// The part of the zero level that belongs to one block: vertices on the voxel edges that start in
/// it, faces of the cells that start in it. Both depend on the voxels alone, not on what else is
/// extracted: blocks that were extracted apart fit without cracks.
struct BlockSurface {
  std::vector<std::uint16_t> edges;  ///< 3 * voxel + axis of each vertex, rising
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals;
  /// Names of the edges on which the vertices lie, in this block or one of the next
  /// (`join_blocks`).
  std::vector<std::array<std::uint16_t, 3>> faces;

  /// Gives spare memory back.
  void shrink() {
    edges.shrink_to_fit();
    positions.shrink_to_fit();
    normals.shrink_to_fit();
    faces.shrink_to_fit();
  }
};

/// The zero level of the distance function in one block, with normals from its gradient. Only cells
/// whose eight voxels have at least `min_weight` give triangles. Looks at the 26 blocks around.
/// Positions are in scene units.
[[nodiscard]] BlockSurface extract_block(const VoxelGrid& grid,
                                         std::size_t block,
                                         float min_weight);

/// One mesh, without colours, from the surfaces of blocks under sorted keys; order by block, so
/// that the result does not depend on the executor.
[[nodiscard]] TriangleMesh join_blocks(std::span<const BlockKey> keys,
                                       std::vector<BlockSurface> surfaces,
                                       Executor& executor);

/// Both for all blocks of a grid.
[[nodiscard]] TriangleMesh extract_surface(const VoxelGrid& grid,
                                           float min_weight,
                                           Executor& executor);

}  // namespace trigmesh
