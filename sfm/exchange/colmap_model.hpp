#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "firmware/base/result.hpp"
#include "sfm/camera/camera.hpp"
#include "sfm/geometry/rigid3.hpp"
#include "sfm/scene/scene.hpp"

// What COLMAP's text and binary files have in common: the lens models, the pixel shift, and the
// step from three tables with identifiers of their own to a Scene. Poses are the same on both sides
// (world to camera, Hamilton quaternions).

namespace trigmesh {

/// COLMAP's (0, 0) is the corner of the first pixel, ours is its centre.
inline constexpr double kColmapPixelShift = 0.5;

/// A lens model of COLMAP.
struct ColmapModel {
  std::int32_t id = -1;
  std::string_view name;
  std::size_t parameter_count = 0;
  /// What it becomes here; absent for models that this build cannot represent.
  std::optional<CameraModel> model;
};

/// All models that COLMAP knows, those without an equivalent here too; nothing for an unknown name
/// or id.
[[nodiscard]] const ColmapModel* find_colmap_model(std::string_view name);
[[nodiscard]] const ColmapModel* find_colmap_model(std::int32_t id);

/// Parameters in COLMAP's order for the model, COLMAP's pixel convention.
struct ColmapParameters {
  const ColmapModel* model = nullptr;
  std::array<double, 8> values{};

  [[nodiscard]] std::span<const double> used() const {
    return std::span(values).first(model->parameter_count);
  }
};

/// PINHOLE, RADIAL (or OPENCV without tangential terms when fx and fy differ), OPENCV,
/// OPENCV_FISHEYE.
[[nodiscard]] ColmapParameters colmap_from_camera(const Camera& camera);

/// `parameters` has as many entries as the model says. kUnsupported for a model without an
/// equivalent, kCorruptData for values that are no camera; the message does not say where.
[[nodiscard]] Result<Camera> camera_from_colmap(const ColmapModel& model,
                                                std::uint64_t width_px,
                                                std::uint64_t height_px,
                                                std::span<const double> parameters);

/// A unit rotation and a translation from file values. kCorruptData when there is no direction in
/// the quaternion. A quaternion that is a unit one up to rounding is kept as it is, so that writing
/// and reading again changes nothing.
[[nodiscard]] Result<Rigid3> pose_from_colmap(const std::array<double, 4>& qw_qx_qy_qz,
                                              const Eigen::Vector3d& translation);

/// COLMAP pixel to ours; nothing when it does not fit a float.
[[nodiscard]] std::optional<Eigen::Vector2f> keypoint_from_colmap(double x, double y);

inline constexpr std::uint64_t kNoColmapPoint = std::numeric_limits<std::uint64_t>::max();

/// cameras: CAMERA_ID and camera.
using ColmapCamera = std::pair<std::uint32_t, Camera>;

/// One entry of images: ours in pixels, COLMAP's in identifiers.
struct ColmapImage {
  std::uint32_t id = 0;
  std::uint32_t camera_id = 0;
  std::string name;
  Rigid3 cam_from_world;
  std::vector<Eigen::Vector2f> keypoints_px;  ///< first pixel centre = (0, 0)
  std::vector<std::uint64_t> point_ids;       ///< per keypoint, kNoColmapPoint for none
};

/// One entry of points3D.
struct ColmapPoint {
  std::uint64_t id = 0;
  Eigen::Vector3d position_in_world = Eigen::Vector3d::Zero();
  std::array<std::uint8_t, 3> color_rgb{};
  double error_px = 0.0;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> track;  ///< IMAGE_ID, POINT2D_IDX
};

struct ColmapTables {
  std::vector<ColmapCamera> cameras;
  std::vector<ColmapImage> images;
  std::vector<ColmapPoint> points;
};

/// A valid Scene, everything sorted by its COLMAP identifier. The images and the tracks must say
/// the same (kCorruptData otherwise). COLMAP permits a track with two keypoints of one image: the
/// first is kept, the other becomes free; points that are left with fewer than two images are
/// dropped.
[[nodiscard]] Result<Scene> scene_from_colmap(ColmapTables tables);

/// kUnsupported for names that no line of text can hold (empty, line break, zero byte).
[[nodiscard]] Result<> check_colmap_name(std::string_view name);

}  // namespace trigmesh
