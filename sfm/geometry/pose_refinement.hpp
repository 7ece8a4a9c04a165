// Pose, or pose and focal length, by robust nonlinear least squares on reprojection errors in
// pixels. Shared by the solvers of this folder.
#pragma once

#include <cstdint>
#include <span>

#include <Eigen/Core>

#include "sfm/camera/camera.hpp"
#include "sfm/geometry/rigid3.hpp"

namespace trigmesh {

/// A camera standing somewhere.
struct PosedCamera {
  Camera camera;
  Rigid3 cam_from_world;
};

/// What is adjusted: the six numbers of the pose, or these and a common factor of both focal
/// lengths.
enum class PoseUnknowns { kPose, kPoseAndFocal };

struct PoseRefinement {
  PosedCamera result;
  bool usable = false;  ///< false when a used point is behind the camera at the start
  bool determined =
      false;  ///< false when a combination of the unknowns has no effect on the pixels
  /// Standard deviation of log(focal) for unit pixel noise; 0 for kPose.
  double focal_sigma_per_px = 0.0;
};

/// Minimises sum rho(|project(point) - pixel|) over the matches with a nonzero mask, rho = Cauchy
/// of the given scale.
[[nodiscard]] PoseRefinement refine_pose(const PosedCamera& start,
                                         std::span<const Eigen::Vector2d> pixels,
                                         std::span<const Eigen::Vector3d> points_in_world,
                                         std::span<const std::uint8_t> mask,
                                         double loss_scale_px,
                                         PoseUnknowns unknowns,
                                         int max_iterations);

}  // namespace trigmesh
