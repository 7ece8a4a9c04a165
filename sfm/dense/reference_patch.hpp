#pragma once

#include <array>

#include <opencv2/core/mat.hpp>

#include "sfm/dense/patch_match_kernel.hpp"

namespace trigmesh {

/// Cuts the patches that are compared out of a reference picture: fixed places around a pixel,
/// close together in the middle and wide outside, with weights that fall with the distance and with
/// the difference to the grey of the centre, so that a patch on a thin bar stays on the bar. Where
/// there is little to compare, patches are two or three times as large.
class ReferencePatchMaker {
 public:
  /// Farthest sample from the centre, to a side.
  static constexpr float kRadius_px = 4.0F;

  /// `grey` is CV_8UC1 and outlives the maker. `grey_sigma` is the decay in grey levels, > 0.
  ReferencePatchMaker(const cv::Mat& grey, float grey_sigma);

  /// The patch around pixel (x, y) inside the picture; samples outside have no weight. Returns its
  /// magnification, 1 to 3.
  int make(int x, int y, ReferencePatch& patch) const;

 private:
  void cut(int x, int y, int magnification, ReferencePatch& patch) const;

  cv::Mat grey_;
  std::array<float, 256> weight_of_difference_{};
  std::array<float, kPatchSampleCount> weight_of_place_{};
};

}  // namespace trigmesh
