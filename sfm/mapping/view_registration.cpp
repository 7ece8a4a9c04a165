#include "sfm/mapping/view_registration.hpp"

#include <algorithm>
#include <array>

#include "sfm/geometry/absolute_pose.hpp"

namespace trigmesh {

namespace {

constexpr std::array<int, 4> kCellsPerSide{2, 4, 8, 16};

AbsolutePoseOptions pose_options(double max_error_px, const MapperOptions& options) {
  AbsolutePoseOptions result;
  result.max_error_px = max_error_px;
  result.min_inliers = static_cast<std::size_t>(options.min_pose_inliers);
  result.seed = options.seed;
  return result;
}

}  // namespace

ViewPose estimate_view_pose(const Map& map,
                            ViewId view,
                            double max_error_px,
                            FocalMode focal_mode,
                            const MapperOptions& options) {
  const std::vector<Map::Candidate> candidates = map.candidates(view);
  std::vector<Eigen::Vector2d> pixels;
  std::vector<Eigen::Vector3d> points;
  for (const Map::Candidate& candidate : candidates) {
    pixels.push_back(map.pixel({view, candidate.feature}));
    points.push_back(map.landmark(candidate.landmark).position_in_world);
  }
  const AbsolutePoseOptions settings = pose_options(max_error_px, options);
  ViewPose result;
  result.map_matches = candidates.size();
  AbsolutePose pose;
  if (focal_mode == FocalMode::kEstimated) {
    const FocalPose found = estimate_focal_pose(map.camera_of(view), pixels, points, settings, {});
    pose = found.pose;
    result.focal_px = found.camera.fx_px;
  } else {
    pose = estimate_absolute_pose(map.camera_of(view), pixels, points, settings);
  }
  result.found = pose.outcome == AbsolutePoseOutcome::kOk;
  result.cam_from_world = pose.cam_from_world;
  for (std::size_t i = 0; i < pose.inliers.size(); ++i) {
    if (pose.inliers[i] != 0) {
      result.inliers.push_back(candidates[i]);
    }
  }
  return result;
}

double visibility_score(const Map& map, ViewId view) {
  const Camera& camera = map.camera_of(view);
  const std::vector<Map::Candidate> candidates = map.candidates(view);
  double score = 0.0;
  for (const int cells : kCellsPerSide) {
    std::vector<char> hit(static_cast<std::size_t>(cells * cells), 0);
    for (const Map::Candidate& candidate : candidates) {
      const Eigen::Vector2d pixel = map.pixel({view, candidate.feature});
      const int column =
          std::clamp(static_cast<int>(pixel.x() * cells / camera.width_px), 0, cells - 1);
      const int row =
          std::clamp(static_cast<int>(pixel.y() * cells / camera.height_px), 0, cells - 1);
      hit[static_cast<std::size_t>(row * cells + column)] = 1;
    }
    score +=
        static_cast<double>(cells) * static_cast<double>(std::count(hit.begin(), hit.end(), 1));
  }
  return score;
}

}  // namespace trigmesh
