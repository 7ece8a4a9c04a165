// E(x) = sum_p D_p(x_p) + sum_{p, q} V_pq [x_p != x_q] with V_pq = a + b exp(-|c_p - c_q|^2 / 2
// s^2) over the four neighbours (Boykov, Jolly 2001, eq. 1 and the contrast term of section 2), s^2
// the mean squared difference of neighbours as in C. Rother et al., "GrabCut", SIGGRAPH 2004,
// eq. 5.
#include "sfm/moving/region_cut.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <opencv2/core.hpp>

#include "sfm/texture/minimum_cut.hpp"

namespace trigmesh {

namespace {

// Costs, in tenths of a nat of colour preference.
constexpr std::int32_t kMarkCost = 60;
constexpr float kColorCost = 20.0F;
constexpr std::int32_t kPriorCost = 3;
constexpr float kBorderCost = 4.0F;
constexpr float kContrastCost = 40.0F;
constexpr float kMaxPreference = 2.0F;
// Counts that every colour is given before the first is counted.
constexpr double kPseudoCount = 8.0;

bool is_free(const MovingView& view, const RegionMarks& marks, int x, int y) {
  const bool left_out = !view.mask.empty() && view.mask.at<std::uint8_t>(y, x) == 0;
  return !left_out && marks.fixed.at<std::uint8_t>(y, x) == 0;
}

float squared_difference(const cv::Mat& rgb, cv::Point a, cv::Point b) {
  const auto& p = rgb.at<cv::Vec3b>(a);
  const auto& q = rgb.at<cv::Vec3b>(b);
  float sum = 0.0F;
  for (int c = 0; c < 3; ++c) {
    const float d = static_cast<float>(p[c]) - static_cast<float>(q[c]);
    sum += d * d;
  }
  return sum;
}

constexpr std::array<std::array<int, 2>, 2> kSteps{{{1, 0}, {0, 1}}};

/// 1 / (2 s^2) of the picture.
float contrast_scale(const cv::Mat& rgb) {
  double sum = 0.0;
  std::size_t count = 0;
  for (int y = 0; y + 1 < rgb.rows; ++y) {
    for (int x = 0; x + 1 < rgb.cols; ++x) {
      for (const auto& step : kSteps) {
        sum += static_cast<double>(squared_difference(rgb, {x, y}, {x + step[0], y + step[1]}));
        ++count;
      }
    }
  }
  return sum > 0.0 ? static_cast<float>(static_cast<double>(count) / (2.0 * sum)) : 0.0F;
}

/// The free pixels, numbered.
struct FreePixels {
  cv::Mat number;  ///< CV_32SC1, -1 = not free
  std::uint32_t count = 0;
};

FreePixels number_free_pixels(const MovingView& view, const RegionMarks& marks) {
  FreePixels free{cv::Mat(view.rgb.size(), CV_32SC1, cv::Scalar(-1)), 0};
  for (int y = 0; y < view.rgb.rows; ++y) {
    for (int x = 0; x < view.rgb.cols; ++x) {
      if (is_free(view, marks, x, y)) {
        free.number.at<std::int32_t>(y, x) = static_cast<std::int32_t>(free.count++);
      }
    }
  }
  return free;
}

/// Cost of saying that a free pixel moved, less that of saying that it did not.
std::int32_t moving_cost(const MovingView& view,
                         const RegionMarks& marks,
                         const ColorPreference& preference,
                         int x,
                         int y) {
  const float color = kColorCost * preference(view.rgb.at<cv::Vec3b>(y, x));
  std::int32_t cost = kPriorCost - static_cast<std::int32_t>(std::lround(color));
  cost -= marks.moving.at<std::uint8_t>(y, x) != 0 ? kMarkCost : 0;
  cost += marks.settled.at<std::uint8_t>(y, x) != 0 ? kMarkCost : 0;
  return cost;
}

void add_border(
    const MovingView& view, const FreePixels& free, float scale, cv::Point a, BinaryCut& cut) {
  for (const auto& step : kSteps) {
    const cv::Point b(a.x + step[0], a.y + step[1]);
    if (b.x >= view.rgb.cols || b.y >= view.rgb.rows) {
      continue;
    }
    const std::int32_t i = free.number.at<std::int32_t>(a);
    const std::int32_t j = free.number.at<std::int32_t>(b);
    const auto cost = static_cast<std::int32_t>(std::lround(
        kBorderCost + kContrastCost * std::exp(-scale * squared_difference(view.rgb, a, b))));
    if (i >= 0 && j >= 0) {
      cut.add_pair(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j), 0, cost);
    } else if (i >= 0 || j >= 0) {
      cut.add_unary(static_cast<std::uint32_t>(std::max(i, j)), 0, cost);
    }
  }
}

}  // namespace

std::size_t ColorPreference::bin_of(const cv::Vec3b& rgb) {
  constexpr std::size_t kWidth = 256 / kBins;
  return (rgb[0] / kWidth * kBins + rgb[1] / kWidth) * kBins + rgb[2] / kWidth;
}

void ColorPreference::add(const MovingView& view, const cv::Mat& moving) {
  for (int y = 0; y < view.rgb.rows; ++y) {
    for (int x = 0; x < view.rgb.cols; ++x) {
      if (!view.mask.empty() && view.mask.at<std::uint8_t>(y, x) == 0) {
        continue;
      }
      const std::size_t bin = bin_of(view.rgb.at<cv::Vec3b>(y, x));
      ++all_[bin];
      ++all_count_;
      if (moving.at<std::uint8_t>(y, x) != 0) {
        ++moving_[bin];
        ++moving_count_;
      }
    }
  }
}

float ColorPreference::operator()(const cv::Vec3b& rgb) const {
  if (moving_count_ == 0) {
    return 0.0F;
  }
  const std::size_t bin = bin_of(rgb);
  const double share = static_cast<double>(moving_count_) / static_cast<double>(all_count_);
  const double ratio = (moving_[bin] + kPseudoCount * share) / ((all_[bin] + kPseudoCount) * share);
  return std::clamp(
      static_cast<float>(std::log(std::max(ratio, 1e-6))), -kMaxPreference, kMaxPreference);
}

cv::Mat cut_region(const MovingView& view,
                   const RegionMarks& marks,
                   const ColorPreference& preference) {
  const FreePixels free = number_free_pixels(view, marks);
  const float scale = contrast_scale(view.rgb);
  BinaryCut cut(free.count);
  for (int y = 0; y < view.rgb.rows; ++y) {
    for (int x = 0; x < view.rgb.cols; ++x) {
      add_border(view, free, scale, {x, y}, cut);
      if (const std::int32_t i = free.number.at<std::int32_t>(y, x); i >= 0) {
        cut.add_unary(static_cast<std::uint32_t>(i), 0, moving_cost(view, marks, preference, x, y));
      }
    }
  }
  const std::vector<std::uint8_t> sides = cut.solve();
  cv::Mat region(view.rgb.size(), CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < region.rows; ++y) {
    for (int x = 0; x < region.cols; ++x) {
      const std::int32_t i = free.number.at<std::int32_t>(y, x);
      if (i >= 0 && sides[static_cast<std::size_t>(i)] != 0) {
        region.at<std::uint8_t>(y, x) = 255;
      }
    }
  }
  return region;
}

}  // namespace trigmesh
