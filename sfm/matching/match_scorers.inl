// What one vector step of the match kernel does: products of bytes, differing bits. Part of
// match_kernel.cpp, compiled once for each instruction set, therefore without an ordinary include
// guard.

#if defined(TRIGMESH_SFM_MATCHING_MATCH_SCORERS_INL_) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIGMESH_SFM_MATCHING_MATCH_SCORERS_INL_
#undef TRIGMESH_SFM_MATCHING_MATCH_SCORERS_INL_
#else
#define TRIGMESH_SFM_MATCHING_MATCH_SCORERS_INL_
#endif

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>

#include <hwy/highway.h>

#include "sfm/matching/match_kernel.hpp"

#if HWY_TARGET == HWY_AVX3_DL && HWY_MAJOR == 1 && HWY_MINOR == 0
// Highway 1.0.3 names AVX-VNNI here, but its run-time check for this target is for AVX512-VNNI,
// which is what we use. Later ones name the right one.
#undef HWY_TARGET_STR
#define HWY_TARGET_STR \
  HWY_TARGET_STR_AVX3  \
  ",vpclmulqdq,avx512vbmi,avx512vbmi2,vaes,avxvnni,avx512vnni,avx512bitalg,avx512vpopcntdq"
#endif

HWY_BEFORE_NAMESPACE();

namespace trigmesh::internal {
namespace HWY_NAMESPACE {
namespace {

#if HWY_TARGET != HWY_SCALAR

namespace hn = hwy::HWY_NAMESPACE;

using D8 = hn::ScalableTag<std::uint8_t>;
using D16 = hn::ScalableTag<std::int16_t>;
using DU16 = hn::ScalableTag<std::uint16_t>;
using D32 = hn::ScalableTag<std::int32_t>;
using DU32 = hn::ScalableTag<std::uint32_t>;
using V8 = hn::Vec<D8>;
using V16 = hn::Vec<D16>;
using V32 = hn::Vec<D32>;

/// Bytes below 128: the sum of two products in each 16-bit lane, at most 2 * 127^2.
HWY_INLINE V16 multiply_bytes(V8 database, V8 query) {
// The better a target, the less its number.
#if HWY_TARGET <= HWY_AVX3
  return V16{_mm512_maddubs_epi16(database.raw, query.raw)};
#elif HWY_TARGET == HWY_AVX2
  return V16{_mm256_maddubs_epi16(database.raw, query.raw)};
#elif HWY_TARGET == HWY_SSE4 || HWY_TARGET == HWY_SSSE3
  return V16{_mm_maddubs_epi16(database.raw, query.raw)};
#elif HWY_ARCH_ARM_A64 && HWY_TARGET != HWY_EMU128
  const uint16x8_t low = vmull_u8(vget_low_u8(database.raw), vget_low_u8(query.raw));
  const uint16x8_t high = vmull_high_u8(database.raw, query.raw);
  return V16(vreinterpretq_s16_u16(vpaddq_u16(low, high)));
#else
  const D16 d;
  const V16 low_byte = hn::Set(d, std::int16_t{0xFF});
  const V16 words = hn::BitCast(d, database);
  const V16 query_words = hn::BitCast(d, query);
  const V16 even = hn::Mul(hn::And(words, low_byte), hn::And(query_words, low_byte));
  const V16 odd = hn::Mul(hn::ShiftRight<8>(words), hn::ShiftRight<8>(query_words));
  return hn::Add(even, odd);
#endif
}

#endif  // HWY_TARGET != HWY_SCALAR

/// Dot product of bytes below 128.
HWY_INLINE std::int32_t dot_product(const std::uint8_t* HWY_RESTRICT a,
                                    const std::uint8_t* HWY_RESTRICT b,
                                    std::size_t count) {
  std::int32_t sum = 0;
  std::size_t i = 0;
#if HWY_TARGET != HWY_SCALAR
  const D8 d8;
  const D32 d32;
  const V16 ones = hn::Set(D16(), std::int16_t{1});
  auto sum0 = hn::Zero(d32);
  auto sum1 = hn::Zero(d32);
  for (; i + hn::MaxLanes(d8) <= count; i += hn::MaxLanes(d8)) {
    const V16 products = multiply_bytes(hn::LoadU(d8, a + i), hn::LoadU(d8, b + i));
    sum0 = hn::ReorderWidenMulAccumulate(d32, products, ones, sum0, sum1);
  }
  sum = hn::GetLane(hn::SumOfLanes(d32, hn::Add(sum0, sum1)));
#endif
  for (; i < count; ++i) {
    sum += std::int32_t{a[i]} * std::int32_t{b[i]};
  }
  return sum;
}

std::int32_t equal_bits(const std::uint8_t* HWY_RESTRICT a,
                        const std::uint8_t* HWY_RESTRICT b,
                        std::size_t count) {
  std::size_t differing = 0;
  std::size_t i = 0;
  for (; i + 8 <= count; i += 8) {
    std::uint64_t word_a = 0;
    std::uint64_t word_b = 0;
    std::memcpy(&word_a, a + i, 8);
    std::memcpy(&word_b, b + i, 8);
    differing += hwy::PopCount(word_a ^ word_b);
  }
  for (; i < count; ++i) {
    differing += hwy::PopCount(static_cast<std::uint64_t>(a[i] ^ b[i]));
  }
  return static_cast<std::int32_t>(8 * count - differing);
}

std::int32_t similarity_impl(const DescriptorRows& a,
                             std::size_t i,
                             const DescriptorRows& b,
                             std::size_t j) {
  return a.metric == DescriptorMetric::kDotProduct
             ? dot_product(a.row(i), b.row(j), a.descriptor_bytes)
             : equal_bits(a.row(i), b.row(j), a.descriptor_bytes);
}

void similarities_impl(const DescriptorRows& a,
                       std::size_t i,
                       const DescriptorRows& b,
                       std::span<const std::uint32_t> candidates,
                       std::int32_t* scores) {
  const std::size_t bytes = a.descriptor_bytes;
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    scores[c] = a.metric == DescriptorMetric::kDotProduct
                    ? dot_product(a.row(i), b.row(candidates[c]), bytes)
                    : equal_bits(a.row(i), b.row(candidates[c]), bytes);
  }
}

#if HWY_TARGET != HWY_SCALAR

/// Dot products of bytes 0..127 in 16-bit lanes, with saturation.
struct DotProduct16 {
  using D = D16;
  static constexpr std::size_t kBytesPerLane = 2;
  static constexpr std::int32_t kBias = -32768;  ///< lane value of similarity 0
  static constexpr std::int32_t kCeiling = 65535;
  static constexpr std::size_t kStepsPerFlush = std::numeric_limits<std::size_t>::max();

