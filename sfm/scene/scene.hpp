#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "sfm/camera/camera.hpp"
#include "sfm/geometry/rigid3.hpp"
#include "sfm/scene/ids.hpp"

namespace trigmesh {

/// One keypoint that sees a landmark.
struct Observation {
  ViewId view{};
  FeatureIndex feature{};

  auto operator<=>(const Observation&) const = default;
};

/// One image of the scene with its pose, once known.
struct View {
  std::string name;  ///< file name relative to the image folder, '/' as separator
  CameraId camera{};
  std::optional<Rigid3> cam_from_world;       ///< absent while the image is not registered
  std::vector<Eigen::Vector2f> keypoints_px;  ///< first pixel centre = (0, 0)
  std::vector<LandmarkId>
      landmarks;  ///< per keypoint: what it sees, or kNoLandmark; same length as keypoints_px
};

/// A 3D point with the keypoints that see it.
struct Landmark {
  Eigen::Vector3d position_in_world = Eigen::Vector3d::Zero();
  std::array<std::uint8_t, 3> color_rgb{};
  double error_px = 0.0;           ///< mean reprojection error over the track
  std::vector<Observation> track;  ///< sorted; at least two views, at most one keypoint of each
};

/// Cameras, poses and points in one world frame: the result of mapping, the input of everything
/// after it. Plain data. `views[i].landmarks` and `landmarks[j].track` say the same thing from both
/// sides; `validate` checks it.
struct Scene {
  std::vector<Camera> cameras;
  std::vector<View> views;
  std::vector<Landmark> landmarks;

  /// Every index in range, both sides of every observation present, tracks sorted, poses and points
  /// finite. Used by readers on what they read: a broken file gives kCorruptData with the first
  /// contradiction.
  [[nodiscard]] Result<> validate() const;
  /// How many views have a pose.
  [[nodiscard]] std::size_t registered_count() const;
};

}  // namespace trigmesh
