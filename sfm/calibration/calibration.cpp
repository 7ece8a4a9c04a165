// Camera calibration from views of a plane: minimise sum |project(K, d, R_i X_j + t_i) - x_ij|^2
// over the intrinsics and all poses (Zhang, PAMI 22(11), 2000, section 3.2-3.3), by
// Levenberg-Marquardt (Ceres) with analytic derivatives.
#include "sfm/calibration/calibration.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <ceres/ceres.h>

#include "firmware/base/check.hpp"
#include "sfm/calibration/planar_pose.hpp"

namespace trigmesh {
namespace {

constexpr double kRobustLoss_px = 1.0;
constexpr int kGridColumns = 10;
constexpr int kGridRows = 8;
constexpr std::size_t kEnoughViews = 10;
constexpr double kTilted_deg = 15.0;
constexpr std::size_t kEnoughTiltedViews = 3;
constexpr double kGoodCoverage_ratio = 0.6;
constexpr double kGoodRms_px = 1.0;
constexpr double kGoodFocalDeviation_ratio = 0.005;
constexpr int kFocalCount = 4;  ///< fx fy cx cy

struct View {
  Rigid3 pose;
  bool used = false;
};

/// R(q) p = p + 2 w (v x p) + 2 v x (v x p), differentiated by the four numbers of the unit
/// quaternion (order x y z w).
Eigen::Matrix<double, 3, 4> rotated_by_quaternion(const Eigen::Quaterniond& q,
                                                  const Eigen::Vector3d& p) {
  const Eigen::Vector3d v = q.vec();
  Eigen::Matrix3d p_cross;
  p_cross << 0.0, -p.z(), p.y(), p.z(), 0.0, -p.x(), -p.y(), p.x(), 0.0;
  Eigen::Matrix<double, 3, 4> d;
  d.leftCols<3>() = -2.0 * q.w() * p_cross + 2.0 * (v.dot(p) * Eigen::Matrix3d::Identity() +
                                                    v * p.transpose() - 2.0 * p * v.transpose());
  d.col(3) = 2.0 * v.cross(p);
  return d;
}

/// predicted - seen, pixels. Parameters: intrinsics (8), rotation of the board (x y z w),
/// translation (3).
class BoardPointCost final : public ceres::SizedCostFunction<2, kIntrinsicsCount, 4, 3> {
 public:
  BoardPointCost(Camera camera, Eigen::Vector3d point_in_board, Eigen::Vector2d pixel)
      : camera_(std::move(camera)),
        point_in_board_(std::move(point_in_board)),
        pixel_(std::move(pixel)) {}

