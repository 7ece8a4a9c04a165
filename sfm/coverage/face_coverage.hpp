#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "firmware/base/executor.hpp"
#include "sfm/dense/dense_view.hpp"
#include "sfm/surface/triangle_mesh.hpp"

namespace trigmesh {

/// Middle, outward unit normal and area of a face; a zero normal when it has no area.
struct FaceShape {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double area = 0.0;
};

[[nodiscard]] FaceShape face_shape(const TriangleMesh& mesh, std::size_t face);

/// How the views see one face. A view sees it when its middle lies in the picture, it faces the
/// camera at a cosine of at least 0.2, and nothing of the mesh hides it.
struct FaceCoverage {
  std::uint32_t framing_views = 0;  ///< in whose picture its middle lies, hidden or not
  std::uint32_t seeing_views = 0;
  float parallax_rad = 0.0F;  ///< largest angle between the first view that sees it and another
};

/// One entry a face. Pictures are not looked at: masks do not count. One z-buffer a thread is in
/// memory, and four bytes a face for each of a few views at once.
[[nodiscard]] std::vector<FaceCoverage> measure_coverage(const TriangleMesh& mesh,
                                                         std::span<const DenseView> views,
                                                         Executor& executor);

}  // namespace trigmesh
