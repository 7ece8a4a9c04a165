#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "firmware/base/result.hpp"
#include "sfm/camera/camera.hpp"
#include "sfm/dense/dense_view.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// A pinhole camera that sees what `camera` sees: the same focal lengths, a picture as large as the
/// rays of the outermost pixels need, but at most 1.5 times the size of the lens's picture to a
/// side (a fisheye loses its rim). A pinhole camera is returned as it is.
[[nodiscard]] Camera undistorted_camera(const Camera& camera);

/// A pinhole camera for the same picture at another size (> 0). Half a pixel of border stays half a
/// pixel: the first pixel centre is (0, 0) before and after.
[[nodiscard]] Camera scaled_pinhole(const Camera& camera, int width_px, int height_px);

/// The picture that `pinhole` would have taken where `camera` took `image`. Bilinear; what the lens
/// did not see is black and has mask 0. When both are the same pinhole camera the pixels are
/// returned untouched, sharing their memory. A mask comes back where one went in or where pixels
/// are missing. kInvalidArgument: sizes or types that do not fit.
[[nodiscard]] Result<ViewImage> undistort_image(const ViewImage& image,
                                                const Camera& camera,
                                                const Camera& pinhole);

/// The way back for a mask: CV_8UC1 of the size of `camera`, each pixel the one of `mask` (CV_8UC1
/// of the size of `pinhole`) that looks along the same ray, `outside` where there is none. When
/// both are the same pinhole camera the mask is returned untouched, sharing its memory.
/// kInvalidArgument: size or type.
[[nodiscard]] Result<cv::Mat> distort_mask(const cv::Mat& mask,
                                           const Camera& pinhole,
                                           const Camera& camera,
                                           std::uint8_t outside);

/// The registered views of a scene with their undistorted cameras, in order.
[[nodiscard]] std::vector<DenseView> dense_views(const Scene& scene);

}  // namespace trigmesh
