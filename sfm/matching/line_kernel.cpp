#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sfm/matching/line_kernel.cpp"
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#include "sfm/matching/line_kernel.hpp"

#include <algorithm>
#include <cmath>

#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();

namespace trigmesh::internal {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using DF = hn::ScalableTag<float>;
using DU = hn::ScalableTag<std::uint32_t>;
using VF = hn::Vec<DF>;

static_assert(hn::MaxLanes(DF()) <= kStripPadding);

/// a . (x, y, 1), never fused, so that all machines round alike.
HWY_INLINE VF plane(const VF* a, VF x, VF y) {
  return hn::Add(hn::Add(hn::Mul(a[0], x), hn::Mul(a[1], y)), a[2]);
}

std::size_t find_near_line_impl(const PointStrips& strips,
                                const LineGate& gate,
                                std::uint32_t* found) {
  const DF d;
  const DU du;
  const int along = strips.along;
  const float slope = -gate.line[along] / gate.line[1 - along];
  const float offset = -gate.line[2] / gate.line[1 - along];
  if (!std::isfinite(slope) || !std::isfinite(offset) || strips.strips == 0) {
    return 0;
  }
  VF line[3];
  VF back_x[3];
  VF back_y[3];
  for (std::size_t i = 0; i < 3; ++i) {
    line[i] = hn::Set(d, gate.line[i]);
    back_x[i] = hn::Set(d, gate.back_x[i]);
    back_y[i] = hn::Set(d, gate.back_y[i]);
  }
  const VF limit = hn::Set(d, gate.limit);
  // In cells: where the line crosses the middle of a strip, and how far from there points can be. A
  // tenth of a cell covers rounding.
  const float reach_px =
      std::sqrt(gate.limit * (1.0F + slope * slope)) + 0.5F * std::abs(slope) * strips.strip_px;
  const float reach = reach_px / strips.cell_px + 0.1F;
  const float last = static_cast<float>(strips.cells) - 1.0F;
  std::size_t count = 0;
  for (int strip = 0; strip < strips.strips; ++strip) {
    const float middle_px =
        strips.strip_begin_px + (static_cast<float>(strip) + 0.5F) * strips.strip_px;
    const float middle = (slope * middle_px + offset - strips.cell_begin_px) / strips.cell_px;
    if (!(middle + reach >= 0.0F && middle - reach < last + 1.0F)) {
      continue;
    }
    const std::uint32_t* row =
        strips.starts.data() + static_cast<std::ptrdiff_t>(strip) * strips.cells;
    const std::uint32_t end = row[static_cast<int>(std::min(middle + reach, last)) + 1];
    for (std::uint32_t k = row[static_cast<int>(std::max(middle - reach, 0.0F))]; k < end;
         k += static_cast<std::uint32_t>(hn::MaxLanes(d))) {
      const VF x = hn::LoadU(d, strips.x_px.data() + k);
      const VF y = hn::LoadU(d, strips.y_px.data() + k);
      const VF error = plane(line, x, y);
      const VF gradient_x = plane(back_x, x, y);
      const VF gradient_y = plane(back_y, x, y);
      const VF squared = hn::Mul(error, error);
      const VF gradient = hn::Add(hn::Mul(gradient_x, gradient_x), hn::Mul(gradient_y, gradient_y));
      auto near = hn::And(hn::Le(squared, limit), hn::Le(squared, hn::Mul(limit, gradient)));
      near = hn::And(near, hn::FirstN(d, end - k));
      const auto members = hn::LoadU(du, strips.members.data() + k);
      count += hn::CompressStore(members, hn::RebindMask(du, near), du, found + count);
    }
  }
  return count;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace trigmesh::internal

HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace trigmesh::internal {

HWY_EXPORT(find_near_line_impl);

std::size_t find_near_line(const PointStrips& strips, const LineGate& gate, std::uint32_t* found) {
  return HWY_DYNAMIC_DISPATCH(find_near_line_impl)(strips, gate, found);
}

}  // namespace trigmesh::internal

#endif  // HWY_ONCE
