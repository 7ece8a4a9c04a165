#pragma once

#include <opencv2/core/mat.hpp>

#include "sfm/camera/camera.hpp"
#include "sfm/geometry/rigid3.hpp"
#include "sfm/texture/textured_mesh.hpp"

namespace trigmesh {

struct RenderedView {
  cv::Mat rgb;       ///< CV_8UC3 of the camera's size; black where nothing is
  cv::Mat coverage;  ///< CV_8UC1: 255 where the outside of a face is seen; elsewhere 0
};

/// What a pinhole camera sees of a textured mesh: z-buffer, perspective-correct, bilinear look-up,
/// no light, no anti-aliasing. Faces with a corner behind the camera are left out. Faces turned
/// away hide what is behind them and cover nothing. Used to judge textures from views that were
/// held out.
[[nodiscard]] RenderedView render_textured(const TexturedMesh& textured,
                                           const Camera& camera,
                                           const Rigid3& cam_from_world);

}  // namespace trigmesh
