#pragma once

#include <cstdint>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace trigmesh::test_support {

/// CV_8UC1 with structure at every scale from 2 to 16 pixels; the same for the same seed.
[[nodiscard]] inline cv::Mat textured_image(int width, int height, std::uint64_t seed) {
  cv::RNG random(seed);
  cv::Mat sum = cv::Mat::zeros(height, width, CV_32FC1);
  for (const double scale : {2.0, 4.0, 8.0, 16.0}) {
    cv::Mat noise(height, width, CV_32FC1);
    random.fill(noise, cv::RNG::UNIFORM, -1.0, 1.0);
    cv::GaussianBlur(noise, noise, {}, scale);
    sum += noise * scale;  // the blur divides the deviation by the scale
  }
  cv::Mat image;
  cv::normalize(sum, image, 30, 225, cv::NORM_MINMAX, CV_8U);
  return image;
}

}  // namespace trigmesh::test_support
