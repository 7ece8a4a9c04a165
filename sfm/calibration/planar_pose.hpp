#pragma once

#include <optional>
#include <span>

#include "sfm/calibration/calibration.hpp"

namespace trigmesh {

/// Pose of a flat board from its homography in normalised coordinates: H ~ [r1 r2 t], made
/// orthonormal; refined by nothing. Nothing when a pixel has no ray, the points are degenerate, or
/// the board would stand behind the camera. At least 4 points.
[[nodiscard]] std::optional<Rigid3> planar_pose(const Camera& camera, const CalibrationView& view);

/// Root mean square distance in pixels between the projections of the view's points and its pixels;
/// infinite when a point does not project.
[[nodiscard]] double view_rms_px(const Camera& camera,
                                 const Rigid3& cam_from_board,
                                 const CalibrationView& view);

/// A camera without distortion and the principal point in the middle of the image, and a pose for
/// every view, to start the adjustment from: of a series of focal lengths the one under which the
/// boards' homographies come nearest to rigid motions (Zhang, PAMI 2000: r1 and r2 orthogonal and
/// of equal length). Nothing when no focal length gives poses for at least three views. Views
/// without a pose have none.
struct CalibrationStart {
  Camera camera;
  std::vector<std::optional<Rigid3>> poses;
};

[[nodiscard]] std::optional<CalibrationStart> find_calibration_start(
    std::span<const CalibrationView> views, const CalibrationOptions& options);

}  // namespace trigmesh
