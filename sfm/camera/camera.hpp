#pragma once

#include <array>
#include <optional>
#include <string_view>

#include <Eigen/Core>

#include "firmware/base/result.hpp"

namespace trigmesh {

/// How a ray becomes a pixel. Coordinates: camera looks along +z, x right, y down; (u, v) = (x/z,
/// y/z).
enum class CameraModel {
  kPinhole,        ///< no distortion
  kRadial,         ///< u (1 + k1 r^2 + k2 r^4)                       distortion = k1 k2 0 0
  kBrownConrady,   ///< radial k1 k2 and tangential p1 p2 (OpenCV)    distortion = k1 k2 p1 p2
  kKannalaBrandt,  ///< fisheye: theta (1 + k1 theta^2 + ... k4 theta^8)  distortion = k1 k2 k3 k4
};

/// Order of the intrinsic parameters wherever they stand in one vector: fx fy cx cy d0 d1 d2 d3.
inline constexpr int kIntrinsicsCount = 8;
using IntrinsicsVector = Eigen::Matrix<double, kIntrinsicsCount, 1>;

/// One camera with its lens. Pixels: the centre of the first pixel is (0, 0), x right, y down, as
/// in OpenCV.
struct Camera {
  CameraModel model = CameraModel::kPinhole;
  int width_px = 0;
  int height_px = 0;
  double fx_px = 0.0;
  double fy_px = 0.0;
  double cx_px = 0.0;
  double cy_px = 0.0;
  /// Meaning by model, see CameraModel; unused entries are zero.
  std::array<double, 4> distortion{};

  /// Sizes positive, focal lengths positive and finite, everything finite.
  [[nodiscard]] Result<> validate() const;
  [[nodiscard]] IntrinsicsVector intrinsics() const;
  void set_intrinsics(const IntrinsicsVector& values);
  /// 3x3 K, undistorted pixels from camera rays.
  [[nodiscard]] Eigen::Matrix3d calibration_matrix() const;

  bool operator==(const Camera&) const = default;
};

/// How many entries of `Camera::distortion` the model uses (0, 2, 4, 4).
[[nodiscard]] int distortion_count(CameraModel model);
/// "pinhole", "radial", "brown_conrady", "kannala_brandt".
[[nodiscard]] std::string_view to_string(CameraModel model);
[[nodiscard]] std::optional<CameraModel> camera_model_from_string(std::string_view name);

/// Pixel of a point given in the camera frame; nothing when the point is behind the camera (z <= 0;
/// for the fisheye: at the centre) or the projection is not finite.
[[nodiscard]] std::optional<Eigen::Vector2d> project(const Camera& camera,
                                                     const Eigen::Vector3d& point_in_cam);

/// Pixel with its derivatives, for bundle adjustment.
struct ProjectionDerivatives {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 3> d_point;                      ///< by the point in the camera frame
  Eigen::Matrix<double, 2, kIntrinsicsCount> d_intrinsics;  ///< by fx fy cx cy d0 d1 d2 d3
};

[[nodiscard]] std::optional<ProjectionDerivatives> project_with_derivatives(
    const Camera& camera, const Eigen::Vector3d& point_in_cam);

/// Normalised image coordinates (x/z, y/z) of the ray through a pixel, distortion removed by Newton
/// iteration. Nothing when the iteration does not converge (outside the invertible part of the lens
/// model) or, for the fisheye, when the ray is 90 degrees or more off the axis.
[[nodiscard]] std::optional<Eigen::Vector2d> normalize_pixel(const Camera& camera,
                                                             const Eigen::Vector2d& pixel);

}  // namespace trigmesh
