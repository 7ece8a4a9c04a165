#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "firmware/base/result.hpp"
#include "sfm/dense/depth_map.hpp"

namespace trigmesh {

/// Most views whose depth maps the page shows; the pipeline picks evenly.
inline constexpr std::size_t kReportDepthViewLimit = 12;
/// Widest picture of them, pixels.
inline constexpr int kReportPictureWidthPx = 256;

/// A view's photograph, depth and confidence side by side, small, as JPEG.
struct DepthPicture {
  std::string image_name{};  ///< as in ReportInput::images
  std::vector<std::uint8_t> image_jpeg{};
  std::vector<std::uint8_t> depth_jpeg{};       ///< near is light, far dark, unknown grey
  std::vector<std::uint8_t> confidence_jpeg{};  ///< grey, none black
  double near_depth =
      0.0;                 ///< what the lightest colour means, scene units; 0 when nothing is known
  double far_depth = 0.0;  ///< what the darkest colour means
  double filled_ratio = 0.0;  ///< pixels with a depth, [0, 1]
};

/// Makes the three pictures. `rgb` is CV_8UC3 of any size. Colours are even in the inverse of the
/// depth between its quantiles 0.02 and 0.98. kInvalidArgument: empty or wrong pictures.
[[nodiscard]] Result<DepthPicture> make_depth_picture(std::string image_name,
                                                      const cv::Mat& rgb,
                                                      const DepthMap& map);

/// The colours of depth: Green's cubehelix (D. A. Green, A colour scheme for the display of
/// astronomical intensity images, Bull. Astr. Soc. India 39, 2011, equation 1), whose lightness
/// grows evenly, so it reads in grey and with any colour vision. `level` in [0, 1]: dark to light.
[[nodiscard]] std::array<std::uint8_t, 3> depth_color(double level);

}  // namespace trigmesh
