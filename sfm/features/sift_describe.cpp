#include "sfm/features/sift_describe.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sfm/features/sift_describe.cpp"
// SVE vectors cannot be kept in arrays; such machines run the NEON code.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// Seen once by all instruction sets: constants and tables.
#ifndef TRIGMESH_SIFT_DESCRIBE_TABLES
#define TRIGMESH_SIFT_DESCRIBE_TABLES

namespace trigmesh::sift {
namespace {

static_assert(std::endian::native == std::endian::little, "pixel pairs are read as 32-bit words");

constexpr float kSpacingSigmas = 0.75F;  ///< distance of grid samples
constexpr int kVectorSlack = 16;         ///< the longest vector, floats

/// A square grid of samples, one row after the other, centred on the keypoint; the outermost
/// samples serve only for differences.
template <int kGridSide>
struct Grid {
  static constexpr int kSide = kGridSide;
  static constexpr int kSize = kSide * kSide;
  static constexpr int kStorage = kSize + 2 * kSide + kVectorSlack;
  using Array = std::array<float, static_cast<std::size_t>(kStorage)>;

  alignas(64) Array column{};
  alignas(64) Array row{};

  constexpr Grid() {
    for (int i = 0; i < kSize; ++i) {
      column[static_cast<std::size_t>(i)] = static_cast<float>(i % kSide) - 0.5F * (kSide - 1);
      row[static_cast<std::size_t>(i)] = static_cast<float>(i / kSide) - 0.5F * (kSide - 1);
    }
  }
};

// Descriptor: 4 cells of 3 sigma = 4 samples; bilinear weights reach half a cell further on either
// side.
constexpr int kCells = 4;
constexpr int kSamplesPerCell = 4;
constexpr int kBins = 8;
constexpr int kWindow = (kCells + 1) * kSamplesPerCell;
using DescriptorGrid = Grid<kWindow + 2>;
constexpr float kMaxEntry = 0.2F;
constexpr float kByteScale = 256.0F;
constexpr float kMaxByte = 127.0F;

// Orientation: a window of 1.5 sigma cut off at 4.5 sigma.
constexpr int kOrientationBins = 36;
constexpr int kOrientationRadius = 6;
using OrientationGrid = Grid<2 * kOrientationRadius + 3>;
constexpr float kOrientationWindowSigmas = 1.5F;
constexpr float kPeakRatio = 0.8F;

constexpr DescriptorGrid kDescriptorGrid;
constexpr OrientationGrid kOrientationGrid;

/// The share of a direction, in kDirections steps of the circle, that each of the 8 bins receives
/// (linear between bins).
constexpr int kDirections = 256;

struct alignas(64) DirectionShares {
  std::array<std::array<float, kBins>, kDirections> share{};

  constexpr DirectionShares() {
    constexpr int kStep = kDirections / kBins;
    for (int i = 0; i < kDirections; ++i) {
      const float part = static_cast<float>(i % kStep) / kStep;
      auto& row = share[static_cast<std::size_t>(i)];
      row[static_cast<std::size_t>(i / kStep)] = 1.0F - part;
      row[static_cast<std::size_t>((i / kStep + 1) % kBins)] = part;
    }
  }
};

constexpr DirectionShares kShares;

/// Weights of the samples along one axis: Gaussian window of half the descriptor's width times the
/// linear share of the cell before (`lower`) and behind (`upper`) the sample.
struct AxisWeights {
  std::array<float, kWindow> lower{};
  std::array<float, kWindow> upper{};

