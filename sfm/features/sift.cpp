#include <cmath>
#include <numbers>

#include <opencv2/features2d.hpp>

#include "firmware/base/check.hpp"
#include "sfm/features/extractors.hpp"

namespace trigmesh {
namespace {

constexpr int kDescriptorLength = 128;

/// RootSIFT (Arandjelovic, Zisserman, CVPR 2012) in 7 bits: an L2 norm of 256, clamped at 127.
void append_root_sift(const cv::Mat& row, std::vector<std::uint8_t>& out) {
  double sum = 0.0;
  for (int i = 0; i < kDescriptorLength; ++i) {
    sum += static_cast<double>(row.at<float>(0, i));
  }
  for (int i = 0; i < kDescriptorLength; ++i) {
    const double part = sum > 0.0 ? static_cast<double>(row.at<float>(0, i)) / sum : 0.0;
    out.push_back(static_cast<std::uint8_t>(std::min(127.0, std::round(256.0 * std::sqrt(part)))));
  }
}

class OpenCvSift final : public FeatureExtractor {
 public:
  explicit OpenCvSift(const FeatureOptions& options) : options_(options) {}

  Result<FeatureSet> extract(const cv::Mat& grey) const override {
    TM_RETURN_IF_ERROR(check_grey_image(grey));
    FeatureSet set{.kind = FeatureKind::kSift,
                   .keypoints = {},
                   .descriptor_bytes = kDescriptorLength,
                   .descriptors = {}};
    try {
      std::vector<cv::KeyPoint> keypoints;
      cv::Mat rows;
      cv::SIFT::create(options_.max_keypoints, 3, 0.02, 10.0, 1.6)
          ->detectAndCompute(grey, cv::noArray(), keypoints, rows);
      for (int i = 0; i < rows.rows && i < options_.max_keypoints; ++i) {
        const cv::KeyPoint& point = keypoints[static_cast<std::size_t>(i)];
        set.keypoints.push_back({.x_px = point.pt.x,
                                 .y_px = point.pt.y,
                                 .scale_px = 0.5F * point.size,
                                 .angle_rad = point.angle * std::numbers::pi_v<float> / 180.0F,
                                 .response = point.response});
        append_root_sift(rows.row(i), set.descriptors);
      }
    } catch (const cv::Exception& error) {
      return fail(ErrorCode::kInternal, "cannot extract SIFT features: {}", error.what());
    }
    sort_features(set);
    return set;
  }

 private:
  FeatureOptions options_;
};

}  // namespace

FeatureExtractorResult create_sift_extractor(const FeatureOptions& options) {
  return std::make_unique<OpenCvSift>(options);
}

}  // namespace trigmesh
