#include "firmware/imaging/sharpness.hpp"

#include <cstddef>
#include <vector>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

double variance_of_laplacian(const std::vector<std::uint8_t>& grey, int width, int height) {
  if (width < 3 || height < 3) {
    return 0.0;
  }
  std::int64_t sum = 0;
  std::int64_t sum_of_squares = 0;
  const auto stride = static_cast<std::ptrdiff_t>(width);
  for (std::ptrdiff_t y = 1; y + 1 < height; ++y) {
    const std::uint8_t* row = grey.data() + y * stride;
    for (std::ptrdiff_t x = 1; x + 1 < stride; ++x) {
      const int value =
          row[x - 1] + row[x + 1] + row[x - stride] + row[x + stride] - 4 * int{row[x]};
      sum += value;
      sum_of_squares += std::int64_t{value} * value;
    }
  }
  const double count = static_cast<double>(width - 2) * static_cast<double>(height - 2);
  const double mean = static_cast<double>(sum) / count;
  return static_cast<double>(sum_of_squares) / count - mean * mean;
}

}  // namespace

Result<double> SharpnessMeter::measure(const FrameLayout& layout,
                                       std::span<const std::uint8_t> bytes) {
  TM_RETURN_IF_ERROR(reducer_.reduce(layout, bytes));
  return variance_of_laplacian(reducer_.grey(), reducer_.width_px(), reducer_.height_px());
}

}  // namespace trigmesh
