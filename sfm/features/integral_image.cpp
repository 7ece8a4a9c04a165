#include "sfm/features/integral_image.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

/// A real table coordinate split for linear interpolation between columns (or rows) `index` and
/// `index + 1`.
struct Split {
  int index = 0;
  float fraction = 0.0F;
};

/// `limit`: last table coordinate. The upper neighbour always exists: the last coordinate is `limit
/// - 1` plus 1.
Split split(float table, int limit) {
  const int index = std::clamp(static_cast<int>(table), 0, limit - 1);
  return {.index = index, .fraction = table - static_cast<float>(index)};
}

/// Lower end, in table coordinates, of an interval of length `side` around pixel coordinate
/// `center`, kept in the image.
float interval_begin(float center_px, float side_px, int size_px) {
  return std::clamp(center_px + 0.5F - 0.5F * side_px, 0.0F, static_cast<float>(size_px) - side_px);
}

}  // namespace

IntegralImage::IntegralImage(const cv::Mat& grey)
    : width_px_(grey.cols),
      height_px_(grey.rows),
      stride_(static_cast<std::size_t>(grey.cols) + 1) {
  TM_CHECK(grey.type() == CV_8UC1 && !grey.empty());
  sums_.resize(stride_ * (static_cast<std::size_t>(height_px_) + 1), 0U);
  for (int y = 0; y < height_px_; ++y) {
    const std::uint8_t* pixels = grey.ptr<std::uint8_t>(y);
    const std::uint32_t* above = row(y);
    std::uint32_t* below = sums_.data() + (static_cast<std::size_t>(y) + 1) * stride_;
    std::uint32_t sum = 0;
    for (int x = 0; x < width_px_; ++x) {
      sum += pixels[x];
      below[x + 1] = above[x + 1] + sum;
    }
  }
}

float IntegralImage::square_mean(float center_x_px, float center_y_px, float side_px) const {
  const float side =
      std::min({side_px, static_cast<float>(width_px_), static_cast<float>(height_px_)});
  const float x_begin = interval_begin(center_x_px, side, width_px_);
  const float y_begin = interval_begin(center_y_px, side, height_px_);
  const Split left = split(x_begin, width_px_);
  const Split right = split(x_begin + side, width_px_);
  const Split top = split(y_begin, height_px_);
  const Split bottom = split(y_begin + side, height_px_);

  // Per table row: the strip from `left` to `right`. Rows are taken relative to the first one while
  // the numbers are whole, so that the floats below are as small as the square itself.
  const std::uint32_t* reference = row(top.index);
  const auto strip = [&](int y) {
    const std::uint32_t* sums = row(y);
    const auto at = [&](int x) { return sums[x] - reference[x]; };
    const std::uint32_t l0 = at(left.index);
    const std::uint32_t r0 = at(right.index);
    const auto whole = static_cast<float>(static_cast<std::int32_t>(r0 - l0));
    const auto left_column = static_cast<float>(static_cast<std::int32_t>(at(left.index + 1) - l0));
    const auto right_column =
        static_cast<float>(static_cast<std::int32_t>(at(right.index + 1) - r0));
    return whole + right.fraction * right_column - left.fraction * left_column;
  };
  const float top_strip = top.fraction * strip(top.index + 1);
  const float bottom_first = strip(bottom.index);
  const float bottom_strip =
      bottom_first + bottom.fraction * (strip(bottom.index + 1) - bottom_first);
  return (bottom_strip - top_strip) / (side * side);
}

bool IntegralImage::grid_sums(
    float left_px, float top_px, float spacing_px, int count, std::span<float> out) const {
  TM_CHECK(count >= 2 && count <= kMaxGrid &&
           out.size() >= static_cast<std::size_t>(count * count));
  const float left = left_px + 0.5F;
  const float top = top_px + 0.5F;
  const float length = spacing_px * static_cast<float>(count - 1);
  if (!(left >= 0.0F && top >= 0.0F && left + length <= static_cast<float>(width_px_) &&
        top + length <= static_cast<float>(height_px_))) {
    return false;
  }
  std::array<Split, kMaxGrid> columns;
  for (int j = 0; j < count; ++j) {
    columns[static_cast<std::size_t>(j)] =
        split(left + static_cast<float>(j) * spacing_px, width_px_);
  }
  // All sums relative to the whole table corner (x0, y0), exact in 32 bits; the fractional parts of
  // the corner cancel in second differences.
  const int x0 = columns[0].index;
  const std::uint32_t* first = row(split(top, height_px_).index);
  for (int i = 0; i < count; ++i) {
    const Split line = split(top + static_cast<float>(i) * spacing_px, height_px_);
    const std::uint32_t* upper = row(line.index);
    const std::uint32_t* lower = row(line.index + 1);
    const std::uint32_t upper_base = upper[x0] - first[x0];
    const std::uint32_t lower_base = lower[x0] - first[x0];
    for (int j = 0; j < count; ++j) {
      const auto [x, fx] = columns[static_cast<std::size_t>(j)];
      const auto at = [&](const std::uint32_t* sums, std::uint32_t base, int column) {
        return static_cast<float>(static_cast<std::int32_t>(sums[column] - first[column] - base));
      };
      const float u0 = at(upper, upper_base, x);
      const float l0 = at(lower, lower_base, x);
      const float u = u0 + fx * (at(upper, upper_base, x + 1) - u0);
      const float l = l0 + fx * (at(lower, lower_base, x + 1) - l0);
      out[static_cast<std::size_t>(i * count + j)] = u + line.fraction * (l - u);
    }
  }
  return true;
}

}  // namespace trigmesh
