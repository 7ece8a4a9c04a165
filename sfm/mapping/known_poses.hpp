#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware/base/executor.hpp"
#include "firmware/base/result.hpp"
#include "sfm/camera/camera.hpp"
#include "sfm/geometry/rigid3.hpp"
#include "sfm/mapping/image_store.hpp"
#include "sfm/mapping/mapper.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// An image whose pose is known beforehand (a calibrated rig, the model of another program), or
/// not.
struct PosedImage {
  MapperImage image;
  std::optional<Rigid3> cam_from_world;
};

/// Points for cameras that stay where they are: tracks from the pairs (strongest first),
/// triangulated from all views with a pose, completed and filtered. No pose and no intrinsics move.
/// The scene lists all images, in order. Of the options the thresholds of triangulation and
/// reprojection count. kInvalidArgument: options, a camera or image that does not exist.
[[nodiscard]] Result<Scene> triangulate_known_poses(const std::vector<Camera>& cameras,
                                                    const std::vector<PosedImage>& images,
                                                    std::span<const PairRecord> pairs,
                                                    const MapperOptions& options,
                                                    Executor& executor);

}  // namespace trigmesh
