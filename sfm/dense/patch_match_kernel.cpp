// Bilaterally weighted normalised cross-correlation of a patch seen through a plane,
//
//   NCC = sum w (r - r') (s - s') / sqrt((sum w (r - r')^2 + n) (sum w (s - s')^2 + n)),  sum w =
//   1,
//
// r and s grey values of the reference and of the source at the plane's homography (bilinear), r'
// and s' weighted means, n the variance of noise. As in J. Schoenberger et al., "Pixelwise view
// selection for unstructured multi-view stereo", ECCV 2016, section 4.3 (without n).
#include "sfm/dense/patch_match_kernel.hpp"

#include <algorithm>
#include <cmath>

#include "firmware/base/check.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sfm/dense/patch_match_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef TRIGMESH_PATCH_MATCH_CONSTANTS
#define TRIGMESH_PATCH_MATCH_CONSTANTS

namespace trigmesh {
namespace {
/// Variance of sensor noise and compression, grey levels squared.
constexpr float kNoiseVariance = 1.0F;
/// Depth in the source over depth in the reference below which a plane is behind the source.
constexpr float kMinDepthRatio = 1e-3F;
}  // namespace
}  // namespace trigmesh
#endif

HWY_BEFORE_NAMESPACE();

namespace trigmesh::HWY_NAMESPACE {
namespace {
namespace hn = hwy::HWY_NAMESPACE;

/// The homography of one hypothesis: source = base + column_x dx + column_y dy.
struct Homography {
  std::array<float, 3> base;
  std::array<float, 3> column_x;
  std::array<float, 3> column_y;
};

HWY_INLINE Homography homography_of(const SourceProjection& source, const PlaneHypothesis& plane) {
  Homography h;
  for (std::size_t k = 0; k < 3; ++k) {
    h.base[k] = source.base[k] + source.epipole[k] * plane.inverse_depth;
    h.column_x[k] = source.column_x[k] + source.epipole[k] * plane.slope_x;
    h.column_y[k] = source.column_y[k] + source.epipole[k] * plane.slope_y;
  }
  return h;
}

HWY_INLINE bool sees_center(const SourceProjection& source, const Homography& h) {
  const float z = h.base[2];
  return z > kMinDepthRatio && h.base[0] >= 0.0F && h.base[0] <= source.max_x_px * z &&
         h.base[1] >= 0.0F && h.base[1] <= source.max_y_px * z;
}

/// Bilinear grey values at (x, y), both inside the picture.
template <class D, class V>
HWY_INLINE V sample_grey(D df, const SourceProjection& source, V x, V y) {
  const hn::RebindToSigned<D> di;
  const hn::RebindToUnsigned<D> du;
  const auto column = hn::Floor(x);
  const auto row = hn::Floor(y);
  const auto fraction_x = hn::Sub(x, column);
  const auto fraction_y = hn::Sub(y, row);
  const auto stride = hn::Set(df, static_cast<float>(source.stride));
  const auto index = hn::ConvertTo(di, hn::MulAdd(row, stride, column));  // exact: below 2^24
  const auto quad = hn::GatherIndex(du, source.quads, index);
  const auto low_byte = hn::Set(du, 255U);
  const auto grey = [&](auto bits) HWY_ATTR { return hn::ConvertTo(df, hn::BitCast(di, bits)); };
  const auto top_left = grey(hn::And(quad, low_byte));
  const auto top_right = grey(hn::And(hn::ShiftRight<8>(quad), low_byte));
  const auto bottom_left = grey(hn::And(hn::ShiftRight<16>(quad), low_byte));
  const auto bottom_right = grey(hn::ShiftRight<24>(quad));
  const auto top = hn::MulAdd(fraction_x, hn::Sub(top_right, top_left), top_left);
  const auto bottom = hn::MulAdd(fraction_x, hn::Sub(bottom_right, bottom_left), bottom_left);
  return hn::MulAdd(fraction_y, hn::Sub(bottom, top), top);
}

HWY_INLINE float match_cost(const ReferencePatch& patch,
                            const SourceProjection& source,
                            const PlaneHypothesis& plane) {
  const hn::CappedTag<float, 16> d;
  const Homography h = homography_of(source, plane);
  if (!sees_center(source, h)) {
    return kNoMatchCost;
  }
  const auto zero = hn::Zero(d);
  auto sum = zero;
  auto sum_squares = zero;
  auto sum_products = zero;
  for (std::size_t i = 0; i < kPatchSampleCount; i += hn::Lanes(d)) {
    const auto dx = hn::Load(d, patch.offset_x_px.data() + i);
    const auto dy = hn::Load(d, patch.offset_y_px.data() + i);
    const auto row = [&](std::size_t k) HWY_ATTR {
      return hn::MulAdd(hn::Set(d, h.column_x[k]),
                        dx,
                        hn::MulAdd(hn::Set(d, h.column_y[k]), dy, hn::Set(d, h.base[k])));
    };
    const auto inverse_z = hn::Div(hn::Set(d, 1.0F), hn::Max(row(2), hn::Set(d, kMinDepthRatio)));
    const auto x = hn::Min(hn::Max(hn::Mul(row(0), inverse_z), zero), hn::Set(d, source.max_x_px));
    const auto y = hn::Min(hn::Max(hn::Mul(row(1), inverse_z), zero), hn::Set(d, source.max_y_px));
    const auto grey = sample_grey(d, source, x, y);
    const auto weighted = hn::Mul(hn::Load(d, patch.weight.data() + i), grey);
    sum = hn::Add(sum, weighted);
    sum_squares = hn::MulAdd(weighted, grey, sum_squares);
    sum_products = hn::MulAdd(hn::Load(d, patch.weighted_deviation.data() + i), grey, sum_products);
  }
  const float mean = hn::GetLane(hn::SumOfLanes(d, sum));
  const float variance = std::max(hn::GetLane(hn::SumOfLanes(d, sum_squares)) - mean * mean, 0.0F);
  const float covariance = hn::GetLane(hn::SumOfLanes(d, sum_products));
  const float scale = std::sqrt((patch.variance + kNoiseVariance) * (variance + kNoiseVariance));
  return std::clamp(1.0F - covariance / scale, 0.0F, 2.0F);
}

void all_costs(const ReferencePatch& patch,
               std::span<const SourceProjection> sources,
               std::span<const PlaneHypothesis> hypotheses,
               float* costs) {
  for (const PlaneHypothesis& plane : hypotheses) {
    for (const SourceProjection& source : sources) {
      *costs++ = match_cost(patch, source, plane);
    }
  }
}

}  // namespace
}  // namespace trigmesh::HWY_NAMESPACE

HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace trigmesh {
namespace {

HWY_EXPORT(all_costs);

double reference_grey(const SourceProjection& source, double x, double y) {
  const double column = std::floor(x);
  const double row = std::floor(y);
  const std::uint32_t quad = source.quads[static_cast<std::ptrdiff_t>(row) * source.stride +
                                          static_cast<std::ptrdiff_t>(column)];
  const double fx = x - column;
  const double fy = y - row;
  const auto byte = [&](unsigned shift) { return static_cast<double>((quad >> shift) & 255U); };
  return (1.0 - fy) * ((1.0 - fx) * byte(0) + fx * byte(8)) +
         fy * ((1.0 - fx) * byte(16) + fx * byte(24));
}

float reference_cost(const ReferencePatch& patch,
                     const SourceProjection& source,
                     const PlaneHypothesis& plane) {
  const auto project = [&](double dx, double dy, std::size_t k) {
    const double inverse_depth = static_cast<double>(plane.inverse_depth) +
                                 static_cast<double>(plane.slope_x) * dx +
                                 static_cast<double>(plane.slope_y) * dy;
    return static_cast<double>(source.base[k]) + static_cast<double>(source.column_x[k]) * dx +
           static_cast<double>(source.column_y[k]) * dy +
           static_cast<double>(source.epipole[k]) * inverse_depth;
  };
  const double max_x = static_cast<double>(source.max_x_px);
  const double max_y = static_cast<double>(source.max_y_px);
  const double min_z = static_cast<double>(kMinDepthRatio);
  const double z0 = project(0.0, 0.0, 2);
  const double x0 = project(0.0, 0.0, 0) / z0;
  const double y0 = project(0.0, 0.0, 1) / z0;
  if (!(z0 > min_z && x0 >= 0.0 && x0 <= max_x && y0 >= 0.0 && y0 <= max_y)) {
    return kNoMatchCost;
  }
  double mean = 0.0;
  double squares = 0.0;
  double covariance = 0.0;
  for (std::size_t i = 0; i < kPatchSampleCount; ++i) {
    const double dx = static_cast<double>(patch.offset_x_px[i]);
    const double dy = static_cast<double>(patch.offset_y_px[i]);
    const double z = std::max(project(dx, dy, 2), min_z);
    const double grey = reference_grey(source,
                                       std::clamp(project(dx, dy, 0) / z, 0.0, max_x),
                                       std::clamp(project(dx, dy, 1) / z, 0.0, max_y));
    mean += static_cast<double>(patch.weight[i]) * grey;
    squares += static_cast<double>(patch.weight[i]) * grey * grey;
    covariance += static_cast<double>(patch.weighted_deviation[i]) * grey;
  }
  const double noise = static_cast<double>(kNoiseVariance);
  const double variance = std::max(squares - mean * mean, 0.0);
  const double scale =
      std::sqrt((static_cast<double>(patch.variance) + noise) * (variance + noise));
  return static_cast<float>(std::clamp(1.0 - covariance / scale, 0.0, 2.0));
}

}  // namespace

void match_costs(const ReferencePatch& patch,
                 std::span<const SourceProjection> sources,
                 std::span<const PlaneHypothesis> hypotheses,
                 std::span<float> costs) {
  TM_CHECK(costs.size() >= sources.size() * hypotheses.size());
  HWY_DYNAMIC_DISPATCH(all_costs)(patch, sources, hypotheses, costs.data());
}

void match_costs_reference(const ReferencePatch& patch,
                           std::span<const SourceProjection> sources,
                           std::span<const PlaneHypothesis> hypotheses,
                           std::span<float> costs) {
  TM_CHECK(costs.size() >= sources.size() * hypotheses.size());
  std::size_t at = 0;
  for (const PlaneHypothesis& plane : hypotheses) {
    for (const SourceProjection& source : sources) {
      costs[at++] = reference_cost(patch, source, plane);
    }
  }
}

}  // namespace trigmesh

#endif  // HWY_ONCE
