#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sfm/camera/camera.hpp"
#include "sfm/matching/matches.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh::test_support {

/// Where the points are; all around the origin. World units; cameras look from -z (y down).
enum class CloudKind {
  kBox,        ///< on the six faces of a cube, seen from outside only (straight from the front: one
               ///< plane)
  kSphere,     ///< on a sphere, seen from outside only
  kVolume,     ///< anywhere in a cube, never hidden
  kPlane,      ///< on the plane z = 0, seen from -z
  kTwoPlanes,  ///< on two planes that meet in a right angle along y, edge towards the cameras
};

/// How the camera moves.
enum class PathKind {
  kArc,           ///< around the origin through `arc_deg`, slightly up and down
  kOrbit,         ///< all the way around
  kLine,          ///< sideways, parallel to x, looking at +z
  kForward,       ///< along +z, looking at +z: no sideways motion at all
  kPureRotation,  ///< turning about y and x in one place
  kRandom,        ///< anywhere in front, looking near the origin, with roll
};

/// Which wrong matches are put among the right ones.
enum class OutlierKind {
  kAnywhere,          ///< any two keypoints
  kNearEpipolarLine,  ///< such that pass an epipolar check: of 32 tries the nearest to the line
};

/// A scene to be made. Everything follows from these numbers.
struct SyntheticSceneOptions {
  CloudKind cloud = CloudKind::kBox;
  std::size_t points = 600;  ///< per component
  double extent = 2.0;       ///< edge or diameter of the cloud

  PathKind path = PathKind::kArc;
  std::size_t views = 10;  ///< per component
  double distance = 5.0;   ///< of the cameras from the origin
  double arc_deg = 60.0;

  /// The first camera group. Group g has a focal length larger by a ratio of 0.1 g. Views take the
  /// groups in turn.
  Camera camera{.model = CameraModel::kPinhole,
                .width_px = 800,
                .height_px = 600,
                .fx_px = 700.0,
                .fy_px = 705.0,
                .cx_px = 401.5,
                .cy_px = 298.0,
                .distortion = {}};
  std::size_t camera_groups = 1;

  double noise_px = 0.0;       ///< standard deviation on each coordinate of a keypoint
  double dropout_ratio = 0.0;  ///< of visible points that are not detected in a view
  double clutter_ratio =
      0.0;  ///< keypoints of nothing, as a ratio of the detected points of the view
  double outlier_ratio = 0.0;  ///< wrong matches, as a ratio of all matches of a pair, [0, 1)
  OutlierKind outlier_kind = OutlierKind::kAnywhere;
  std::size_t min_pair_matches = 15;  ///< pairs with fewer right matches are left out

  std::size_t components =
      1;  ///< copies of cloud and path (with other random numbers) that do not see each other
  std::uint64_t seed = 1;
};

/// A verified image pair as matching would hand it on.
struct SyntheticPair {
  ImagePair pair;
  TwoViewGeometry geometry;
};

/// What is true, and what is seen of it.
struct SyntheticScene {
  /// True cameras, poses and points; keypoints with noise, in random order. Landmarks are the
  /// points that at least two views detect. View names: "component0/view000.jpg".
  Scene truth;
  std::vector<SyntheticPair> pairs;  ///< ascending
  std::vector<std::size_t> component_of_view;
};

[[nodiscard]] SyntheticScene make_synthetic_scene(const SyntheticSceneOptions& options);

/// The scene as it is before mapping: cameras, names and keypoints, but no poses and no landmarks.
[[nodiscard]] Scene without_model(const Scene& scene);

/// How far `perturbed` moves things: standard deviations.
struct Perturbation {
  double rotation_rad = 0.0;  ///< about the camera's own centre
  double translation = 0.0;   ///< of each coordinate of the camera centre
  double point = 0.0;         ///< of each coordinate of a landmark
  std::uint64_t seed = 7;
};

[[nodiscard]] Scene perturbed(const Scene& scene, const Perturbation& perturbation);

}  // namespace trigmesh::test_support
