#pragma once

#include <cstddef>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "sfm/camera/camera.hpp"
#include "sfm/geometry/rigid3.hpp"

namespace trigmesh {

/// What is known of one view before things that moved are looked for in it. All pictures have the
/// size of `camera`.
struct MovingView {
  Camera camera;  ///< kPinhole
  Rigid3 cam_from_world;
  cv::Mat rgb;   ///< CV_8UC3 red, green, blue
  cv::Mat mask;  ///< CV_8UC1, 0 = leave this pixel out; or empty: all count
  cv::Mat
      depth;  ///< CV_32FC1: z that other views confirm, scene units; 0 = not confirmed; or empty
  /// Nearest depth at which something of the scene stands in this view, scene units, >= 0.
  float min_depth = 0.0F;
  std::vector<std::size_t> neighbors;  ///< positions of views that look at the same surfaces
};

}  // namespace trigmesh
