// SURF orientation and descriptor: H. Bay, A. Ess, T. Tuytelaars, L. Van Gool, "Speeded-Up Robust
// Features (SURF)", Computer Vision and Image Understanding 110(3), 2008, section 4. Lengths are in
// units of s, the scale of the keypoint.
//
//   orientation: Haar wavelets of side 4s at a grid of step s within radius 6s, weighted by a
//   Gaussian of 2s; the longest sum
//                of the response vectors within a sliding window of 60 degrees.
//   descriptor:  Haar wavelets of side 2s at 20x20 samples of step s, weighted by a Gaussian
//   of 3.3s.
//
// Both use real-valued positions and sizes. Wavelets of side 2s on a grid of step s have all their
// corners on a grid of step s: the 20x20 samples need the means of 21x21 cells of side s. When the
// descriptor is turned, the cells' centres turn; the cells stay upright, as every box of an
// integral image must.
#include "sfm/features/surf_descriptor.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trigmesh {
namespace {

constexpr int kSamples = 20;               ///< Haar samples along one side of the descriptor window
constexpr int kCells = kSamples + 1;       ///< cells along one side
constexpr int kSubregions = 4;             ///< along one side
constexpr int kSubregionSamples = 5;       ///< along one side of a subregion
constexpr float kDescriptorSigma = 3.3F;   ///< in units of s
constexpr int kOrientationRadius = 6;      ///< in units of s
constexpr float kOrientationSigma = 2.0F;  ///< in units of s (paper: 2s)
constexpr int kDirectionBins =
    72;  ///< 5 degrees each; finer than any window step the result could notice
constexpr int kWindowBins = kDirectionBins / 6;
constexpr float kUnitLengthInBytes = 256.0F;
constexpr float kLargestByte = 127.0F;
/// Grey levels; a neighbourhood whose summed responses stay below rounding noise has no direction
/// and no descriptor.
constexpr float kFlat = 1e-2F;

using CellMeans = std::array<std::array<float, kCells>, kCells>;
using SampleRow = std::array<float, kSamples>;

struct Vector2 {
  float x = 0.0F;
  float y = 0.0F;
};

template <std::size_t N>
std::array<float, N> gaussian_weights(float first_position, float sigma) {
  std::array<float, N> weights{};
  for (std::size_t i = 0; i < N; ++i) {
    const float t = (first_position + static_cast<float>(i)) / sigma;
    weights[i] = std::exp(-0.5F * t * t);
  }
  return weights;
}

/// Means of the upright cells from one regular grid of table look-ups; false when the window leaves
/// the image.
bool upright_cells(const IntegralImage& integral, const Keypoint& keypoint, CellMeans& cells) {
  constexpr int kLines = kCells + 1;
  const float s = keypoint.scale_px;
  const float half_window = 0.5F * static_cast<float>(kCells) * s;
  std::array<float, kLines * kLines> sums;
  if (!integral.grid_sums(
          keypoint.x_px - half_window, keypoint.y_px - half_window, s, kLines, sums)) {
    return false;
  }
  const float to_mean = 1.0F / (s * s);
  for (std::size_t i = 0; i < kCells; ++i) {
    const float* above = sums.data() + i * kLines;
    const float* below = above + kLines;
    for (std::size_t j = 0; j < kCells; ++j) {
      cells[i][j] = to_mean * ((below[j + 1] - below[j]) - (above[j + 1] - above[j]));
    }
  }
  return true;
}

void turned_cells(const IntegralImage& integral, const Keypoint& keypoint, CellMeans& cells) {
  const float s = keypoint.scale_px;
  const float cosine = s * std::cos(keypoint.angle_rad);
  const float sine = s * std::sin(keypoint.angle_rad);
  constexpr float kCenter = 0.5F * static_cast<float>(kCells - 1);
  for (std::size_t i = 0; i < kCells; ++i) {
    const float v = static_cast<float>(i) - kCenter;
    for (std::size_t j = 0; j < kCells; ++j) {
      const float u = static_cast<float>(j) - kCenter;
      cells[i][j] = integral.square_mean(
          keypoint.x_px + u * cosine - v * sine, keypoint.y_px + u * sine + v * cosine, s);
    }
  }
}

/// Positive and negative parts of dx and dy, summed over the rows of a subregion, one value a
/// sample column.
struct ColumnSums {
  SampleRow dx_positive{};
  SampleRow dx_negative{};
  SampleRow dy_positive{};
  SampleRow dy_negative{};

