#pragma once

#include <array>
#include <cstdint>
#include <vector>

/// The inner loops of the scale space, one image row at a time, in SIMD chosen at run time. Rows
/// are float grey values 0..255; every row has at least kRowSlack floats of storage behind its last
/// pixel, which the loops may read and write.
namespace trigmesh::sift {

inline constexpr int kRowSlack = 64;   ///< floats readable and writable behind the end of a row
inline constexpr int kRowsAtOnce = 4;  ///< rows that blur_columns makes in one go
inline constexpr int kMaxKernelRadius = 16;

/// A normalised, truncated Gaussian whose *discrete* variance is exactly sigma^2.
struct GaussianKernel {
  int radius = 0;
  std::vector<float> half;  ///< radius + 1 weights, the centre first
  std::vector<float>
      padded;  ///< all 2 radius + 1 weights with kRowsAtOnce - 1 zeros on either side
};

/// `sigma` in pixels, (0, 4].
[[nodiscard]] GaussianKernel make_gaussian_kernel(double sigma);

/// Vertical pass: out[j][x] = sum_t weight(t) * rows[j + t][x] for the kRowsAtOnce outputs j.
/// `rows` points to 2 radius + kRowsAtOnce rows.
void blur_columns(const GaussianKernel& kernel,
                  const float* const* rows,
                  int width,
                  const std::array<float*, kRowsAtOnce>& out);

/// Horizontal pass over a row with `radius` valid pixels before its begin and behind its end:
/// blurred = kernel * row and, when asked for, difference = blurred - finer. `finer` and
/// `difference` may be null.
void blur_row(const GaussianKernel& kernel,
              const float* row,
              int width,
              float* blurred,
              const float* finer,
              float* difference);

/// Stores grey values as fixed point with 8 fractional bits: out = round(256 * row).
void quantise_row(const float* row, int width, std::uint16_t* out);

/// Three rows (y - 1, y, y + 1) of three adjacent difference-of-Gaussian layers (finer, centre,
/// coarser).
using Neighbourhood = std::array<std::array<const float*, 3>, 3>;

/// Appends the x in [begin, end) whose centre value exceeds `threshold` in magnitude and is the
/// largest or the smallest of its 26 neighbours. Of equal neighbours exactly one is taken. Columns
/// begin - 1 and end must exist.
void find_extrema(
    const Neighbourhood& rows, float threshold, int begin, int end, std::vector<int>& out);

}  // namespace trigmesh::sift
