#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "sfm/geometry/rigid3.hpp"

namespace trigmesh {

enum class HomographyOutcome {
  kOk,
  kTooFewPoints,  ///< fewer than four matches
  kDegenerate,    ///< three of four on a line, or all on one: more than one homography fits
};

struct HomographyEstimate {
  HomographyOutcome outcome = HomographyOutcome::kTooFewPoints;
  /// second ~ H first in homogeneous pixels; 3x3, Frobenius norm 1, positive determinant where
  /// possible.
  Eigen::Matrix3d second_from_first = Eigen::Matrix3d::Zero();
};

/// Least squares over all matches (normalised DLT). Not robust; first[i] matches second[i]. `mask`:
/// the matches to use (empty: all).
[[nodiscard]] HomographyEstimate estimate_homography(std::span<const Eigen::Vector2d> first,
                                                     std::span<const Eigen::Vector2d> second,
                                                     std::span<const std::uint8_t> mask = {});

/// Squared distance of the second point to the image of the first, pixels squared; infinite when
/// that lies at infinity.
[[nodiscard]] double transfer_error_squared(const Eigen::Matrix3d& second_from_first,
                                            const Eigen::Vector2d& first,
                                            const Eigen::Vector2d& second);

/// Sum of the transfer errors in both images, squared; infinite when the homography is singular.
[[nodiscard]] double symmetric_transfer_error_squared(const Eigen::Matrix3d& second_from_first,
                                                      const Eigen::Vector2d& first,
                                                      const Eigen::Vector2d& second);

/// What a homography says about a camera that only turned: H ~ K2 R K1^-1.
struct RotationFromHomography {
  Eigen::Quaterniond second_from_first = Eigen::Quaterniond::Identity();  ///< nearest rotation
  /// Largest deviation of a singular value of K2^-1 H K1 (scaled to determinant one) from 1. Near 0
  /// for a pure rotation; of the order of baseline / distance for a plane seen from two places.
  double deviation = 0.0;
};

/// Nothing when the homography is singular.
[[nodiscard]] std::optional<RotationFromHomography> rotation_from_homography(
    const Eigen::Matrix3d& second_from_first,
    const Eigen::Matrix3d& first_calibration,
    const Eigen::Matrix3d& second_calibration);

/// A plane seen from two places is explained by two motions. Given one of them and the homography
/// of the plane in normalised coordinates (x/z, y/z), second ~ H first, the other one; |t| = 1.
/// Nothing when the homography is singular or the motion has no translation that it needs.
[[nodiscard]] std::optional<Rigid3> other_motion_of_plane(
    const Eigen::Matrix3d& second_from_first_normalized, const Rigid3& second_from_first);

}  // namespace trigmesh