  void add_row(const std::array<float, kCells>& above,
               const std::array<float, kCells>& below,
               float row_weight,
               const SampleRow& weights) {
    for (std::size_t j = 0; j < kSamples; ++j) {
      const float weight = row_weight * weights[j];
      const float dx = weight * ((above[j + 1] + below[j + 1]) - (above[j] + below[j]));
      const float dy = weight * ((below[j] + below[j + 1]) - (above[j] + above[j + 1]));
      dx_positive[j] += std::max(dx, 0.0F);
      dx_negative[j] += std::max(-dx, 0.0F);
      dy_positive[j] += std::max(dy, 0.0F);
      dy_negative[j] += std::max(-dy, 0.0F);
    }
  }
};

float subregion_sum(const SampleRow& row, std::size_t subregion) {
  float sum = 0.0F;
  for (std::size_t j = 0; j < kSubregionSamples; ++j) {
    sum += row[subregion * kSubregionSamples + j];
  }
  return sum;
}

/// Haar responses around the keypoint, gathered by direction.
using DirectionBins = std::array<Vector2, kDirectionBins>;

/// Fraction of a turn, [0, 1), by a polynomial for the arctangent (largest error 0.3 degrees: only
/// a bin is wanted).
float turn_fraction(Vector2 v) {
  const float ax = std::abs(v.x);
  const float ay = std::abs(v.y);
  const float ratio = std::min(ax, ay) / std::max(std::max(ax, ay), 1e-20F);
  const float octant = ratio * (0.125F + 0.0435F * (1.0F - ratio));
  const float quadrant = ay > ax ? 0.25F - octant : octant;
  const float half = v.x < 0.0F ? 0.5F - quadrant : quadrant;
  return v.y < 0.0F ? 1.0F - half : half;
}

/// Means of the squares of side 2s that the wavelets of the orientation are made of; [i][j] is
/// centred at (j - kPatchReach, i - kPatchReach) s.
constexpr int kPatchReach = kOrientationRadius + 1;
constexpr int kPatches = 2 * kPatchReach + 1;
using PatchMeans = std::array<std::array<float, kPatches>, kPatches>;

PatchMeans patches_around(const IntegralImage& integral, const Keypoint& keypoint) {
  constexpr std::size_t kLines = kPatches + 2;
  const float s = keypoint.scale_px;
  const float reach_px = static_cast<float>(kPatchReach + 1) * s;
  PatchMeans patches;
  std::array<float, kLines * kLines> sums;
  if (integral.grid_sums(keypoint.x_px - reach_px, keypoint.y_px - reach_px, s, kLines, sums)) {
    const float to_mean = 1.0F / (4.0F * s * s);
    for (std::size_t i = 0; i < kPatches; ++i) {
      const float* above = sums.data() + i * kLines;
      const float* below = above + 2 * kLines;
      for (std::size_t j = 0; j < kPatches; ++j) {
        patches[i][j] = to_mean * ((below[j + 2] - below[j]) - (above[j + 2] - above[j]));
      }
    }
    return patches;
  }
  for (std::size_t i = 0; i < kPatches; ++i) {
    for (std::size_t j = 0; j < kPatches; ++j) {
      patches[i][j] = integral.square_mean(
          keypoint.x_px + s * (static_cast<float>(j) - static_cast<float>(kPatchReach)),
          keypoint.y_px + s * (static_cast<float>(i) - static_cast<float>(kPatchReach)),
          2.0F * s);
    }
  }
  return patches;
}

DirectionBins directions_around(const IntegralImage& integral, const Keypoint& keypoint) {
  constexpr std::size_t kAcross = 2 * kOrientationRadius + 1;
  static const auto kWeights = gaussian_weights<kAcross>(-kOrientationRadius, kOrientationSigma);
  const PatchMeans patches = patches_around(integral, keypoint);
  DirectionBins bins{};
  for (std::size_t i = 0; i < kAcross; ++i) {
    for (std::size_t j = 0; j < kAcross; ++j) {
      const int row = static_cast<int>(i) - kOrientationRadius;
      const int column = static_cast<int>(j) - kOrientationRadius;
      if (row * row + column * column > kOrientationRadius * kOrientationRadius) {
        continue;
      }
      // The four squares of the wavelet of side 4s around sample (i, j); patch index i + 1 is
      // centred on the sample.
      const float nw = patches[i][j];
      const float ne = patches[i][j + 2];
      const float sw = patches[i + 2][j];
      const float se = patches[i + 2][j + 2];
      const float weight = kWeights[i] * kWeights[j];
      const Vector2 response{.x = weight * ((ne + se) - (nw + sw)),
                             .y = weight * ((sw + se) - (nw + ne))};
      const int bin =
          static_cast<int>(turn_fraction(response) * static_cast<float>(kDirectionBins));
      Vector2& sum = bins[static_cast<std::size_t>(std::clamp(bin, 0, kDirectionBins - 1))];
      sum.x += response.x;
      sum.y += response.y;
    }
  }
  return bins;
}

}  // namespace

