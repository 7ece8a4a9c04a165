// Random numbers for sample-and-score loops. The generator is PCG-XSH-RR 64/32 (M. E. O'Neill,
// "PCG: A Family of Simple Fast Space-Efficient Statistically Good Algorithms for Random Number
// Generation", HMC-CS-2014-0905, 2014, section 6.3.1); bounded numbers follow D. Lemire, "Fast
// Random Integer Generation in an Interval", ACM TOMACS 2019, algorithm 5. Unlike the standard
// library's distributions both give the same numbers on every platform.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "firmware/base/check.hpp"

namespace trigmesh {

/// Per input element: 1 when it agrees with the estimate, else 0.
using InlierMask = std::vector<std::uint8_t>;

/// Small deterministic random generator: the same seed gives the same numbers everywhere.
class RandomGenerator {
 public:
  explicit RandomGenerator(std::uint64_t seed) {
    next();
    state_ += seed;
    next();
  }

  /// Uniform over all 32-bit values.
  std::uint32_t next() {
    const std::uint64_t old = state_;
    state_ = old * 6364136223846793005ULL + kIncrement;
    const auto xorshifted = static_cast<std::uint32_t>(((old >> 18U) ^ old) >> 27U);
    const auto rotation = static_cast<std::uint32_t>(old >> 59U);
    return (xorshifted >> rotation) | (xorshifted << ((32U - rotation) & 31U));
  }

  /// Uniform in [0, bound), without bias; bound > 0.
  std::uint32_t below(std::uint32_t bound) {
    std::uint64_t product = std::uint64_t{next()} * bound;
    auto low = static_cast<std::uint32_t>(product);
    if (low < bound) {
      const std::uint32_t threshold = (0U - bound) % bound;
      while (low < threshold) {
        product = std::uint64_t{next()} * bound;
        low = static_cast<std::uint32_t>(product);
      }
    }
    return static_cast<std::uint32_t>(product >> 32U);
  }

  /// Uniform in [0, 1).
  double uniform() { return next() * 0x1p-32; }

 private:
  static constexpr std::uint64_t kIncrement = 1442695040888963407ULL;
  std::uint64_t state_ = 0;
};

/// Draws kSize different numbers of [0, count); every subset is equally likely; count >= kSize.
template <std::size_t kSize>
[[nodiscard]] std::array<std::uint32_t, kSize> sample_distinct(RandomGenerator& random,
                                                               std::uint32_t count) {
  TM_CHECK(count >= kSize);
  std::array<std::uint32_t, kSize> sample{};
  for (std::size_t i = 0; i < kSize; ++i) {
    const auto end = sample.begin() + static_cast<std::ptrdiff_t>(i);
    do {
      sample[i] = random.below(count);
    } while (std::find(sample.begin(), end, sample[i]) != end);
  }
  return sample;
}

/// The numbers 0 .. count-1 in random order (Fisher-Yates).
[[nodiscard]] inline std::vector<std::uint32_t> random_permutation(RandomGenerator& random,
                                                                   std::uint32_t count) {
  std::vector<std::uint32_t> order(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t j = random.below(i + 1);
    order[i] = order[j];
    order[j] = i;
  }
  return order;
}

/// How many samples must be drawn so that with probability `confidence` one of them holds inliers
/// only: log(1 - confidence) / log(1 - ratio^size) (Fischler & Bolles, CACM 1981), rounded up, at
/// most `limit`.
[[nodiscard]] inline std::size_t required_iterations(double inlier_ratio,
                                                     int sample_size,
                                                     double confidence,
                                                     std::size_t limit) {
  const double all_inliers = std::pow(inlier_ratio, sample_size);
  if (!(all_inliers > 0.0)) {
    return limit;
  }
  if (all_inliers >= 1.0) {
    return 1;
  }
  const double needed = std::log(1.0 - confidence) / std::log1p(-all_inliers);
  return needed < static_cast<double>(limit) ? static_cast<std::size_t>(std::ceil(needed)) : limit;
}

}  // namespace trigmesh
