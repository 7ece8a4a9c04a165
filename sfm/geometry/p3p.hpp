#pragma once

#include <array>
#include <cstddef>

#include <Eigen/Core>

#include "sfm/geometry/rigid3.hpp"

namespace trigmesh {

/// Up to four poses, the first `count` entries.
struct P3pSolutions {
  std::array<Rigid3, 4> cam_from_world;
  std::size_t count = 0;
};

/// All camera poses from which three world points are seen along three rays, with positive depths.
/// `rays_in_cam`: unit length. None when the points are collinear or coincide, or when no pose
/// exists.
[[nodiscard]] P3pSolutions solve_p3p(const std::array<Eigen::Vector3d, 3>& rays_in_cam,
                                     const std::array<Eigen::Vector3d, 3>& points_in_world);

}  // namespace trigmesh
