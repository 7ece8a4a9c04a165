#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "sfm/camera/camera.hpp"
#include "sfm/scene/ids.hpp"

namespace trigmesh {

/// The epipolar geometry of one pair as evidence for focal lengths.
struct FocalEvidence {
  CameraId first{};
  CameraId second{};
  Eigen::Matrix3d fundamental = Eigen::Matrix3d::Zero();  ///< second^T F first = 0, pixels
  double weight = 1.0;                                    ///< e.g. number of inliers
};

/// Finds the focal lengths (pixels, fx = fy) of the cameras marked `unknown` under which the
/// essential matrices K2^T F K1 of all pairs come nearest to having two equal singular values
/// (Mendonca and Cipolla, "A simple technique for self-calibration", CVPR 1999, eq. 8, with a
/// truncated cost so that wrong pairs do not pull), searched on a logarithmic grid of 0.4 to 4
/// times the longer image side, each camera group by its own pairs first, then one after the other
/// by all until nothing changes. Principal
/// points are as in `cameras`. A group without evidence keeps 1.2 times the longer side. Result:
/// one focal length per camera; known ones unchanged.
[[nodiscard]] std::vector<double> vote_focal_lengths(std::span<const Camera> cameras,
                                                     const std::vector<bool>& unknown,
                                                     std::span<const FocalEvidence> evidence);

}  // namespace trigmesh
