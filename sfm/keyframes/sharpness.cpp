#include "sfm/keyframes/sharpness.hpp"

#include <cstdint>

#include "firmware/base/check.hpp"

namespace trigmesh {

double variance_of_laplacian(const cv::Mat& grey) {
  TM_CHECK(grey.type() == CV_8UC1);
  if (grey.cols < 3 || grey.rows < 3) {
    return 0.0;
  }
  std::int64_t sum = 0;
  std::int64_t sum_of_squares = 0;
  for (int y = 1; y + 1 < grey.rows; ++y) {
    const std::uint8_t* above = grey.ptr<std::uint8_t>(y - 1);
    const std::uint8_t* row = grey.ptr<std::uint8_t>(y);
    const std::uint8_t* below = grey.ptr<std::uint8_t>(y + 1);
    for (int x = 1; x + 1 < grey.cols; ++x) {
      const int value = row[x - 1] + row[x + 1] + above[x] + below[x] - 4 * int{row[x]};
      sum += value;
      sum_of_squares += std::int64_t{value} * value;
    }
  }
  const double count = static_cast<double>(grey.cols - 2) * static_cast<double>(grey.rows - 2);
  const double mean = static_cast<double>(sum) / count;
  return static_cast<double>(sum_of_squares) / count - mean * mean;
}

}  // namespace trigmesh
