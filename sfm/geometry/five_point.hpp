#pragma once

#include <array>
#include <cstddef>

#include <Eigen/Core>

namespace trigmesh {

/// Up to ten essential matrices, the first `count` entries; Frobenius norm 1.
struct FivePointSolutions {
  std::array<Eigen::Matrix3d, 10> essentials;
  std::size_t count = 0;
};

/// All real essential matrices with ray_in_second^T E ray_in_first = 0 for five matches. Rays of
/// any length, both signs. None when two matches are equal or the system is otherwise singular;
/// points on one plane are fine.
[[nodiscard]] FivePointSolutions solve_five_point(
    const std::array<Eigen::Vector3d, 5>& rays_in_first,
    const std::array<Eigen::Vector3d, 5>& rays_in_second);

}  // namespace trigmesh
