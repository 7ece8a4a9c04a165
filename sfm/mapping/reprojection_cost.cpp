#include "sfm/mapping/reprojection_cost.hpp"

#include <algorithm>

namespace trigmesh {
namespace {

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

Eigen::Quaterniond rotation_from_parameters(const std::array<double, PoseState::kSize>& p) {
  return Eigen::Quaterniond(1.0, 0.5 * p[0], 0.5 * p[1], 0.5 * p[2]).normalized();
}

Eigen::Vector3d translation_from_parameters(const std::array<double, PoseState::kSize>& p) {
  return {p[3], p[4], p[5]};
}

/// a^T [-[q]x S | I] for both rows a of `d_point`: turning by dv moves the point by dv x q.
void fill_pose_jacobian(const PoseState& pose,
                        const Eigen::Vector3d& point_in_cam,
                        const Eigen::Matrix<double, 2, 3>& d_point,
                        double* out) {
  const Eigen::Vector3d q = point_in_cam - pose.step_translation;
  for (int row = 0; row < 2; ++row) {
    const Eigen::Vector3d a = d_point.row(row).transpose();
    const Eigen::Vector3d spin = q.cross(a);
    double* to = out + row * PoseState::kSize;
    Eigen::Map<Eigen::RowVector3d>{to}.noalias() = spin.transpose() * pose.spin_by_parameters;
    to[3] = a.x();
    to[4] = a.y();
    to[5] = a.z();
    if (pose.frozen_translation >= 0) {
      to[3 + pose.frozen_translation] = 0.0;
    }
  }
}

void fill_intrinsics_jacobian(const IntrinsicsState& intrinsics,
                              const Eigen::Matrix<double, 2, kIntrinsicsCount>& d_intrinsics,
                              double inverse_sigma,
                              double* out) {
  const int size = intrinsics.block_size();
  std::fill(out, out + 2 * size, 0.0);
  for (int i = 0; i < intrinsics.free_count; ++i) {
    const int entry = intrinsics.free[static_cast<std::size_t>(i)];
    for (int row = 0; row < 2; ++row) {
      const double derivative =
          entry == 0 ? d_intrinsics(row, 0) + intrinsics.aspect_ratio * d_intrinsics(row, 1)
                     : d_intrinsics(row, entry + 1);
      out[row * size + i] = inverse_sigma * derivative;
    }
  }
}

void clear_jacobians(const IntrinsicsState& intrinsics, const ReprojectionJacobians& jacobians) {
  if (jacobians.pose != nullptr) {
    std::fill(jacobians.pose, jacobians.pose + 2 * PoseState::kSize, 0.0);
  }
  if (jacobians.point != nullptr) {
    std::fill(jacobians.point, jacobians.point + 6, 0.0);
  }
  if (jacobians.intrinsics != nullptr) {
    std::fill(jacobians.intrinsics, jacobians.intrinsics + 2 * intrinsics.block_size(), 0.0);
  }
}

/// What the residual needs of the camera. The pinhole needs no lens model; it is worth its own
/// path.
struct Projection {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 3> d_point;
};

bool project_pinhole(const Camera& camera, const Eigen::Vector3d& p, Projection& out) {
  constexpr double kMinDepth = 1e-12;
  if (!(p.z() > kMinDepth)) {
    return false;
  }
  const double inverse_z = 1.0 / p.z();
  const double u = p.x() * inverse_z;
  const double v = p.y() * inverse_z;
  const double fx = camera.fx_px * inverse_z;
  const double fy = camera.fy_px * inverse_z;
  out.pixel = {camera.fx_px * u + camera.cx_px, camera.fy_px * v + camera.cy_px};
  out.d_point << fx, 0.0, -fx * u, 0.0, fy, -fy * v;
  return true;
}

}  // namespace

void PoseState::update() {
  const Eigen::Vector3d half(0.5 * parameters[0], 0.5 * parameters[1], 0.5 * parameters[2]);
  const Eigen::Matrix3d turn = rotation_from_parameters(parameters).toRotationMatrix();
  step_translation = translation_from_parameters(parameters);
  rotation = turn * base.rotation.toRotationMatrix();
  translation = turn * base.translation + step_translation;
  // q = (1, h) / |.|, h = w / 2: the angular velocity 2 dq q* is (I + [h]x) dw / (1 + |h|^2).
  spin_by_parameters =
      (Eigen::Matrix3d::Identity() + cross_matrix(half)) / (1.0 + half.squaredNorm());
}

Rigid3 PoseState::cam_from_world() const {
  return Rigid3{rotation_from_parameters(parameters), translation_from_parameters(parameters)} *
         base;
}

IntrinsicsState::IntrinsicsState(const Camera& start, const IntrinsicsFreedom& freedom)
    : camera(start), aspect_ratio(start.fy_px / start.fx_px) {
  const auto add = [this](int entry, double value) {
    free[static_cast<std::size_t>(free_count)] = entry;
    parameters[static_cast<std::size_t>(free_count)] = value;
    ++free_count;
  };
  if (freedom.focal) {
    add(0, start.fx_px);
  }
  if (freedom.principal_point) {
    add(1, start.cx_px);
    add(2, start.cy_px);
  }
  const int distortion = std::min(freedom.distortion, distortion_count(start.model));
  for (int i = 0; i < distortion; ++i) {
    add(3 + i, start.distortion[static_cast<std::size_t>(i)]);
  }
}

int IntrinsicsState::block_size() const {
  if (free_count == 0) {
    return 0;
  }
  return free_count <= kSmallSize ? kSmallSize : kFullSize;
}

void IntrinsicsState::update() {
  for (int i = 0; i < free_count; ++i) {
    const double value = parameters[static_cast<std::size_t>(i)];
    const int entry = free[static_cast<std::size_t>(i)];
    if (entry == 0) {
      camera.fx_px = value;
      camera.fy_px = aspect_ratio * value;
    } else if (entry == 1) {
      camera.cx_px = value;
    } else if (entry == 2) {
      camera.cy_px = value;
    } else {
      camera.distortion[static_cast<std::size_t>(entry - 3)] = value;
    }
  }
}

Eigen::Vector2d evaluate_reprojection(const PoseState& pose,
                                      const IntrinsicsState& intrinsics,
                                      const Eigen::Vector3d& point_in_world,
                                      const BundleObservation& observation,
                                      const ReprojectionJacobians& jacobians) {
  const Eigen::Vector3d point_in_cam = pose.rotation * point_in_world + pose.translation;
  const double inverse_sigma = static_cast<double>(observation.inverse_sigma);
  Projection projection;
  bool projected = false;
  if (intrinsics.camera.model == CameraModel::kPinhole && jacobians.intrinsics == nullptr) {
    projected = project_pinhole(intrinsics.camera, point_in_cam, projection);
  } else if (jacobians.pose != nullptr || jacobians.point != nullptr ||
             jacobians.intrinsics != nullptr) {
    if (const auto full = project_with_derivatives(intrinsics.camera, point_in_cam)) {
      projected = true;
      projection.pixel = full->pixel;
      projection.d_point = full->d_point;
      if (jacobians.intrinsics != nullptr) {
        fill_intrinsics_jacobian(
            intrinsics, full->d_intrinsics, inverse_sigma, jacobians.intrinsics);
      }
    }
  } else if (const auto pixel = project(intrinsics.camera, point_in_cam)) {
    projected = true;
    projection.pixel = *pixel;
    projection.d_point.setZero();
  }
  if (!projected) {
    clear_jacobians(intrinsics, jacobians);
    return Eigen::Vector2d::Constant(kUnprojectablePx * inverse_sigma);
  }
  projection.d_point *= inverse_sigma;
  if (jacobians.pose != nullptr) {
    fill_pose_jacobian(pose, point_in_cam, projection.d_point, jacobians.pose);
  }
  if (jacobians.point != nullptr) {
    Eigen::Map<PointJacobian>{jacobians.point}.noalias() = projection.d_point * pose.rotation;
  }
  return (projection.pixel - observation.pixel.cast<double>()) * inverse_sigma;
}

}  // namespace trigmesh
