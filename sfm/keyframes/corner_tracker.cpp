#include "sfm/keyframes/corner_tracker.hpp"

#include <array>
#include <cmath>

#include <Eigen/LU>
#include <opencv2/imgproc.hpp>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

using Eigen::Vector2f;

constexpr int kMaxPatchRadius = 15;
/// A patch with a border of one pixel, for gradients.
constexpr int kMaxPatchPixels = (2 * kMaxPatchRadius + 3) * (2 * kMaxPatchRadius + 3);
/// A step below this ends the iterations of a level, pixels.
constexpr float kConvergedPx = 0.02F;

/// On the stack, with sums that Eigen computes four at a time.
using PatchPixels = Eigen::Array<float, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxPatchPixels, 1>;

/// Bilinear grey values of the (2 r + 1)^2 pixels around `centre`; false where one lies outside.
bool sample_patch(const cv::Mat& image, const Vector2f& centre, int radius, PatchPixels& patch) {
  const float left = centre.x() - static_cast<float>(radius);
  const float top = centre.y() - static_cast<float>(radius);
  const int side = 2 * radius + 1;
  // Written so that NaN is outside, too.
  if (!(left >= 0.0F && top >= 0.0F &&
        left + static_cast<float>(side) < static_cast<float>(image.cols) &&
        top + static_cast<float>(side) < static_cast<float>(image.rows))) {
    return false;
  }
  const int column = static_cast<int>(left);
  const int row = static_cast<int>(top);
  const float a = left - static_cast<float>(column);
  const float b = top - static_cast<float>(row);
  const std::array<float, 4> weights = {(1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b};
  patch.resize(Eigen::Index{side} * side);
  float* pixels = patch.data();
  for (int y = 0; y < side; ++y) {
    const std::uint8_t* upper = image.ptr<std::uint8_t>(row + y) + column;
    const std::uint8_t* lower = image.ptr<std::uint8_t>(row + y + 1) + column;
    for (int x = 0; x < side; ++x) {
      *pixels++ = weights[0] * static_cast<float>(upper[x]) +
                  weights[1] * static_cast<float>(upper[x + 1]) +
                  weights[2] * static_cast<float>(lower[x]) +
                  weights[3] * static_cast<float>(lower[x + 1]);
    }
  }
  return true;
}

/// What is known of a patch in the first image, all means subtracted.
struct Template {
  PatchPixels values;
  PatchPixels gradient_x;
  PatchPixels gradient_y;
  Eigen::Matrix2f inverse_moments;
  float energy = 0.0F;  ///< sum of the squared values
};

void subtract_mean(PatchPixels& pixels) {
  pixels -= pixels.mean();
}

/// Values and central differences from the patch with its border.
void split_border(const PatchPixels& bordered, int radius, Template& patch) {
  const Eigen::Index side = 2 * radius + 1;
  const Eigen::Index stride = side + 2;
  for (PatchPixels* part : {&patch.values, &patch.gradient_x, &patch.gradient_y}) {
    part->resize(side * side);
  }
  for (Eigen::Index y = 0; y < side; ++y) {
    const Eigen::Index from = (y + 1) * stride + 1;
    patch.values.segment(y * side, side) = bordered.segment(from, side);
    patch.gradient_x.segment(y * side, side) =
        0.5F * (bordered.segment(from + 1, side) - bordered.segment(from - 1, side));
    patch.gradient_y.segment(y * side, side) =
        0.5F * (bordered.segment(from + stride, side) - bordered.segment(from - stride, side));
  }
}

/// False where the patch leaves the image or has no structure in two directions.
bool make_template(const cv::Mat& image, const Vector2f& centre, int radius, Template& patch) {
  PatchPixels bordered;
  if (!sample_patch(image, centre, radius + 1, bordered)) {
    return false;
  }
  split_border(bordered, radius, patch);
  subtract_mean(patch.values);
  subtract_mean(patch.gradient_x);
  subtract_mean(patch.gradient_y);
  const float xx = patch.gradient_x.square().sum();
  const float xy = (patch.gradient_x * patch.gradient_y).sum();
  const float yy = patch.gradient_y.square().sum();
  const float determinant = xx * yy - xy * xy;
  // One grey level of gradient in the weaker direction: below it noise decides.
  if (!(determinant > (xx + yy) * static_cast<float>(patch.values.size()))) {
    return false;
  }
  patch.inverse_moments << yy, -xy, -xy, xx;
  patch.inverse_moments /= determinant;
  patch.energy = patch.values.square().sum();
  return true;
}

/// Moves `position` to where the patch fits best; false where it leaves the image.
bool align(const cv::Mat& image,
           const Template& patch,
           int radius,
           int max_iterations,
           Vector2f& position) {
  PatchPixels pixels;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    if (!sample_patch(image, position, radius, pixels)) {
      return false;
    }
    subtract_mean(pixels);
    pixels *= std::sqrt(patch.energy / std::max(pixels.square().sum(), 1e-6F));
    pixels -= patch.values;
    const Vector2f sum((pixels * patch.gradient_x).sum(), (pixels * patch.gradient_y).sum());
    const Vector2f step = patch.inverse_moments * sum;
    position -= step;
    if (step.squaredNorm() < kConvergedPx * kConvergedPx) {
      return true;
    }
  }
  return true;
}