  bool Evaluate(const double* const* parameters,
                double* residuals,
                double** jacobians) const override {
    Camera camera = camera_;
    camera.set_intrinsics(Eigen::Map<const IntrinsicsVector>(parameters[0]));
    const Eigen::Map<const Eigen::Quaterniond> rotation(parameters[1]);
    const Eigen::Map<const Eigen::Vector3d> translation(parameters[2]);
    const auto projection =
        project_with_derivatives(camera, rotation * point_in_board_ + translation);
    if (!projection) {
      return false;
    }
    Eigen::Map<Eigen::Vector2d> residual(residuals);
    residual = projection->pixel - pixel_;
    if (jacobians == nullptr) {
      return true;
    }
    if (jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, kIntrinsicsCount, Eigen::RowMajor>> d_intrinsics(
          jacobians[0]);
      d_intrinsics = projection->d_intrinsics;
    }
    if (jacobians[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 4, Eigen::RowMajor>> d_rotation(jacobians[1]);
      d_rotation = projection->d_point * rotated_by_quaternion(rotation, point_in_board_);
    }
    if (jacobians[2] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> d_translation(jacobians[2]);
      d_translation = projection->d_point;
    }
    return true;
  }

 private:
  Camera camera_;
  Eigen::Vector3d point_in_board_;
  Eigen::Vector2d pixel_;
};

enum class Free { kFocalLength, kAll };
enum class Loss { kRobust, kSquares };

std::vector<int> constant_intrinsics(CameraModel model, Free free) {
  std::vector<int> constant;
  const int first = free == Free::kAll ? kFocalCount + distortion_count(model) : 2;
  for (int i = first; i < kIntrinsicsCount; ++i) {
    constant.push_back(i);
  }
  return constant;
}

/// One adjustment of the camera and of the poses of the views in use. False when Ceres gives up.
bool adjust(std::span<const CalibrationView> data,
            Camera& camera,
            std::vector<View>& views,
            Free free,
            Loss loss) {
  ceres::Problem problem;
  IntrinsicsVector intrinsics = camera.intrinsics();
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (!views[v].used) {
      continue;
    }
    double* rotation = views[v].pose.rotation.coeffs().data();
    double* translation = views[v].pose.translation.data();
    for (std::size_t i = 0; i < data[v].pixels.size(); ++i) {
      const Eigen::Vector3d point(data[v].board_m[i].x(), data[v].board_m[i].y(), 0.0);
      problem.AddResidualBlock(
          new BoardPointCost(camera, point, data[v].pixels[i]),
          loss == Loss::kRobust ? new ceres::HuberLoss(kRobustLoss_px) : nullptr,
          intrinsics.data(),
          rotation,
          translation);
    }
    problem.SetManifold(rotation, new ceres::EigenQuaternionManifold);
  }
  const auto constant = constant_intrinsics(camera.model, free);
  if (!constant.empty()) {
    problem.SetManifold(intrinsics.data(), new ceres::SubsetManifold(kIntrinsicsCount, constant));
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-10;
  options.parameter_tolerance = 1e-10;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  camera.set_intrinsics(intrinsics);
  return summary.IsSolutionUsable() && camera.validate().has_value();
}

std::vector<double> view_residuals(std::span<const CalibrationView> data,
                                   const Camera& camera,
                                   const std::vector<View>& views) {
  std::vector<double> rms(views.size());
  for (std::size_t v = 0; v < views.size(); ++v) {
    rms[v] = view_rms_px(camera, views[v].pose, data[v]);
  }
  return rms;
}

std::size_t used_count(const std::vector<View>& views) {
  return static_cast<std::size_t>(
      std::count_if(views.begin(), views.end(), [](const View& v) { return v.used; }));
}

/// Puts views aside whose residual stands out. True when there were any.
bool drop_outliers(const std::vector<double>& rms,
                   const CalibrationOptions& options,
                   std::vector<View>& views) {
  std::vector<double> used;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (views[v].used) {
      used.push_back(rms[v]);
    }
  }
  std::nth_element(used.begin(), used.begin() + std::ssize(used) / 2, used.end());
  const double limit =
      std::max(options.outlier_floor_px, options.outlier_ratio * used[used.size() / 2]);
  bool dropped = false;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (views[v].used && !(rms[v] <= limit)) {
      views[v].used = false;
      dropped = true;
    }
  }
  return dropped;
}

/// Standard deviations of the free intrinsics: square roots of the diagonal of sigma^2 (A - sum B
/// C^-1 B^T)^-1, the poses (6 numbers each) marginalised out of the normal equations. NaN where the
/// data do not determine a parameter.
IntrinsicsVector intrinsics_deviation(std::span<const CalibrationView> data,
                                      const Camera& camera,
                                      const std::vector<View>& views) {
  using Matrix8 = Eigen::Matrix<double, kIntrinsicsCount, kIntrinsicsCount>;
  Matrix8 information = Matrix8::Zero();
  double squares = 0.0;
  double redundancy = 0.0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (!views[v].used) {
      continue;
    }
    Eigen::Matrix<double, kIntrinsicsCount, 6> mixed =
        Eigen::Matrix<double, kIntrinsicsCount, 6>::Zero();
    Eigen::Matrix<double, 6, 6> pose_information = Eigen::Matrix<double, 6, 6>::Zero();
    for (std::size_t i = 0; i < data[v].pixels.size(); ++i) {
      const Eigen::Vector3d rotated =
          views[v].pose.rotation *
          Eigen::Vector3d(data[v].board_m[i].x(), data[v].board_m[i].y(), 0.0);
      const auto projection = project_with_derivatives(camera, rotated + views[v].pose.translation);
      if (!projection) {
        continue;
      }
      Eigen::Matrix3d turn;  // d(exp(w) rotated)/dw = -[rotated]x
      turn << 0.0, rotated.z(), -rotated.y(), -rotated.z(), 0.0, rotated.x(), rotated.y(),
          -rotated.x(), 0.0;
      Eigen::Matrix<double, 2, 6> d_pose;
      d_pose << projection->d_point * turn, projection->d_point;
      information += projection->d_intrinsics.transpose() * projection->d_intrinsics;
      mixed += projection->d_intrinsics.transpose() * d_pose;
      pose_information += d_pose.transpose() * d_pose;
      squares += (projection->pixel - data[v].pixels[i]).squaredNorm();
      redundancy += 2.0;
    }
    information -= mixed * pose_information.ldlt().solve(mixed.transpose());
    redundancy -= 6.0;
  }
  const int count = kFocalCount + distortion_count(camera.model);
  redundancy -= count;
  const Eigen::MatrixXd free_information = information.topLeftCorner(count, count);
  const Eigen::FullPivLU<Eigen::MatrixXd> lu(free_information);
  IntrinsicsVector deviation = IntrinsicsVector::Zero();
  const double variance = squares / std::max(redundancy, 1.0);
  if (!lu.isInvertible()) {
    deviation.head(count).setConstant(std::numeric_limits<double>::quiet_NaN());
    return deviation;
  }
  deviation.head(count) = (variance * lu.inverse().diagonal().array()).sqrt().matrix();
  return deviation;
}

