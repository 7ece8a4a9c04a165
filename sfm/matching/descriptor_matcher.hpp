#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "firmware/base/result.hpp"
#include "sfm/features/features.hpp"
#include "sfm/matching/match_kernel.hpp"
#include "sfm/matching/matches.hpp"

namespace trigmesh {

/// The descriptors of one image, prepared once for being compared with those of many others.
/// Borrows the descriptors: the FeatureSet must outlive the index and stay unchanged (moving it is
/// allowed). Thread-safe to read.
class DescriptorIndex {
 public:
  /// kInvalidArgument when sizes do not fit each other, a dot-product descriptor has a byte above
  /// 127, or there are more than 100000 descriptors or more than 512 bytes in one. An empty set is
  /// valid.
  [[nodiscard]] static Result<DescriptorIndex> build(const FeatureSet& features);

  [[nodiscard]] std::size_t size() const { return rows_.count; }

  [[nodiscard]] const internal::DescriptorRows& rows() const { return rows_; }

  [[nodiscard]] const internal::InterleavedRows& interleaved() const { return interleaved_; }

  /// Euclidean length of descriptor i (dot-product descriptors only).
  [[nodiscard]] double length(std::size_t i) const { return lengths_[i]; }

 private:
  DescriptorIndex() = default;

  internal::DescriptorRows rows_;
  internal::InterleavedRows interleaved_;
  std::vector<double> lengths_;
};

/// How descriptors are paired.
struct MatchOptions {
  /// Largest ratio of the distance to the nearest to the distance to the second nearest neighbour,
  /// (0, 1]; it must hold in both directions (Lowe, IJCV 2004, section 7.1). The distance is the
  /// bit count, or the Euclidean distance of the descriptors scaled to unit length: |a - b|^2 = 2 -
  /// 2 cos(a, b).
  double max_ratio = 0.8;
  /// Compare only the first descriptors of each image, which are the coarsest: preemptive matching
  /// (Wu, 3DV 2013).
  std::size_t max_features = std::numeric_limits<std::size_t>::max();

  [[nodiscard]] Result<> validate() const;
};

/// Exact nearest neighbours: pairs that are each other's nearest (the larger dot product, the fewer
/// differing bits; the lowest index among equals) and pass the ratio test in both directions.
/// Sorted by `first`; each descriptor at most once. With a single candidate the second nearest
/// counts as unrelated (orthogonal, or all bits different). Both indexes must be of the same kind.
/// Cost: size a times size b; 8000 x 8000 SIFT takes about 90 ms with AVX2, 35 ms with AVX512-VNNI.
[[nodiscard]] std::vector<FeatureMatch> match_descriptors(const DescriptorIndex& a,
                                                          const DescriptorIndex& b,
                                                          const MatchOptions& options);

/// Distances of a nearest and a second nearest neighbour pass the ratio test. Used by every matcher
/// of this folder. `length_product`: |a| |b| of the nearest pair (dot product), or the number of
/// bits (Hamming).
[[nodiscard]] bool passes_ratio_test(DescriptorMetric metric,
                                     double best_similarity,
                                     double second_similarity,
                                     double length_product,
                                     double max_ratio);

}  // namespace trigmesh
