#pragma once

#include <vector>

#include "sfm/surface/depth_frame.hpp"
#include "sfm/surface/voxel_grid.hpp"

namespace trigmesh {

/// What a depth map says about the space around its surface.
struct TsdfOptions {
  float truncation = 1.0F;               ///< scene units
  float free_space_weight_ratio = 0.3F;  ///< of "seen through" relative to "surface here"
};

/// Along a ray nothing is said beyond this many truncation distances behind the surface.
inline constexpr float kMaxRayTruncations = 1.5F;

/// Blocks within the truncation distance of the planes of a frame, sorted, each once; blocks that
/// fewer than a few pixels touch are left out.
[[nodiscard]] std::vector<BlockKey> blocks_near_surface(const DepthFrame& frame,
                                                        double voxel_size,
                                                        double truncation);

/// Adds one view to the running weighted mean of one block (Curless and Levoy, "A volumetric method
/// for building complex models from range images", SIGGRAPH 1996, eq. 3-4), with the distance to
/// the pixel's plane in place of the distance along the ray, a weight that falls to zero behind the
/// surface (as in Bylow et al., "Real-time camera tracking and 3D reconstruction using signed
/// distance functions", RSS 2013) and a vote for empty space in front of it.
void integrate(const DepthFrame& frame,
               const TsdfOptions& options,
               VoxelGrid& grid,
               std::size_t block);

}  // namespace trigmesh
