#include "tests/support/matchers.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Geometry>

namespace trigmesh::test_support {
namespace {

/// Mean distance of the centres from their mean.
double spread(const std::vector<Rigid3>& poses) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Rigid3& pose : poses) {
    mean += camera_center(pose) / static_cast<double>(poses.size());
  }
  double sum = 0.0;
  for (const Rigid3& pose : poses) {
    sum += (camera_center(pose) - mean).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(poses.size()));
}

/// Four columns a camera: its centre and the tips of its axes.
Eigen::Matrix3Xd frames_of(const std::vector<Rigid3>& poses, double axis_length) {
  Eigen::Matrix3Xd tips(3, 4 * static_cast<Eigen::Index>(poses.size()));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Matrix3d axes = poses[i].rotation.toRotationMatrix().transpose();
    const Eigen::Vector3d center = camera_center(poses[i]);
    const auto column = 4 * static_cast<Eigen::Index>(i);
    tips.col(column) = center;
    tips.middleCols<3>(column + 1) = (axis_length * axes).colwise() + center;
  }
  return tips;
}

}  // namespace

double rotation_distance_rad(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return rotation_angle(a.conjugate() * b);
}

ReconstructionError compare_reconstruction(const Scene& estimate, const Scene& truth) {
  ReconstructionError error;
  std::vector<Rigid3> estimated;
  std::vector<Rigid3> wanted;
  for (std::size_t i = 0; i < truth.views.size(); ++i) {
    if (!truth.views[i].cam_from_world) {
      continue;
    }
    if (i < estimate.views.size() && estimate.views[i].cam_from_world) {
      estimated.push_back(*estimate.views[i].cam_from_world);
      wanted.push_back(*truth.views[i].cam_from_world);
    } else {
      ++error.missing_views;
    }
  }
  error.common_views = wanted.size();
  if (wanted.size() < 2) {
    return error;
  }
  const double estimated_spread = spread(estimated);
  const double wanted_spread = spread(wanted);
  const bool in_one_place = !(estimated_spread > 0.0) || !(wanted_spread > 0.0);
  const Eigen::Matrix4d truth_from_estimate =
      Eigen::umeyama(frames_of(estimated, in_one_place ? 1.0 : estimated_spread),
                     frames_of(wanted, in_one_place ? 1.0 : wanted_spread),
                     true);
  error.scale = std::cbrt(truth_from_estimate.topLeftCorner<3, 3>().determinant());
  const Eigen::Matrix3d rotation = truth_from_estimate.topLeftCorner<3, 3>() / error.scale;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const Eigen::Vector3d center =
        (truth_from_estimate * camera_center(estimated[i]).homogeneous()).head<3>();
    const double moved = (center - camera_center(wanted[i])).norm();
    const Eigen::Quaterniond aligned =
        estimated[i].rotation * Eigen::Quaterniond(rotation).conjugate();
    error.rmse_position += moved * moved / static_cast<double>(wanted.size());
    error.max_position = std::max(error.max_position, moved);
    error.max_rotation_rad =
        std::max(error.max_rotation_rad, rotation_distance_rad(aligned, wanted[i].rotation));
  }
  error.rmse_position = std::sqrt(error.rmse_position);
  return error;
}

}  // namespace trigmesh::test_support
