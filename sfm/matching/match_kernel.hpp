#pragma once

// Inside of the descriptor matcher: the loops over all pairs, in the best instruction set of the
// machine (Highway).

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sfm/features/features.hpp"

namespace trigmesh::internal {

/// Memory aligned for any vector unit.
struct alignas(64) CacheLine {
  std::uint8_t bytes[64];
};

/// Descriptors of one image, row after row, as the extractor gave them. Borrowed.
struct DescriptorRows {
  DescriptorMetric metric = DescriptorMetric::kDotProduct;
  std::size_t descriptor_bytes = 0;
  std::size_t count = 0;
  const std::uint8_t* data = nullptr;

  [[nodiscard]] const std::uint8_t* row(std::size_t i) const { return data + i * descriptor_bytes; }
};

/// The same descriptors, interleaved so that each lane of a vector holds another descriptor: a
/// block of descriptors is `steps` pairs of vectors, and lane l of step s holds bytes s * w .. s *
/// w + w - 1 of descriptor l (w = 2 or 4). The layout depends on the instruction set that was
/// chosen at run time.
struct InterleavedRows {
  std::size_t descriptors_per_block = 0;
  std::size_t bytes_per_block = 0;
  std::vector<CacheLine> lines;
};

/// Similarity of two descriptors: the dot product, or the number of equal bits. Larger is nearer.
[[nodiscard]] std::int32_t similarity(const DescriptorRows& a,
                                      std::size_t i,
                                      const DescriptorRows& b,
                                      std::size_t j);

/// Similarity of descriptor `i` of a to each of `candidates` in b, written to `scores` (same
/// length).
void similarities(const DescriptorRows& a,
                  std::size_t i,
                  const DescriptorRows& b,
                  std::span<const std::uint32_t> candidates,
                  std::int32_t* scores);

[[nodiscard]] InterleavedRows interleave(const DescriptorRows& rows);

/// The nearest neighbour and the similarity of the two nearest. No neighbour: both similarities are
/// 0.
struct NearestTwo {
  std::int32_t best = 0;
  std::int32_t second = 0;
  /// The nearest, or, in columns, the first of `rows_per_group` rows of which one is the nearest.
  std::uint32_t position = 0;
};

/// What one pass over the similarity matrix (rows of a by rows of b) leaves.
struct ScanResult {
  std::vector<NearestTwo> rows;     ///< for each of a, its two nearest in b
  std::vector<NearestTwo> columns;  ///< for each of b, its two nearest in a
  std::uint32_t rows_per_group = 1;
  /// Similarities from here on are reported as this value: the largest that the lanes can hold.
  std::int32_t ceiling = 0;
};

/// Compares the first `count_a` rows of a with the first `count_b` of b. `b_interleaved` belongs to
/// b.
[[nodiscard]] ScanResult scan_all_pairs(const DescriptorRows& a,
                                        std::size_t count_a,
                                        const DescriptorRows& b,
                                        const InterleavedRows& b_interleaved,
                                        std::size_t count_b);

/// Most descriptors of one image: group numbers are kept in 16-bit lanes.
inline constexpr std::size_t kMaxDescriptors = 100000;
/// Longest descriptor: bit counts are kept in 16-bit lanes.
inline constexpr std::size_t kMaxDescriptorBytes = 512;

}  // namespace trigmesh::internal
