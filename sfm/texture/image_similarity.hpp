#pragma once

#include <cstddef>

#include <opencv2/core/mat.hpp>

namespace trigmesh {

struct ImageSimilarity {
  double psnr_db = 0.0;         ///< of the squared error of all three channels; 100 when equal
  double ssim = 0.0;            ///< mean over the covered pixels of the grey pictures' SSIM
  std::size_t pixel_count = 0;  ///< covered; when 0 the others are 0 too
};

/// How alike two pictures (CV_8UC3, same size) are where `coverage` (CV_8UC1) is not 0. SSIM: Wang,
/// Bovik, Sheikh, Simoncelli, "Image Quality Assessment: From Error Visibility to Structural
/// Similarity", TIP 2004, with its window (Gaussian of 1.5 px, 11x11) and constants; only pixels
/// whose whole window is covered count.
[[nodiscard]] ImageSimilarity compare_images(const cv::Mat& image,
                                             const cv::Mat& truth,
                                             const cv::Mat& coverage);

}  // namespace trigmesh
