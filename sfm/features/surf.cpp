#include <algorithm>

#include "firmware/base/check.hpp"
#include "sfm/features/extractors.hpp"
#include "sfm/features/integral_image.hpp"
#include "sfm/features/keypoint_spread.hpp"
#include "sfm/features/surf_descriptor.hpp"
#include "sfm/features/surf_detector.hpp"

namespace trigmesh {
namespace {

/// Low on purpose: the strongest points, spread over the image, are kept up to max_keypoints
/// (README).
constexpr float kThreshold = 4e-5F;
constexpr int kOctaves = 4;

/// Twice the size by linear interpolation: pixel (2x, 2y) of the result is pixel (x, y).
cv::Mat doubled(const cv::Mat& grey) {
  cv::Mat result(2 * grey.rows - 1, 2 * grey.cols - 1, CV_8UC1);
  for (int y = 0; y < result.rows; ++y) {
    const std::uint8_t* upper = grey.ptr<std::uint8_t>(y / 2);
    const std::uint8_t* lower = grey.ptr<std::uint8_t>((y + 1) / 2);
    std::uint8_t* out = result.ptr<std::uint8_t>(y);
    for (int x = 0; x < result.cols; ++x) {
      const int left = x / 2;
      const int right = (x + 1) / 2;
      out[x] = static_cast<std::uint8_t>(
          (upper[left] + upper[right] + lower[left] + lower[right] + 2) / 4);
    }
  }
  return result;
}

/// The strongest points, spread over the image.
std::vector<Keypoint> select(const std::vector<Keypoint>& keypoints,
                             const IntegralImage& integral,
                             int count) {
  std::vector<SpreadCandidate> candidates;
  candidates.reserve(keypoints.size());
  for (const Keypoint& keypoint : keypoints) {
    candidates.push_back(
        {.x_px = keypoint.x_px, .y_px = keypoint.y_px, .strength = keypoint.response});
  }
  std::vector<Keypoint> selected;
  for (const std::size_t index : spread_keypoints(candidates,
                                                  integral.width_px(),
                                                  integral.height_px(),
                                                  static_cast<std::size_t>(count))) {
    selected.push_back(keypoints[index]);
  }
  return selected;
}

class SurfExtractor final : public FeatureExtractor {
 public:
  explicit SurfExtractor(const FeatureOptions& options) : options_(options) {}

  Result<FeatureSet> extract(const cv::Mat& grey) const override {
    TM_RETURN_IF_ERROR(check_grey_image(grey));
    const IntegralImage integral(options_.upsample ? doubled(grey) : grey);
    std::vector<Keypoint> keypoints = detect_surf_keypoints(
        integral,
        {.threshold = kThreshold, .octaves = options_.upsample ? kOctaves + 1 : kOctaves});
    keypoints = select(keypoints, integral, options_.max_keypoints);

    FeatureSet set{.kind = FeatureKind::kSurf,
                   .keypoints = {},
                   .descriptor_bytes = kSurfDescriptorLength,
                   .descriptors = {}};
    set.keypoints.reserve(keypoints.size());
    set.descriptors.resize(keypoints.size() * kSurfDescriptorLength);
    for (Keypoint& keypoint : keypoints) {
      if (options_.oriented) {
        keypoint.angle_rad = surf_orientation(integral, keypoint);
      }
      std::uint8_t* row = set.descriptors.data() + set.keypoints.size() * kSurfDescriptorLength;
      quantize_surf(surf_descriptor(integral, keypoint),
                    std::span<std::uint8_t, kSurfDescriptorLength>(row, kSurfDescriptorLength));
      set.keypoints.push_back(in_input_pixels(keypoint));
    }
    sort_features(set);
    return set;
  }

 private:
  [[nodiscard]] Keypoint in_input_pixels(Keypoint keypoint) const {
    if (options_.upsample) {
      keypoint.x_px *= 0.5F;
      keypoint.y_px *= 0.5F;
      keypoint.scale_px *= 0.5F;
    }
    return keypoint;
  }

  FeatureOptions options_;
};

}  // namespace

FeatureExtractorResult create_surf_extractor(const FeatureOptions& options) {
  return std::make_unique<SurfExtractor>(options);
}

}  // namespace trigmesh
