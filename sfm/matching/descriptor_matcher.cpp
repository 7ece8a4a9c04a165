#include "sfm/matching/descriptor_matcher.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

using internal::DescriptorRows;
using internal::NearestTwo;
using internal::ScanResult;

/// Reads exact nearest neighbours out of a scan: finds the row within a group, and looks again
/// where lanes were full.
class ScanReader {
 public:
  ScanReader(const DescriptorRows& a,
             std::size_t count_a,
             const DescriptorRows& b,
             std::size_t count_b)
      : a_(a), b_(b), count_a_(count_a), count_b_(count_b) {}

  [[nodiscard]] NearestTwo row(const ScanResult& scan, std::size_t i) const {
    const NearestTwo& raw = scan.rows[i];
    if (raw.second >= scan.ceiling) {
      return search(a_, i, b_, count_b_);
    }
    NearestTwo out = raw;
    if (raw.best >= scan.ceiling) {
      out.best = internal::similarity(a_, i, b_, raw.position);
    }
    return out;
  }

  [[nodiscard]] NearestTwo column(const ScanResult& scan, std::size_t j) const {
    const NearestTwo& raw = scan.columns[j];
    if (raw.second >= scan.ceiling) {
      return search(b_, j, a_, count_a_);
    }
    NearestTwo out = raw;
    for (std::size_t i = raw.position;
         i < std::min<std::size_t>(raw.position + scan.rows_per_group, count_a_);
         ++i) {
      const std::int32_t exact = internal::similarity(b_, j, a_, i);
      if (std::min(exact, scan.ceiling) == raw.best) {
        out.best = exact;
        out.position = static_cast<std::uint32_t>(i);
        return out;
      }
    }
    return NearestTwo{};
  }

 private:
  /// One row of the matrix without any ceiling.
  static NearestTwo search(const DescriptorRows& from,
                           std::size_t i,
                           const DescriptorRows& in,
                           std::size_t count) {
    NearestTwo out;
    for (std::size_t j = 0; j < count; ++j) {
      const std::int32_t score = internal::similarity(from, i, in, j);
      if (score > out.best) {
        out = {.best = score, .second = out.best, .position = static_cast<std::uint32_t>(j)};
      } else {
        out.second = std::max(out.second, score);
      }
    }
    return out;
  }

  const DescriptorRows& a_;
  const DescriptorRows& b_;
  std::size_t count_a_;
  std::size_t count_b_;
};

}  // namespace

Result<DescriptorIndex> DescriptorIndex::build(const FeatureSet& features) {
  if (features.size() > internal::kMaxDescriptors) {
    return fail(ErrorCode::kInvalidArgument,
                "{} descriptors in one image, at most {} can be matched",
                features.size(),
                internal::kMaxDescriptors);
  }
  if (features.size() > 0 && (features.descriptor_bytes == 0 ||
                              features.descriptor_bytes > internal::kMaxDescriptorBytes)) {
    return fail(ErrorCode::kInvalidArgument,
                "descriptors of {} bytes cannot be matched",
                features.descriptor_bytes);
  }
  if (features.descriptors.size() != features.size() * features.descriptor_bytes) {
    return fail(ErrorCode::kInvalidArgument,
                "{} keypoints with {} descriptor bytes each, but {} bytes given",
                features.size(),
                features.descriptor_bytes,
                features.descriptors.size());
  }
  DescriptorIndex out;
  out.rows_ = {.metric = descriptor_metric(features.kind),
               .descriptor_bytes = features.descriptor_bytes,
               .count = features.size(),
               .data = features.descriptors.data()};
  if (out.rows_.metric == DescriptorMetric::kDotProduct) {
    std::uint8_t all_bits = 0;
    for (const std::uint8_t byte : features.descriptors) {
      all_bits = static_cast<std::uint8_t>(all_bits | byte);
    }
    if (all_bits > 127) {
      return fail(ErrorCode::kInvalidArgument,
                  "a {} descriptor has a byte above 127",
                  to_string(features.kind));
    }
    out.lengths_.resize(out.size());
    for (std::size_t i = 0; i < out.size(); ++i) {
      out.lengths_[i] =
          std::sqrt(static_cast<double>(internal::similarity(out.rows_, i, out.rows_, i)));
    }
  }
  out.interleaved_ = internal::interleave(out.rows_);
  return out;
}

Result<> MatchOptions::validate() const {
  if (!(max_ratio > 0.0 && max_ratio <= 1.0)) {
    return fail(ErrorCode::kInvalidArgument, "max_ratio is {}, must be in (0, 1]", max_ratio);
  }
  return {};
}

bool passes_ratio_test(DescriptorMetric metric,
                       double best_similarity,
                       double second_similarity,
                       double length_product,
                       double max_ratio) {
  if (metric == DescriptorMetric::kHamming) {
    return length_product - best_similarity < max_ratio * (length_product - second_similarity);
  }
  // |a - b|^2 = 2 - 2 cos; the second nearest is taken to be as long as the nearest.
  const double best_squared = 2.0 - 2.0 * best_similarity / length_product;
  const double second_squared = 2.0 - 2.0 * second_similarity / length_product;
  return best_squared < max_ratio * max_ratio * second_squared;
}

std::vector<FeatureMatch> match_descriptors(const DescriptorIndex& a,
                                            const DescriptorIndex& b,
                                            const MatchOptions& options) {
  const std::size_t count_a = std::min(a.size(), options.max_features);
  const std::size_t count_b = std::min(b.size(), options.max_features);
  if (count_a == 0 || count_b == 0) {
    return {};
  }
  const DescriptorMetric metric = a.rows().metric;
  TM_CHECK(metric == b.rows().metric && a.rows().descriptor_bytes == b.rows().descriptor_bytes);

  const ScanResult scan =
      internal::scan_all_pairs(a.rows(), count_a, b.rows(), b.interleaved(), count_b);
  const ScanReader reader(a.rows(), count_a, b.rows(), count_b);
  std::vector<FeatureMatch> matches;
  for (std::size_t i = 0; i < count_a; ++i) {
    if (scan.rows[i].best == 0) {
      continue;
    }
    const NearestTwo in_b = reader.row(scan, i);
    const auto length_product = [&] {
      return metric == DescriptorMetric::kHamming
                 ? static_cast<double>(8 * a.rows().descriptor_bytes)
                 : a.length(i) * b.length(in_b.position);
    };
    if (!passes_ratio_test(metric, in_b.best, in_b.second, length_product(), options.max_ratio)) {
      continue;
    }
    const NearestTwo in_a = reader.column(scan, in_b.position);
    if (in_a.position == i &&
        passes_ratio_test(metric, in_a.best, in_a.second, length_product(), options.max_ratio)) {
      matches.push_back({id_of<FeatureIndex>(i), id_of<FeatureIndex>(in_b.position)});
    }
  }
  return matches;
}

}  // namespace trigmesh