  AxisWeights() {
    for (int i = 0; i < kWindow; ++i) {
      const float offset = (static_cast<float>(i) - 0.5F * (kWindow - 1)) / kSamplesPerCell;
      const float window = std::exp(-0.5F * offset * offset / (0.25F * kCells * kCells));
      const float part = (static_cast<float>(i % kSamplesPerCell) + 0.5F) / kSamplesPerCell;
      lower[static_cast<std::size_t>(i)] = (1.0F - part) * window;
      upper[static_cast<std::size_t>(i)] = part * window;
    }
  }
};

const AxisWeights& axis_weights() {
  static const AxisWeights weights;
  return weights;
}

/// Gaussian window of the orientation histogram on the grid, zero outside the circle.
const OrientationGrid::Array& orientation_window() {
  static const OrientationGrid::Array window = [] {
    OrientationGrid::Array made{};
    for (int i = 0; i < OrientationGrid::kSize; ++i) {
      const auto index = static_cast<std::size_t>(i);
      const float u = kOrientationGrid.column[index];
      const float v = kOrientationGrid.row[index];
      const float squared = u * u + v * v;
      const float radius = kOrientationRadius + 0.5F;
      const float sigma = kOrientationWindowSigmas / kSpacingSigmas;
      made[index] = squared < radius * radius ? std::exp(-0.5F * squared / (sigma * sigma)) : 0.0F;
    }
    return made;
  }();
  return window;
}

}  // namespace
}  // namespace trigmesh::sift
#endif  // TRIGMESH_SIFT_DESCRIBE_TABLES

HWY_BEFORE_NAMESPACE();

namespace trigmesh::sift::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using FloatTag = hn::CappedTag<float, kVectorSlack>;
using IntTag = hn::RebindToSigned<FloatTag>;
using V = hn::Vec<FloatTag>;
constexpr FloatTag kFloat;
constexpr IntTag kInt;

/// Where a grid lies in a level: sample (column u, row v) is at origin + u * (ux, uy) + v * (-uy,
/// ux).
struct Placement {
  float x = 0.0F;
  float y = 0.0F;
  float ux = 0.0F;
  float uy = 0.0F;
};

/// Bilinear samples of the level (as fixed-point numbers) on the whole grid. Places outside take
/// the border's value.
template <class GridType>
HWY_INLINE void SampleGrid(const LevelView& level,
                           const Placement& at,
                           const GridType& grid,
                           float* HWY_RESTRICT out) {
  const V ux = hn::Set(kFloat, at.ux), uy = hn::Set(kFloat, at.uy);
  const V x0 = hn::Set(kFloat, at.x), y0 = hn::Set(kFloat, at.y);
  const V zero = hn::Zero(kFloat);
  // Just below the last pixel, so that its right and lower neighbour exist.
  const V x_max = hn::Set(kFloat, static_cast<float>(level.width - 1) - 1.0F / 256.0F);
  const V y_max = hn::Set(kFloat, static_cast<float>(level.height - 1) - 1.0F / 256.0F);
  const auto stride = hn::Set(kInt, static_cast<std::int32_t>(level.stride));
  const auto low_half = hn::Set(kInt, 0xFFFF);
  const auto* upper = reinterpret_cast<const std::int32_t*>(level.pixels);
  const auto* lower = reinterpret_cast<const std::int32_t*>(level.pixels + level.stride);
  const int lanes = static_cast<int>(hn::Lanes(kFloat));
  for (int i = 0; i < GridType::kSize; i += lanes) {
    const V u = hn::Load(kFloat, grid.column.data() + i);
    const V v = hn::Load(kFloat, grid.row.data() + i);
    const V x = hn::Min(hn::Max(hn::NegMulAdd(v, uy, hn::MulAdd(u, ux, x0)), zero), x_max);
    const V y = hn::Min(hn::Max(hn::MulAdd(v, ux, hn::MulAdd(u, uy, y0)), zero), y_max);
    const auto column = hn::ConvertTo(kInt, x);
    const auto row = hn::ConvertTo(kInt, y);
    const V fx = hn::Sub(x, hn::ConvertTo(kFloat, column));
    const V fy = hn::Sub(y, hn::ConvertTo(kFloat, row));
    // Two neighbouring 16-bit pixels come with one 32-bit read.
    const auto pixel = hn::Add(hn::Mul(row, stride), column);
    const auto offset = hn::Add(pixel, pixel);
    const auto top = hn::GatherOffset(kInt, upper, offset);
    const auto bottom = hn::GatherOffset(kInt, lower, offset);
    const V a = hn::ConvertTo(kFloat, hn::And(top, low_half));
    const V b = hn::ConvertTo(kFloat, hn::And(hn::ShiftRight<16>(top), low_half));
    const V c = hn::ConvertTo(kFloat, hn::And(bottom, low_half));
    const V e = hn::ConvertTo(kFloat, hn::And(hn::ShiftRight<16>(bottom), low_half));
    const V ab = hn::MulAdd(fx, hn::Sub(b, a), a);
    const V ce = hn::MulAdd(fx, hn::Sub(e, c), c);
    hn::StoreU(hn::MulAdd(fy, hn::Sub(ce, ab), ab), kFloat, out + i);
  }
}

