#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/depth_map_store.hpp"
#include "firmware/pipeline/photo_images.hpp"
#include "firmware/pipeline/stage_context.hpp"
#include "firmware/pipeline/surface_plan.hpp"
#include "sfm/dense/dense_cloud.hpp"
#include "sfm/dense/dense_view.hpp"
#include "sfm/dense/view_selection.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// What depth maps are made of. All of it outlives the stage.
struct DenseInput {
  const Scene& scene;
  std::span<const DenseView> views;
  const PhotoImages& images;
  const SurfacePlan& plan;
  std::uint64_t seed = 0;
};

/// The finished depth maps: filtered, on disk, and what they were made from.
struct DepthMaps {
  DepthMapStore maps;
  DepthMapStore unfiltered;        ///< of the geometric round
  std::vector<StereoPlan> stereo;  ///< per view
  std::uint64_t key = 0;           ///< of all maps together
};

/// Depth maps of all views: a photometric round, a geometric one, then the filter, each over all
/// views. Every finished map is kept in the work folder. kCancelled, kInsufficientData (no view
/// shares enough with another), kIo, kNoSpace, what the images return.
[[nodiscard]] Result<DepthMaps> make_depth_maps(const DenseInput& input,
                                                const StageContext& context);

/// The maps filtered again after masks were added: `input.images` leaves out what `depth` was made
/// with. What the masks leave out confirms nothing in other maps. Errors as above.
[[nodiscard]] Result<DepthMaps> filter_masked(const DenseInput& input,
                                              DepthMaps depth,
                                              const StageContext& context);

/// One cloud of the maps. Errors as above.
[[nodiscard]] Result<DenseCloud> fuse_maps(const DenseInput& input,
                                           const DepthMaps& depth,
                                           const StageContext& context);

}  // namespace trigmesh
