#pragma once

#include <optional>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "sfm/camera/camera.hpp"
#include "sfm/geometry/rigid3.hpp"
#include "sfm/surface/triangle_mesh.hpp"

namespace trigmesh {

/// What a camera could see of a mesh, by a z-buffer of moderate size. Thread-safe after it is made.
class MeshVisibility {
 public:
  /// Draws the mesh, at most `longest_side_px` wide or high; > 0. `camera`: kPinhole.
  MeshVisibility(const TriangleMesh& mesh,
                 const Camera& camera,
                 const Rigid3& cam_from_world,
                 int longest_side_px);

  /// Whether the point lies inside the picture, hidden or not.
  [[nodiscard]] bool frames(const Eigen::Vector3d& point_in_world) const;

  /// Whether it does and no part of the mesh is in front of it by more than a few pixels'
  /// footprint: a point of the mesh itself is seen, also at a grazing angle.
  [[nodiscard]] bool sees(const Eigen::Vector3d& point_in_world) const;

  [[nodiscard]] const Eigen::Vector3d& center_in_world() const { return center_in_world_; }

 private:
  /// Pixel and depth along the axis; nothing outside of the picture.
  [[nodiscard]] std::optional<Eigen::Vector3d> pixel_of(const Eigen::Vector3d& point) const;

  Camera camera_;
  Rigid3 cam_from_world_;
  Eigen::Vector3d center_in_world_;
  cv::Mat inverse_depth_;
};

}  // namespace trigmesh
