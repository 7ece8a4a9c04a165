// AKAZE (Alcantarilla, Nuevo, Bartoli, BMVC 2013) and ORB (Rublee, Rabaud, Konolige, Bradski, ICCV
// 2011) from OpenCV.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <utility>
#include <vector>

#include <opencv2/features2d.hpp>

#include "firmware/base/check.hpp"
#include "sfm/features/extractors.hpp"
#include "sfm/features/keypoint_spread.hpp"

namespace trigmesh {
namespace {

/// 486 bits in 61 bytes, padded with zeros to whole 64-bit words for the matcher.
constexpr std::size_t kAkazeBytes = 64;
constexpr std::size_t kOrbBytes = 32;
/// OpenCV's default is 1e-3; a third of it finds about five times the points, of which the
/// strongest are kept (README).
constexpr float kAkazeThreshold = 3e-4F;
/// OpenCV's AKAZE reports 2 x 1.5 sigma as size.
constexpr float kAkazeSigmaPerSize = 1.0F / 3.0F;
constexpr int kOrbPatchSide_px = 31;
constexpr float kOrbScaleStep = 1.2F;
constexpr int kOrbLevels = 8;
constexpr int kOrbFastThreshold = 10;
/// ORB orients by the centroid of a 31 pixel patch: as wide as a Gaussian derivative of about this
/// sigma.
constexpr float kOrbSigma_px = static_cast<float>(kOrbPatchSide_px) / 12.0F;
/// Candidates found for every point kept, so that there is a choice for spreading them.
constexpr int kCandidateFactor = 2;

/// How `cv::KeyPoint::size` (a diameter) becomes sigma, and whether the angle is kept.
struct Conversion {
  FeatureKind kind;
  std::size_t descriptor_bytes;
  float sigma_per_size;
  bool oriented;
};

FeatureSet to_feature_set(const std::vector<cv::KeyPoint>& points,
                          const cv::Mat& rows,
                          const Conversion& conversion) {
  FeatureSet set{
      .kind = conversion.kind,
      .keypoints = {},
      .descriptor_bytes = conversion.descriptor_bytes,
      .descriptors = std::vector<std::uint8_t>(points.size() * conversion.descriptor_bytes, 0)};
  set.keypoints.reserve(points.size());
  for (const cv::KeyPoint& point : points) {
    const float angle = std::remainder(point.angle * std::numbers::pi_v<float> / 180.0F,
                                       2.0F * std::numbers::pi_v<float>);
    set.keypoints.push_back({.x_px = point.pt.x,
                             .y_px = point.pt.y,
                             .scale_px = conversion.sigma_per_size * point.size,
                             .angle_rad = conversion.oriented ? angle : 0.0F,
                             .response = point.response});
  }
  for (int i = 0; i < rows.rows; ++i) {
    const auto bytes = std::min(conversion.descriptor_bytes, static_cast<std::size_t>(rows.cols));
    std::memcpy(set.descriptors.data() + static_cast<std::size_t>(i) * conversion.descriptor_bytes,
                rows.ptr<std::uint8_t>(i),
                bytes);
  }
  return set;
}

/// Keeps the strongest `count` features, spread over the image.
void keep_spread(FeatureSet& set, const cv::Size& size, int count) {
  std::vector<SpreadCandidate> candidates;
  candidates.reserve(set.size());
  for (const Keypoint& keypoint : set.keypoints) {
    candidates.push_back(
        {.x_px = keypoint.x_px, .y_px = keypoint.y_px, .strength = keypoint.response});
  }
  const auto order =
      spread_keypoints(candidates, size.width, size.height, static_cast<std::size_t>(count));
  FeatureSet kept{.kind = set.kind,
                  .keypoints = {},
                  .descriptor_bytes = set.descriptor_bytes,
                  .descriptors = {}};
  for (const std::size_t i : order) {
    const auto row = set.descriptor(i);
    kept.keypoints.push_back(set.keypoints[i]);
    kept.descriptors.insert(kept.descriptors.end(), row.begin(), row.end());
  }
  set = std::move(kept);
}

/// Runs one of OpenCV's extractors and turns its result into ours.
class OpenCvExtractor : public FeatureExtractor {
 public:
  OpenCvExtractor(const FeatureOptions& options, const Conversion& conversion)
      : options_(options), conversion_(conversion) {}

  Result<FeatureSet> extract(const cv::Mat& grey) const final {
    TM_RETURN_IF_ERROR(check_grey_image(grey));
    try {
      std::vector<cv::KeyPoint> points;
      cv::Mat rows;
      run(grey, points, rows);
      FeatureSet set = to_feature_set(points, rows, conversion_);
      keep_spread(set, grey.size(), options_.max_keypoints);
      sort_features(set);
      return set;
    } catch (const cv::Exception& error) {
      return fail(ErrorCode::kInternal,
                  "cannot extract {} features: {}",
                  to_string(conversion_.kind),
                  error.what());
    }
  }

 protected:
  [[nodiscard]] const FeatureOptions& options() const { return options_; }

 private:
  /// Fills points and as many descriptor rows; a new OpenCV object each time, for they are not
  /// thread-safe.
  virtual void run(const cv::Mat& grey, std::vector<cv::KeyPoint>& points, cv::Mat& rows) const = 0;

  FeatureOptions options_;
  Conversion conversion_;
};

class AkazeExtractor final : public OpenCvExtractor {
 public:
  explicit AkazeExtractor(const FeatureOptions& options)
      : OpenCvExtractor(options,
                        {.kind = FeatureKind::kAkaze,
                         .descriptor_bytes = kAkazeBytes,
                         .sigma_per_size = kAkazeSigmaPerSize,
                         .oriented = options.oriented}) {}

 private:
  void run(const cv::Mat& grey, std::vector<cv::KeyPoint>& points, cv::Mat& rows) const override {
    const auto type =
        options().oriented ? cv::AKAZE::DESCRIPTOR_MLDB : cv::AKAZE::DESCRIPTOR_MLDB_UPRIGHT;
    cv::AKAZE::create(type, 0, 3, kAkazeThreshold)
        ->detectAndCompute(grey, cv::noArray(), points, rows);
  }
};

class OrbExtractor final : public OpenCvExtractor {
 public:
  explicit OrbExtractor(const FeatureOptions& options)
      : OpenCvExtractor(options,
                        {.kind = FeatureKind::kOrb,
                         .descriptor_bytes = kOrbBytes,
                         .sigma_per_size = kOrbSigma_px / static_cast<float>(kOrbPatchSide_px),
                         .oriented = options.oriented}) {}

 private:
  void run(const cv::Mat& grey, std::vector<cv::KeyPoint>& points, cv::Mat& rows) const override {
    const auto orb = cv::ORB::create(kCandidateFactor * options().max_keypoints,
                                     kOrbScaleStep,
                                     kOrbLevels,
                                     kOrbPatchSide_px,
                                     0,
                                     2,
                                     cv::ORB::HARRIS_SCORE,
                                     kOrbPatchSide_px,
                                     kOrbFastThreshold);
    orb->detect(grey, points);
    if (!options().oriented) {
      for (cv::KeyPoint& point : points) {
        point.angle = 0.0F;
      }
    }
    orb->compute(grey, points, rows);
  }
};

}  // namespace

FeatureExtractorResult create_akaze_extractor(const FeatureOptions& options) {
  return std::make_unique<AkazeExtractor>(options);
}

FeatureExtractorResult create_orb_extractor(const FeatureOptions& options) {
  return std::make_unique<OrbExtractor>(options);
}

}  // namespace trigmesh
