#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <Eigen/Core>

#include "firmware/base/result.hpp"
#include "sfm/camera/camera.hpp"
#include "sfm/geometry/rigid3.hpp"
#include "sfm/geometry/sampling.hpp"

namespace trigmesh {

/// How two cameras are placed by their matches.
struct RelativePoseOptions {
  /// A match is an inlier when its Sampson error is at most this, undistorted pixels, > 0.
  double max_error_px = 1.5;
  /// Fewer inliers than this are no pose, >= 6.
  std::size_t min_inliers = 15;
  /// Probability that the best sample was free of outliers when sampling stops early, (0, 1).
  double confidence = 0.9999;
  /// At most so many samples of five, > 0. At 30 % inliers about 3800 are needed.
  std::size_t max_iterations = 10000;
  std::uint64_t seed = 1;

  [[nodiscard]] Result<> validate() const;
};

enum class RelativePoseOutcome {
  kOk,
  kTooFewPoints,   ///< fewer than six matches whose pixels have rays
  kTooFewInliers,  ///< no essential matrix explains `min_inliers` matches
  kNoParallax,     ///< a rotation alone explains the inliers: the direction of translation means
                   ///< nothing
  kAmbiguous,      ///< the matches do not tell which of the four decompositions is true
};

/// "ok", "too_few_points", "too_few_inliers", "no_parallax", "ambiguous".
[[nodiscard]] std::string_view to_string(RelativePoseOutcome outcome);

struct RelativePose {
  RelativePoseOutcome outcome = RelativePoseOutcome::kTooFewPoints;
  /// |t| = 1. For kNoParallax the rotation alone with t = 0. Otherwise the best try, if there is
  /// one.
  Rigid3 second_from_first{};
  /// One entry per match: small Sampson error and not behind a camera.
  InlierMask inliers{};
  std::size_t inlier_count = 0;
  std::size_t rotation_inlier_count = 0;  ///< inliers that a rotation alone explains as well
  double median_angle_rad = 0.0;          ///< of the angle between the two rays, over the inliers
  double rmse_px = 0.0;                   ///< of the Sampson errors of the inliers
  std::size_t iterations = 0;
};

/// Pose of the second camera relative to the first from matches of pixels (with distortion), any
/// part of which may be wrong. Deterministic for a seed. A scene of one plane has two motions that
/// explain it exactly; either may be returned. first_pixels[i] matches second_pixels[i].
[[nodiscard]] RelativePose estimate_relative_pose(const Camera& first_camera,
                                                  const Camera& second_camera,
                                                  std::span<const Eigen::Vector2d> first_pixels,
                                                  std::span<const Eigen::Vector2d> second_pixels,
                                                  const RelativePoseOptions& options);

/// The same from a known fundamental matrix (undistorted pixels, as matching leaves it): E = K2^T F
/// K1, decomposition, and refinement on its inliers; no sampling. Right only as far as the
/// calibrations are.
[[nodiscard]] RelativePose relative_pose_from_fundamental(
    const Eigen::Matrix3d& fundamental,
    const Camera& first_camera,
    const Camera& second_camera,
    std::span<const Eigen::Vector2d> first_pixels,
    std::span<const Eigen::Vector2d> second_pixels,
    const RelativePoseOptions& options);

}  // namespace trigmesh
