#include "sfm/mapping/loop_check.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace trigmesh {

namespace {

constexpr std::size_t kFewestAngles = 8;

/// Between where `seen` looks and where the landmark of `known` lies from there.
std::optional<double> angle_deg(const Map& map, const Observation& known, const Observation& seen) {
  const View& view = map.scene().views[index(known.view)];
  const LandmarkId landmark = view.landmarks[index(known.feature)];
  const auto ray = normalize_pixel(map.camera_of(seen.view), map.pixel(seen));
  if (landmark == kNoLandmark || !ray) {
    return std::nullopt;
  }
  const Eigen::Vector3d expected = map.pose(seen.view) * map.landmark(landmark).position_in_world;
  const Eigen::Vector3d found = ray->homogeneous();
  return std::atan2(expected.cross(found).norm(), expected.dot(found)) * 180.0 / std::numbers::pi;
}

}  // namespace

std::optional<double> disagreement_deg(const Map& map,
                                       ImagePair pair,
                                       std::span<const FeatureMatch> matches) {
  std::vector<double> angles_deg;
  for (const FeatureMatch& match : matches) {
    const Observation first{pair.first, match.first};
    const Observation second{pair.second, match.second};
    for (const auto& angle : {angle_deg(map, first, second), angle_deg(map, second, first)}) {
      if (angle) {
        angles_deg.push_back(*angle);
      }
    }
  }
  if (angles_deg.size() < kFewestAngles) {
    return std::nullopt;
  }
  const auto middle = angles_deg.begin() + static_cast<std::ptrdiff_t>(angles_deg.size() / 2);
  std::nth_element(angles_deg.begin(), middle, angles_deg.end());
  return *middle;
}

}  // namespace trigmesh
