#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "firmware/base/result.hpp"
#include "sfm/camera/camera.hpp"
#include "sfm/geometry/rigid3.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// A registered photograph as the stages after mapping see it: a pinhole camera without distortion
/// and where it stood.
struct DenseView {
  std::string name;  ///< of the photograph, relative to the image folder
  Camera camera;     ///< kPinhole, of the undistorted picture at its full size
  Rigid3 cam_from_world;
  ViewId source{};  ///< position in Scene::views
};

/// The pixels of a DenseView.
struct ViewImage {
  cv::Mat rgb;   ///< CV_8UC3 red, green, blue, of the size of the view's camera
  cv::Mat mask;  ///< CV_8UC1 of the same size: 0 = leave this pixel out; or empty: all count
};

/// Where the pixels of views come from. Kept behind an interface because not all pictures fit in
/// memory at once.
class ViewImageSource {
 public:
  ViewImageSource() = default;
  ViewImageSource(const ViewImageSource&) = delete;
  ViewImageSource& operator=(const ViewImageSource&) = delete;
  ViewImageSource& operator=(ViewImageSource&&) = delete;
  virtual ~ViewImageSource() = default;

  /// The picture of view `view`, undistorted, at full size. The same call gives the same pixels.
  /// Thread-safe. kIo, kCorruptData.
  [[nodiscard]] virtual Result<ViewImage> load(std::size_t view) const = 0;

 protected:
  ViewImageSource(ViewImageSource&&) = default;  ///< for sources that are made by a function
};

}  // namespace trigmesh
