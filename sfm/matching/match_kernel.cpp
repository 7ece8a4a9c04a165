// Every descriptor of one image against every one of another, with the two nearest neighbours in
// both directions from one pass over the similarity matrix.
//
// A tile of kRowsPerGroup queries times two vectors of database descriptors is accumulated in
// registers. Each lane belongs to another database descriptor (see InterleavedRows), so there are
// no horizontal sums, and the running two best of a row or column are lane-wise max/min. Cost per
// vector of pairs: 64 multiply-adds and about 8 operations for the two best.
//
// Dot products: bytes are at most 127, so a pair of products fits 16 bits (2 * 127^2 = 32258), and
// the sum is accumulated in unsigned 16 bits with saturation: a similarity of 65535 or more is
// reported as the ceiling 65535 and looked at again by the caller. With VNNI the sums have 32 bits
// and are exact.

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sfm/matching/match_kernel.cpp"
// SVE vectors cannot be kept in arrays; such machines run the NEON code.
#define TRIGMESH_SVE (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#ifdef TRIGMESH_FEW_SIMD_TARGETS  // sanitizer builds: one of each width
#define HWY_DISABLED_TARGETS (TRIGMESH_SVE | HWY_SSSE3 | HWY_SSE4 | HWY_AVX3)
#else
#define HWY_DISABLED_TARGETS TRIGMESH_SVE
#endif
#define HWY_WANT_AVX3_DL
#include "sfm/matching/match_kernel.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "sfm/matching/match_scorers.inl"

HWY_BEFORE_NAMESPACE();

namespace trigmesh::internal {
namespace HWY_NAMESPACE {
namespace {

#if HWY_TARGET != HWY_SCALAR

constexpr std::size_t kVectorsPerBlock = 2;
constexpr std::size_t kRowsPerGroup = HWY_CAP_GE512 ? 8 : 4;
constexpr std::size_t kRowsPerTile = 64;

template <class Scorer>
using LaneOf = hn::TFromD<typename Scorer::D>;
template <class Scorer>
using VectorOf = hn::Vec<typename Scorer::D>;
template <class Scorer>
constexpr std::size_t kLanes = hn::MaxLanes(typename Scorer::D());

/// Always even: the kernel takes two steps at a time.
template <class Scorer>
constexpr std::size_t steps_of(std::size_t descriptor_bytes) {
  constexpr std::size_t kBytesInTwoSteps = 2 * Scorer::kBytesPerLane;
  return 2 * ((descriptor_bytes + kBytesInTwoSteps - 1) / kBytesInTwoSteps);
}

template <class Scorer>
InterleavedRows interleave_for(const DescriptorRows& rows) {
  constexpr std::size_t kWidth = Scorer::kBytesPerLane;
  constexpr std::size_t kLaneCount = kLanes<Scorer>;
  const std::size_t steps = steps_of<Scorer>(rows.descriptor_bytes);
  InterleavedRows out;
  out.descriptors_per_block = kVectorsPerBlock * kLaneCount;
  out.bytes_per_block = steps * out.descriptors_per_block * kWidth;
  const std::size_t blocks =
      (rows.count + out.descriptors_per_block - 1) / out.descriptors_per_block;
  out.lines.assign((blocks * out.bytes_per_block + sizeof(CacheLine) - 1) / sizeof(CacheLine),
                   CacheLine{});
  auto* bytes = reinterpret_cast<std::uint8_t*>(out.lines.data());
  for (std::size_t i = 0; i < rows.count; ++i) {
    const std::size_t lane = i % out.descriptors_per_block;
    std::uint8_t* target =
        bytes + (i / out.descriptors_per_block) * out.bytes_per_block + lane * kWidth;
    const std::uint8_t* source = rows.row(i);
    const std::size_t stride = out.descriptors_per_block * kWidth;
    const std::size_t whole_steps = rows.descriptor_bytes / kWidth;
    for (std::size_t s = 0; s < whole_steps; ++s) {
      std::memcpy(target + s * stride, source + s * kWidth, kWidth);
    }
    std::memcpy(target + whole_steps * stride,
                source + whole_steps * kWidth,
                rows.descriptor_bytes % kWidth);
  }
  return out;
}

/// Queries of one tile as the kernel reads them: word [group][step][row in group], a pair of bytes
/// written twice when lanes have 16 bits. Rows past the end are zero.
template <class Scorer>
void spread_queries(const DescriptorRows& a,
                    std::size_t first,
                    std::size_t count,
                    std::vector<std::uint32_t>& words) {
  const std::size_t steps = steps_of<Scorer>(a.descriptor_bytes);
  const std::size_t groups = (count + kRowsPerGroup - 1) / kRowsPerGroup;
  words.assign(groups * steps * kRowsPerGroup, 0);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint8_t* row = a.row(first + i);
    std::uint32_t* target =
        words.data() + (i / kRowsPerGroup) * steps * kRowsPerGroup + i % kRowsPerGroup;
    for (std::size_t begin = 0, s = 0; begin < a.descriptor_bytes;
         begin += Scorer::kBytesPerLane, ++s) {
      std::uint32_t word = 0;
      std::memcpy(&word, row + begin, std::min(Scorer::kBytesPerLane, a.descriptor_bytes - begin));
      target[s * kRowsPerGroup] = Scorer::kBytesPerLane == 2 ? word * 0x10001U : word;
    }
  }
}

template <class Scorer>
struct Tile {
  /// Written out, because g++ builds an implicit one without the instructions of the target.
  HWY_INLINE Tile() {
  }  // NOLINT(cppcoreguidelines-pro-type-member-init,modernize-use-equals-default)

