#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "firmware/base/result.hpp"
#include "sfm/features/features.hpp"

namespace trigmesh {

using Rgb = std::array<std::uint8_t, 3>;

/// What the later stages need of one photograph; the pixels are gone by then.
struct ImageFeatures {
  int width_px = 0;
  int height_px = 0;
  std::uint64_t content = 0;  ///< hash of the file: equal for equal files
  std::string camera_key;  ///< equal for photographs of one camera with one lens setting, by EXIF;
                           ///< may be empty
  double exif_focal_px = 0.0;  ///< focal length that EXIF tells; 0 when it tells none
  FeatureSet features;
  std::vector<Rgb> colors;  ///< per keypoint, the mean around it
};

/// Bytes for a checkpoint and back. Decoding anything else gives kCorruptData.
[[nodiscard]] std::vector<std::uint8_t> encode_image_features(const ImageFeatures& image);
[[nodiscard]] Result<ImageFeatures> decode_image_features(std::span<const std::uint8_t> bytes);

/// Decodes a photograph (JPEG or PNG bytes) and finds its keypoints. The errors are those of
/// decoding and extraction.
[[nodiscard]] Result<ImageFeatures> extract_image_features(std::span<const std::uint8_t> file,
                                                           const FeatureExtractor& extractor);

/// Takes out the keypoints whose pixel is 0 in the mask (CV_8UC1 of the photograph's size).
void drop_masked_features(const cv::Mat& mask, ImageFeatures& image);

}  // namespace trigmesh
