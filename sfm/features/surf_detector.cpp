// Fast-Hessian detector: H. Bay, A. Ess, T. Tuytelaars, L. Van Gool, "Speeded-Up Robust Features
// (SURF)", Computer Vision and Image Understanding 110(3), 2008, section 3. Response: det(H_approx)
// = Dxx Dyy - (0.9 Dxy)^2 (eq. 3). Refinement: M. Brown, D. Lowe, "Invariant features from interest
// point groups", BMVC 2002:  offset = -(d2D/dx2)^-1 dD/dx.
#include "sfm/features/surf_detector.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>

#include <Eigen/LU>

#include "firmware/base/check.hpp"
#include "sfm/features/surf_kernels.hpp"

namespace trigmesh {
namespace {

constexpr float kLargestGrey = 255.0F;

/// The last three rows of responses of all layers of an octave.
class ResponseWindow {
 public:
  explicit ResponseWindow(std::size_t row_capacity) {
    for (auto& layer : rows_) {
      for (auto& row : layer) {
        row.assign(row_capacity, 0.0F);
      }
    }
  }

  [[nodiscard]] std::vector<float>& row(int layer, int sample_row) {
    return rows_[static_cast<std::size_t>(layer)][static_cast<std::size_t>(sample_row % 3)];
  }

  [[nodiscard]] const std::vector<float>& row(int layer, int sample_row) const {
    return rows_[static_cast<std::size_t>(layer)][static_cast<std::size_t>(sample_row % 3)];
  }

 private:
  std::array<std::array<std::vector<float>, 3>, kSurfLayers> rows_;
};

/// The 27 responses around a sample: [layer][row][column].
struct Neighbourhood {
  std::array<std::array<const float*, 3>, 3>
      rows;  ///< each pointing at the left neighbour's column

  [[nodiscard]] float at(int layer, int row, int column) const {
    return rows[static_cast<std::size_t>(layer + 1)][static_cast<std::size_t>(row + 1)][column + 1];
  }
};

/// Larger than the 26 neighbours; of equal ones the last in layer, row, column order wins, so that
/// a plateau of two samples (a blob exactly between pixels) still gives one point.
bool is_maximum(const Neighbourhood& n) {
  const float value = n.at(0, 0, 0);
  for (int layer = -1; layer <= 1; ++layer) {
    for (int row = -1; row <= 1; ++row) {
      for (int column = -1; column <= 1; ++column) {
        const int order = 9 * layer + 3 * row + column;
        const float other = n.at(layer, row, column);
        if (order < 0 ? value < other : (order > 0 && value <= other)) {
          return false;
        }
      }
    }
  }
  return true;
}

/// Offset (column, row, layer), in samples, of the peak of the quadratic through the neighbourhood;
/// nothing when the peak lies beyond a neighbouring sample.
std::optional<Eigen::Vector3d> peak_offset(const Neighbourhood& n) {
  const auto at = [&](int column, int row, int layer) {
    return static_cast<double>(n.at(layer, row, column));
  };
  const double center = at(0, 0, 0);
  const Eigen::Vector3d gradient(0.5 * (at(1, 0, 0) - at(-1, 0, 0)),
                                 0.5 * (at(0, 1, 0) - at(0, -1, 0)),
                                 0.5 * (at(0, 0, 1) - at(0, 0, -1)));
  const double xx = at(1, 0, 0) + at(-1, 0, 0) - 2.0 * center;
  const double yy = at(0, 1, 0) + at(0, -1, 0) - 2.0 * center;
  const double ss = at(0, 0, 1) + at(0, 0, -1) - 2.0 * center;
  const double xy = 0.25 * (at(1, 1, 0) - at(-1, 1, 0) - at(1, -1, 0) + at(-1, -1, 0));
  const double xs = 0.25 * (at(1, 0, 1) - at(-1, 0, 1) - at(1, 0, -1) + at(-1, 0, -1));
  const double ys = 0.25 * (at(0, 1, 1) - at(0, -1, 1) - at(0, 1, -1) + at(0, -1, -1));
  Eigen::Matrix3d hessian;
  hessian << xx, xy, xs, xy, yy, ys, xs, ys, ss;
  Eigen::Matrix3d inverse;
  bool invertible = false;
  // The responses are small numbers: their determinant is judged against the size of the entries.
  hessian.computeInverseWithCheck(inverse, invertible, 1e-9 * std::pow(std::abs(center), 3));
  if (!invertible) {
    return std::nullopt;
  }
  const Eigen::Vector3d offset = -(inverse * gradient);
  if (!(offset.cwiseAbs().maxCoeff() <= 1.0)) {
    return std::nullopt;
  }
  return offset;
}

/// Searches one octave, keeping three rows of responses at a time.
class OctaveSearch {
 public:
  OctaveSearch(const IntegralImage& integral, int octave, float threshold)
      : samples_(integral, octave),
        octave_(octave),
        threshold_(threshold),
        window_(samples_.row_capacity()) {}

