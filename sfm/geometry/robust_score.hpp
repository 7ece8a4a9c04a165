// Truncated squares with an early end. Scoring stops by Wald's sequential test: with e the part of
// inliers of a good model and d that of a wrong one, the ratio of likelihoods of "wrong" to "good"
// is multiplied by d / e at each inlier and (1 - d) / (1 - e) at each outlier; the model is given
// up when it exceeds a limit A, which loses a good one with probability 1 / A (J. Matas, O. Chum,
// "Randomized RANSAC with Sequential Probability Ratio Test", ICCV 2005, equation 2).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

namespace trigmesh {

/// Truncated squared errors (MSAC) and how many elements agree.
struct Score {
  double cost = std::numeric_limits<double>::infinity();
  std::size_t inliers = 0;
};

/// Score over all elements; infinite as soon as it is plain that the model is not better than
/// `best`. `squared_error(i)` in the unit of `max_error` squared; `order`: every element once, in
/// random order.
template <typename SquaredError>
[[nodiscard]] Score score_sequentially(std::span<const std::uint32_t> order,
                                       double max_error,
                                       const Score& best,
                                       const SquaredError& squared_error) {
  constexpr double kChance = 0.02;        // part of the elements that agrees with a wrong model
  constexpr double kLeastInliers = 0.08;  // the test stays patient at high outlier rates
  constexpr double kMostInliers = 0.95;
  constexpr double kDecision = 200.0;  // one good model in so many is lost
  const double ratio = static_cast<double>(best.inliers) / static_cast<double>(order.size());
  const double expected = std::clamp(ratio, kLeastInliers, kMostInliers);
  const double inlier_factor = kChance / expected;
  const double outlier_factor = (1.0 - kChance) / (1.0 - expected);
  const double limit = max_error * max_error;
  Score out{.cost = 0.0};
  double likelihood_ratio = 1.0;
  for (const std::uint32_t i : order) {
    const double error = squared_error(i);
    const bool inlier = error <= limit;
    out.cost += inlier ? error : limit;
    out.inliers += inlier ? 1 : 0;
    likelihood_ratio *= inlier ? inlier_factor : outlier_factor;
    if (out.cost >= best.cost || likelihood_ratio > kDecision) {
      return {};
    }
  }
  return out;
}

/// The same over all elements without shortcut; sets mask[i].
template <typename SquaredError>
[[nodiscard]] Score mark_inliers(std::span<std::uint8_t> mask,
                                 double max_error,
                                 const SquaredError& squared_error) {
  const double limit = max_error * max_error;
  Score out{.cost = 0.0};
  for (std::size_t i = 0; i < mask.size(); ++i) {
    const double error = squared_error(i);
    mask[i] = error <= limit ? 1 : 0;
    out.inliers += mask[i];
    out.cost += error <= limit ? error : limit;
  }
  return out;
}

}  // namespace trigmesh