double tilt_deg(const Rigid3& cam_from_board, const CalibrationView& view) {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& p : view.board_m) {
    middle += p;
  }
  middle /= static_cast<double>(view.board_m.size());
  const Eigen::Vector3d sight = cam_from_board * Eigen::Vector3d(middle.x(), middle.y(), 0.0);
  const Eigen::Vector3d normal = cam_from_board.rotation * Eigen::Vector3d::UnitZ();
  const double cosine = std::clamp(std::abs(normal.dot(sight.normalized())), 0.0, 1.0);
  return std::acos(cosine) * 180.0 / std::numbers::pi;
}

double coverage(std::span<const CalibrationView> data,
                const std::vector<View>& views,
                const CalibrationOptions& options) {
  std::array<bool, static_cast<std::size_t>(kGridColumns * kGridRows)> seen{};
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (!views[v].used) {
      continue;
    }
    for (const Eigen::Vector2d& pixel : data[v].pixels) {
      const auto cell = [](double position, int size, int count) {
        return std::clamp(static_cast<int>((position + 0.5) / size * count), 0, count - 1);
      };
      const int column = cell(pixel.x(), options.width_px, kGridColumns);
      const int row = cell(pixel.y(), options.height_px, kGridRows);
      seen[static_cast<std::size_t>(row * kGridColumns + column)] = true;
    }
  }
  return static_cast<double>(std::count(seen.begin(), seen.end(), true)) /
         static_cast<double>(seen.size());
}

std::vector<std::string> warnings_about(const CalibrationReport& report) {
  std::vector<std::string> warnings;
  if (report.views_used < kEnoughViews) {
    warnings.push_back(
        fmt::format("only {} views were used: {} or more make the result trustworthy",
                    report.views_used,
                    kEnoughViews));
  }
  const auto tilted = static_cast<std::size_t>(
      std::count_if(report.views.begin(), report.views.end(), [](const CalibratedView& v) {
        return v.used && v.tilt_deg >= kTilted_deg;
      }));
  if (tilted < kEnoughTiltedViews) {
    warnings.push_back(
        fmt::format("the board faces the camera in nearly all views ({} of {} tilted by {:.0f} "
                    "degrees or more): tilt it, "
                    "or the focal length remains uncertain",
                    tilted,
                    report.views_used,
                    kTilted_deg));
  }
  if (report.coverage_ratio < kGoodCoverage_ratio) {
    warnings.push_back(
        fmt::format("corners cover {:.0f} % of the image: take views with the board near its "
                    "borders, where the distortion is largest",
                    100.0 * report.coverage_ratio));
  }
  if (report.rms_px > kGoodRms_px) {
    warnings.push_back(
        fmt::format("the residual of {:.2f} px is large: is the board flat and sharp, and does the "
                    "lens model fit the lens?",
                    report.rms_px));
  }
  const double focal_deviation = report.standard_deviation[0] / report.camera.fx_px;
  if (!(focal_deviation <= kGoodFocalDeviation_ratio)) {
    warnings.push_back(
        "the views determine the focal length poorly: add tilted views at several distances");
  }
  return warnings;
}

