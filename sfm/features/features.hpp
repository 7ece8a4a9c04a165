#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "firmware/base/result.hpp"

namespace trigmesh {

/// Which detector and descriptor.
enum class FeatureKind { kSift, kSurf, kAkaze, kOrb };

/// "sift", "surf", "akaze", "orb".
[[nodiscard]] std::string_view to_string(FeatureKind kind);
[[nodiscard]] std::optional<FeatureKind> feature_kind_from_string(std::string_view name);

/// How two descriptors are compared.
enum class DescriptorMetric {
  kDotProduct,  ///< bytes 0..127, vectors of (nearly) equal length: a larger dot product is nearer
                ///< (SIFT, SURF)
  kHamming,     ///< bit strings: fewer differing bits are nearer (AKAZE, ORB)
};

/// A point found again under change of view. Pixels: first pixel centre = (0, 0).
struct Keypoint {
  float x_px = 0.0F;
  float y_px = 0.0F;
  float scale_px =
      0.0F;  ///< sigma of the Gaussian at which it was found, in pixels of the input image
  float angle_rad = 0.0F;  ///< orientation, x axis towards y axis; 0 when upright
  float response = 0.0F;   ///< strength; comparable only within one image and kind
};

/// Keypoints and descriptors of one image. Row i of the descriptors belongs to keypoint i.
struct FeatureSet {
  FeatureKind kind = FeatureKind::kSift;
  std::vector<Keypoint> keypoints;
  std::size_t descriptor_bytes = 0;
  std::vector<std::uint8_t> descriptors;  ///< keypoints.size() * descriptor_bytes

  [[nodiscard]] std::size_t size() const { return keypoints.size(); }

  [[nodiscard]] std::span<const std::uint8_t> descriptor(std::size_t i) const {
    return std::span(descriptors).subspan(i * descriptor_bytes, descriptor_bytes);
  }
};

[[nodiscard]] DescriptorMetric descriptor_metric(FeatureKind kind);

/// Options common to all extractors.
struct FeatureOptions {
  /// Most keypoints kept in one image, [16, 100000]; they are spread over the image, not clustered.
  int max_keypoints = 8000;
  /// Rotation-invariant descriptors; off ("upright") is faster and better when the camera is never
  /// rolled.
  bool oriented = true;
  /// SIFT and SURF: start at twice the image size. Finds about four times as many points at four
  /// times the cost.
  bool upsample = true;

  [[nodiscard]] Result<> validate() const;
};

/// Finds and describes keypoints in one grey image. Thread-safe: one extractor may serve several
/// threads; deterministic: the same image gives the same bytes. Uses no thread of its own.
class FeatureExtractor {
 public:
  FeatureExtractor() = default;
  FeatureExtractor(const FeatureExtractor&) = delete;
  FeatureExtractor& operator=(const FeatureExtractor&) = delete;
  FeatureExtractor(FeatureExtractor&&) = delete;
  FeatureExtractor& operator=(FeatureExtractor&&) = delete;
  virtual ~FeatureExtractor() = default;

  /// `grey`: CV_8UC1, at least 16x16. Keypoints come in descending order of scale (coarsest first),
  /// ties broken by response, then y, then x. An image without texture gives an empty set, which is
  /// not an error.
  [[nodiscard]] virtual Result<FeatureSet> extract(const cv::Mat& grey) const = 0;
};

/// Makes the extractor of a kind; kInvalidArgument when the options are out of range.
[[nodiscard]] Result<std::unique_ptr<FeatureExtractor>> create_feature_extractor(
    FeatureKind kind, const FeatureOptions& options);

}  // namespace trigmesh
