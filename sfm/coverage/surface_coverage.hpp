#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "firmware/base/executor.hpp"
#include "sfm/coverage/shooting_direction.hpp"
#include "sfm/coverage/surface_gaps.hpp"

namespace trigmesh {

/// A gap that more photographs would close.
struct ReachableGap {
  GapKind kind = GapKind::kWeak;  ///< of the larger part of it
  Eigen::Vector3d center_in_world = Eigen::Vector3d::Zero();
  double area_ratio = 0.0;  ///< what would be seen of it, of the whole area
  ShootingDirection direction;
};

/// What the views have not seen well, and could. The whole area is that of the subject with what is
/// missing of it.
struct SurfaceCoverage {
  std::vector<ReachableGap> gaps;  ///< by falling area
  double gap_ratio = 0.0;          ///< sum of their areas, of the whole area
};

/// Judges a finished surface by its borders and by which views see it: where is a hole or too few
/// views, and from where would it be seen. Gaps below a thousandth of the subject are not looked
/// at, nor more than the 20 largest. The same input gives the same result with any executor.
/// No views: nothing. O(views x faces).
[[nodiscard]] SurfaceCoverage measure_surface_coverage(const TriangleMesh& mesh,
                                                       std::span<const DenseView> views,
                                                       Executor& executor);

}  // namespace trigmesh