  VectorOf<Scorer> score[kRowsPerGroup][kVectorsPerBlock];
};

/// Sums over all steps for one group of queries and one block.
template <class Scorer>
HWY_INLINE void accumulate_tile(const std::uint8_t* HWY_RESTRICT block,
                                const std::uint32_t* HWY_RESTRICT queries,
                                std::size_t steps,
                                Tile<Scorer>& tile) {
  const D8 d8;
  const DU32 d32;
  constexpr std::size_t kBytes = hn::MaxLanes(d8);
  VectorOf<Scorer> sum[kRowsPerGroup][kVectorsPerBlock];
#pragma GCC unroll 8
  for (std::size_t r = 0; r < kRowsPerGroup; ++r) {
    sum[r][0] = hn::Zero(typename Scorer::D());
    sum[r][1] = hn::Zero(typename Scorer::D());
  }
  for (std::size_t s = 0; s < steps; s += 2) {
    const V8 step0[2] = {hn::Load(d8, block), hn::Load(d8, block + kBytes)};
    const V8 step1[2] = {hn::Load(d8, block + 2 * kBytes), hn::Load(d8, block + 3 * kBytes)};
    block += 2 * kVectorsPerBlock * kBytes;
#pragma GCC unroll 8
    for (std::size_t r = 0; r < kRowsPerGroup; ++r) {
      const V8 query0 = hn::BitCast(d8, hn::Set(d32, queries[r]));
      const V8 query1 = hn::BitCast(d8, hn::Set(d32, queries[kRowsPerGroup + r]));
      sum[r][0] = Scorer::accumulate(sum[r][0], step0[0], query0, step1[0], query1);
      sum[r][1] = Scorer::accumulate(sum[r][1], step0[1], query0, step1[1], query1);
    }
    queries += 2 * kRowsPerGroup;
  }
#pragma GCC unroll 8
  for (std::size_t r = 0; r < kRowsPerGroup; ++r) {
    tile.score[r][0] = Scorer::flush(sum[r][0], tile.score[r][0]);
    tile.score[r][1] = Scorer::flush(sum[r][1], tile.score[r][1]);
  }
}

/// Similarities of one group of queries to one block, as biased lane values.
template <class Scorer>
HWY_INLINE void score_tile(const std::uint8_t* block,
                           const std::uint32_t* queries,
                           std::size_t steps,
                           std::int32_t bits,
                           Tile<Scorer>& tile) {
  if constexpr (Scorer::kStepsPerFlush == std::numeric_limits<std::size_t>::max()) {
    accumulate_tile<Scorer>(block, queries, steps, tile);
  } else {
    const typename Scorer::D d;
    for (auto& row : tile.score) {
      row[0] = hn::Zero(d);
      row[1] = hn::Zero(d);
    }
    for (std::size_t s = 0; s < steps; s += Scorer::kStepsPerFlush) {
      const std::size_t some = std::min(Scorer::kStepsPerFlush, steps - s);
      accumulate_tile<Scorer>(block + s * kVectorsPerBlock * hn::MaxLanes(D8()),
                              queries + s * kRowsPerGroup,
                              some,
                              tile);
    }
    const auto all = hn::Set(d, static_cast<LaneOf<Scorer>>(bits));
    for (auto& row : tile.score) {
      row[0] = hn::Sub(all, row[0]);
      row[1] = hn::Sub(all, row[1]);
    }
  }
}

/// Gives the lanes past the last descriptor and the rows past the last query similarity 0.
template <class Scorer>
void clear_outside(std::size_t rows, std::size_t lanes, Tile<Scorer>& tile) {
  const typename Scorer::D d;
  const auto none = hn::Set(d, static_cast<LaneOf<Scorer>>(Scorer::kBias));
  for (std::size_t r = 0; r < kRowsPerGroup; ++r) {
    for (std::size_t v = 0; v < kVectorsPerBlock; ++v) {
      const std::size_t begin = v * kLanes<Scorer>;
      const std::size_t valid =
          r < rows ? std::clamp<std::size_t>(lanes, begin, begin + kLanes<Scorer>) - begin : 0;
      tile.score[r][v] = hn::IfThenElse(hn::FirstN(d, valid), tile.score[r][v], none);
    }
  }
}

/// Running two best of each lane, kept in memory between tiles.
template <class Scorer>
struct alignas(64) LaneState {
  LaneOf<Scorer> best[kLanes<Scorer>];
  LaneOf<Scorer> second[kLanes<Scorer>];
  LaneOf<Scorer> where[kLanes<Scorer>];

