#pragma once

#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <optional>
#include <vector>

#include "sfm/calibration/aruco.hpp"
#include "sfm/scene/scene.hpp"
#include "tests/support/random.hpp"

namespace trigmesh::test_support {

/// A marker in the world of a scene, in scene units; see SquareFit for its frame.
struct TrueMarker {
  Rigid3 world_from_marker;
  double side = 1.0;
};

/// How a card with markers is looked at.
struct CardSceneOptions {
  std::size_t views = 12;
  double distance = 10.0;
  double arc_deg = 120.0;  ///< the cameras stand on an arc above the plane z = 0
  double height = 6.0;
  double noise_px = 0.0;  ///< of each coordinate of a corner
  std::uint64_t seed = 3;
};

/// Views with true poses, and what a faultless detector finds in them.
struct CardScene {
  Scene scene;
  std::vector<std::vector<MarkerDetection>> detections;  ///< per view
};

/// Corner `k` of a marker in the order of MarkerDetection.
inline Eigen::Vector3d true_corner(const TrueMarker& marker, std::size_t k) {
  const double half = 0.5 * marker.side;
  const double x = k == 0 || k == 3 ? -half : half;
  const double y = k < 2 ? half : -half;
  return marker.world_from_marker * Eigen::Vector3d(x, y, 0.0);
}

/// Pose of a camera at `center` that looks at the origin; z of the world is up in its picture.
inline Rigid3 look_at_origin(const Eigen::Vector3d& center) {
  const Eigen::Vector3d forward = -center.normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d cam_from_world;
  cam_from_world << right.transpose(), forward.cross(right).transpose(), forward.transpose();
  const Eigen::Quaterniond rotation(cam_from_world);
  return {rotation, -(rotation * center)};
}

inline CardScene make_card_scene(const std::map<int, TrueMarker>& markers,
                                 const CardSceneOptions& options = {}) {
  CardScene made;
  made.scene.cameras = {{.model = CameraModel::kRadial,
                         .width_px = 1280,
                         .height_px = 960,
                         .fx_px = 1100.0,
                         .fy_px = 1100.0,
                         .cx_px = 639.5,
                         .cy_px = 479.5,
                         .distortion = {-0.05, 0.01, 0.0, 0.0}}};
  Random random(options.seed);
  for (std::size_t i = 0; i < options.views; ++i) {
    const double part =
        options.views == 1 ? 0.5 : static_cast<double>(i) / static_cast<double>(options.views - 1);
    const double angle = (part - 0.5) * options.arc_deg * std::numbers::pi / 180.0;
    const Eigen::Vector3d center(
        options.distance * std::cos(angle), options.distance * std::sin(angle), options.height);
    View view;
    view.name = "view" + std::to_string(i);
    view.cam_from_world = look_at_origin(center);
    std::vector<MarkerDetection> found;
    for (const auto& [id, marker] : markers) {
      MarkerDetection detection{.id = id, .corners_px = {}};
      for (std::size_t k = 0; k < 4; ++k) {
        detection.corners_px[k] =
            *project(made.scene.cameras[0], *view.cam_from_world * true_corner(marker, k)) +
            options.noise_px * Eigen::Vector2d(random.normal(), random.normal());
      }
      found.push_back(detection);
    }
    made.scene.views.push_back(std::move(view));
    made.detections.push_back(std::move(found));
  }
  return made;
}

/// Four markers of one side on the plane z = 0, as on a card.
inline std::map<int, TrueMarker> card_of_four(double side = 1.0) {
  std::map<int, TrueMarker> markers;
  for (int id = 0; id < 4; ++id) {
    const Eigen::Vector3d place(id % 2 == 0 ? -side : side, id < 2 ? side : -side, 0.0);
    markers[id] = {{Eigen::Quaterniond::Identity(), place}, side};
  }
  return markers;
}

}  // namespace trigmesh::test_support
