// The lens models. With (u, v) = (x/z, y/z), r^2 = u^2 + v^2 and (u', v') the distorted
// coordinates:
//
//   radial          u' = u L,  L = 1 + k1 r^2 + k2 r^4
//   Brown-Conrady   u' = u L + 2 p1 u v + p2 (r^2 + 2 u^2),  v' = v L + p1 (r^2 + 2 v^2) + 2 p2 u v
//                   (D. C. Brown, "Decentering distortion of lenses", Photogrammetric Engineering,
//                   1966)
//   Kannala-Brandt  u' = x s,  s = theta_d / rho,  rho^2 = x^2 + y^2,  theta = atan2(rho, z),
//                   theta_d = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8)
//                   (J. Kannala, S. Brandt, "A generic camera model and calibration method for
//                   conventional, wide-angle, and fish-eye lenses", PAMI 2006, equation 6)
//
// and pixel = (fx u' + cx, fy v' + cy).
#include "sfm/camera/camera.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/LU>

namespace trigmesh {

namespace {

/// Distorted coordinates with their derivatives by the point in the camera frame and by the
/// coefficients.
struct Distorted {
  Eigen::Vector2d value;
  Eigen::Matrix<double, 2, 3> d_point;
  Eigen::Matrix<double, 2, 4> d_distortion;
};

Eigen::Vector2d distort_plane(const Camera& camera, const Eigen::Vector2d& uv) {
  const auto& d = camera.distortion;
  if (camera.model == CameraModel::kPinhole) {
    return uv;
  }
  const double r2 = uv.squaredNorm();
  const double gain = 1.0 + r2 * (d[0] + r2 * d[1]);
  Eigen::Vector2d out = uv * gain;
  if (camera.model == CameraModel::kBrownConrady) {
    const double xy = 2.0 * uv.x() * uv.y();
    out.x() += d[2] * xy + d[3] * (r2 + 2.0 * uv.x() * uv.x());
    out.y() += d[2] * (r2 + 2.0 * uv.y() * uv.y()) + d[3] * xy;
  }
  return out;
}

/// Derivative of `distort_plane` by (u, v): symmetric.
Eigen::Matrix2d distort_plane_jacobian(const Camera& camera, const Eigen::Vector2d& uv) {
  const auto& d = camera.distortion;
  Eigen::Matrix2d j = Eigen::Matrix2d::Identity();
  if (camera.model == CameraModel::kPinhole) {
    return j;
  }
  const double r2 = uv.squaredNorm();
  const double gain = 1.0 + r2 * (d[0] + r2 * d[1]);
  const double slope = 2.0 * (d[0] + 2.0 * d[1] * r2);
  j(0, 0) = gain + slope * uv.x() * uv.x();
  j(1, 1) = gain + slope * uv.y() * uv.y();
  j(0, 1) = slope * uv.x() * uv.y();
  if (camera.model == CameraModel::kBrownConrady) {
    j(0, 0) += 2.0 * d[2] * uv.y() + 6.0 * d[3] * uv.x();
    j(1, 1) += 6.0 * d[2] * uv.y() + 2.0 * d[3] * uv.x();
    j(0, 1) += 2.0 * d[2] * uv.x() + 2.0 * d[3] * uv.y();
  }
  j(1, 0) = j(0, 1);
  return j;
}

Distorted distort_plane_with_derivatives(const Camera& camera, const Eigen::Vector3d& p) {
  const double inverse_z = 1.0 / p.z();
  const Eigen::Vector2d uv = p.head<2>() / p.z();
  Eigen::Matrix<double, 2, 3> d_uv;
  d_uv << inverse_z, 0.0, -uv.x() * inverse_z, 0.0, inverse_z, -uv.y() * inverse_z;

  Distorted out;
  out.value = distort_plane(camera, uv);
  out.d_distortion.setZero();
  if (camera.model == CameraModel::kPinhole) {
    out.d_point = d_uv;
    return out;
  }
  out.d_point = distort_plane_jacobian(camera, uv) * d_uv;
  const double r2 = uv.squaredNorm();
  out.d_distortion.col(0) = uv * r2;
  out.d_distortion.col(1) = uv * (r2 * r2);
  if (camera.model == CameraModel::kBrownConrady) {
    const double xy = 2.0 * uv.x() * uv.y();
    out.d_distortion.col(2) << xy, r2 + 2.0 * uv.y() * uv.y();
    out.d_distortion.col(3) << r2 + 2.0 * uv.x() * uv.x(), xy;
  }
  return out;
}

/// 1 + c0 t + c1 t^2 + c2 t^3 + c3 t^4.
double even_polynomial(const std::array<double, 4>& c, double t) {
  return 1.0 + t * (c[0] + t * (c[1] + t * (c[2] + t * c[3])));
}

/// Derivative by a of a * even_polynomial(a^2).
double odd_polynomial_slope(const std::array<double, 4>& c, double t) {
  return 1.0 + t * (3.0 * c[0] + t * (5.0 * c[1] + t * (7.0 * c[2] + t * 9.0 * c[3])));
}

/// theta / rho; tends to 1 / z on the axis.
double angle_over_radius(double rho, double z) {
  return rho > 0.0 ? std::atan2(rho, z) / rho : 1.0 / z;
}

std::optional<Eigen::Vector2d> distort_fisheye(const Camera& camera, const Eigen::Vector3d& p) {
  const double rho = std::hypot(p.x(), p.y());
  if (rho == 0.0 && p.z() <= 0.0) {
    return std::nullopt;  // the centre, or straight behind: no direction in the image
  }
  const double theta = std::atan2(rho, p.z());
  const double scale =
      angle_over_radius(rho, p.z()) * even_polynomial(camera.distortion, theta * theta);
  return Eigen::Vector2d(p.head<2>() * scale);
}

std::optional<Distorted> distort_fisheye_with_derivatives(const Camera& camera,
                                                          const Eigen::Vector3d& p) {
  const double rho = std::hypot(p.x(), p.y());
  if (rho == 0.0 && p.z() <= 0.0) {
    return std::nullopt;
  }
  const double theta = std::atan2(rho, p.z());
  const double theta2 = theta * theta;
  const double ratio = angle_over_radius(rho, p.z());
  const double scale = ratio * even_polynomial(camera.distortion, theta2);
  const double slope = odd_polynomial_slope(camera.distortion, theta2);
  const double distance2 = p.squaredNorm();
  // d scale / d x = curvature * x. The closed form cancels near the axis; its limit follows from
  // theta = q - q^3/3 + .., scale = (1 + (k1 - 1/3) q^2 + ..) / z with q = rho / z.
  constexpr double kNearAxis = 1e-4;
  const double curvature = rho < kNearAxis * p.z()
                               ? 2.0 * (camera.distortion[0] - 1.0 / 3.0) / (p.z() * p.z() * p.z())
                               : (slope * p.z() / distance2 - scale) / (rho * rho);

  const Eigen::Vector2d xy = p.head<2>();
  Distorted out;
  out.value = xy * scale;
  out.d_point.leftCols<2>() = curvature * xy * xy.transpose();
  out.d_point(0, 0) += scale;
  out.d_point(1, 1) += scale;
  out.d_point.col(2) = xy * (-slope / distance2);
  double power = ratio;
  for (Eigen::Index i = 0; i < 4; ++i) {
    power *= theta2;
    out.d_distortion.col(i) = xy * power;
  }
  return out;
}

/// Whether f(a) = a * even_polynomial(a^2) rises everywhere on [0, a], seen at samples.
bool rises_up_to(const std::array<double, 4>& c, double a) {
  constexpr int kSamples = 8;
  for (int i = 1; i <= kSamples; ++i) {
    const double at = a * i / kSamples;
    if (odd_polynomial_slope(c, at * at) <= 0.0) {
      return false;
    }
  }
  return true;
}

/// The a >= 0 with a * even_polynomial(a^2) = target on the branch that rises from 0; Newton kept
/// in a bracket.
std::optional<double> invert_odd_polynomial(const std::array<double, 4>& c, double target) {
  constexpr int kMaxIterations = 60;
  constexpr double kTolerance = 1e-14;
  double low = 0.0;
  double high = std::numeric_limits<double>::infinity();
  double a = target;
  for (int i = 0; i < kMaxIterations; ++i) {
    const double residual = a * even_polynomial(c, a * a) - target;
    const double slope = odd_polynomial_slope(c, a * a);
    if (std::abs(residual) <= kTolerance * (1.0 + target) && slope > 0.0) {
      return rises_up_to(c, a) ? std::optional(a) : std::nullopt;
    }
    // A falling curve means that `a` is already past the invertible part.
    (slope <= 0.0 || residual > 0.0 ? high : low) = a;
    const double next = a - residual / slope;
    const bool usable = slope > 0.0 && next > low && next < high;
    a = usable ? next : 0.5 * (low + (std::isfinite(high) ? high : 2.0 * a));
    if (!std::isfinite(a)) {
      return std::nullopt;
    }
  }
  return std::nullopt;
}

std::optional<Eigen::Vector2d> undistort_radial(const Camera& camera,
                                                const Eigen::Vector2d& distorted) {
  const double radius = distorted.norm();
  if (radius == 0.0) {
    return distorted;
  }
  const auto r =
      invert_odd_polynomial({camera.distortion[0], camera.distortion[1], 0.0, 0.0}, radius);
  if (!r) {
    return std::nullopt;
  }
  return Eigen::Vector2d(distorted * (*r / radius));
}

/// Whether the map keeps its orientation all along the segment from the centre to uv.
bool invertible_up_to(const Camera& camera, const Eigen::Vector2d& uv) {
  constexpr int kSamples = 8;
  for (int i = 1; i <= kSamples; ++i) {
    if (distort_plane_jacobian(camera, uv * i / kSamples).determinant() <= 0.0) {
      return false;
    }
  }
  return true;
}

std::optional<Eigen::Vector2d> undistort_brown_conrady(const Camera& camera,
                                                       const Eigen::Vector2d& distorted) {
  constexpr int kMaxIterations = 20;
  constexpr double kTolerance = 1e-14;
  auto uv = undistort_radial(camera, distorted);
  for (int i = 0; uv && i < kMaxIterations; ++i) {
    const Eigen::Vector2d residual = distort_plane(camera, *uv) - distorted;
    if (residual.norm() <= kTolerance * (1.0 + distorted.norm())) {
      return invertible_up_to(camera, *uv) ? uv : std::nullopt;
    }
    const Eigen::Matrix2d jacobian = distort_plane_jacobian(camera, *uv);
    if (!(jacobian.determinant() > 0.0)) {
      return std::nullopt;
    }
    *uv -= jacobian.inverse() * residual;
  }
  return std::nullopt;
}

std::optional<Eigen::Vector2d> undistort_fisheye(const Camera& camera,
                                                 const Eigen::Vector2d& distorted) {
  const double theta_d = distorted.norm();
  if (theta_d == 0.0) {
    return distorted;
  }
  constexpr double kLimitRad =
      std::numbers::pi / 2.0 - 1e-9;  // clear of the rounding of 90 degrees
  const auto theta = invert_odd_polynomial(camera.distortion, theta_d);
  if (!theta || *theta >= kLimitRad) {
    return std::nullopt;
  }
  return Eigen::Vector2d(distorted * (std::tan(*theta) / theta_d));
}

}  // namespace

Result<> Camera::validate() const {
  if (width_px <= 0 || height_px <= 0) {
    return fail(ErrorCode::kInvalidArgument,
                "camera size is {} x {}, both must be positive",
                width_px,
                height_px);
  }
  if (!(fx_px > 0.0 && fy_px > 0.0 && std::isfinite(fx_px) && std::isfinite(fy_px))) {
    return fail(ErrorCode::kInvalidArgument,
                "camera focal length is fx_px={} fy_px={}, both must be positive and finite",
                fx_px,
                fy_px);
  }
  if (!intrinsics().allFinite()) {
    return fail(ErrorCode::kInvalidArgument,
                "camera principal point ({}, {}) or distortion ({}, {}, {}, {}) is not finite",
                cx_px,
                cy_px,
                distortion[0],
                distortion[1],
                distortion[2],
                distortion[3]);
  }
  return {};
}

IntrinsicsVector Camera::intrinsics() const {
  IntrinsicsVector values;
  values << fx_px, fy_px, cx_px, cy_px, distortion[0], distortion[1], distortion[2], distortion[3];
  return values;
}

void Camera::set_intrinsics(const IntrinsicsVector& values) {
  fx_px = values[0];
  fy_px = values[1];
  cx_px = values[2];
  cy_px = values[3];
  distortion = {values[4], values[5], values[6], values[7]};
}

Eigen::Matrix3d Camera::calibration_matrix() const {
  Eigen::Matrix3d k;
  k << fx_px, 0.0, cx_px, 0.0, fy_px, cy_px, 0.0, 0.0, 1.0;
  return k;
}

int distortion_count(CameraModel model) {
  switch (model) {
    case CameraModel::kPinhole:
      return 0;
    case CameraModel::kRadial:
      return 2;
    case CameraModel::kBrownConrady:
    case CameraModel::kKannalaBrandt:
      return 4;
  }
  return 0;
}

std::string_view to_string(CameraModel model) {
  switch (model) {
    case CameraModel::kPinhole:
      return "pinhole";
    case CameraModel::kRadial:
      return "radial";
    case CameraModel::kBrownConrady:
      return "brown_conrady";
    case CameraModel::kKannalaBrandt:
      return "kannala_brandt";
  }
  return "unknown";
}

std::optional<CameraModel> camera_model_from_string(std::string_view name) {
  for (const auto model : {CameraModel::kPinhole,
                           CameraModel::kRadial,
                           CameraModel::kBrownConrady,
                           CameraModel::kKannalaBrandt}) {
    if (to_string(model) == name) {
      return model;
    }
  }
  return std::nullopt;
}

std::optional<Eigen::Vector2d> project(const Camera& camera, const Eigen::Vector3d& point_in_cam) {
  std::optional<Eigen::Vector2d> distorted;
  if (camera.model == CameraModel::kKannalaBrandt) {
    distorted = distort_fisheye(camera, point_in_cam);
  } else if (point_in_cam.z() > 0.0) {
    distorted = distort_plane(camera, point_in_cam.head<2>() / point_in_cam.z());
  }
  if (!distorted) {
    return std::nullopt;
  }
  const Eigen::Vector2d pixel(camera.fx_px * distorted->x() + camera.cx_px,
                              camera.fy_px * distorted->y() + camera.cy_px);
  return pixel.allFinite() ? std::optional(pixel) : std::nullopt;
}

std::optional<ProjectionDerivatives> project_with_derivatives(const Camera& camera,
                                                              const Eigen::Vector3d& point_in_cam) {
  std::optional<Distorted> distorted;
  if (camera.model == CameraModel::kKannalaBrandt) {
    distorted = distort_fisheye_with_derivatives(camera, point_in_cam);
  } else if (point_in_cam.z() > 0.0) {
    distorted = distort_plane_with_derivatives(camera, point_in_cam);
  }
  if (!distorted) {
    return std::nullopt;
  }
  ProjectionDerivatives out;
  out.pixel << camera.fx_px * distorted->value.x() + camera.cx_px,
      camera.fy_px * distorted->value.y() + camera.cy_px;
  if (!out.pixel.allFinite()) {
    return std::nullopt;
  }
  const Eigen::Vector2d focal(camera.fx_px, camera.fy_px);
  out.d_point = focal.asDiagonal() * distorted->d_point;
  out.d_intrinsics << distorted->value.x(), 0.0, 1.0, 0.0, Eigen::RowVector4d::Zero(), 0.0,
      distorted->value.y(), 0.0, 1.0, Eigen::RowVector4d::Zero();
  out.d_intrinsics.rightCols<4>() = focal.asDiagonal() * distorted->d_distortion;
  return out;
}

std::optional<Eigen::Vector2d> normalize_pixel(const Camera& camera, const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d distorted((pixel.x() - camera.cx_px) / camera.fx_px,
                                  (pixel.y() - camera.cy_px) / camera.fy_px);
  if (!distorted.allFinite()) {
    return std::nullopt;
  }
  switch (camera.model) {
    case CameraModel::kPinhole:
      return distorted;
    case CameraModel::kRadial:
      return undistort_radial(camera, distorted);
    case CameraModel::kBrownConrady:
      return undistort_brown_conrady(camera, distorted);
    case CameraModel::kKannalaBrandt:
      return undistort_fisheye(camera, distorted);
  }
  return std::nullopt;
}

}  // namespace trigmesh
