// Pose of a plane: Z. Zhang, "A flexible new technique for camera calibration", PAMI 22(11), 2000,
// section 3.1:
//   s [u v 1]^T = [r1 r2 t] [X Y 1]^T,  r1 = h1 / |h1|,  r2 = h2 / |h2|,  r3 = r1 x r2,  t = h3 /
//   |h1|.
// Homography by the normalised direct linear transform (Hartley, Zisserman, "Multiple View
// Geometry", 2004, algorithm 4.2).
#include "sfm/calibration/planar_pose.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

namespace trigmesh {
namespace {

constexpr double kShortestFocal_ratio =
    0.25;  ///< of the longer image side: a fisheye of 180 degrees has 0.32
constexpr double kLongestFocal_ratio = 8.0;
constexpr double kFocalStep = 1.12;

/// Moves points to zero mean and a mean distance of sqrt(2).
Eigen::Matrix3d conditioning(const std::vector<Eigen::Vector2d>& points) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& p : points) {
    mean += p;
  }
  mean /= static_cast<double>(points.size());
  double distance = 0.0;
  for (const auto& p : points) {
    distance += (p - mean).norm();
  }
  const double scale =
      std::sqrt(2.0) * static_cast<double>(points.size()) / std::max(distance, 1e-12);
  Eigen::Matrix3d t;
  t << scale, 0.0, -scale * mean.x(), 0.0, scale, -scale * mean.y(), 0.0, 0.0, 1.0;
  return t;
}

/// 3x3, b ~ H a; nothing when the points do not determine it.
std::optional<Eigen::Matrix3d> homography(const std::vector<Eigen::Vector2d>& a,
                                          const std::vector<Eigen::Vector2d>& b) {
  const Eigen::Matrix3d ta = conditioning(a);
  const Eigen::Matrix3d tb = conditioning(b);
  Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Eigen::Vector3d p = ta * a[i].homogeneous();
    const Eigen::Vector3d q = tb * b[i].homogeneous();
    Eigen::Matrix<double, 9, 1> row;
    row << p, Eigen::Vector3d::Zero(), -q.x() * p;
    normal += row * row.transpose();
    row << Eigen::Vector3d::Zero(), p, -q.y() * p;
    normal += row * row.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> solver(normal);
  // A second solution means points on a line.
  if (!(solver.eigenvalues()[1] > 1e-9 * solver.eigenvalues()[8])) {
    return std::nullopt;
  }
  const Eigen::Matrix<double, 9, 1> h = solver.eigenvectors().col(0);
  Eigen::Matrix3d conditioned;
  conditioned << h.head<3>().transpose(), h.segment<3>(3).transpose(), h.tail<3>().transpose();
  return Eigen::Matrix3d(tb.inverse() * conditioned * ta);
}

Camera trial_camera(const CalibrationOptions& options, double focal_px) {
  return {.model = options.model,
          .width_px = options.width_px,
          .height_px = options.height_px,
          .fx_px = focal_px,
          .fy_px = focal_px,
          .cx_px = 0.5 * (options.width_px - 1),
          .cy_px = 0.5 * (options.height_px - 1),
          .distortion = {}};
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + std::ssize(values) / 2, values.end());
  return values[values.size() / 2];
}

}  // namespace

std::optional<Rigid3> planar_pose(const Camera& camera, const CalibrationView& view) {
  std::vector<Eigen::Vector2d> rays;
  rays.reserve(view.pixels.size());
  for (const Eigen::Vector2d& pixel : view.pixels) {
    const auto ray = normalize_pixel(camera, pixel);
    if (!ray) {
      return std::nullopt;
    }
    rays.push_back(*ray);
  }
  const auto found = homography(view.board_m, rays);
  if (!found) {
    return std::nullopt;
  }
  Eigen::Matrix3d h = *found / std::sqrt(found->col(0).norm() * found->col(1).norm());
  if (h(2, 2) < 0.0) {
    h = -h;
  }
  Eigen::Matrix3d axes;
  axes << h.col(0), h.col(1), h.col(0).cross(h.col(1));
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(axes, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d rotation = svd.matrixU() * svd.matrixV().transpose();
  if (!(rotation.determinant() > 0.0) || !h.allFinite()) {
    return std::nullopt;
  }
  return Rigid3{.rotation = Eigen::Quaterniond(rotation).normalized(), .translation = h.col(2)};
}

double view_rms_px(const Camera& camera,
                   const Rigid3& cam_from_board,
                   const CalibrationView& view) {
  double sum = 0.0;
  for (std::size_t i = 0; i < view.pixels.size(); ++i) {
    const Eigen::Vector3d point(view.board_m[i].x(), view.board_m[i].y(), 0.0);
    const auto pixel = project(camera, cam_from_board * point);
    if (!pixel) {
      return std::numeric_limits<double>::infinity();
    }
    sum += (*pixel - view.pixels[i]).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(view.pixels.size()));
}

std::optional<CalibrationStart> find_calibration_start(std::span<const CalibrationView> views,
                                                       const CalibrationOptions& options) {
  const double longer_side = std::max(options.width_px, options.height_px);
  std::optional<CalibrationStart> best;
  double best_cost = std::numeric_limits<double>::infinity();
  for (double ratio = kShortestFocal_ratio; ratio <= kLongestFocal_ratio; ratio *= kFocalStep) {
    CalibrationStart trial{.camera = trial_camera(options, ratio * longer_side), .poses = {}};
    std::vector<double> residuals;
    for (const CalibrationView& view : views) {
      trial.poses.push_back(planar_pose(trial.camera, view));
      residuals.push_back(trial.poses.back() ? view_rms_px(trial.camera, *trial.poses.back(), view)
                                             : std::numeric_limits<double>::infinity());
    }
    const auto posed = std::count_if(
        residuals.begin(), residuals.end(), [](double r) { return std::isfinite(r); });
    // The median, so that a wrongly detected board has no say.
    const double cost = median(residuals);
    if (posed >= std::ssize(residuals) / 2 + 1 &&
        static_cast<std::size_t>(posed) >= kMinCalibrationViews && cost < best_cost) {
      best_cost = cost;
      best = std::move(trial);
    }
  }
  return best;
}

}  // namespace trigmesh
