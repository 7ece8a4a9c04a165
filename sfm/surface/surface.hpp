#pragma once

#include <span>

#include "firmware/base/executor.hpp"
#include "firmware/base/result.hpp"
#include "sfm/dense/dense_view.hpp"
#include "sfm/dense/depth_map.hpp"
#include "sfm/surface/surface_options.hpp"

namespace trigmesh {

/// What a surface is made from. The sources are borrowed for the call; their index is the position
/// in `views`.
struct SurfaceInput {
  std::span<const DenseView> views;
  const DepthMapSource* depth_maps = nullptr;  ///< never null
  const ViewImageSource* images = nullptr;     ///< never null; an empty image gives no colour
};

/// Makes one coloured triangle surface from the depth maps of all views: distance function -> zero
/// level -> what enough views support -> components, holes -> budget of faces. Depth maps and
/// images are loaded one view at a time. The same input gives the same bytes with any executor.
/// kInvalidArgument: options or maps that contradict themselves; kInsufficientData: no depth
/// anywhere, or no surface was left; errors of the sources.
[[nodiscard]] Result<SurfaceResult> make_surface(const SurfaceInput& input,
                                                 const SurfaceOptions& options,
                                                 Executor& executor);

}  // namespace trigmesh
