#pragma once

#include <span>

#include "firmware/base/executor.hpp"
#include "firmware/base/result.hpp"
#include "sfm/dense/dense_view.hpp"
#include "sfm/dense/depth_map.hpp"
#include "sfm/surface/surface_options.hpp"
#include "sfm/surface/voxel_grid.hpp"

namespace trigmesh {

/// Edge of a voxel that the depth maps' resolution asks for: `SurfaceOptions::voxel_size`, or the
/// ratio times the median of depth / focal length. kInsufficientData: no depth anywhere.
[[nodiscard]] Result<double> choose_voxel_size(std::span<const DenseView> views,
                                               const DepthMapSource& depth_maps,
                                               const SurfaceOptions& options);

/// All depth maps in one distance function. Loads one map at a time (twice); fills in the report's
/// voxel size, memory and view fields. kInsufficientData: no depth anywhere; errors of the source.
[[nodiscard]] Result<VoxelGrid> fuse_depth_maps(std::span<const DenseView> views,
                                                const DepthMapSource& depth_maps,
                                                const SurfaceOptions& options,
                                                SurfaceReport& report,
                                                Executor& executor);

}  // namespace trigmesh
