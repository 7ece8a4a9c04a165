#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <opencv2/core/mat.hpp>

namespace trigmesh::testing {

/// A Gaussian bump: grey = amplitude exp(-|p - center|^2 / (2 sigma^2)) on top of the others.
struct Blob {
  double x = 0.0;
  double y = 0.0;
  double sigma = 1.0;
  double amplitude = 0.0;
};

/// p_image = scale R(angle) p_texture + (shift_x, shift_y), pixels; first pixel centre = (0, 0).
struct Similarity {
  double scale = 1.0;
  double angle_rad = 0.0;
  double shift_x = 0.0;
  double shift_y = 0.0;

  [[nodiscard]] cv::Point2d apply(double x, double y) const {
    const double c = scale * std::cos(angle_rad);
    const double s = scale * std::sin(angle_rad);
    return {c * x - s * y + shift_x, s * x + c * y + shift_y};
  }
};

/// Blobs of many sizes at fixed pseudo-random places of a `side` x `side` square centred at the
/// origin.
inline std::vector<Blob> random_texture(int count, double side, std::uint32_t seed) {
  std::mt19937 generator(seed);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(generator()) / 4294967296.0;
  };
  std::vector<Blob> blobs;
  for (int i = 0; i < count; ++i) {
    const double sign = i % 2 == 0 ? 1.0 : -1.0;
    blobs.push_back({.x = uniform(-0.5 * side, 0.5 * side),
                     .y = uniform(-0.5 * side, 0.5 * side),
                     .sigma = 1.0 * std::exp(uniform(0.0, 1.5)),
                     .amplitude = sign * uniform(25.0, 80.0)});
  }
  return blobs;
}

/// The texture as seen through a similarity: exact, because a Gaussian stays a Gaussian. Background
/// 128.
inline cv::Mat render(const std::vector<Blob>& blobs,
                      const Similarity& view,
                      int width,
                      int height) {
  cv::Mat sum(height, width, CV_64FC1, cv::Scalar(128.0));
  for (const Blob& blob : blobs) {
    const cv::Point2d center = view.apply(blob.x, blob.y);
    const double sigma = blob.sigma * view.scale;
    const auto begin = [&](double c) {
      return std::max(0, static_cast<int>(std::floor(c - 5.0 * sigma)));
    };
    const auto end = [&](double c, int size) {
      return std::min(size, static_cast<int>(std::ceil(c + 5.0 * sigma)));
    };
    for (int y = begin(center.y); y < end(center.y, height); ++y) {
      for (int x = begin(center.x); x < end(center.x, width); ++x) {
        const double dx = x - center.x;
        const double dy = y - center.y;
        sum.at<double>(y, x) +=
            blob.amplitude * std::exp(-0.5 * (dx * dx + dy * dy) / (sigma * sigma));
      }
    }
  }
  cv::Mat grey(height, width, CV_8UC1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      grey.at<std::uint8_t>(y, x) =
          static_cast<std::uint8_t>(std::clamp(std::lround(sum.at<double>(y, x)), 0L, 255L));
    }
  }
  return grey;
}

}  // namespace trigmesh::testing