  void run(std::vector<Keypoint>& keypoints) {
    for (int row = 0; row < samples_.rows(); ++row) {
      for (int layer = 0; layer < kSurfLayers; ++layer) {
        samples_.compute_row(surf_filter_side(octave_, layer), row, window_.row(layer, row));
      }
      for (int layer = 1; layer + 1 < kSurfLayers; ++layer) {
        search_row(layer, row - 1, keypoints);
      }
    }
  }

 private:
  /// Looks for maxima in row `row` of `layer`, whose next row has just been computed.
  void search_row(int layer, int row, std::vector<Keypoint>& keypoints) const {
    // One sample inside the border of the largest filter involved.
    const int border = samples_.border(surf_filter_side(octave_, layer + 1)) + 1;
    if (row < border || row >= samples_.rows() - border) {
      return;
    }
    const float* center = window_.row(layer, row).data();
    for (int column = border; column < samples_.columns() - border; ++column) {
      const float value = center[column];
      if (value <= threshold_ || value < center[column - 1] || value <= center[column + 1]) {
        continue;
      }
      const Neighbourhood neighbourhood = around(layer, row, column);
      if (!is_maximum(neighbourhood)) {
        continue;
      }
      if (const auto offset = peak_offset(neighbourhood)) {
        keypoints.push_back(keypoint(layer, row, column, *offset, value));
      }
    }
  }

  [[nodiscard]] Neighbourhood around(int layer, int row, int column) const {
    Neighbourhood n{};
    for (int i = -1; i <= 1; ++i) {
      for (int j = -1; j <= 1; ++j) {
        n.rows[static_cast<std::size_t>(i + 1)][static_cast<std::size_t>(j + 1)] =
            window_.row(layer + i, row + j).data() + column - 1;
      }
    }
    return n;
  }

  [[nodiscard]] Keypoint keypoint(
      int layer, int row, int column, const Eigen::Vector3d& offset, float response) const {
    const auto step = static_cast<float>(samples_.step_px());
    const Eigen::Vector3f shift = offset.cast<float>();
    const auto side = static_cast<float>(surf_filter_side(octave_, layer));
    const auto side_step =
        static_cast<float>(surf_filter_side(octave_, 1) - surf_filter_side(octave_, 0));
    return {.x_px = step * (static_cast<float>(column) + shift.x()),
            .y_px = step * (static_cast<float>(row) + shift.y()),
            .scale_px = surf_sigma(side + side_step * shift.z()),
            .angle_rad = 0.0F,
            .response = response};
  }

