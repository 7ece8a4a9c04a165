#pragma once

#include <functional>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "sfm/camera/camera.hpp"
#include "sfm/dense/depth_map.hpp"
#include "sfm/dense/patch_match.hpp"
#include "sfm/geometry/rigid3.hpp"

namespace trigmesh::test {

/// Where a ray meets a surface first.
struct Hit {
  double distance = 0.0;  ///< along the direction
  Eigen::Vector3d normal_in_world = Eigen::Vector3d::Zero();
};

/// A surface: the first hit of the ray origin + distance * direction, distance > 0.
using Surface = std::function<std::optional<Hit>(const Eigen::Vector3d& origin,
                                                 const Eigen::Vector3d& direction)>;

/// The plane normal . X = offset, as far as `radius` from `center` (all of it by default).
[[nodiscard]] Surface plane(const Eigen::Vector3d& normal,
                            double offset,
                            const Eigen::Vector3d& center = Eigen::Vector3d::Zero(),
                            double radius = 1e9);
[[nodiscard]] Surface sphere(const Eigen::Vector3d& center, double radius);

/// A pinhole camera of 96x72 pixels, 100 px focal length.
[[nodiscard]] Camera small_camera();
/// A camera at `center` that looks at `target`; y is down.
[[nodiscard]] Rigid3 look_at(const Eigen::Vector3d& center, const Eigen::Vector3d& target);

/// A picture of surfaces with a solid texture (the grey of a point depends on its place only), and
/// the true depth and normals at the pixel centres.
struct RenderedView {
  StereoImage image;
  DepthMap truth;  ///< confidence 255 where there is a surface
};

[[nodiscard]] RenderedView render(const std::vector<Surface>& surfaces,
                                  const Camera& camera,
                                  const Rigid3& cam_from_world);

/// Share of the pixels at least `border_px` inside whose depth is within `ratio` of the truth.
[[nodiscard]] double correct_share(const DepthMap& map,
                                   const DepthMap& truth,
                                   double ratio,
                                   int border_px = 4);

}  // namespace trigmesh::test