float correlation(const cv::Mat& image,
                  const Template& patch,
                  int radius,
                  const Vector2f& position) {
  PatchPixels pixels;
  if (!sample_patch(image, position, radius, pixels)) {
    return -1.0F;
  }
  subtract_mean(pixels);
  const float energy = pixels.square().sum();
  return (pixels * patch.values).sum() / std::sqrt(std::max(energy * patch.energy, 1e-6F));
}

/// One way only, coarse to fine.
std::optional<Vector2f> follow(const ImagePyramid& first,
                               const ImagePyramid& second,
                               const Vector2f& corner,
                               const Vector2f& guess,
                               const CornerTrackerOptions& options) {
  Template patch;
  const int radius = options.patch_radius_px;
  const auto top = static_cast<int>(std::min(first.size(), second.size())) - 1;
  Vector2f position = guess;
  for (int level = top; level >= 0; --level) {
    // The first pixel's centre is at 0, and a level's pixel covers two by two of the one below.
    const auto scale = 1.0F / static_cast<float>(1 << level);
    const Vector2f centre = (corner.array() + 0.5F) * scale - 0.5F;
    Vector2f place = (position.array() + 0.5F) * scale - 0.5F;
    const auto index = static_cast<std::size_t>(level);
    const bool has_template = make_template(first[index], centre, radius, patch);
    const bool fits =
        has_template && align(second[index], patch, radius, options.max_iterations, place);
    if (level == 0) {
      const bool is_alike = fits && correlation(second[0], patch, radius, place) >=
                                        static_cast<float>(options.min_patch_correlation);
      return is_alike ? std::optional(place) : std::nullopt;
    }
    // A coarse level near the border is left out: the finer one may still do.
    if (fits) {
      position = (place.array() + 0.5F) / scale - 0.5F;
    }
  }
  return std::nullopt;
}

}  // namespace

Result<> CornerTrackerOptions::validate() const {
  if (max_corners < 8 || max_corners > 2000) {
    return fail(ErrorCode::kInvalidArgument, "max_corners is {}, must be 8 to 2000", max_corners);
  }
  if (!(min_corner_strength > 0.0 && min_corner_strength < 1.0)) {
    return fail(ErrorCode::kInvalidArgument,
                "min_corner_strength is {}, must lie between 0 and 1",
                min_corner_strength);
  }
  if (!(min_distance_px >= 1.0 && min_distance_px <= 200.0)) {
    return fail(
        ErrorCode::kInvalidArgument, "min_distance_px is {}, must be 1 to 200", min_distance_px);
  }
  if (patch_radius_px < 2 || patch_radius_px > kMaxPatchRadius) {
    return fail(ErrorCode::kInvalidArgument,
                "patch_radius_px is {}, must be 2 to {}",
                patch_radius_px,
                kMaxPatchRadius);
  }
  if (levels < 1 || levels > 6 || max_iterations < 1 || max_iterations > 100) {
    return fail(ErrorCode::kInvalidArgument,
                "levels is {} and max_iterations is {}, must be 1 to 6 and 1 to 100",
                levels,
                max_iterations);
  }
  if (!(max_roundtrip_px > 0.0) ||
      !(min_patch_correlation >= -1.0 && min_patch_correlation <= 1.0)) {
    return fail(ErrorCode::kInvalidArgument,
                "max_roundtrip_px is {} and min_patch_correlation is {}, must be more than 0 and "
                "-1 to 1",
                max_roundtrip_px,
                min_patch_correlation);
  }
  return {};
}

std::vector<Vector2f> find_corners(const cv::Mat& grey, const CornerTrackerOptions& options) {
  TM_CHECK(grey.type() == CV_8UC1);
  constexpr int kBlockSide = 5;
  // A patch nearer to the border cannot be taken.
  const int border = options.patch_radius_px + 2;
  if (std::min(grey.cols, grey.rows) <= 2 * border + kBlockSide) {
    return {};
  }
  const cv::Rect inner(border, border, grey.cols - 2 * border, grey.rows - 2 * border);
  std::vector<cv::Point2f> found;
  cv::goodFeaturesToTrack(grey(inner),
                          found,
                          options.max_corners,
                          options.min_corner_strength,
                          options.min_distance_px,
                          cv::noArray(),
                          kBlockSide);
  std::vector<Vector2f> corners;
  corners.reserve(found.size());
  for (const cv::Point2f& point : found) {
    corners.emplace_back(point.x + static_cast<float>(border),
                         point.y + static_cast<float>(border));
  }
  return corners;
}

std::optional<Vector2f> track_corner(const ImagePyramid& first,
                                     const ImagePyramid& second,
                                     const Vector2f& corner,
                                     const CornerTrackerOptions& options) {
  const std::optional<Vector2f> there = follow(first, second, corner, corner, options);
  if (!there.has_value()) {
    return std::nullopt;
  }
  const std::optional<Vector2f> back = follow(second, first, *there, corner, options);
  const bool comes_back =
      back.has_value() && (*back - corner).norm() <= static_cast<float>(options.max_roundtrip_px);
  return comes_back ? there : std::nullopt;
}

}  // namespace trigmesh