  /// Four products fit an unsigned lane (64516), so only every second addition must saturate; on
  /// Intel those run on fewer ports.
  static HWY_INLINE V16 accumulate(V16 sum, V8 database0, V8 query0, V8 database1, V8 query1) {
    const DU16 d;
    const auto four = hn::BitCast(
        d, hn::Add(multiply_bytes(database0, query0), multiply_bytes(database1, query1)));
    return hn::BitCast(D16(), hn::SaturatedAdd(hn::BitCast(d, sum), four));
  }

  /// Unsigned to signed order.
  static HWY_INLINE V16 flush(V16 sum, V16 /*total*/) {
    return hn::Xor(sum, hn::Set(D16(), static_cast<std::int16_t>(kBias)));
  }
};

#if HWY_TARGET <= HWY_AVX3_DL
/// Dot products of bytes 0..127 in 32-bit lanes, exact.
struct DotProduct32 {
  using D = D32;
  static constexpr std::size_t kBytesPerLane = 4;
  static constexpr std::int32_t kBias = 0;
  static constexpr std::int32_t kCeiling = std::numeric_limits<std::int32_t>::max();
  static constexpr std::size_t kStepsPerFlush = std::numeric_limits<std::size_t>::max();

  static HWY_INLINE V32 accumulate(V32 sum, V8 database0, V8 query0, V8 database1, V8 query1) {
    const __m512i first = _mm512_dpbusd_epi32(sum.raw, database0.raw, query0.raw);
    return V32{_mm512_dpbusd_epi32(first, database1.raw, query1.raw)};
  }

  static HWY_INLINE V32 flush(V32 sum, V32 /*total*/) { return sum; }
};
#endif

/// Differing bits. Bytes are counted apart for 16 steps (at most 128 each), then added to the
/// lanes.
struct HammingDistance {
  using D = D16;
  static constexpr std::size_t kBytesPerLane = 2;
  static constexpr std::int32_t kBias = 0;
  static constexpr std::int32_t kCeiling = std::numeric_limits<std::int32_t>::max();
  static constexpr std::size_t kStepsPerFlush = 16;

  static HWY_INLINE V16 accumulate(V16 sum, V8 database0, V8 query0, V8 database1, V8 query1) {
    const V8 bits0 = hn::PopulationCount(hn::Xor(database0, query0));
    const V8 bits1 = hn::PopulationCount(hn::Xor(database1, query1));
    return hn::BitCast(D16(), hn::Add(hn::BitCast(D8(), sum), hn::Add(bits0, bits1)));
  }

  static HWY_INLINE V16 flush(V16 sum, V16 total) {
    const D16 d;
    const V16 low_byte = hn::Set(d, std::int16_t{0xFF});
    const auto high = hn::ShiftRight<8>(hn::BitCast(DU16(), sum));
    return hn::Add(total, hn::Add(hn::And(sum, low_byte), hn::BitCast(d, high)));
  }
};

#endif  // HWY_TARGET != HWY_SCALAR

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace trigmesh::internal

HWY_AFTER_NAMESPACE();

#endif
