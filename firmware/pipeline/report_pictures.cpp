#include "firmware/pipeline/report_pictures.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "firmware/base/check.hpp"
#include "sfm/exchange/image_codec.hpp"

namespace trigmesh {
namespace {

constexpr double kNearQuantile = 0.02;
constexpr double kFarQuantile = 0.98;
constexpr int kJpegQuality = 82;
const cv::Vec3b kUnknown(96, 96, 96);

cv::Size small_size(const cv::Mat& image) {
  if (image.cols <= kReportPictureWidthPx) {
    return image.size();
  }
  const double factor = static_cast<double>(kReportPictureWidthPx) / image.cols;
  return {kReportPictureWidthPx, std::max(1, static_cast<int>(std::lround(image.rows * factor)))};
}

cv::Mat shrink(const cv::Mat& image, int interpolation) {
  cv::Mat small;
  cv::resize(image, small, small_size(image), 0, 0, interpolation);
  return small;
}

/// The inverse depths that are known, ascending.
std::vector<float> inverse_depths(const cv::Mat& depth) {
  std::vector<float> values;
  for (int y = 0; y < depth.rows; ++y) {
    const float* row = depth.ptr<float>(y);
    for (int x = 0; x < depth.cols; ++x) {
      if (row[x] > 0.0F && std::isfinite(row[x])) {
        values.push_back(1.0F / row[x]);
      }
    }
  }
  std::ranges::sort(values);
  return values;
}

struct InverseDepthRange {
  double low = 0.0;   ///< far
  double high = 0.0;  ///< near
};

std::optional<InverseDepthRange> range_of(const std::vector<float>& sorted) {
  if (sorted.empty()) {
    return std::nullopt;
  }
  const auto at = [&](double quantile) {
    return static_cast<double>(
        sorted[static_cast<std::size_t>(quantile * static_cast<double>(sorted.size() - 1))]);
  };
  return InverseDepthRange{at(1.0 - kFarQuantile), at(1.0 - kNearQuantile)};
}

cv::Mat paint_depth(const cv::Mat& depth, const InverseDepthRange& range) {
  constexpr std::size_t kLevels = 256;
  std::array<cv::Vec3b, kLevels> colors;
  for (std::size_t i = 0; i < kLevels; ++i) {
    const std::array<std::uint8_t, 3> rgb =
        depth_color(static_cast<double>(i) / static_cast<double>(kLevels - 1));
    colors[i] = cv::Vec3b(rgb[0], rgb[1], rgb[2]);
  }
  const double width = std::max(range.high - range.low, 1e-12 * range.high);
  cv::Mat picture(depth.size(), CV_8UC3);
  for (int y = 0; y < depth.rows; ++y) {
    const float* row = depth.ptr<float>(y);
    for (int x = 0; x < depth.cols; ++x) {
      const bool is_known = row[x] > 0.0F && std::isfinite(row[x]);
      if (!is_known) {
        picture.at<cv::Vec3b>(y, x) = kUnknown;
        continue;
      }
      const double level = (1.0 / static_cast<double>(row[x]) - range.low) / width;
      const double place = std::clamp(level, 0.0, 1.0) * static_cast<double>(kLevels - 1);
      picture.at<cv::Vec3b>(y, x) = colors[static_cast<std::size_t>(std::lround(place))];
    }
  }
  return picture;
}

Result<> check_pictures(const cv::Mat& rgb, const DepthMap& map) {
  if (rgb.empty() || rgb.type() != CV_8UC3 || map.depth.empty() || map.depth.type() != CV_32FC1 ||
      map.confidence.type() != CV_8UC1 || map.confidence.size() != map.depth.size()) {
    return fail(ErrorCode::kInvalidArgument,
                "a depth picture needs an RGB photograph and a depth map with its confidence");
  }
  return {};
}

}  // namespace

std::array<std::uint8_t, 3> depth_color(double level) {
  constexpr double kDarkest = 0.12;  // apart from black, which is no colour of depth
  constexpr double kLightest = 0.95;
  constexpr double kStart = 0.5;
  constexpr double kRotations = -1.5;
  constexpr double kHue = 1.2;
  const double lambda = kDarkest + (kLightest - kDarkest) * std::clamp(level, 0.0, 1.0);
  const double phi = 2.0 * std::numbers::pi * (kStart / 3.0 + 1.0 + kRotations * lambda);
  const double amplitude = 0.5 * kHue * lambda * (1.0 - lambda);
  const double c = std::cos(phi);
  const double s = std::sin(phi);
  const auto to_byte = [](double value) {
    return static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(value, 0.0, 1.0)));
  };
  return {to_byte(lambda + amplitude * (-0.14861 * c + 1.78277 * s)),
          to_byte(lambda + amplitude * (-0.29227 * c - 0.90649 * s)),
          to_byte(lambda + amplitude * 1.97294 * c)};
}

Result<DepthPicture> make_depth_picture(std::string image_name,
                                        const cv::Mat& rgb,
                                        const DepthMap& map) {
  TM_RETURN_IF_ERROR(check_pictures(rgb, map));
  DepthPicture picture;
  picture.image_name = std::move(image_name);
  const std::vector<float> known = inverse_depths(map.depth);
  picture.filled_ratio = static_cast<double>(known.size()) / static_cast<double>(map.depth.total());
  InverseDepthRange range{1.0, 1.0};
  if (const std::optional<InverseDepthRange> found = range_of(known)) {
    range = *found;
    picture.near_depth = 1.0 / range.high;
    picture.far_depth = 1.0 / range.low;
  }
  TM_ASSIGN_OR_RETURN(picture.image_jpeg, encode_jpeg(shrink(rgb, cv::INTER_AREA), kJpegQuality));
  // Depths on both sides of an edge have no mean, so they are picked, not averaged.
  TM_ASSIGN_OR_RETURN(
      picture.depth_jpeg,
      encode_jpeg(paint_depth(shrink(map.depth, cv::INTER_NEAREST), range), kJpegQuality));
  TM_ASSIGN_OR_RETURN(picture.confidence_jpeg,
                      encode_jpeg(shrink(map.confidence, cv::INTER_AREA), kJpegQuality));
  return picture;
}

}  // namespace trigmesh