  SurfOctave samples_;
  int octave_ = 0;
  float threshold_ = 0.0F;
  ResponseWindow window_;
};

}  // namespace

SurfOctave::SurfOctave(const IntegralImage& integral, int octave)
    : step_px_(1 << octave),
      columns_((integral.width_px() + step_px_ - 1) / step_px_),
      rows_((integral.height_px() + step_px_ - 1) / step_px_),
      width_px_(integral.width_px()),
      height_px_(integral.height_px()) {
  const auto step = static_cast<std::size_t>(step_px_);
  const std::size_t table_columns = static_cast<std::size_t>(width_px_) + 1;
  phase_length_ = (table_columns + step - 1) / step;
  row_length_ = phase_length_ * step;
  tables_.resize(row_length_ * (static_cast<std::size_t>(height_px_) + 1) + kSurfKernelPadding, 0U);
  for (int y = 0; y <= height_px_; ++y) {
    const std::uint32_t* source = integral.row(y);
    std::uint32_t* target = tables_.data() + static_cast<std::size_t>(y) * row_length_;
    for (std::size_t phase = 0; phase < step; ++phase) {
      for (std::size_t x = phase, k = phase * phase_length_; x < table_columns; x += step, ++k) {
        target[k] = source[x];
      }
    }
  }
  strips_xx_.resize(row_length_ + kSurfKernelPadding, 0U);
  strips_yy_.resize(row_length_ + kSurfKernelPadding, 0U);
  strips_xy_.resize(row_length_ + kSurfKernelPadding, 0U);
}

std::size_t SurfOctave::row_capacity() const {
  return static_cast<std::size_t>(columns_) + kSurfKernelPadding;
}

std::ptrdiff_t SurfOctave::shifted(int offset_px) const {
  const int phase = ((offset_px % step_px_) + step_px_) % step_px_;
  return static_cast<std::ptrdiff_t>(phase) * static_cast<std::ptrdiff_t>(phase_length_) +
         (offset_px - phase) / step_px_;
}

void SurfOctave::compute_row(int filter_side_px, int sample_row, std::vector<float>& out) {
  TM_CHECK(out.size() >= row_capacity());
  const int b = filter_side_px / 2;
  const int l = filter_side_px / 3;
  const int h = l / 2;
  const int y = sample_row * step_px_;
  const int first = border(filter_side_px);
  // Filters reach table columns x - b .. x + b + 1 <= width.
  const int last = (width_px_ - 1 - b >= 0) ? (width_px_ - 1 - b) / step_px_ : -1;
  if (y < b || y + b + 1 > height_px_ || last < first) {
    std::fill(out.begin(), out.end(), 0.0F);
    return;
  }
  const auto line = [&](int offset) { return table_row(y + offset); };
  surf_vertical_strips({.minus_b = line(-b),
                        .minus_l = line(-l),
                        .minus_l_plus_1 = line(1 - l),
                        .minus_h = line(-h),
                        .zero = line(0),
                        .plus_1 = line(1),
                        .plus_h_plus_1 = line(h + 1),
                        .plus_l = line(l),
                        .plus_l_plus_1 = line(l + 1),
                        .plus_b_plus_1 = line(b + 1)},
                       row_length_,
                       {.xx = strips_xx_.data(), .yy = strips_yy_.data(), .xy = strips_xy_.data()});
  const auto from = [&](const std::vector<std::uint32_t>& strips, int offset) {
    return strips.data() + (shifted(offset) + first);
  };
  const float scale = 1.0F / (kLargestGrey * static_cast<float>(filter_side_px * filter_side_px));
  surf_determinants({.xx_minus_b = from(strips_xx_, -b),
                     .xx_minus_h = from(strips_xx_, -h),
                     .xx_plus_h_plus_1 = from(strips_xx_, h + 1),
                     .xx_plus_b_plus_1 = from(strips_xx_, b + 1),
                     .yy_minus_l_plus_1 = from(strips_yy_, 1 - l),
                     .yy_plus_l = from(strips_yy_, l),
                     .xy_minus_l = from(strips_xy_, -l),
                     .xy_zero = from(strips_xy_, 0),
                     .xy_plus_1 = from(strips_xy_, 1),
                     .xy_plus_l_plus_1 = from(strips_xy_, l + 1)},
                    static_cast<std::size_t>(last - first + 1),
                    scale,
                    out.data() + first);
  std::fill(out.begin(), out.begin() + first, 0.0F);
  std::fill(out.begin() + last + 1, out.end(), 0.0F);
}

std::vector<Keypoint> detect_surf_keypoints(const IntegralImage& integral,
                                            const SurfDetectorOptions& options) {
  std::vector<Keypoint> keypoints;
  const int smaller_side = std::min(integral.width_px(), integral.height_px());
  for (int octave = 0; octave < options.octaves; ++octave) {
    // The third filter must fit, or no sample has a neighbour above and below in scale.
    if (surf_filter_side(octave, 2) + 2 * (1 << octave) > smaller_side) {
      break;
    }
    OctaveSearch(integral, octave, options.threshold).run(keypoints);
  }
  return keypoints;
}

}  // namespace trigmesh
