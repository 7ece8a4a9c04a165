#pragma once

#include <cstddef>

#include <opencv2/core/mat.hpp>

#include "firmware/base/result.hpp"
#include "sfm/camera/camera.hpp"

namespace trigmesh {

/// What one view knows about the surface in front of it.
struct DepthMap {
  Camera camera;  ///< kPinhole, of the size of the maps (a scaled version of the view's camera)
  cv::Mat depth;  ///< CV_32FC1: z in the camera frame, scene units; 0 = not known
  cv::Mat
      normal;  ///< CV_32FC3: camera frame, unit length, towards the camera; 0 where the depth is 0
  cv::Mat confidence;  ///< CV_8UC1: 0 = none (where the depth is 0) to 255
};

/// Where the depth maps of views come from; they are made one by one and spilled to disk.
class DepthMapSource {
 public:
  DepthMapSource() = default;
  DepthMapSource(const DepthMapSource&) = delete;
  DepthMapSource& operator=(const DepthMapSource&) = delete;
  DepthMapSource& operator=(DepthMapSource&&) = delete;
  virtual ~DepthMapSource() = default;

  /// The map of view `view`; empty mats when it has none. Thread-safe. kIo, kCorruptData.
  [[nodiscard]] virtual Result<DepthMap> load(std::size_t view) const = 0;

 protected:
  DepthMapSource(DepthMapSource&&) = default;  ///< for sources that are made by a function
};

}  // namespace trigmesh
