#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "firmware/base/result.hpp"
#include "sfm/dense/dense_view.hpp"
#include "sfm/dense/depth_map.hpp"

namespace trigmesh {

/// What one pixel says: a small plane in front of the camera. 32 bytes, read together.
struct PixelPlane {
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< camera frame, unit, towards the camera
  float offset = 0.0F;                               ///< normal . x of the points x of the plane
  float depth = 0.0F;                                ///< z; 0 = nothing known
  float weight = 0.0F;  ///< confidence * cosine of the viewing angle / (pixel footprint)^2, scaled
  float free_depth = 0.0F;  ///< space is empty up to here: the nearest depth of the pixels around
  float padding = 0.0F;
};

/// A depth map made ready to be asked about points of the world.
struct DepthFrame {
  Eigen::Matrix3f rotation_cam_from_world = Eigen::Matrix3f::Identity();
  Eigen::Vector3f translation_cam_from_world = Eigen::Vector3f::Zero();
  float fx_px = 0.0F;
  float fy_px = 0.0F;
  float cx_px = 0.0F;
  float cy_px = 0.0F;
  int width_px = 0;
  int height_px = 0;
  std::vector<PixelPlane> planes;  ///< row by row

  [[nodiscard]] Eigen::Vector3f to_camera(const Eigen::Vector3f& point_in_world) const {
    return rotation_cam_from_world * point_in_world + translation_cam_from_world;
  }

  /// The plane that the pixel nearest to a point in front of the camera holds; null outside the
  /// picture, behind the camera and where nothing is known.
  [[nodiscard]] const PixelPlane* find_plane(const Eigen::Vector3f& point_in_cam) const;
};

/// Which pixels take part.
struct DepthFrameOptions {
  float voxel_size = 1.0F;  ///< scene units; weights are scaled so that footprint = voxel gives 1
  float max_footprint_voxels = 5.0F;
};

/// kInvalidArgument: a map whose parts do not have the size of its camera or the wrong type, or a
/// camera with distortion. An empty depth map gives a frame without planes.
[[nodiscard]] Result<DepthFrame> make_depth_frame(const DepthMap& map,
                                                  const Rigid3& cam_from_world,
                                                  const DepthFrameOptions& options);

}  // namespace trigmesh