/// Direction of (x, y) in turns, [-0.5, 0.5]; 0 for (0, 0). The arctangent on [0, 1] is Abramowitz
/// and Stegun 4.4.49, whose error is below 1e-5 rad.
HWY_INLINE V DirectionInTurns(V x, V y) {
  const V ax = hn::Abs(x);
  const V ay = hn::Abs(y);
  const V tiny = hn::Set(kFloat, 1e-20F);
  const V t = hn::Div(hn::Min(ax, ay), hn::Max(hn::Max(ax, ay), tiny));
  const V t2 = hn::Mul(t, t);
  constexpr float kTurn = 0.5F / std::numbers::pi_v<float>;
  V p = hn::Set(kFloat, 0.0208351F * kTurn);
  p = hn::MulAdd(p, t2, hn::Set(kFloat, -0.0851330F * kTurn));
  p = hn::MulAdd(p, t2, hn::Set(kFloat, 0.1801410F * kTurn));
  p = hn::MulAdd(p, t2, hn::Set(kFloat, -0.3302995F * kTurn));
  p = hn::MulAdd(p, t2, hn::Set(kFloat, 0.9998660F * kTurn));
  V turn = hn::Mul(p, t);
  turn = hn::IfThenElse(hn::Gt(ay, ax), hn::Sub(hn::Set(kFloat, 0.25F), turn), turn);
  turn = hn::IfThenElse(hn::Lt(x, hn::Zero(kFloat)), hn::Sub(hn::Set(kFloat, 0.5F), turn), turn);
  return hn::CopySign(turn, y);
}

/// Magnitude and direction (in `steps` per turn) at every inner sample of the grid; entries at the
/// border columns are meaningless.
template <class GridType>
HWY_INLINE void Gradients(const float* HWY_RESTRICT samples,
                          float steps,
                          float* HWY_RESTRICT magnitude,
                          float* HWY_RESTRICT direction) {
  constexpr int kSide = GridType::kSide;
  const int lanes = static_cast<int>(hn::Lanes(kFloat));
  const V per_turn = hn::Set(kFloat, steps);
  for (int i = kSide; i < kSide * (kSide - 1); i += lanes) {
    const V dx = hn::Sub(hn::LoadU(kFloat, samples + i + 1), hn::LoadU(kFloat, samples + i - 1));
    const V dy =
        hn::Sub(hn::LoadU(kFloat, samples + i + kSide), hn::LoadU(kFloat, samples + i - kSide));
    hn::StoreU(hn::Sqrt(hn::MulAdd(dx, dx, hn::Mul(dy, dy))), kFloat, magnitude + i);
    hn::StoreU(hn::Mul(per_turn, DirectionInTurns(dx, dy)), kFloat, direction + i);
  }
}

