#pragma once

#include <span>

#include "firmware/base/executor.hpp"
#include "firmware/base/result.hpp"
#include "sfm/dense/dense_view.hpp"
#include "sfm/dense/depth_map.hpp"
#include "sfm/surface/surface_options.hpp"
#include "sfm/surface/triangle_mesh.hpp"

namespace trigmesh {

/// Edge of a voxel that the depth maps' resolution asks for: `SurfaceOptions::voxel_size`, or the
/// ratio times the median of depth / focal length. kInsufficientData: no depth anywhere.
[[nodiscard]] Result<double> choose_voxel_size(std::span<const DenseView> views,
                                               const DepthMapSource& depth_maps,
                                               const SurfaceOptions& options);

/// The zero level of one distance function of all depth maps, with normals and without colours.
/// Space is worked on in tiles: voxels of one tile at a time, each from the maps that reach it,
/// loaded one by one in order. The result does not depend on the tiles. Fills in the report's voxel
/// size, memory, tile and view fields. kInsufficientData: no depth anywhere; errors of the source.
[[nodiscard]] Result<TriangleMesh> fuse_depth_maps(std::span<const DenseView> views,
                                                   const DepthMapSource& depth_maps,
                                                   const SurfaceOptions& options,
                                                   SurfaceReport& report,
                                                   Executor& executor);

}  // namespace trigmesh
