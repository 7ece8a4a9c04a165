#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>

#include <Eigen/Core>

#include "sfm/geometry/rigid3.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// How well the place of an edge is known on average over views, pixels, once the detector has
/// taken out what the edges inside of the markers tell: synth_A_orbit, _demo and _video are 0.004,
/// 0.001 and 0.013 px wrong.
inline constexpr double kEdgePlaceSdPx = 0.02;

/// A square marker as one view sees it.
struct MarkerSighting {
  ViewId view{};
  /// Corners of the black square: top left, top right, bottom right, bottom left in the marker's
  /// own orientation. Pixels as measured, first pixel centre = (0, 0).
  std::array<Eigen::Vector2d, 4> corners_px;
};

/// Why a square could not be measured.
enum class SquareOutcome {
  kOk,
  kTooFewViews,   ///< seen by too few views with a pose
  kSmallAngle,    ///< its views are too near to each other for its distance
  kInconsistent,  ///< no place of a square explains enough of the views: it moved, is there twice,
                  ///< is not flat, or poses are wrong
};

/// "ok", "too_few_views", "small_angle", "inconsistent".
[[nodiscard]] std::string_view to_string(SquareOutcome outcome);

struct SquareFitOptions {
  /// Views that must agree, >= 2. With two a wrong one could not be told from the other.
  std::size_t min_views = 3;
  /// Smallest part of the views that see it which must agree, (0, 1].
  double min_agreeing_ratio = 0.6;
  /// Largest angle between two directions from which it is seen, radians, at least; below, its side
  /// hangs on the noise of poses.
  double min_angle_rad = 0.05;
  /// Largest error of a corner, pixels, for a view to agree at first. Then views are put aside that
  /// are more than three times as wrong as the median and by more than half a pixel.
  double max_error_px = 4.0;
};

/// A square in the world of a scene, with what is known of its accuracy.
struct SquareFit {
  SquareOutcome outcome = SquareOutcome::kTooFewViews;
  std::size_t views_seen = 0;  ///< with a pose
  std::size_t views_used = 0;
  double rms_px = 0.0;     ///< of the distances of the corners in the views that were used
  double angle_rad = 0.0;  ///< largest angle between two directions from which it is seen

  // The rest is meant when kOk only.

  /// Marker frame: origin in the middle, x to the right of the pattern, y to its top, z out of it
  /// towards the viewer.
  Rigid3 world_from_marker;
  double side = 0.0;           ///< of the black square, scene units
  double side_sd_ratio = 0.0;  ///< standard deviation of the side, as a part of it
  double normal_sd_rad = 0.0;  ///< of the direction of its z axis, about one axis
  /// What the side may be wrong by, as a part of it, because edges are seen in a wrong place by
  /// kEdgePlaceSdPx: the same for all markers of a scene, so it does not average out.
  double edge_sd_ratio = 0.0;
  Eigen::Matrix3d center_covariance = Eigen::Matrix3d::Zero();  ///< 3x3, scene units squared
};

/// Measures a square by all views that see it: first its corners one by one, leaving out views that
/// disagree with most others, then pose and side together so that the squared distances of all
/// corners are smallest. Poses and cameras are taken as they are. Standard deviations come from
/// what is left over, counted by views: the corners of one view err together, when its pose or the
/// place of its edges does. Views without a pose are passed over. Deterministic.
[[nodiscard]] SquareFit fit_square(const Scene& scene,
                                   std::span<const MarkerSighting> sightings,
                                   const SquareFitOptions& options = {});

}  // namespace trigmesh