/// The histogram of directions, linear between bins; bin i is the direction i / kOrientationBins
/// turns.
void OrientationHistogram(const LevelView& level, const PatchCentre& centre, float* histogram) {
  using GridType = OrientationGrid;
  constexpr int kSide = GridType::kSide;
  alignas(64) float samples[GridType::kStorage] = {};
  alignas(64) float magnitude[GridType::kStorage];
  alignas(64) float direction[GridType::kStorage];
  const float step = kSpacingSigmas * centre.sigma_px;
  SampleGrid(level,
             {.x = centre.x_px, .y = centre.y_px, .ux = step, .uy = 0.0F},
             kOrientationGrid,
             samples);
  Gradients<GridType>(samples, kOrientationBins, magnitude, direction);
  const auto& window = orientation_window();
  float bins[2 * kOrientationBins] = {};  // directions are in [-18, 18]: shifted by one turn
  for (int row = 1; row < kSide - 1; ++row) {
    for (int i = row * kSide + 1; i < row * kSide + kSide - 1; ++i) {
      const float position = direction[i] + kOrientationBins;
      const int bin = static_cast<int>(position);
      const float part = position - static_cast<float>(bin);
      const float weight = magnitude[i] * window[static_cast<std::size_t>(i)];
      bins[bin] += weight * (1.0F - part);
      bins[bin + 1] += weight * part;
    }
  }
  for (int i = 0; i < kOrientationBins; ++i) {
    histogram[i] = bins[i] + bins[i + kOrientationBins];
  }
}

/// The 16 x 8 histogram before normalisation, cell rows first.
void DescriptorHistogram(const LevelView& level,
                         const PatchCentre& centre,
                         float angle_rad,
                         float* histogram) {
  using GridType = DescriptorGrid;
  constexpr int kSide = GridType::kSide;
  alignas(64) float samples[GridType::kStorage] = {};
  alignas(64) float magnitude[GridType::kStorage];
  alignas(64) float direction[GridType::kStorage];
  const float step = kSpacingSigmas * centre.sigma_px;
  SampleGrid(level,
             {.x = centre.x_px,
              .y = centre.y_px,
              .ux = step * std::cos(angle_rad),
              .uy = step * std::sin(angle_rad)},
             kDescriptorGrid,
             samples);
  Gradients<GridType>(samples, kDirections, magnitude, direction);
  alignas(64) std::int32_t nearest[GridType::kStorage];
  const int lanes = static_cast<int>(hn::Lanes(kFloat));
  for (int i = kSide; i < kSide * (kSide - 1); i += lanes) {
    const auto turn = hn::NearestInt(hn::LoadU(kFloat, direction + i));
    hn::StoreU(hn::And(turn, hn::Set(kInt, kDirections - 1)), kInt, nearest + i);
  }

  // One vector (or two on 128-bit machines) holds the 8 bins of a cell.
  const hn::CappedTag<float, kBins> d;
  constexpr int kParts = kBins / hn::MaxLanes(d);
  constexpr int kLanes = kBins / kParts;
  using B = hn::Vec<decltype(d)>;
  const AxisWeights& weights = axis_weights();
  std::fill_n(histogram, kDescriptorLength, 0.0F);
  for (int part = 0; part < kParts; ++part) {
    float* cells = histogram + part * kLanes;
    const float* shares = kShares.share[0].data() + part * kLanes;
    for (int row = 0; row < kWindow; ++row) {
      const int first = (row + 1) * kSide + 1;
      // Samples of group g lie between cells g - 1 and g.
      B lower[kCells + 1], upper[kCells + 1];
      for (int group = 0; group <= kCells; ++group) {
        B to_lower = hn::Zero(d), to_upper = hn::Zero(d);
        for (int i = group * kSamplesPerCell; i < (group + 1) * kSamplesPerCell; ++i) {
          const float* share = shares + nearest[first + i] * kBins;
          const B entry = hn::Mul(hn::Set(d, magnitude[first + i]), hn::LoadU(d, share));
          const auto index = static_cast<std::size_t>(i);
          to_lower = hn::MulAdd(hn::Set(d, weights.lower[index]), entry, to_lower);
          to_upper = hn::MulAdd(hn::Set(d, weights.upper[index]), entry, to_upper);
        }
        lower[group] = to_lower;
        upper[group] = to_upper;
      }
      const int row_group = row / kSamplesPerCell;
      const B row_lower = hn::Set(d, weights.lower[static_cast<std::size_t>(row)]);
      const B row_upper = hn::Set(d, weights.upper[static_cast<std::size_t>(row)]);
      for (int cell = 0; cell < kCells; ++cell) {
        const B sum = hn::Add(upper[cell], lower[cell + 1]);
        if (row_group > 0) {
          float* out = cells + ((row_group - 1) * kCells + cell) * kBins;
          hn::StoreU(hn::MulAdd(row_lower, sum, hn::LoadU(d, out)), d, out);
        }
        if (row_group < kCells) {
          float* out = cells + (row_group * kCells + cell) * kBins;
          hn::StoreU(hn::MulAdd(row_upper, sum, hn::LoadU(d, out)), d, out);
        }
      }
    }
  }
}

}  // namespace
}  // namespace trigmesh::sift::HWY_NAMESPACE

HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trigmesh::sift {
namespace {

HWY_EXPORT(OrientationHistogram);
HWY_EXPORT(DescriptorHistogram);

using Histogram = std::array<float, kOrientationBins>;

/// Circular convolution with (1, 4, 6, 4, 1) / 16.
Histogram smooth(const Histogram& raw) {
  Histogram out{};
  const auto at = [&](int i) {
    return raw[static_cast<std::size_t>((i + kOrientationBins) % kOrientationBins)];
  };
  for (int i = 0; i < kOrientationBins; ++i) {
    out[static_cast<std::size_t>(i)] = (at(i - 2) + at(i + 2)) * (1.0F / 16.0F) +
                                       (at(i - 1) + at(i + 1)) * (4.0F / 16.0F) +
                                       at(i) * (6.0F / 16.0F);
  }
  return out;
}

struct Peak {
  float height = 0.0F;
  float bin = 0.0F;
};

}  // namespace

Orientations find_orientations(const LevelView& level, const PatchCentre& centre) {
  Histogram raw{};
  HWY_DYNAMIC_DISPATCH(OrientationHistogram)(level, centre, raw.data());
  const Histogram histogram = smooth(raw);
  const float highest = *std::max_element(histogram.begin(), histogram.end());
  Orientations found;
  if (highest <= 0.0F) {
    return found;
  }
  std::array<Peak, kOrientationBins> peaks{};
  std::size_t count = 0;
  for (int i = 0; i < kOrientationBins; ++i) {
    const auto at = [&](int k) {
      return histogram[static_cast<std::size_t>((k + kOrientationBins) % kOrientationBins)];
    };
    const float before = at(i - 1), here = at(i), behind = at(i + 1);
    if (here >= kPeakRatio * highest && here > before && here >= behind) {
      const float shift = 0.5F * (before - behind) / (before - 2.0F * here + behind);
      peaks[count++] = {.height = here, .bin = static_cast<float>(i) + shift};
    }
  }
  const auto end = peaks.begin() + static_cast<std::ptrdiff_t>(count);
  std::stable_sort(
      peaks.begin(), end, [](const Peak& a, const Peak& b) { return a.height > b.height; });
  for (std::size_t i = 0; i < std::min<std::size_t>(count, kMaxOrientations); ++i) {
    constexpr float kBinAngle = 2.0F * std::numbers::pi_v<float> / kOrientationBins;
    float angle = kBinAngle * peaks[i].bin;
    if (angle > std::numbers::pi_v<float>) {
      angle -= 2.0F * std::numbers::pi_v<float>;
    }
    found.angle_rad[i] = angle;
    ++found.count;
  }
  return found;
}

void describe(const LevelView& level,
              const PatchCentre& centre,
              float angle_rad,
              std::span<std::uint8_t, kDescriptorLength> out) {
  alignas(64) std::array<float, kDescriptorLength> histogram;
  HWY_DYNAMIC_DISPATCH(DescriptorHistogram)(level, centre, angle_rad, histogram.data());
  float squares = 0.0F;
  for (const float entry : histogram) {
    squares += entry * entry;
  }
  const float limit = kMaxEntry * std::sqrt(squares);
  float sum = 0.0F;
  for (float& entry : histogram) {
    entry = std::min(entry, limit);
    sum += entry;
  }
  const float scale = sum > 0.0F ? kByteScale * kByteScale / sum : 0.0F;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const float root = std::sqrt(scale * histogram[i]);
    out[i] = static_cast<std::uint8_t>(std::min(kMaxByte, root + 0.5F));
  }
}

}  // namespace trigmesh::sift
#endif  // HWY_ONCE
