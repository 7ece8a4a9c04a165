#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <opencv2/core/mat.hpp>

namespace trigmesh {

/// Summed-area table of an 8-bit image (Bay et al. 2008, eq. 1): after one pass, the sum over any
/// upright rectangle costs four look-ups. Sums are kept modulo 2^32, so images of any size work as
/// long as one *queried* rectangle stays below 8.4 million pixels (its sum fits 31 bits).
/// Thread-compatible, immutable after construction.
///
/// Two kinds of coordinates: *table* coordinates are whole numbers, column c lies between pixels
/// c-1 and c; *pixel* coordinates are real, the centre of the first pixel is (0, 0), so table
/// column c is pixel coordinate c - 0.5.
class IntegralImage {
 public:
  /// `grey`: CV_8UC1, not empty.
  explicit IntegralImage(const cv::Mat& grey);

  [[nodiscard]] int width_px() const { return width_px_; }

  [[nodiscard]] int height_px() const { return height_px_; }

  /// Table row y in [0, height_px()]: width_px() + 1 sums of all pixels above row y and left of the
  /// column.
  [[nodiscard]] const std::uint32_t* row(int y) const {
    return sums_.data() + static_cast<std::size_t>(y) * stride_;
  }

  /// Exact sum of the pixels in columns [x_begin, x_end) and rows [y_begin, y_end), all inside the
  /// image.
  [[nodiscard]] std::int32_t box_sum(int x_begin, int y_begin, int x_end, int y_end) const {
    const std::uint32_t* top = row(y_begin);
    const std::uint32_t* bottom = row(y_end);
    return static_cast<std::int32_t>(bottom[x_end] - bottom[x_begin] - top[x_end] + top[x_begin]);
  }

  /// Mean grey value of a square with real-valued centre and side, pixels taken as little squares
  /// of constant value. A square that leaves the image is moved back inside (as if the border were
  /// replicated); its side is cut to the image.
  [[nodiscard]] float square_mean(float center_x_px, float center_y_px, float side_px) const;

  /// The table itself on a regular grid of `count` x `count` real positions, (left_px + j *
  /// spacing_px,
  /// top_px + i * spacing_px) at out[i * count + j], less a plane that cancels in second
  /// differences: the sum over the cells between lines i0 < i1 and columns j0 < j1 is out(i1,j1) -
  /// out(i1,j0) - out(i0,j1) + out(i0,j0). Returns false, and writes nothing, when the grid leaves
  /// the image. 2 <= count <= kMaxGrid.
  [[nodiscard]] bool grid_sums(
      float left_px, float top_px, float spacing_px, int count, std::span<float> out) const;

  static constexpr int kMaxGrid = 32;

 private:
  int width_px_ = 0;
  int height_px_ = 0;
  std::size_t stride_ = 0;
  std::vector<std::uint32_t> sums_;
};

}  // namespace trigmesh
