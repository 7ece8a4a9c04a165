#pragma once

#include <cstddef>
#include <string>

#include <Eigen/Core>
#include <fmt/core.h>
#include <gmock/gmock.h>

#include "sfm/geometry/rigid3.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh::test_support {

/// Angle between two rotations in radians, accurate for small ones.
[[nodiscard]] double rotation_distance_rad(const Eigen::Quaterniond& a,
                                           const Eigen::Quaterniond& b);

/// How far an estimate is from the truth after the best similarity of its cameras.
struct ReconstructionError {
  std::size_t common_views = 0;   ///< registered in both
  std::size_t missing_views = 0;  ///< registered in the truth only
  double scale = 1.0;             ///< truth_from_estimate
  double max_rotation_rad = 0.0;
  double rmse_position = 0.0;  ///< of camera centres, in units of the truth
  double max_position = 0.0;
};

/// Views are compared by position. The similarity is fitted to the centres and axes of the cameras,
/// so that it is defined for cameras in a line too. With fewer than two common views nothing is
/// fitted.
[[nodiscard]] ReconstructionError compare_reconstruction(const Scene& estimate, const Scene& truth);

/// Rotation within `rotation_rad` and camera centre within `position` of `expected`.
MATCHER_P3(Rigid3Near,
           expected,
           rotation_rad,
           position,
           fmt::format("within {} rad and {} of the expected pose", rotation_rad, position)) {
  const Rigid3& actual = arg;
  const Rigid3& wanted = expected;
  const double turned = rotation_distance_rad(actual.rotation, wanted.rotation);
  const double moved = (camera_center(actual) - camera_center(wanted)).norm();
  *result_listener << "turned by " << turned << " rad, centre moved by " << moved;
  return turned <= rotation_rad && moved <= position;
}

/// A scene in which every view that is registered in `truth` is registered too, with each rotation
/// within `rotation_rad` and the root mean square of the camera positions within `position` after
/// similarity alignment.
MATCHER_P3(ReconstructionNear,
           truth,
           rotation_rad,
           position,
           fmt::format("within {} rad and {} of the true cameras", rotation_rad, position)) {
  const ReconstructionError error = compare_reconstruction(arg, truth);
  *result_listener << error.common_views << " common views, " << error.missing_views
                   << " missing, turned by up to " << error.max_rotation_rad
                   << " rad, position rmse " << error.rmse_position << ", max "
                   << error.max_position;
  return error.missing_views == 0 && error.max_rotation_rad <= rotation_rad &&
         error.rmse_position <= position;
}

}  // namespace trigmesh::test_support
