#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "sfm/camera/camera.hpp"
#include "sfm/geometry/rigid3.hpp"
#include "sfm/surface/voxel_grid.hpp"

namespace trigmesh {

/// A part of space whose voxels are in memory at once.
struct VoxelTile {
  std::vector<std::uint32_t> blocks;  ///< positions in the list of all blocks, rising
  std::vector<BlockKey> keys;         ///< of these and of the blocks around them, sorted
};

/// Cuts a sorted list of blocks into tiles of at most `max_blocks` blocks with those around them,
/// by halving along the longest side. Each block belongs to one tile. `max_blocks` at least 27.
[[nodiscard]] std::vector<VoxelTile> make_tiles(std::span<const BlockKey> keys,
                                                std::size_t max_blocks);

/// Where a depth map may say something.
struct ViewReach {
  Camera camera;  ///< of the map, kPinhole
  Rigid3 cam_from_world;
  double max_depth = 0.0;  ///< nothing is said beyond, scene units; 0 = nothing is said at all
};

/// Whether some voxel of the tile may lie in reach of a view: false only where none does.
[[nodiscard]] bool may_reach(const ViewReach& view, const VoxelTile& tile, double voxel_size);

}  // namespace trigmesh