  void reset() {
    std::fill(std::begin(best), std::end(best), static_cast<LaneOf<Scorer>>(Scorer::kBias));
    std::fill(std::begin(second), std::end(second), static_cast<LaneOf<Scorer>>(Scorer::kBias));
    std::fill(std::begin(where), std::end(where), LaneOf<Scorer>{0});
  }

  /// Takes in the two best of a new group. The first of equals stays.
  HWY_INLINE void merge(VectorOf<Scorer> high, VectorOf<Scorer> low, VectorOf<Scorer> group) {
    const typename Scorer::D d;
    const auto old_best = hn::Load(d, best);
    hn::Store(hn::Max(hn::Max(hn::Load(d, second), low), hn::Min(old_best, high)), d, second);
    hn::Store(hn::IfThenElse(hn::Gt(high, old_best), group, hn::Load(d, where)), d, where);
    hn::Store(hn::Max(old_best, high), d, best);
  }
};

template <class Scorer>
HWY_INLINE void update_rows(const Tile<Scorer>& tile,
                            std::size_t block,
                            LaneState<Scorer>* states) {
  const auto group = hn::Set(typename Scorer::D(), static_cast<LaneOf<Scorer>>(block));
#pragma GCC unroll 8
  for (std::size_t r = 0; r < kRowsPerGroup; ++r) {
    const auto high = hn::Max(tile.score[r][0], tile.score[r][1]);
    const auto low = hn::Min(tile.score[r][0], tile.score[r][1]);
    states[r].merge(high, low, group);
  }
}

template <class Scorer>
HWY_INLINE void update_columns(const Tile<Scorer>& tile,
                               std::size_t row_group,
                               LaneState<Scorer>* states) {
  const auto group = hn::Set(typename Scorer::D(), static_cast<LaneOf<Scorer>>(row_group));
#pragma GCC unroll 2
  for (std::size_t v = 0; v < kVectorsPerBlock; ++v) {
    auto high = hn::Max(tile.score[0][v], tile.score[1][v]);
    auto low = hn::Min(tile.score[0][v], tile.score[1][v]);
#pragma GCC unroll 8
    for (std::size_t r = 2; r < kRowsPerGroup; r += 2) {
      const auto next_high = hn::Max(tile.score[r][v], tile.score[r + 1][v]);
      const auto next_low = hn::Min(tile.score[r][v], tile.score[r + 1][v]);
      low = hn::Max(hn::Max(low, next_low), hn::Min(high, next_high));
      high = hn::Max(high, next_high);
    }
    states[v].merge(high, low, group);
  }
}

/// The two best over all lanes of a row, with the lowest position among equals.
template <class Scorer>
NearestTwo reduce_row(const LaneState<Scorer>& state,
                      const DescriptorRows& a,
                      std::size_t i,
                      const DescriptorRows& b) {
  constexpr std::size_t kLaneCount = kLanes<Scorer>;
  LaneOf<Scorer> best = state.best[0];
  LaneOf<Scorer> second = state.second[0];
  for (std::size_t l = 1; l < kLaneCount; ++l) {
    second = std::max({second, state.second[l], std::min(best, state.best[l])});
    best = std::max(best, state.best[l]);
  }
  NearestTwo out{.best = std::int32_t{best} - Scorer::kBias,
                 .second = std::int32_t{second} - Scorer::kBias};
  if (out.best == 0) {
    return out;
  }
  out.position = std::numeric_limits<std::uint32_t>::max();
  for (std::size_t l = 0; l < kLaneCount; ++l) {
    if (state.best[l] != best) {
      continue;
    }
    // The lane stands for one descriptor in each vector of the block.
    std::size_t j = static_cast<std::size_t>(state.where[l]) * kVectorsPerBlock * kLaneCount + l;
    if (std::min(similarity_impl(a, i, b, j), Scorer::kCeiling) != out.best) {
      j += kLaneCount;
    }
    out.position = std::min(out.position, static_cast<std::uint32_t>(j));
  }
  return out;
}

template <class Scorer>
ScanResult scan_for(const DescriptorRows& a,
                    std::size_t count_a,
                    const DescriptorRows& b,
                    const InterleavedRows& b_interleaved,
                    std::size_t count_b) {
  constexpr std::size_t kPerBlock = kVectorsPerBlock * kLanes<Scorer>;
  const std::size_t steps = steps_of<Scorer>(a.descriptor_bytes);
  const std::size_t blocks = (count_b + kPerBlock - 1) / kPerBlock;
  const auto bits = static_cast<std::int32_t>(8 * a.descriptor_bytes);
  const auto* b_bytes = reinterpret_cast<const std::uint8_t*>(b_interleaved.lines.data());

  ScanResult out;
  out.rows.resize(count_a);
  out.columns.resize(count_b);
  out.rows_per_group = kRowsPerGroup;
  out.ceiling = Scorer::kCeiling;

  std::vector<LaneState<Scorer>> column_states(blocks * kVectorsPerBlock);
  for (auto& state : column_states) {
    state.reset();
  }
  std::array<LaneState<Scorer>, kRowsPerTile> row_states;
  std::vector<std::uint32_t> queries;
  for (std::size_t first = 0; first < count_a; first += kRowsPerTile) {
    const std::size_t rows = std::min(kRowsPerTile, count_a - first);
    spread_queries<Scorer>(a, first, rows, queries);
    for (auto& state : row_states) {
      state.reset();
    }
    for (std::size_t block = 0; block < blocks; ++block) {
      const std::uint8_t* block_bytes = b_bytes + block * b_interleaved.bytes_per_block;
      const std::size_t lanes = std::min(kPerBlock, count_b - block * kPerBlock);
      for (std::size_t r = 0; r < rows; r += kRowsPerGroup) {
        Tile<Scorer> tile;
        score_tile<Scorer>(block_bytes, queries.data() + r * steps, steps, bits, tile);
        if (lanes < kPerBlock || rows - r < kRowsPerGroup) {
          clear_outside<Scorer>(rows - r, lanes, tile);
        }
        update_rows<Scorer>(tile, block, &row_states[r]);
        update_columns<Scorer>(
            tile, (first + r) / kRowsPerGroup, &column_states[block * kVectorsPerBlock]);
      }
    }
    for (std::size_t r = 0; r < rows; ++r) {
      out.rows[first + r] = reduce_row<Scorer>(row_states[r], a, first + r, b);
    }
  }
  for (std::size_t j = 0; j < count_b; ++j) {
    const LaneState<Scorer>& state = column_states[j / kLanes<Scorer>];
    const std::size_t lane = j % kLanes<Scorer>;
    out.columns[j] = {.best = std::int32_t{state.best[lane]} - Scorer::kBias,
                      .second = std::int32_t{state.second[lane]} - Scorer::kBias,
                      .position = static_cast<std::uint32_t>(state.where[lane]) *
                                  static_cast<std::uint32_t>(kRowsPerGroup)};
  }
  return out;
}

#if HWY_TARGET <= HWY_AVX3_DL
using DotProduct = DotProduct32;
#else
using DotProduct = DotProduct16;
#endif

InterleavedRows interleave_impl(const DescriptorRows& rows) {
  return rows.metric == DescriptorMetric::kDotProduct ? interleave_for<DotProduct>(rows)
                                                      : interleave_for<HammingDistance>(rows);
}

ScanResult scan_impl(const DescriptorRows& a,
                     std::size_t count_a,
                     const DescriptorRows& b,
                     const InterleavedRows& b_interleaved,
                     std::size_t count_b) {
  return a.metric == DescriptorMetric::kDotProduct
             ? scan_for<DotProduct>(a, count_a, b, b_interleaved, count_b)
             : scan_for<HammingDistance>(a, count_a, b, b_interleaved, count_b);
}

#else  // HWY_TARGET == HWY_SCALAR: machines without any vector unit that Highway knows

InterleavedRows interleave_impl(const DescriptorRows& /*rows*/) {
  return {};
}

void take_in(std::int32_t score, std::size_t position, NearestTwo& nearest) {
  if (score > nearest.best) {
    nearest = {
        .best = score, .second = nearest.best, .position = static_cast<std::uint32_t>(position)};
  } else {
    nearest.second = std::max(nearest.second, score);
  }
}

ScanResult scan_impl(const DescriptorRows& a,
                     std::size_t count_a,
                     const DescriptorRows& b,
                     const InterleavedRows& /*b_interleaved*/,
                     std::size_t count_b) {
  ScanResult out;
  out.rows.resize(count_a);
  out.columns.resize(count_b);
  out.ceiling = std::numeric_limits<std::int32_t>::max();
  for (std::size_t i = 0; i < count_a; ++i) {
    for (std::size_t j = 0; j < count_b; ++j) {
      const std::int32_t score = similarity_impl(a, i, b, j);
      take_in(score, j, out.rows[i]);
      take_in(score, i, out.columns[j]);
    }
  }
  return out;
}

#endif  // HWY_TARGET != HWY_SCALAR

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace trigmesh::internal

HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace trigmesh::internal {

HWY_EXPORT(similarity_impl);
HWY_EXPORT(similarities_impl);
HWY_EXPORT(interleave_impl);
HWY_EXPORT(scan_impl);

std::int32_t similarity(const DescriptorRows& a,
                        std::size_t i,
                        const DescriptorRows& b,
                        std::size_t j) {
  return HWY_DYNAMIC_DISPATCH(similarity_impl)(a, i, b, j);
}

void similarities(const DescriptorRows& a,
                  std::size_t i,
                  const DescriptorRows& b,
                  std::span<const std::uint32_t> candidates,
                  std::int32_t* scores) {
  HWY_DYNAMIC_DISPATCH(similarities_impl)(a, i, b, candidates, scores);
}

InterleavedRows interleave(const DescriptorRows& rows) {
  return HWY_DYNAMIC_DISPATCH(interleave_impl)(rows);
}

ScanResult scan_all_pairs(const DescriptorRows& a,
                          std::size_t count_a,
                          const DescriptorRows& b,
                          const InterleavedRows& b_interleaved,
                          std::size_t count_b) {
  return HWY_DYNAMIC_DISPATCH(scan_impl)(a, count_a, b, b_interleaved, count_b);
}

}  // namespace trigmesh::internal

#endif  // HWY_ONCE
