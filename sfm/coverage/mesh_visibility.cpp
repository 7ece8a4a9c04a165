#include "sfm/coverage/mesh_visibility.hpp"

#include <algorithm>
#include <cmath>

#include "firmware/base/check.hpp"
#include "sfm/dense/undistortion.hpp"
#include "sfm/texture/mesh_projection.hpp"

namespace trigmesh {
namespace {

// At a cosine of 0.2 the depth of a plane changes by five footprints from pixel to pixel.
constexpr double kSlackFootprints = 6.0;

Camera reduced(const Camera& camera, int longest_side_px) {
  const int longest = std::max(camera.width_px, camera.height_px);
  if (longest <= longest_side_px) {
    return camera;
  }
  const double scale = static_cast<double>(longest_side_px) / longest;
  const auto side = [scale](int pixels) {
    return std::max(1, static_cast<int>(std::lround(scale * pixels)));
  };
  return scaled_pinhole(camera, side(camera.width_px), side(camera.height_px));
}

}  // namespace

MeshVisibility::MeshVisibility(const TriangleMesh& mesh,
                               const Camera& camera,
                               const Rigid3& cam_from_world,
                               int longest_side_px)
    : camera_(reduced(camera, longest_side_px)),
      cam_from_world_(cam_from_world),
      center_in_world_(camera_center(cam_from_world)),
      inverse_depth_(render_inverse_depth(mesh,
                                          project_mesh(mesh, camera_, cam_from_world),
                                          {camera_.width_px, camera_.height_px})) {}

std::optional<Eigen::Vector3d> MeshVisibility::pixel_of(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d in_cam = cam_from_world_ * point;
  const auto pixel = project(camera_, in_cam);
  if (!pixel || pixel->x() <= -0.5 || pixel->y() <= -0.5 || pixel->x() >= camera_.width_px - 0.5 ||
      pixel->y() >= camera_.height_px - 0.5) {
    return std::nullopt;
  }
  return Eigen::Vector3d(pixel->x(), pixel->y(), in_cam.z());
}

bool MeshVisibility::frames(const Eigen::Vector3d& point_in_world) const {
  return pixel_of(point_in_world).has_value();
}

bool MeshVisibility::sees(const Eigen::Vector3d& point_in_world) const {
  const auto pixel = pixel_of(point_in_world);
  if (!pixel) {
    return false;
  }
  const int x = static_cast<int>(std::lround(pixel->x()));
  const int y = static_cast<int>(std::lround(pixel->y()));
  const auto nearest = static_cast<double>(inverse_depth_.at<float>(
      std::clamp(y, 0, camera_.height_px - 1), std::clamp(x, 0, camera_.width_px - 1)));
  // A step of s along the axis is s / depth * focal footprints of a pixel.
  return (nearest * pixel->z() - 1.0) * camera_.fx_px <= kSlackFootprints;
}

}  // namespace trigmesh
