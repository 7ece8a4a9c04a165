#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include <Eigen/Core>

#include "firmware/base/result.hpp"
#include "sfm/camera/camera.hpp"
#include "sfm/geometry/rigid3.hpp"
#include "sfm/geometry/sampling.hpp"

namespace trigmesh {

/// One view of a point, prepared once so that triangulation need not invert lenses or unpack
/// quaternions.
struct Sighting {
  const Camera* camera = nullptr;  ///< lent; outlives the call
  Eigen::Matrix<double, 3, 4> cam_from_world = Eigen::Matrix<double, 3, 4>::Zero();  ///< [R|t]
  Eigen::Vector3d center_in_world = Eigen::Vector3d::Zero();
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();       ///< as measured, with distortion
  Eigen::Vector2d normalized = Eigen::Vector2d::Zero();  ///< normalize_pixel(*camera, pixel)
};

/// Nothing when the pixel has no ray (see `normalize_pixel`).
[[nodiscard]] std::optional<Sighting> make_sighting(const Camera& camera,
                                                    const Rigid3& cam_from_world,
                                                    const Eigen::Vector2d& pixel);

struct TriangulationOptions {
  /// Smallest angle between two of the rays at the point, radians, [0, pi). Below about one degree
  /// depth is ill-conditioned.
  double min_angle_rad = 0.026;
  /// Largest reprojection error of any (robust version: of any inlier) view, pixels, > 0.
  double max_error_px = 4.0;
  /// Steps of the refinement of the reprojection error; 0 leaves the linear solution.
  int max_refinement_steps = 6;
  /// Robust version: how many views must agree, >= 2.
  std::size_t min_inliers = 2;
  /// Robust version: at most this many pairs of views are tried; with few views all are.
  std::size_t max_pairs = 60;
  std::uint64_t seed = 1;

  [[nodiscard]] Result<> validate() const;
};

enum class TriangulationOutcome {
  kOk,
  kBehindCamera,  ///< the point that fits best lies behind a camera that sees it
  kSmallAngle,    ///< the rays are too nearly parallel
  kLargeError,    ///< no point is near enough to all rays (robust version: to enough of them)
  kDegenerate,    ///< fewer than two views, or all from one place
};

/// "ok", "behind_camera", "small_angle", "large_error", "degenerate".
[[nodiscard]] std::string_view to_string(TriangulationOutcome outcome);

struct Triangulation {
  TriangulationOutcome outcome = TriangulationOutcome::kDegenerate;
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();
  double angle_rad = 0.0;      ///< largest angle between two rays at the point
  double max_error_px = 0.0;   ///< over the views used
  double mean_error_px = 0.0;  ///< over the views used
};

/// A triangulation that may leave views out.
struct RobustTriangulation {
  Triangulation best;
  InlierMask inliers;  ///< one entry per sighting; all 0 unless kOk
  std::size_t inlier_count = 0;
};

/// Angle at `point` between the directions to two camera centres, radians, [0, pi]; 0 when the
/// point is at a centre.
[[nodiscard]] double triangulation_angle(const Eigen::Vector3d& first_center,
                                         const Eigen::Vector3d& second_center,
                                         const Eigen::Vector3d& point);

/// Linear solution in homogeneous coordinates, unit length, finite also for points at infinity
/// (last entry 0). Minimises an algebraic error; nothing with fewer than two views.
[[nodiscard]] std::optional<Eigen::Vector4d> triangulate_linear(
    std::span<const Sighting> sightings);

/// The point that minimises the sum of squared reprojection errors over all sightings, then the
/// checks in the order of the outcomes. `point_in_world` and the errors are filled for every
/// outcome that has a point at all. No heap allocation.
[[nodiscard]] Triangulation triangulate(std::span<const Sighting> sightings,
                                        const TriangulationOptions& options);

/// The same when some of the sightings may belong to another point: the point that most of them
/// agree on. When all agree this costs no more than `triangulate`. Deterministic.
[[nodiscard]] RobustTriangulation triangulate_robust(std::span<const Sighting> sightings,
                                                     const TriangulationOptions& options);

}  // namespace trigmesh
