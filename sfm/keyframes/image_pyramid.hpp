#pragma once

#include <memory>
#include <vector>

#include <opencv2/core/mat.hpp>

namespace trigmesh {

/// An image and its halves, CV_8UC1. Level 0 is the image itself.
using ImagePyramid = std::vector<cv::Mat>;

/// Halves level 0 of `pyramid` up to `levels`; those that would be smaller than 16 pixels on a side
/// are left out. Images that are there are written over. Precondition: level 0 is CV_8UC1.
void build_halves(int levels, ImagePyramid& pyramid);

/// Pyramids in memory that is used again once nobody holds them. Thread-compatible.
class PyramidPool {
 public:
  /// Of a copy of `grey` (CV_8UC1), reduced where its longer side is more than `side_px`.
  [[nodiscard]] std::shared_ptr<const ImagePyramid> make(const cv::Mat& grey,
                                                         int side_px,
                                                         int levels);

 private:
  [[nodiscard]] const std::shared_ptr<ImagePyramid>& free_one();

  std::vector<std::shared_ptr<ImagePyramid>> pyramids_;  ///< in use and free
};

}  // namespace trigmesh
