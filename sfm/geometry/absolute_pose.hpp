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

/// How a camera is found from pixels of known points.
struct AbsolutePoseOptions {
  /// A match is an inlier when its reprojection error is at most this, pixels, > 0.
  double max_error_px = 4.0;
  /// Fewer inliers than this are no pose, >= 4.
  std::size_t min_inliers = 12;
  /// Probability that the best sample was free of outliers when sampling stops early, (0, 1).
  double confidence = 0.9999;
  /// At most so many samples of three, > 0. At 90 % outliers about 9200 are needed.
  std::size_t max_iterations = 20000;
  std::uint64_t seed = 1;

  [[nodiscard]] Result<> validate() const;
};

enum class AbsolutePoseOutcome {
  kOk,
  kTooFewPoints,   ///< fewer than four matches whose pixel has a ray
  kTooFewInliers,  ///< no pose explains `min_inliers` matches
  kDegenerate,     ///< all samples, or the inliers together, are collinear or coincide: the pose is
                   ///< not determined
};

/// "ok", "too_few_points", "too_few_inliers", "degenerate".
[[nodiscard]] std::string_view to_string(AbsolutePoseOutcome outcome);

struct AbsolutePose {
  AbsolutePoseOutcome outcome = AbsolutePoseOutcome::kTooFewPoints;
  Rigid3 cam_from_world{};  ///< also the best try when kTooFewInliers
  InlierMask inliers{};     ///< one entry per match
  std::size_t inlier_count = 0;
  double rmse_px = 0.0;  ///< over the inliers
  std::size_t iterations = 0;
};

/// Pose of a camera with known intrinsics from matches of pixels (with distortion) and world
/// points, of which any part may be wrong. Deterministic for a seed. Every error is measured in
/// pixels through the lens. pixels[i] sees points_in_world[i].
[[nodiscard]] AbsolutePose estimate_absolute_pose(const Camera& camera,
                                                  std::span<const Eigen::Vector2d> pixels,
                                                  std::span<const Eigen::Vector3d> points_in_world,
                                                  const AbsolutePoseOptions& options);

/// Starts from a pose that is nearly right (the last frame, a motion model) instead of sampling:
/// takes the matches within three times `max_error_px`, then refines as above.
[[nodiscard]] AbsolutePose refine_absolute_pose(const Camera& camera,
                                                std::span<const Eigen::Vector2d> pixels,
                                                std::span<const Eigen::Vector3d> points_in_world,
                                                const Rigid3& start_cam_from_world,
                                                const AbsolutePoseOptions& options);

/// Which focal lengths are tried for an uncalibrated camera, as parts of the larger image side.
struct FocalSearchOptions {
  double min_focal_ratio = 0.5;  ///< > 0
  double max_focal_ratio = 3.0;  ///< > min_focal_ratio
  int candidates = 20;           ///< on a logarithmic grid, >= 2

  [[nodiscard]] Result<> validate() const;
};

/// A pose found together with the focal length.
struct FocalPose {
  AbsolutePose pose;
  Camera camera;  ///< as given, with both focal lengths scaled by one factor
  /// Standard deviation of the focal length over the focal length, from the residuals of the
  /// inliers. Large when the points do not determine it (a plane seen straight on, hardly any
  /// depth).
  double focal_relative_sigma = 0.0;
};

/// Pose and focal length of a camera whose other intrinsics (principal point, distortion, fy / fx)
/// are taken from `camera`.
[[nodiscard]] FocalPose estimate_focal_pose(const Camera& camera,
                                            std::span<const Eigen::Vector2d> pixels,
                                            std::span<const Eigen::Vector3d> points_in_world,
                                            const AbsolutePoseOptions& options,
                                            const FocalSearchOptions& search_options);

}  // namespace trigmesh
