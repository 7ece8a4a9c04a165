#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "sfm/moving/moving_view.hpp"

namespace trigmesh {

/// Marks for the pixels of a view, CV_8UC1 of its size.
struct RegionMarks {
  cv::Mat moving;   ///< 255: evidence that it moved
  cv::Mat settled;  ///< 255: evidence that it stood still
  cv::Mat fixed;    ///< 255: it stood still, whatever speaks against it
};

/// How much more often a colour is found where things moved than elsewhere, learned from all views.
class ColorPreference {
 public:
  /// Adds the pixels of a view that its mask leaves in.
  void add(const MovingView& view, const cv::Mat& moving);
  /// Logarithm of the ratio, in [-2, 2]; 0 before anything was added.
  [[nodiscard]] float operator()(const cv::Vec3b& rgb) const;

 private:
  static constexpr std::size_t kBins = 16;  ///< a channel
  [[nodiscard]] static std::size_t bin_of(const cv::Vec3b& rgb);

  std::vector<std::uint32_t> moving_ = std::vector<std::uint32_t>(kBins * kBins * kBins, 0);
  std::vector<std::uint32_t> all_ = std::vector<std::uint32_t>(kBins * kBins * kBins, 0);
  std::uint64_t moving_count_ = 0;
  std::uint64_t all_count_ = 0;
};

/// The pixels (CV_8UC1, 255) on the moving side of the cheapest border: it keeps to the marks, runs
/// along edges of the picture and prefers the colours of what moved (Y. Boykov, M.-P. Jolly,
/// "Interactive graph cuts for optimal boundary and region segmentation", ICCV 2001).
[[nodiscard]] cv::Mat cut_region(const MovingView& view,
                                 const RegionMarks& marks,
                                 const ColorPreference& preference);

}  // namespace trigmesh