float surf_orientation(const IntegralImage& integral, const Keypoint& keypoint) {
  const DirectionBins bins = directions_around(integral, keypoint);
  Vector2 best;
  float best_length = kFlat * kFlat;
  for (std::size_t first = 0; first < kDirectionBins; ++first) {
    Vector2 sum;
    for (std::size_t k = 0; k < kWindowBins; ++k) {
      const Vector2& bin = bins[(first + k) % kDirectionBins];
      sum.x += bin.x;
      sum.y += bin.y;
    }
    const float length = sum.x * sum.x + sum.y * sum.y;
    if (length > best_length) {
      best_length = length;
      best = sum;
    }
  }
  return best_length > kFlat * kFlat ? std::atan2(best.y, best.x) : 0.0F;
}

SurfVector surf_descriptor(const IntegralImage& integral, const Keypoint& keypoint) {
  static const auto kWeights =
      gaussian_weights<kSamples>(-0.5F * static_cast<float>(kSamples - 1), kDescriptorSigma);
  CellMeans cells;
  if (keypoint.angle_rad != 0.0F || !upright_cells(integral, keypoint, cells)) {
    turned_cells(integral, keypoint, cells);
  }
  SurfVector descriptor{};
  float squared = 0.0F;
  for (std::size_t row = 0; row < kSubregions; ++row) {
    ColumnSums sums;
    for (std::size_t k = 0; k < kSubregionSamples; ++k) {
      const std::size_t i = row * kSubregionSamples + k;
      sums.add_row(cells[i], cells[i + 1], kWeights[i], kWeights);
    }
    for (std::size_t column = 0; column < kSubregions; ++column) {
      float* out = descriptor.data() + 4 * (row * kSubregions + column);
      out[0] = subregion_sum(sums.dx_positive, column);
      out[1] = subregion_sum(sums.dx_negative, column);
      out[2] = subregion_sum(sums.dy_positive, column);
      out[3] = subregion_sum(sums.dy_negative, column);
      squared += out[0] * out[0] + out[1] * out[1] + out[2] * out[2] + out[3] * out[3];
    }
  }
  if (squared <= kFlat * kFlat) {
    return {};
  }
  const float to_unit = 1.0F / std::sqrt(squared);
  std::transform(descriptor.begin(), descriptor.end(), descriptor.begin(), [&](float v) {
    return v * to_unit;
  });
  return descriptor;
}

void quantize_surf(const SurfVector& descriptor,
                   std::span<std::uint8_t, kSurfDescriptorLength> bytes) {
  // Components that would exceed the largest byte are cut, and the others grow until the length is
  // right again. That can push further ones over the limit: at most four fit (5 * 127^2 > 256^2),
  // so five rounds always end.
  float scale = kUnitLengthInBytes;
  for (int round = 0; round < 5; ++round) {
    float free_squared = 0.0F;
    float length_squared_left = kUnitLengthInBytes * kUnitLengthInBytes;
    for (const float v : descriptor) {
      const bool cut = v * scale > kLargestByte;
      free_squared += cut ? 0.0F : v * v;
      length_squared_left -= cut ? kLargestByte * kLargestByte : 0.0F;
    }
    if (free_squared <= 0.0F || length_squared_left <= 0.0F) {
      break;
    }
    scale = std::max(scale, std::sqrt(length_squared_left / free_squared));
  }
  std::transform(descriptor.begin(), descriptor.end(), bytes.begin(), [&](float v) {
    return static_cast<std::uint8_t>(std::lround(std::min(kLargestByte, v * scale)));
  });
}

}  // namespace trigmesh
