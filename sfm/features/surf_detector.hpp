#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sfm/features/features.hpp"
#include "sfm/features/integral_image.hpp"

namespace trigmesh {

/// Sides of the box filters of one octave, in pixels, growing by equal steps (Bay et al. 2008,
/// section 3.3): 9 15 21 27 | 15 27 39 51 | 27 51 75 99 | 51 99 147 195. A filter of side L stands
/// for sigma = 1.2 L / 9.
inline constexpr int kSurfLayers = 4;

/// Side of filter `layer` of octave `octave` (both from 0).
[[nodiscard]] constexpr int surf_filter_side(int octave, int layer) {
  return 3 * ((2 << octave) * (layer + 1) + 1);
}

/// Sigma in pixels of the Gaussian that a box filter of this (interpolated) side stands for.
[[nodiscard]] constexpr float surf_sigma(float filter_side_px) {
  return 1.2F / 9.0F * filter_side_px;
}

/// Determinant-of-Hessian responses of one octave, sampled every 2^octave pixels.
/// Thread-compatible.
class SurfOctave {
 public:
  SurfOctave(const IntegralImage& integral, int octave);

  /// Samples per row and rows in this octave; sample (i, j) stands for pixel (j * step_px(), i *
  /// step_px()).
  [[nodiscard]] int columns() const { return columns_; }

  [[nodiscard]] int rows() const { return rows_; }

  [[nodiscard]] int step_px() const { return step_px_; }

  /// Samples at the border whose filter of this side would leave the image; the same on all four
  /// sides or one less.
  [[nodiscard]] int border(int filter_side_px) const {
    return (filter_side_px / 2 + step_px_ - 1) / step_px_;
  }

  /// Writes the responses det = Dxx Dyy - (0.9 Dxy)^2 (paper, eq. 3) of one row of samples, grey
  /// values taken as 0..1 and filters divided by their area; zero where the filter leaves the
  /// image. `out` holds at least row_capacity() floats.
  void compute_row(int filter_side_px, int sample_row, std::vector<float>& out);

  [[nodiscard]] std::size_t row_capacity() const;

 private:
  /// Start of table row y; columns of equal remainder modulo the step lie together, so that strided
  /// samples are contiguous.
  [[nodiscard]] const std::uint32_t* table_row(int y) const {
    return tables_.data() + static_cast<std::size_t>(y) * row_length_;
  }

  /// Position in a row of `table_row` order of sample 0 shifted by `offset_px`.
  [[nodiscard]] std::ptrdiff_t shifted(int offset_px) const;

  int step_px_ = 1;
  int columns_ = 0;
  int rows_ = 0;
  int width_px_ = 0;
  int height_px_ = 0;
  std::size_t phase_length_ = 0;
  std::size_t row_length_ = 0;
  std::vector<std::uint32_t> tables_;
  /// Vertical differences for the row at work: strips that Dxx, Dyy and Dxy are made of.
  std::vector<std::uint32_t> strips_xx_;
  std::vector<std::uint32_t> strips_yy_;
  std::vector<std::uint32_t> strips_xy_;
};

struct SurfDetectorOptions {
  /// Smallest determinant of Hessian kept, grey values 0..1.
  float threshold = 0.0F;
  /// Octaves searched, [1, 5]; those whose filters do not fit the image are left out.
  int octaves = 4;
};

/// Maxima of the determinant of the Hessian over place and scale (3x3x3 neighbourhood), refined by
/// a quadratic fit (Brown, Lowe, BMVC 2002). Keypoints without orientation, in the order octave,
/// row, layer, column.
[[nodiscard]] std::vector<Keypoint> detect_surf_keypoints(const IntegralImage& integral,
                                                          const SurfDetectorOptions& options);

}  // namespace trigmesh
