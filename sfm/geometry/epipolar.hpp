#pragma once

#include <cstdint>
#include <span>

#include <Eigen/Core>

#include "sfm/geometry/rigid3.hpp"

namespace trigmesh {

// Conventions of this file: points are 2-vectors, undistorted pixels for a fundamental matrix F and
// normalised coordinates (x/z, y/z) for an essential matrix E; second^T F first = 0 with a 1
// appended to both; 3x3, defined up to scale.

enum class FundamentalOutcome {
  kOk,
  kTooFewPoints,  ///< fewer than eight matches
  kDegenerate,    ///< a plane, a line, too many equal points, no translation: more than one F fits
};

struct FundamentalEstimate {
  FundamentalOutcome outcome = FundamentalOutcome::kTooFewPoints;
  Eigen::Matrix3d fundamental = Eigen::Matrix3d::Zero();  ///< rank two, Frobenius norm 1
};

/// Least squares over all matches (normalised eight-point algorithm). Not robust; first[i] matches
/// second[i]. Degenerate input is recognised when it is so within rounding; noise hides it, so
/// compare with a homography to detect planes.
[[nodiscard]] FundamentalEstimate estimate_fundamental(std::span<const Eigen::Vector2d> first,
                                                       std::span<const Eigen::Vector2d> second);

/// Nearest matrix of rank two, Frobenius norm 1.
[[nodiscard]] Eigen::Matrix3d enforce_rank_two(const Eigen::Matrix3d& fundamental);
/// Nearest matrix with singular values (s, s, 0), scaled to s = 1.
[[nodiscard]] Eigen::Matrix3d enforce_essential(const Eigen::Matrix3d& essential);

/// E = K2^T F K1, without enforcing anything.
[[nodiscard]] Eigen::Matrix3d essential_from_fundamental(const Eigen::Matrix3d& fundamental,
                                                         const Eigen::Matrix3d& first_calibration,
                                                         const Eigen::Matrix3d& second_calibration);
/// F = K2^-T E K1^-1.
[[nodiscard]] Eigen::Matrix3d fundamental_from_essential(const Eigen::Matrix3d& essential,
                                                         const Eigen::Matrix3d& first_calibration,
                                                         const Eigen::Matrix3d& second_calibration);
/// E = [t]x R, scaled to |t| = 1; zero when the translation is zero.
[[nodiscard]] Eigen::Matrix3d essential_from_pose(const Rigid3& second_from_first);

/// Square of the Sampson error: to first order the squared distance of the match, as a point of
/// four dimensions, to the nearest one that satisfies the constraint. Same unit as the points,
/// squared; 0 for a match of two epipoles.
[[nodiscard]] double sampson_error_squared(const Eigen::Matrix3d& fundamental,
                                           const Eigen::Vector2d& first,
                                           const Eigen::Vector2d& second);

/// What a refinement minimises: sum of Cauchy losses of the Sampson errors over the matches with a
/// nonzero mask (empty: all).
struct EpipolarRefinementOptions {
  double loss_scale = 1.0;  ///< same unit as the Sampson error, > 0
  int max_iterations = 20;
};

/// Refines a fundamental matrix (seven unknowns) in undistorted pixels. Keeps rank two; never worse
/// than the start.
[[nodiscard]] Eigen::Matrix3d refine_fundamental(const Eigen::Matrix3d& start,
                                                 std::span<const Eigen::Vector2d> first,
                                                 std::span<const Eigen::Vector2d> second,
                                                 std::span<const std::uint8_t> mask,
                                                 const EpipolarRefinementOptions& options);

/// Two calibrations, for errors in pixels.
struct CalibrationPair {
  Eigen::Matrix3d first = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d second = Eigen::Matrix3d::Identity();
};

/// Refines rotation and direction of translation (five unknowns) on the Sampson error in
/// undistorted pixels. The result has |t| = 1; `start` has a translation that is not zero.
[[nodiscard]] Rigid3 refine_relative_pose(const Rigid3& start_second_from_first,
                                          const CalibrationPair& calibrations,
                                          std::span<const Eigen::Vector2d> first,
                                          std::span<const Eigen::Vector2d> second,
                                          std::span<const std::uint8_t> mask,
                                          const EpipolarRefinementOptions& options);

}  // namespace trigmesh
