#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/build_options.hpp"
#include "sfm/dense/dense_view.hpp"
#include "sfm/dense/depth_filter.hpp"
#include "sfm/dense/fusion.hpp"
#include "sfm/dense/patch_match.hpp"
#include "sfm/dense/view_selection.hpp"
#include "sfm/surface/surface_options.hpp"
#include "sfm/texture/texture_surface.hpp"

namespace trigmesh {

/// How the stages after mapping work, within a memory limit.
struct SurfacePlan {
  double map_scale = 1.0;  ///< size of the depth maps / size of the pictures, (0, 1]
  /// Size of the maps of the first, photometric round / size of the depth maps, (0, 1].
  double first_round_scale = 1.0;
  /// Longer side of the pictures that are searched for what moved, pixels; 0: they are not.
  int moving_side_px = 0;
  ViewSelectionOptions selection;
  PatchMatchOptions patch_match;
  DepthFilterOptions filter;
  FusionOptions fusion;
  SurfaceOptions surface;
  TextureOptions texture;
  std::vector<std::string> lowered;  ///< one sentence for each quality setting that was lowered
};

/// Settings of a preset for these views; smaller depth maps, then smaller tiles of voxels
/// (coarser voxels when the mesh itself would not fit) and smaller texture pages, as far as
/// `limit_bytes` (0: no limit) asks for. The result does not depend on the number of threads.
/// kLimitExceeded when even the lowest settings need more.
[[nodiscard]] Result<SurfacePlan> plan_surface(std::span<const DenseView> views,
                                               const BuildOptions& options,
                                               std::uint64_t limit_bytes);

/// A size of the depth map for a picture of this size.
[[nodiscard]] int scaled_side(int side_px, double scale);

}  // namespace trigmesh