Result<> check_views(std::span<const CalibrationView> data) {
  if (data.size() < kMinCalibrationViews) {
    return fail(ErrorCode::kInsufficientData,
                "cannot calibrate from {} views of the board, at least {} are needed",
                data.size(),
                kMinCalibrationViews);
  }
  for (std::size_t v = 0; v < data.size(); ++v) {
    if (data[v].pixels.size() != data[v].board_m.size() || data[v].pixels.size() < 4) {
      return fail(ErrorCode::kInvalidArgument,
                  "view {} has {} pixels for {} board points, need at least 4 of each and as many",
                  v,
                  data[v].pixels.size(),
                  data[v].board_m.size());
    }
  }
  return {};
}

CalibrationReport make_report(std::span<const CalibrationView> data,
                              const Camera& camera,
                              const std::vector<View>& views,
                              const CalibrationOptions& options) {
  CalibrationReport report;
  report.camera = camera;
  const auto rms = view_residuals(data, camera, views);
  double squares = 0.0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    report.views.push_back({.used = views[v].used,
                            .rms_px = rms[v],
                            .tilt_deg = tilt_deg(views[v].pose, data[v]),
                            .cam_from_board = views[v].pose});
    if (views[v].used) {
      report.corners_used += data[v].pixels.size();
      squares += rms[v] * rms[v] * static_cast<double>(data[v].pixels.size());
    }
  }
  report.views_used = used_count(views);
  report.rms_px = std::sqrt(squares / static_cast<double>(report.corners_used));
  report.coverage_ratio = coverage(data, views, options);
  report.standard_deviation = intrinsics_deviation(data, camera, views);
  report.warnings = warnings_about(report);
  return report;
}

}  // namespace

Result<> CalibrationOptions::validate() const {
  if (width_px < 16 || height_px < 16) {
    return fail(ErrorCode::kInvalidArgument,
                "image size is {}x{}, must be at least 16x16",
                width_px,
                height_px);
  }
  if (!(outlier_ratio >= 1.5)) {
    return fail(
        ErrorCode::kInvalidArgument, "outlier_ratio is {}, must be at least 1.5", outlier_ratio);
  }
  if (!(outlier_floor_px > 0.0)) {
    return fail(ErrorCode::kInvalidArgument,
                "outlier_floor_px is {}, must be larger than 0",
                outlier_floor_px);
  }
  return {};
}

Result<CalibrationReport> calibrate_camera(std::span<const CalibrationView> data,
                                           const CalibrationOptions& options) {
  TM_RETURN_IF_ERROR(options.validate());
  TM_RETURN_IF_ERROR(check_views(data));
  const auto start = find_calibration_start(data, options);
  if (!start) {
    return fail(ErrorCode::kInsufficientData,
                "cannot calibrate: no focal length gives a pose of the board in three views; are "
                "the detections right?");
  }
  Camera camera = start->camera;
  std::vector<View> views;
  for (const auto& pose : start->poses) {
    views.push_back({.pose = pose.value_or(Rigid3{}), .used = pose.has_value()});
  }
  if (!adjust(data, camera, views, Free::kFocalLength, Loss::kRobust)) {
    return fail(ErrorCode::kInsufficientData, "cannot calibrate: the adjustment did not converge");
  }
  for (bool changed = true; changed;) {
    if (!adjust(data, camera, views, Free::kAll, Loss::kRobust)) {
      return fail(ErrorCode::kInsufficientData,
                  "cannot calibrate: the adjustment did not converge");
    }
    changed = drop_outliers(view_residuals(data, camera, views), options, views);
    if (used_count(views) < kMinCalibrationViews) {
      return fail(
          ErrorCode::kInsufficientData,
          "cannot calibrate: only {} of {} views agree with each other, at least {} are needed",
          used_count(views),
          data.size(),
          kMinCalibrationViews);
    }
  }
  if (!adjust(data, camera, views, Free::kAll, Loss::kSquares)) {
    return fail(ErrorCode::kInsufficientData, "cannot calibrate: the adjustment did not converge");
  }
  return make_report(data, camera, views, options);
}

}  // namespace trigmesh
