#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include <Eigen/Core>

#include "sfm/camera/camera.hpp"
#include "sfm/geometry/rigid3.hpp"
#include "sfm/mapping/bundle_adjustment.hpp"

// The reprojection error with its derivatives by pose, point and intrinsics; free of any solver.

namespace trigmesh {

/// A pose under adjustment: six numbers around a base that does not move during one adjustment,
///   cam_from_world = (R(w), t) * base,  R(w) = the rotation of the quaternion (1, w / 2) made
///   unit,
/// parameters = (w, t). R(w) is rational in w (no trigonometry) and, like exp, turns by |w| rad for
/// small w.
struct PoseState {
  static constexpr int kSize = 6;

  Rigid3 base;
  std::array<double, kSize> parameters{};
  /// A coordinate of t that keeps its value because it holds the scale: its derivatives are zero.
  /// -1: none.
  int frozen_translation = -1;

  // Derived from the above by `update`.
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();      ///< of cam_from_world
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();       ///< of cam_from_world
  Eigen::Vector3d step_translation = Eigen::Vector3d::Zero();  ///< t
  Eigen::Matrix3d spin_by_parameters =
      Eigen::Matrix3d::Identity();  ///< d(angular motion in camera frame) / dw

  /// To be called after the parameters changed.
  void update();
  [[nodiscard]] Rigid3 cam_from_world() const;
};

/// The intrinsics of a camera under adjustment: the free ones in one vector, padded to one of two
/// fixed sizes. Entries: 0 focal (fx; fy follows), 1 cx, 2 cy, 3..6 distortion.
struct IntrinsicsState {
  static constexpr int kEntries = 7;
  static constexpr int kSmallSize =
      6;  ///< the size of a pose, for which the solver has its fastest code
  static constexpr int kFullSize = 7;

  Camera camera;
  double aspect_ratio = 1.0;         ///< fy / fx, constant
  std::array<int, kEntries> free{};  ///< which entries are free, ascending
  int free_count = 0;
  std::array<double, kFullSize>
      parameters{};  ///< values of the free entries; the rest has no effect

  IntrinsicsState(const Camera& start, const IntrinsicsFreedom& freedom);
  /// 0 when nothing is free.
  [[nodiscard]] int block_size() const;
  /// Brings `camera` to the parameters.
  void update();
};

/// One keypoint that sees a point, in positions of the arrays of the problem.
struct BundleObservation {
  std::uint32_t pose = 0;
  std::uint32_t camera = 0;
  std::uint32_t point = 0;
  float inverse_sigma = 1.0F;
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
};

/// The residual (weighted by 1 / sigma) in place of one that cannot be computed, on each
/// coordinate.
inline constexpr double kUnprojectablePx = 1000.0;

using PointJacobian = Eigen::Matrix<double, 2, 3, Eigen::RowMajor>;
using PoseJacobian = Eigen::Matrix<double, 2, PoseState::kSize, Eigen::RowMajor>;

/// Where derivatives are wanted; null where not. Intrinsics: 2 x block_size(), row-major.
struct ReprojectionJacobians {
  double* pose = nullptr;
  double* point = nullptr;
  double* intrinsics = nullptr;
};

/// (projection - pixel) / sigma. Not projectable: kUnprojectablePx / sigma twice and zero
/// derivatives.
Eigen::Vector2d evaluate_reprojection(const PoseState& pose,
                                      const IntrinsicsState& intrinsics,
                                      const Eigen::Vector3d& point_in_world,
                                      const BundleObservation& observation,
                                      const ReprojectionJacobians& jacobians);

}  // namespace trigmesh
