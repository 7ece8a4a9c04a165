#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "sfm/calibration/board.hpp"
#include "sfm/calibration/charuco.hpp"
#include "sfm/camera/camera.hpp"
#include "sfm/geometry/rigid3.hpp"

namespace trigmesh::test_support {

/// Grey value, 0..255, at a place of a plane, metres.
using PlanePattern = std::function<double(double x_m, double y_m)>;

/// A printed board with a white border of one square on grey; corner 0 at the origin.
[[nodiscard]] PlanePattern board_pattern(const Board& board,
                                         CharucoLayout layout = CharucoLayout::kBlackTopLeft);

/// One marker with a white border of two cells on grey; its black square has the corners (0, 0) and
/// (side_m, side_m).
[[nodiscard]] PlanePattern marker_pattern(const MarkerDictionary& dictionary,
                                          int id,
                                          double side_m);

/// Renders planes as a camera with any lens model sees them, light summed over a pixel and written
/// as sRGB: 3x3 rays a pixel, each traced exactly but for the lens, which is interpolated within a
/// pixel.
class PlaneRenderer {
 public:
  explicit PlaneRenderer(const Camera& camera);

  /// The plane z = 0 of its own frame. `noise`: standard deviation in grey levels, reproducible by
  /// `seed`.
  [[nodiscard]] cv::Mat render(const PlanePattern& pattern,
                               const Rigid3& cam_from_plane,
                               double noise,
                               std::uint64_t seed) const;

 private:
  [[nodiscard]] const Eigen::Vector2d& ray(int column, int row) const {
    return corner_rays_[static_cast<std::size_t>(row * (camera_.width_px + 1) + column)];
  }

  Camera camera_;
  std::vector<Eigen::Vector2d>
      corner_rays_;  ///< normalised coordinates of the pixels' corners; NaN outside the lens
};

/// Pose of a board of `width_m` x `height_m` (corner 0 at the origin): its middle at `distance_m`
/// along the axis, moved by `shift` (fractions of the distance), turned by `tilt_x_deg` about the
/// image's x axis, then `tilt_y_deg` about y, after `roll_deg` in its plane.
[[nodiscard]] Rigid3 board_pose(const Eigen::Vector2d& size_m,
                                double distance_m,
                                const Eigen::Vector2d& shift,
                                const Eigen::Vector3d& tilt_x_tilt_y_roll_deg);

/// Poses such as a careful operator takes: tilted to all sides, at several distances, out to the
/// corners of the image.
[[nodiscard]] std::vector<Rigid3> varied_board_poses(const Camera& camera,
                                                     const Eigen::Vector2d& size_m,
                                                     int count);

}  // namespace trigmesh::test_support
