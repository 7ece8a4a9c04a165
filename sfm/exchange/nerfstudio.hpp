#pragma once

#include <string>
#include <string_view>

#include "firmware/base/result.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// transforms.json as nerfstudio and the programs around it read it: intrinsics (first pixel centre
/// = (0.5, 0.5)) once or, with several cameras, per frame; camera-to-world matrices with OpenGL
/// axes (x right, y up, z back); world frame as in the scene. Only registered views. `image_folder`
/// stands before the names, as seen from the folder of the file; `ply_name` is the point cloud
/// beside it. kUnsupported for names that are no UTF-8.
[[nodiscard]] Result<std::string> write_nerfstudio(const Scene& scene,
                                                   std::string_view image_folder,
                                                   std::string_view ply_name);

}  // namespace trigmesh
