#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "firmware/base/executor.hpp"
#include "sfm/coverage/surface_gaps.hpp"
#include "sfm/dense/dense_view.hpp"
#include "sfm/surface/triangle_mesh.hpp"

namespace trigmesh {

/// Which way is up for whoever held the camera: the direction to which the horizontal axes of the
/// pictures are as perpendicular as can be, on the side of their upper edges. Unit. Where all views
/// look the same way it is the upper edge alone. Precondition: at least one view.
[[nodiscard]] Eigen::Vector3d up_of_views(std::span<const DenseView> views);

/// Where to stand, told from a photograph that exists: one turns around the gap.
struct ShootingDirection {
  std::size_t view = 0;        ///< the existing view that looks at the gap from most nearly there
  double turn_left_rad = 0.0;  ///< around up, as seen by who stood there facing the gap; right < 0
  double rise_rad = 0.0;       ///< how much higher above the horizon; lower < 0
  double elevation_rad = 0.0;  ///< above the horizon of the gap, where to stand
  double visible_area = 0.0;   ///< of the gap, as seen from there, squared scene units
};

/// The direction from which most of a gap would be seen: its normal, or up to 50 degrees beside it
/// where something stands in front, never lower than 20 degrees below the lowest view nor higher
/// than 40 degrees above the highest. Nothing when no such place sees a quarter of it: it lies
/// underneath or inside. Draws the mesh up to 15 times, in parallel. Precondition: at least one
/// view.
[[nodiscard]] std::optional<ShootingDirection> find_shooting_direction(
    const SurfaceGap& gap,
    const TriangleMesh& mesh,
    std::span<const DenseView> views,
    const Eigen::Vector3d& up,
    Executor& executor);

}  // namespace trigmesh
