#pragma once

#include <cstddef>
#include <cstdint>

/// Inner loops of the SURF detector, compiled for several instruction sets and chosen at run time
/// (Highway). They work in whole vectors: every array must be readable and writable for
/// `kSurfKernelPadding` elements beyond `count`. All sums are modulo 2^32 and exact; the
/// floating-point operations are element-wise and never fused, so that every instruction set gives
/// the same bits.
namespace trigmesh {

inline constexpr std::size_t kSurfKernelPadding = 64;

/// Table rows (summed-area table) that the filters of one image row need; names are the row
/// relative to the centre, with b = side / 2, l = side / 3, h = l / 2.
struct SurfTableRows {
  const std::uint32_t* minus_b;
  const std::uint32_t* minus_l;
  const std::uint32_t* minus_l_plus_1;
  const std::uint32_t* minus_h;
  const std::uint32_t* zero;
  const std::uint32_t* plus_1;
  const std::uint32_t* plus_h_plus_1;
  const std::uint32_t* plus_l;
  const std::uint32_t* plus_l_plus_1;
  const std::uint32_t* plus_b_plus_1;
};

/// Vertical half of the three filters, one value a table column.
struct SurfStrips {
  std::uint32_t* xx;
  std::uint32_t* yy;
  std::uint32_t* xy;
};

void surf_vertical_strips(const SurfTableRows& rows, std::size_t count, const SurfStrips& strips);

/// Strips at the columns that the horizontal half of the filters needs; element k belongs to sample
/// k.
struct SurfStripColumns {
  const std::uint32_t* xx_minus_b;
  const std::uint32_t* xx_minus_h;
  const std::uint32_t* xx_plus_h_plus_1;
  const std::uint32_t* xx_plus_b_plus_1;
  const std::uint32_t* yy_minus_l_plus_1;
  const std::uint32_t* yy_plus_l;
  const std::uint32_t* xy_minus_l;
  const std::uint32_t* xy_zero;
  const std::uint32_t* xy_plus_1;
  const std::uint32_t* xy_plus_l_plus_1;
};

/// out[k] = Dxx Dyy - (0.9 Dxy)^2 with each filter sum multiplied by `scale`.
void surf_determinants(const SurfStripColumns& columns, std::size_t count, float scale, float* out);

}  // namespace trigmesh
