#include "sfm/keyframes/view_change.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/SVD>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kReweightings = 6;
/// Keeps the weight of a perfect ray finite, radians: a tenth of a pixel of a small image.
constexpr double kSmallestAngle = 3e-4;

double angle_between(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

double median_deg(std::vector<double> angles) {
  const auto middle = angles.begin() + static_cast<std::ptrdiff_t>(angles.size() / 2);
  std::nth_element(angles.begin(), middle, angles.end());
  return *middle * 180.0 / std::numbers::pi;
}

std::vector<double> angles_after(const Matrix3d& rotation,
                                 std::span<const Vector3d> first,
                                 std::span<const Vector3d> second) {
  std::vector<double> angles(first.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    angles[i] = angle_between(rotation * first[i], second[i]);
  }
  return angles;
}

Matrix3d weighted_rotation(std::span<const Vector3d> first,
                           std::span<const Vector3d> second,
                           std::span<const double> angles) {
  Matrix3d moments = Matrix3d::Zero();
  for (std::size_t i = 0; i < first.size(); ++i) {
    moments += second[i] * first[i].transpose() / std::max(angles[i], kSmallestAngle);
  }
  const Eigen::JacobiSVD<Matrix3d> svd(moments, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  return svd.matrixU() * Vector3d(1.0, 1.0, sign < 0.0 ? -1.0 : 1.0).asDiagonal() *
         svd.matrixV().transpose();
}

}  // namespace

ViewChange view_change(std::span<const Vector3d> first, std::span<const Vector3d> second) {
  TM_CHECK(first.size() == second.size());
  if (first.size() < 3) {
    return {};
  }
  std::vector<double> angles = angles_after(Matrix3d::Identity(), first, second);
  ViewChange change;
  change.motion_deg = median_deg(angles);
  for (int i = 0; i < kReweightings; ++i) {
    angles = angles_after(weighted_rotation(first, second, angles), first, second);
  }
  change.parallax_deg = median_deg(std::move(angles));
  return change;
}

}  // namespace trigmesh
