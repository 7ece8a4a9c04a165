#pragma once

#include "firmware/base/executor.hpp"
#include "sfm/surface/triangle_mesh.hpp"
#include "sfm/surface/voxel_grid.hpp"

namespace trigmesh {

/// The zero level of the distance function as triangles, with normals from its gradient and without
/// colours. Only cells whose eight voxels have at least `min_weight` give triangles. Vertices lie on
/// voxel edges and are shared by all cells around, in this block and the next; order by block, so
/// that the result does not depend on the executor. Positions are in scene units.
[[nodiscard]] TriangleMesh extract_surface(const VoxelGrid& grid,
                                           float min_weight,
                                           Executor& executor);

}  // namespace trigmesh
