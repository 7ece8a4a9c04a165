#include "sfm/features/features.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <tuple>
#include <utility>

#include "sfm/features/extractors.hpp"

namespace trigmesh {
namespace {

constexpr std::array<std::pair<FeatureKind, std::string_view>, 4> kNames{{
    {FeatureKind::kSift, "sift"},
    {FeatureKind::kSurf, "surf"},
    {FeatureKind::kAkaze, "akaze"},
    {FeatureKind::kOrb, "orb"},
}};
constexpr int kMinImageSide = 16;
constexpr int kMinKeypoints = 16;
constexpr int kMaxKeypoints = 100000;

}  // namespace

std::string_view to_string(FeatureKind kind) {
  for (const auto& [value, name] : kNames) {
    if (value == kind) {
      return name;
    }
  }
  return "unknown";
}

std::optional<FeatureKind> feature_kind_from_string(std::string_view name) {
  for (const auto& [value, text] : kNames) {
    if (text == name) {
      return value;
    }
  }
  return std::nullopt;
}

DescriptorMetric descriptor_metric(FeatureKind kind) {
  const bool is_binary = kind == FeatureKind::kAkaze || kind == FeatureKind::kOrb;
  return is_binary ? DescriptorMetric::kHamming : DescriptorMetric::kDotProduct;
}

Result<> FeatureOptions::validate() const {
  if (max_keypoints < kMinKeypoints || max_keypoints > kMaxKeypoints) {
    return fail(ErrorCode::kInvalidArgument,
                "max_keypoints is {}, must be in [{}, {}]",
                max_keypoints,
                kMinKeypoints,
                kMaxKeypoints);
  }
  return {};
}

Result<std::unique_ptr<FeatureExtractor>> create_feature_extractor(FeatureKind kind,
                                                                   const FeatureOptions& options) {
  if (auto valid = options.validate(); !valid) {
    return tl::unexpected<Error>(std::move(valid).error());
  }
  switch (kind) {
    case FeatureKind::kSift:
      return create_sift_extractor(options);
    case FeatureKind::kSurf:
      return create_surf_extractor(options);
    case FeatureKind::kAkaze:
      return create_akaze_extractor(options);
    case FeatureKind::kOrb:
      return create_orb_extractor(options);
  }
  return fail(ErrorCode::kInvalidArgument, "no extractor of kind {}", static_cast<int>(kind));
}

Result<> check_grey_image(const cv::Mat& grey) {
  if (grey.type() != CV_8UC1 || grey.dims != 2) {
    return fail(ErrorCode::kInvalidArgument,
                "cannot extract features: the image must be 8-bit grey, got OpenCV type {}",
                grey.type());
  }
  if (grey.cols < kMinImageSide || grey.rows < kMinImageSide) {
    return fail(ErrorCode::kInvalidArgument,
                "cannot extract features: the image is {}x{}, must be at least {}x{}",
                grey.cols,
                grey.rows,
                kMinImageSide,
                kMinImageSide);
  }
  return {};
}

bool comes_before(const Keypoint& a, const Keypoint& b) {
  return std::tuple(-a.scale_px, -a.response, a.y_px, a.x_px, a.angle_rad) <
         std::tuple(-b.scale_px, -b.response, b.y_px, b.x_px, b.angle_rad);
}

void sort_features(FeatureSet& features) {
  std::vector<std::size_t> order(features.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return comes_before(features.keypoints[a], features.keypoints[b]);
  });
  FeatureSet sorted{.kind = features.kind,
                    .keypoints = {},
                    .descriptor_bytes = features.descriptor_bytes,
                    .descriptors = {}};
  sorted.keypoints.reserve(features.size());
  sorted.descriptors.reserve(features.descriptors.size());
  for (const std::size_t i : order) {
    const auto row = features.descriptor(i);
    sorted.keypoints.push_back(features.keypoints[i]);
    sorted.descriptors.insert(sorted.descriptors.end(), row.begin(), row.end());
  }
  features = std::move(sorted);
}

}  // namespace trigmesh
