#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "firmware/base/result.hpp"
#include "sfm/matching/matches.hpp"

namespace trigmesh {

/// How an image pair is verified. Defaults: photographs about 1500 pixels wide.
struct VerificationOptions {
  /// Largest Sampson distance of an inlier to the epipolar geometry, and transfer distance to the
  /// homography, pixels, > 0.
  double max_error_px = 2.0;
  /// Fewer agreeing matches are no evidence: kNone. >= 8.
  std::size_t min_inliers = 15;
  /// A homography that explains at least this part of the inliers makes the pair planar or a pure
  /// rotation, (0, 1] (Schoenberger, Frahm, CVPR 2016, section 4.1).
  double min_homography_ratio = 0.8;
  /// A rotation of the camera that explains at least this part of the inliers makes the pair a pure
  /// rotation, (0, 1].
  double min_rotation_ratio = 0.9;
  /// Matches that moved no farther than this, pixels, stand still: an overlay or the same picture.
  /// >= 0.
  double max_still_px = 0.3;
  /// Part of the matches that must stand still for a watermark or duplicate, (0, 1].
  double min_still_ratio = 0.7;
  /// Width of the strip along the border where watermarks are, part of the image diagonal, (0,
  /// 0.5).
  double border_ratio = 0.1;
  /// A duplicate must match this part of the features of the poorer image, (0, 1]; less is an
  /// overlay.
  double min_duplicate_ratio = 0.4;
  /// Samples are drawn from at most this many matches, evenly taken; all matches vote in the end.
  /// >= 50.
  std::size_t max_sampled_matches = 500;
  /// Limit of the search for the fundamental matrix, > 0.
  int max_iterations = 2000;
  /// Of the random generator.
  int seed = 1;

  [[nodiscard]] Result<> validate() const;
};

/// What verification needs of one image; borrowed for the call.
struct VerificationImage {
  /// Undistorted pixels of all keypoints (not only the matched), first pixel centre = (0, 0).
  std::span<const Eigen::Vector2d> points_px;
  int width_px = 0;
  int height_px = 0;
  /// 3x3 K when it is known, at least roughly; without it the focal length of a pure rotation is
  /// searched for.
  std::optional<Eigen::Matrix3d> calibration;
};

/// Finds the fundamental matrix that most matches agree with (USAC: Raguram et al., PAMI 2013, by
/// OpenCV; then local optimisation over all matches with gradient weights, Luong, Faugeras, IJCV
/// 1996, section 3.3), the homography likewise, and decides what the pair is. Inliers are sorted;
/// those of kPureRotation agree with the rotation, those of kPlanar and kGeneral with F, those of
/// kWatermark and kDuplicate stand still. Too few: kNone with no inliers. F is zero when none could
/// be estimated (duplicates, watermarks, sometimes pure rotations). Matches with points that are
/// not finite are ignored. Deterministic.
[[nodiscard]] TwoViewGeometry verify_pair(std::span<const FeatureMatch> matches,
                                          const VerificationImage& first,
                                          const VerificationImage& second,
                                          const VerificationOptions& options);

}  // namespace trigmesh
