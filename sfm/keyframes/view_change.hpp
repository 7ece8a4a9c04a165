#pragma once

#include <span>

#include <Eigen/Core>

namespace trigmesh {

/// How far a camera turned and moved between two views of the same corners.
struct ViewChange {
  double motion_deg = 0.0;    ///< median angle between the rays to a corner in both views
  double parallax_deg = 0.0;  ///< the same after the best rotation: a lower bound of the parallax
};

/// From the rays (unit vectors in the camera's frame) to each corner in both views. The rotation
/// minimises the sum of the angles (reweighted least squares of Kabsch's solution, Acta Cryst. A32,
/// 1976), so that a near thing does not spoil it. Fewer than 3 rays: zero. Precondition: as many
/// rays in both.
[[nodiscard]] ViewChange view_change(std::span<const Eigen::Vector3d> first,
                                     std::span<const Eigen::Vector3d> second);

}  // namespace trigmesh
