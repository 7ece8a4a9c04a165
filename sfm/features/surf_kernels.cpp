#include "sfm/features/surf_kernels.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sfm/features/surf_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();

namespace trigmesh::HWY_NAMESPACE {
namespace {
namespace hn = hwy::HWY_NAMESPACE;

/// whole - 3 * middle: the lobes 1, -2, 1 of a second-derivative box filter.
template <class V>
HWY_INLINE V second_difference(V whole, V middle) {
  return hn::Sub(hn::Sub(hn::Sub(whole, middle), middle), middle);
}

void vertical_strips(const SurfTableRows& rows, std::size_t count, const SurfStrips& strips) {
  const hn::ScalableTag<std::uint32_t> d;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const auto at = [&](const std::uint32_t* row) HWY_ATTR { return hn::LoadU(d, row + i); };
    hn::StoreU(hn::Sub(at(rows.plus_l), at(rows.minus_l_plus_1)), d, strips.xx + i);
    const auto whole = hn::Sub(at(rows.plus_b_plus_1), at(rows.minus_b));
    const auto middle = hn::Sub(at(rows.plus_h_plus_1), at(rows.minus_h));
    hn::StoreU(second_difference(whole, middle), d, strips.yy + i);
    const auto above = hn::Sub(at(rows.zero), at(rows.minus_l));
    const auto below = hn::Sub(at(rows.plus_l_plus_1), at(rows.plus_1));
    hn::StoreU(hn::Sub(above, below), d, strips.xy + i);
  }
}

void determinants(const SurfStripColumns& columns, std::size_t count, float scale, float* out) {
  const hn::ScalableTag<float> df;
  const hn::RebindToSigned<decltype(df)> di;
  const hn::RebindToUnsigned<decltype(df)> du;
  const auto factor = hn::Set(df, scale);
  const auto xy_weight = hn::Set(df, 0.9F * scale);
  for (std::size_t k = 0; k < count; k += hn::Lanes(df)) {
    const auto at = [&](const std::uint32_t* strips) HWY_ATTR { return hn::LoadU(du, strips + k); };
    const auto to_float = [&](hn::Vec<decltype(du)> v)
                              HWY_ATTR { return hn::ConvertTo(df, hn::BitCast(di, v)); };
    const auto dxx =
        second_difference(hn::Sub(at(columns.xx_plus_b_plus_1), at(columns.xx_minus_b)),
                          hn::Sub(at(columns.xx_plus_h_plus_1), at(columns.xx_minus_h)));
    const auto dyy = hn::Sub(at(columns.yy_plus_l), at(columns.yy_minus_l_plus_1));
    const auto dxy = hn::Sub(hn::Sub(at(columns.xy_plus_l_plus_1), at(columns.xy_plus_1)),
                             hn::Sub(at(columns.xy_zero), at(columns.xy_minus_l)));
    const auto xx = hn::Mul(to_float(dxx), factor);
    const auto yy = hn::Mul(to_float(dyy), factor);
    const auto xy = hn::Mul(to_float(dxy), xy_weight);
    hn::StoreU(hn::Sub(hn::Mul(xx, yy), hn::Mul(xy, xy)), df, out + k);
  }
}

}  // namespace
}  // namespace trigmesh::HWY_NAMESPACE

HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace trigmesh {
namespace {

HWY_EXPORT(vertical_strips);
HWY_EXPORT(determinants);

}  // namespace

void surf_vertical_strips(const SurfTableRows& rows, std::size_t count, const SurfStrips& strips) {
  HWY_DYNAMIC_DISPATCH(vertical_strips)(rows, count, strips);
}

void surf_determinants(const SurfStripColumns& columns,
                       std::size_t count,
                       float scale,
                       float* out) {
  HWY_DYNAMIC_DISPATCH(determinants)(columns, count, scale, out);
}

}  // namespace trigmesh

#endif  // HWY_ONCE
