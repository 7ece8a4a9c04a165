#pragma once

#include <vector>

#include "sfm/mapping/map.hpp"
#include "sfm/mapping/mapper.hpp"

namespace trigmesh {

/// The pose of a view in a map from keypoints whose tracks have landmarks.
struct ViewPose {
  bool found = false;
  Rigid3 cam_from_world;
  std::size_t map_matches = 0;
  std::vector<Map::Candidate> inliers;
  std::optional<double>
      focal_px;  ///< set when the focal length of its camera was found along with the pose
};

/// Whether the focal length is estimated with the pose, for the first view of a camera of which
/// nothing is known.
enum class FocalMode { kAsIs, kEstimated };

/// P3P with local optimisation on all 2D-3D matches; found when `min_pose_inliers` agree within
/// `max_error_px`.
[[nodiscard]] ViewPose estimate_view_pose(const Map& map,
                                          ViewId view,
                                          double max_error_px,
                                          FocalMode focal_mode,
                                          const MapperOptions& options);

/// How well the 2D-3D matches of a view bind its pose: the number of cells that hold one, summed
/// over image grids of 2, 4, 8 and 16 cells a side and weighted by cells a side (Schoenberger and
/// Frahm, CVPR 2016, section 4.2).
[[nodiscard]] double visibility_score(const Map& map, ViewId view);

}  // namespace trigmesh
