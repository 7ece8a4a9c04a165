#pragma once

#include <string>
#include <string_view>

#include "firmware/base/result.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// An OpenMVS interface archive (.mvs), version 7: one platform per camera, the registered views,
/// the landmarks with their views and colours. First pixel centre = (0, 0), as here. OpenMVS works
/// on undistorted images only: kUnsupported, with what to do, when a camera has distortion.
/// `image_folder` stands before the names, as seen from the folder of the file.
[[nodiscard]] Result<std::string> write_openmvs(const Scene& scene, std::string_view image_folder);

}  // namespace trigmesh
