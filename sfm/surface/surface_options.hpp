#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "firmware/base/result.hpp"
#include "sfm/surface/triangle_mesh.hpp"

namespace trigmesh {

/// How depth maps become a surface. Lengths "in voxels" are multiples of the voxel edge that is
/// used.
struct SurfaceOptions {
  /// Edge of a voxel in scene units; 0 = `voxel_footprint_ratio` times the median pixel footprint
  /// (depth / focal length) of the depth maps. [0, inf).
  double voxel_size = 0.0;
  /// See `voxel_size`; (0, 20]. Smaller keeps thinner parts, memory grows with its inverse square.
  double voxel_footprint_ratio = 0.8;
  /// Depth maps speak about this much space on both sides of their surface, voxels, [1.5, 10].
  /// Parts thinner than this begin to lose their back to their front.
  double truncation_voxels = 3.0;
  /// Pixels whose footprint is larger than this are left out (far background), voxels, > 0.
  double max_footprint_voxels = 5.0;
  /// Weight of "a view sees through here" relative to "a view sees a surface here", (0, 1].
  double free_space_weight_ratio = 0.3;
  /// Smallest weight of a voxel that counts as known; 1 = one confident, frontal observation. > 0.
  double min_voxel_weight = 0.2;
  /// Surface that fewer depth maps than this agree on is removed, [0, 20].
  int min_support_views = 2;
  /// Components with less than this part of the area of the largest are removed, [0, 1].
  double min_component_area_ratio = 0.0002;
  /// Holes up to this diameter are filled, voxels, [0, 200].
  double max_filled_hole_voxels = 25.0;
  /// Passes of smoothing that keeps the volume, [0, 20].
  int smoothing_passes = 1;
  /// Budget of faces; > 0.
  std::size_t max_faces = 700'000;
  /// Bytes for voxels and mesh, at least 4 MiB. Voxels are worked on in tiles that fit; only when
  /// the mesh itself would not fit the voxel is made larger in steps of `kVoxelGrowthRatio`. What
  /// it does not hold: one depth map and picture, and the budget of faces that simplification
  /// leaves.
  std::size_t max_memory_bytes = std::size_t{640} << 20U;
  /// Bytes for the voxels of one tile, at least 2 MiB; the result does not depend on it. Each tile
  /// loads the depth maps that reach it again.
  std::size_t max_tile_bytes = std::size_t{512} << 20U;

  /// kInvalidArgument: names the field, its value and the rule.
  [[nodiscard]] Result<> validate() const;
};

/// One declared step towards less memory: voxels this much larger, faces about halved.
inline constexpr double kVoxelGrowthRatio = 1.4142135623730951;

/// A hole that was left open.
struct SurfaceHole {
  Eigen::Vector3f center_in_world = Eigen::Vector3f::Zero();  ///< mean of its border
  float diameter = 0.0F;   ///< diagonal of the box around its border, scene units
  float perimeter = 0.0F;  ///< length of its border, scene units
  std::size_t edge_count = 0;
};

/// What was done.
struct SurfaceReport {
  double voxel_size = 0.0;         ///< scene units
  double wanted_voxel_size = 0.0;  ///< before the memory budget was looked at
  int memory_steps = 0;            ///< how often the voxel was made larger to keep the budget
  std::size_t tile_count = 0;      ///< parts of space that were worked on one by one
  std::size_t grid_bytes = 0;      ///< of the voxels of the largest tile
  std::size_t block_count = 0;
  std::size_t view_count = 0;         ///< views with a depth map
  std::size_t extracted_faces = 0;    ///< before cleaning
  std::size_t unsupported_faces = 0;  ///< removed: too few views agree
  std::size_t removed_components = 0;
  std::size_t removed_component_faces = 0;
  std::size_t filled_holes = 0;
  std::size_t faces_before_simplification = 0;
  std::size_t non_manifold_edges = 0;   ///< of the result; 0, else something is wrong
  double simplification_error = 0.0;    ///< scene units; 0 = nothing was simplified
  std::size_t open_hole_count = 0;      ///< all that were left open
  std::vector<SurfaceHole> open_holes;  ///< the largest `kMaxReportedHoles`, by falling perimeter
};

inline constexpr std::size_t kMaxReportedHoles = 200;

/// Surface and what was done to get it.
struct SurfaceResult {
  TriangleMesh mesh;  ///< with normals and colours
  SurfaceReport report;
};

}  // namespace trigmesh
