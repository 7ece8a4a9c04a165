#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "firmware/base/result.hpp"
#include "sfm/camera/camera.hpp"
#include "sfm/geometry/rigid3.hpp"

namespace trigmesh {

/// One photograph of the board: matching places, first pixel centre = (0, 0).
struct CalibrationView {
  std::vector<Eigen::Vector2d> board_m;  ///< in the board's plane z = 0, metres
  std::vector<Eigen::Vector2d> pixels;   ///< as many
};

struct CalibrationOptions {
  CameraModel model = CameraModel::kBrownConrady;
  int width_px = 0;
  int height_px = 0;
  /// A view is left out when its rms is more than this many times the median of all views, >= 1.5
  /// ...
  double outlier_ratio = 3.0;
  /// ... and more than this many pixels, > 0: good data have views that differ by much and are all
  /// good.
  double outlier_floor_px = 0.5;

  [[nodiscard]] Result<> validate() const;
};

/// What became of one view, in input order.
struct CalibratedView {
  bool used = false;  ///< false: left out because its board disagrees with the others
  double rms_px =
      0.0;  ///< root mean square of the distances in pixels between predicted and seen corners
  double tilt_deg = 0.0;  ///< angle between the board's normal and the line of sight to its middle
  Rigid3 cam_from_board;  ///< metres
};

struct CalibrationReport {
  Camera camera;
  /// Standard deviations of the parameters, order as Camera::intrinsics; zero for those that the
  /// model does not use.
  IntrinsicsVector standard_deviation = IntrinsicsVector::Zero();
  double rms_px = 0.0;  ///< over all corners of the views used, distance in pixels
  std::size_t views_used = 0;
  std::size_t corners_used = 0;
  double coverage_ratio =
      0.0;  ///< part of a 10 x 8 grid over the image in which a corner of a used view lies
  std::vector<CalibratedView> views;
  /// Sentences for the operator: too few or too frontal views, poor coverage, weak parameters,
  /// large residual.
  std::vector<std::string> warnings;
};

/// Fewest views from which a camera is calibrated.
inline constexpr std::size_t kMinCalibrationViews = 3;

/// Intrinsics from views of a flat board: a focal length by trial (the one whose homographies fit
/// best, which is Zhang's constraint), then bundle adjustment of all parameters and poses with a
/// robust loss, outlier views put aside, and a final adjustment without the loss. kInvalidArgument:
/// options, views whose two lists differ in length or have fewer than four points;
/// kInsufficientData: fewer than three views (given, or left after outliers), or no convergence.
/// Single-threaded, deterministic.
[[nodiscard]] Result<CalibrationReport> calibrate_camera(std::span<const CalibrationView> views,
                                                         const CalibrationOptions& options);

}  // namespace trigmesh
