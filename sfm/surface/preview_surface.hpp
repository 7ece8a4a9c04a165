#pragma once

#include "firmware/base/executor.hpp"
#include "firmware/base/result.hpp"
#include "sfm/scene/scene.hpp"
#include "sfm/surface/surface_options.hpp"

namespace trigmesh {

/// A quick coarse surface from cameras and landmarks alone, without pictures: interpolated depth
/// maps of 160 pixels width through the same steps as `make_surface`, with options that forgive
/// their errors. kInsufficientData: no view sees enough landmarks.
[[nodiscard]] Result<SurfaceResult> make_preview_surface(const Scene& scene, Executor& executor);

}  // namespace trigmesh
