#include "sfm/keyframes/view_change.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <Eigen/SVD>

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

}  // namespace

void ViewChangeMeter::begin() {
  rays_.clear();
}

void ViewChangeMeter::add(const Vector3d& first, const Vector3d& second) {
  rays_.push_back({first, second});
}

void ViewChangeMeter::rotate(const Matrix3d& rotation) {
  for (RayPair& ray : rays_) {
    ray.angle = angle_between(rotation * ray.first, ray.second);
  }
}

Matrix3d ViewChangeMeter::weighted_rotation() const {
  Matrix3d moments = Matrix3d::Zero();
  for (const RayPair& ray : rays_) {
    moments += ray.second * ray.first.transpose() / std::max(ray.angle, kSmallestAngle);
  }
  const Eigen::JacobiSVD<Matrix3d> svd(moments, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  return svd.matrixU() * Vector3d(1.0, 1.0, sign < 0.0 ? -1.0 : 1.0).asDiagonal() *
         svd.matrixV().transpose();
}

double ViewChangeMeter::median_angle_deg() {
  angles_.clear();
  for (const RayPair& ray : rays_) {
    angles_.push_back(ray.angle);
  }
  const auto middle = angles_.begin() + static_cast<std::ptrdiff_t>(angles_.size() / 2);
  std::nth_element(angles_.begin(), middle, angles_.end());
  return *middle * 180.0 / std::numbers::pi;
}

ViewChange ViewChangeMeter::measure() {
  if (rays_.size() < 3) {
    return {};
  }
  ViewChange change;
  rotate(Matrix3d::Identity());
  change.motion_deg = median_angle_deg();
  for (int i = 0; i < kReweightings; ++i) {
    rotate(weighted_rotation());
  }
  change.parallax_deg = median_angle_deg();
  return change;
}

}  // namespace trigmesh
