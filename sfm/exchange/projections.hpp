#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "firmware/base/result.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// One image of projections.txt.
struct NamedProjection {
  std::string name;
  /// P = K [R|t], 3x4: homogeneous undistorted pixels (first pixel centre = (0, 0)) from
  /// homogeneous world points.
  Eigen::Matrix<double, 3, 4> projection = Eigen::Matrix<double, 3, 4>::Zero();
};

/// The n camera matrices of the method's paper: one line for each registered view, the name and the
/// 12 numbers of P row by row. Lens distortion is no part of P. kUnsupported for a name with a line
/// break.
[[nodiscard]] Result<std::string> write_projections(const Scene& scene);

/// The name is everything before the last 12 fields and may hold blanks.
[[nodiscard]] Result<std::vector<NamedProjection>> read_projections(std::string_view text);

}  // namespace trigmesh
