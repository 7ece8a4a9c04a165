#include "sfm/mapping/map_joining.hpp"

#include <algorithm>
#include <vector>

namespace trigmesh {

namespace {

struct CommonLandmarks {
  std::vector<Eigen::Vector3d> in_a;
  std::vector<Eigen::Vector3d> in_b;
};

CommonLandmarks common_landmarks(const Map& a, const Map& b) {
  CommonLandmarks common;
  for (const LandmarkId id : b.landmarks()) {
    const LandmarkId twin = a.landmark_of(b.track_of(id));
    if (twin != kNoLandmark) {
      common.in_a.push_back(a.landmark(twin).position_in_world);
      common.in_b.push_back(b.landmark(id).position_in_world);
    }
  }
  return common;
}

/// Median distance from the median point: a measure of extent that outliers do not move.
double median_spread(std::vector<Eigen::Vector3d> points) {
  Eigen::Vector3d center;
  const std::size_t middle = points.size() / 2;
  for (int axis = 0; axis < 3; ++axis) {
    std::nth_element(
        points.begin(),
        points.begin() + static_cast<std::ptrdiff_t>(middle),
        points.end(),
        [axis](const Eigen::Vector3d& p, const Eigen::Vector3d& q) { return p[axis] < q[axis]; });
    center[axis] = points[middle][axis];
  }
  std::vector<double> distances;
  for (const Eigen::Vector3d& point : points) {
    distances.push_back((point - center).norm());
  }
  std::nth_element(
      distances.begin(), distances.begin() + static_cast<std::ptrdiff_t>(middle), distances.end());
  return distances[middle];
}

}  // namespace

std::optional<Sim3> find_overlap(const Map& a,
                                 const Map& b,
                                 std::size_t min_common,
                                 double max_error_ratio,
                                 std::uint64_t seed) {
  const CommonLandmarks common = common_landmarks(a, b);
  if (common.in_a.size() < min_common) {
    return std::nullopt;
  }
  RobustAlignmentOptions options;
  options.max_error = max_error_ratio * median_spread(common.in_a);
  options.min_inliers = std::max(min_common, common.in_a.size() / 2);
  options.seed = seed;
  if (!(options.max_error > 0.0)) {
    return std::nullopt;
  }
  const Alignment alignment = align_points_robust(common.in_b, common.in_a, options);
  return alignment.outcome == AlignmentOutcome::kOk ? std::optional(alignment.b_from_a)
                                                    : std::nullopt;
}

void absorb(Map& a, const Map& b, const Sim3& a_from_b) {
  for (const ViewId view : b.registered()) {
    a.register_view(view, transform_pose(a_from_b, b.pose(view)));
  }
  for (const LandmarkId id : b.landmarks()) {
    const Landmark& landmark = b.landmark(id);
    const LandmarkId twin = a.landmark_of(b.track_of(id));
    if (twin == kNoLandmark) {
      a.add_landmark(b.track_of(id), a_from_b * landmark.position_in_world, landmark.track);
      continue;
    }
    for (const Observation& observation : landmark.track) {
      a.add_observation(twin, observation);
    }
  }
}

}  // namespace trigmesh
