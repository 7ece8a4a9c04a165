// Random cameras and points for the tests of the solvers; std::mt19937 and hand-made distributions,
// so that the numbers are the same everywhere.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "sfm/camera/camera.hpp"
#include "sfm/geometry/rigid3.hpp"

namespace trigmesh::synthetic {

class Random {
 public:
  explicit Random(std::uint32_t seed) : engine_(seed) {}

  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_()) * 0x1p-32);
  }

  double gauss() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform(0.0, 1.0)));
    return radius * std::cos(uniform(0.0, 2.0 * std::numbers::pi));
  }

  Eigen::Vector2d gauss2(double sigma) {
    const double x = gauss();
    const double y = gauss();
    return sigma * Eigen::Vector2d(x, y);
  }

  /// Uniform in [0, width) x [0, height). The order of the two calls is fixed; that of arguments is
  /// not.
  Eigen::Vector2d in_rectangle(double width, double height) {
    const double x = uniform(0.0, width);
    const double y = uniform(0.0, height);
    return {x, y};
  }

  Eigen::Vector3d in_box(double half) {
    const double x = uniform(-half, half);
    const double y = uniform(-half, half);
    const double z = uniform(-half, half);
    return {x, y, z};
  }

  Eigen::Quaterniond rotation() {
    const double a = gauss();
    const double b = gauss();
    const double c = gauss();
    const double d = gauss();
    return Eigen::Quaterniond(a, b, c, d).normalized();
  }

 private:
  std::mt19937 engine_;
};

inline Camera pinhole() {
  return {.model = CameraModel::kPinhole,
          .width_px = 1600,
          .height_px = 1200,
          .fx_px = 1300.0,
          .fy_px = 1290.0,
          .cx_px = 795.0,
          .cy_px = 605.0};
}

inline Camera brown_conrady() {
  Camera camera = pinhole();
  camera.model = CameraModel::kBrownConrady;
  camera.distortion = {-0.12, 0.04, 0.0008, -0.0005};
  return camera;
}

inline Camera fisheye() {
  Camera camera = pinhole();
  camera.model = CameraModel::kKannalaBrandt;
  camera.fx_px = 520.0;
  camera.fy_px = 518.0;
  camera.distortion = {0.02, -0.008, 0.002, -0.0003};
  return camera;
}

/// A camera at `center` that looks at `target`, image x roughly level.
inline Rigid3 look_at(const Eigen::Vector3d& center, const Eigen::Vector3d& target) {
  const Eigen::Vector3d z = (target - center).normalized();
  const Eigen::Vector3d hint =
      std::abs(z.y()) < 0.9 ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX();
  const Eigen::Vector3d x = hint.cross(z).normalized();
  Eigen::Matrix3d world_from_cam;
  world_from_cam << x, z.cross(x), z;
  const Eigen::Quaterniond rotation(Eigen::Matrix3d(world_from_cam.transpose()));
  return {rotation, -(rotation * center)};
}

/// `count` cameras on an arc of `arc_rad` and radius 5 around the origin, looking at it.
inline std::vector<Rigid3> arc_of_cameras(std::size_t count, double arc_rad) {
  std::vector<Rigid3> poses;
  for (std::size_t i = 0; i < count; ++i) {
    const double a =
        arc_rad *
        (static_cast<double>(i) / static_cast<double>(std::max<std::size_t>(1, count - 1)) - 0.5);
    poses.push_back(look_at({5.0 * std::sin(a), -0.4 * std::sin(3.0 * a), -5.0 * std::cos(a)},
                            Eigen::Vector3d::Zero()));
  }
  return poses;
}

inline double rotation_distance_rad(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return rotation_angle(a * b.conjugate());
}

/// Angle between two directions, radians, [0, pi].
inline double direction_distance_rad(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace trigmesh::synthetic
