#include "firmware/pipeline/image_features.hpp"

#include <algorithm>
#include <cmath>

#include "firmware/base/binary_stream.hpp"
#include "firmware/base/check.hpp"
#include "firmware/pipeline/checkpoint.hpp"
#include "sfm/exchange/exif.hpp"
#include "sfm/exchange/image_codec.hpp"

namespace trigmesh {

namespace {

// A keypoint sits on the darkest or brightest spot of a blob; its surroundings tell the colour of
// the surface.
constexpr float kColorRadiusInScales = 2.0F;
constexpr int kMaxColorRadiusPx = 6;

Rgb mean_color(const cv::Mat& rgb, const Keypoint& keypoint) {
  const int x = static_cast<int>(std::lround(keypoint.x_px));
  const int y = static_cast<int>(std::lround(keypoint.y_px));
  const int radius = std::min(
      kMaxColorRadiusPx, static_cast<int>(std::lround(kColorRadiusInScales * keypoint.scale_px)));
  std::array<int, 3> sum{};
  int count = 0;
  for (int row = std::max(0, y - radius); row <= std::min(rgb.rows - 1, y + radius); ++row) {
    const std::uint8_t* line = rgb.ptr<std::uint8_t>(row);
    for (int column = std::max(0, x - radius); column <= std::min(rgb.cols - 1, x + radius);
         ++column) {
      for (std::size_t c = 0; c < 3; ++c) {
        sum[c] += line[3 * static_cast<std::size_t>(column) + c];
      }
      ++count;
    }
  }
  const auto channel = [&](std::size_t c) {
    return static_cast<std::uint8_t>(count > 0 ? (sum[c] + count / 2) / count : 0);
  };
  return {channel(0), channel(1), channel(2)};
}

std::vector<Rgb> sample_colors(const cv::Mat& rgb, const std::vector<Keypoint>& keypoints) {
  std::vector<Rgb> colors;
  colors.reserve(keypoints.size());
  for (const Keypoint& keypoint : keypoints) {
    colors.push_back(mean_color(rgb, keypoint));
  }
  return colors;
}

}  // namespace

std::vector<std::uint8_t> encode_image_features(const ImageFeatures& image) {
  BinaryWriter out;
  out.value(image.width_px);
  out.value(image.height_px);
  out.value(image.content);
  out.items(std::vector<char>(image.camera_key.begin(), image.camera_key.end()));
  out.value(image.exif_focal_px);
  out.value(static_cast<std::uint32_t>(image.features.kind));
  out.value(static_cast<std::uint64_t>(image.features.descriptor_bytes));
  out.items(image.features.keypoints);
  out.items(image.features.descriptors);
  out.items(image.colors);
  return out.take();
}

Result<ImageFeatures> decode_image_features(std::span<const std::uint8_t> bytes) {
  BinaryReader in(bytes);
  ImageFeatures image;
  image.width_px = in.value<int>();
  image.height_px = in.value<int>();
  image.content = in.value<std::uint64_t>();
  const auto key = in.items<char>();
  image.camera_key.assign(key.begin(), key.end());
  image.exif_focal_px = in.value<double>();
  const auto kind = in.value<std::uint32_t>();
  image.features.descriptor_bytes = static_cast<std::size_t>(in.value<std::uint64_t>());
  image.features.keypoints = in.items<Keypoint>();
  image.features.descriptors = in.items<std::uint8_t>();
  image.colors = in.items<Rgb>();
  const std::size_t count = image.features.size();
  if (!in.complete() || kind > static_cast<std::uint32_t>(FeatureKind::kOrb) ||
      image.width_px <= 0 || image.height_px <= 0 || image.colors.size() != count ||
      image.features.descriptor_bytes > 4096 ||
      image.features.descriptors.size() != count * image.features.descriptor_bytes) {
    return fail(ErrorCode::kCorruptData,
                "cannot read stored features: the record contradicts itself");
  }
  image.features.kind = static_cast<FeatureKind>(kind);
  return image;
}

Result<ImageFeatures> extract_image_features(std::span<const std::uint8_t> file,
                                             const FeatureExtractor& extractor) {
  TM_ASSIGN_OR_RETURN(DecodedImage decoded, decode_image(file));
  ImageFeatures image;
  image.width_px = decoded.grey.cols;
  image.height_px = decoded.grey.rows;
  image.content = content_hash(file);
  if (const auto exif = read_exif_camera(file, image.width_px, image.height_px)) {
    image.camera_key = exif->group_key();
    image.exif_focal_px = exif->focal_px.value_or(0.0);
  }
  TM_ASSIGN_OR_RETURN(image.features, extractor.extract(decoded.grey));
  image.colors = sample_colors(decoded.rgb, image.features.keypoints);
  return image;
}

void drop_masked_features(const cv::Mat& mask, ImageFeatures& image) {
  FeatureSet& features = image.features;
  const std::size_t bytes = features.descriptor_bytes;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const Keypoint& keypoint = features.keypoints[i];
    const int x = std::clamp(static_cast<int>(std::lround(keypoint.x_px)), 0, mask.cols - 1);
    const int y = std::clamp(static_cast<int>(std::lround(keypoint.y_px)), 0, mask.rows - 1);
    if (mask.at<std::uint8_t>(y, x) == 0) {
      continue;
    }
    features.keypoints[kept] = keypoint;
    image.colors[kept] = image.colors[i];
    std::copy_n(features.descriptors.begin() + static_cast<std::ptrdiff_t>(i * bytes),
                bytes,
                features.descriptors.begin() + static_cast<std::ptrdiff_t>(kept * bytes));
    ++kept;
  }
  features.keypoints.resize(kept);
  image.colors.resize(kept);
  features.descriptors.resize(kept * bytes);
}

}  // namespace trigmesh
