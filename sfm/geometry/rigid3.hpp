#pragma once

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace trigmesh {

/// Rigid motion between two frames. A value named `b_from_a` maps a point: point_in_b = b_from_a *
/// point_in_a.
struct Rigid3 {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< unit, Hamilton
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  [[nodiscard]] Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return rotation * point + translation;
  }

  /// c_from_b * b_from_a = c_from_a.
  [[nodiscard]] Rigid3 operator*(const Rigid3& other) const {
    return {(rotation * other.rotation).normalized(), rotation * other.translation + translation};
  }

  [[nodiscard]] Rigid3 inverse() const {
    const Eigen::Quaterniond back = rotation.conjugate();
    return {back, -(back * translation)};
  }

  /// 3x4 matrix [R|t].
  [[nodiscard]] Eigen::Matrix<double, 3, 4> matrix() const {
    Eigen::Matrix<double, 3, 4> m;
    m << rotation.toRotationMatrix(), translation;
    return m;
  }
};

/// Where the camera stands, in the world, given `cam_from_world`: C = -R^T t.
[[nodiscard]] inline Eigen::Vector3d camera_center(const Rigid3& cam_from_world) {
  return -(cam_from_world.rotation.conjugate() * cam_from_world.translation);
}

/// Angle of a rotation in radians, [0, pi].
[[nodiscard]] inline double rotation_angle(const Eigen::Quaterniond& rotation) {
  return 2.0 * std::atan2(rotation.vec().norm(), std::abs(rotation.w()));
}

}  // namespace trigmesh
