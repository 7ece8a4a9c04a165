#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "sfm/geometry/rigid3.hpp"
#include "sfm/geometry/sampling.hpp"

namespace trigmesh {

/// Rotation, translation and scale between two worlds: point_in_b = scale * (rotation * point_in_a)
/// + translation for a value named `b_from_a`.
struct Sim3 {
  double scale = 1.0;                                            ///< > 0
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< unit, Hamilton
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  [[nodiscard]] Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return scale * (rotation * point) + translation;
  }

  /// c_from_b * b_from_a = c_from_a.
  [[nodiscard]] Sim3 operator*(const Sim3& other) const {
    return {scale * other.scale,
            (rotation * other.rotation).normalized(),
            scale * (rotation * other.translation) + translation};
  }

  [[nodiscard]] Sim3 inverse() const {
    const Eigen::Quaterniond back = rotation.conjugate();
    return {1.0 / scale, back, -(back * translation) / scale};
  }
};

/// The pose of the same camera in world b: its centre moves with `b_from_a`, its depths are
/// measured in the units of b.
[[nodiscard]] Rigid3 transform_pose(const Sim3& b_from_a, const Rigid3& cam_from_a);

/// Whether the scale between the two sets is known to be one.
enum class ScaleMode { kFixedToOne, kEstimated };

enum class AlignmentOutcome {
  kOk,
  kTooFewPoints,   ///< fewer than three pairs
  kDegenerate,     ///< the points lie on one line or coincide: a rotation about it stays free
  kTooFewInliers,  ///< robust version only: no motion explains the asked number of pairs
};

struct Alignment {
  AlignmentOutcome outcome = AlignmentOutcome::kTooFewPoints;
  Sim3 b_from_a;
  double rmse = 0.0;   ///< of the pairs used, in units of b
  InlierMask inliers;  ///< robust version only
  std::size_t inlier_count = 0;
};

/// Least-squares motion that carries points_in_a[i] to points_in_b[i] (Umeyama 1991); same length.
/// Coplanar points are fine; reflections are never returned.
[[nodiscard]] Alignment align_points(std::span<const Eigen::Vector3d> points_in_a,
                                     std::span<const Eigen::Vector3d> points_in_b,
                                     ScaleMode scale_mode);

struct RobustAlignmentOptions {
  double max_error = 0.0;  ///< pairs farther apart than this are outliers; units of b, > 0
  ScaleMode scale_mode = ScaleMode::kEstimated;
  std::size_t min_inliers = 4;
  std::size_t max_iterations = 2000;
  double confidence = 0.9999;  ///< (0, 1)
  std::uint64_t seed = 1;
};

/// The same in the presence of wrong pairs: samples of three, scored by truncated squares, refitted
/// on the inliers.
[[nodiscard]] Alignment align_points_robust(std::span<const Eigen::Vector3d> points_in_a,
                                            std::span<const Eigen::Vector3d> points_in_b,
                                            const RobustAlignmentOptions& options);

}  // namespace trigmesh
