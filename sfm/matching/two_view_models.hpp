#pragma once

// Inside of two-view verification: robust estimation and local optimisation of F, H and a pure
// rotation from point pairs.

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace trigmesh::internal {

/// Undistorted pixels of the same things in two images; equal lengths.
struct PointPairs {
  std::vector<Eigen::Vector2d> first;
  std::vector<Eigen::Vector2d> second;

  [[nodiscard]] std::size_t size() const { return first.size(); }

  /// At most `most` of the pairs, taken evenly over the whole list.
  [[nodiscard]] PointPairs thinned(std::size_t most) const;
  [[nodiscard]] PointPairs selected(const std::vector<std::size_t>& positions) const;
};

/// Limits of a search by sampling.
struct SearchLimits {
  double max_error_px = 2.0;
  double confidence = 0.9999;
  int max_iterations = 2000;
  int seed = 1;
};

/// Squared first-order distance of a pair to the epipolar geometry, square pixels (Sampson;
/// Hartley, Zisserman, 2nd ed., eq. 11.9).
[[nodiscard]] double sampson_squared(const Eigen::Matrix3d& fundamental,
                                     const Eigen::Vector2d& first,
                                     const Eigen::Vector2d& second);

/// Squared distance of H first from second, square pixels; infinite when H first is at infinity.
[[nodiscard]] double transfer_squared(const Eigen::Matrix3d& homography,
                                      const Eigen::Vector2d& first,
                                      const Eigen::Vector2d& second);

/// Robust F, second^T F first = 0. Nothing when fewer than 8 pairs or no model is found. F has unit
/// norm.
[[nodiscard]] std::optional<Eigen::Matrix3d> search_fundamental(const PointPairs& pairs,
                                                                const SearchLimits& limits);

/// Robust H, second ~ H first. Nothing when fewer than 4 pairs or no model is found. H has unit
/// norm.
[[nodiscard]] std::optional<Eigen::Matrix3d> search_homography(const PointPairs& pairs,
                                                               const SearchLimits& limits);

/// Improves F over all pairs until the truncated quadratic score stops growing; never worse than
/// `start`.
[[nodiscard]] Eigen::Matrix3d refine_fundamental(const PointPairs& pairs,
                                                 const Eigen::Matrix3d& start,
                                                 double max_error_px);

/// The same for H.
[[nodiscard]] Eigen::Matrix3d refine_homography(const PointPairs& pairs,
                                                const Eigen::Matrix3d& start,
                                                double max_error_px);

/// K of both images.
struct CalibrationPair {
  Eigen::Matrix3d first;
  Eigen::Matrix3d second;
};

/// H = K2 R K1^-1 of the rotation that explains most of the pairs, from a start that already
/// explains many of them.
[[nodiscard]] Eigen::Matrix3d fit_rotation_homography(const PointPairs& pairs,
                                                      const CalibrationPair& calibration,
                                                      double max_error_px);

/// Positions of the pairs within the error.
[[nodiscard]] std::vector<std::size_t> fundamental_inliers(const PointPairs& pairs,
                                                           const Eigen::Matrix3d& fundamental,
                                                           double max_error_px);
[[nodiscard]] std::vector<std::size_t> homography_inliers(const PointPairs& pairs,
                                                          const Eigen::Matrix3d& homography,
                                                          double max_error_px);

}  // namespace trigmesh::internal
