#include "sfm/mapping/structure.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "sfm/geometry/triangulation.hpp"

namespace trigmesh {

namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;
// Work is handed to threads in pieces of this many tracks or landmarks.
constexpr std::size_t kBlock = 256;

void for_each_block(Executor& executor,
                    std::size_t count,
                    const std::function<void(std::size_t)>& work) {
  executor.for_each_index((count + kBlock - 1) / kBlock, [&](std::size_t block) {
    for (std::size_t i = block * kBlock; i < std::min(count, (block + 1) * kBlock); ++i) {
      work(i);
    }
  });
}

TriangulationOptions triangulation_options(const MapperOptions& options) {
  TriangulationOptions result;
  result.min_angle_rad = options.min_triangulation_angle_deg * kRadPerDeg;
  result.max_error_px = options.max_reprojection_px;
  result.seed = options.seed;
  return result;
}

struct Sightings {
  std::vector<Sighting> sightings;
  std::vector<Observation> observations;
};

/// The given observations that lie in registered views and have a ray.
Sightings sightings_of(const Map& map, std::span<const Observation> observations) {
  Sightings found;
  for (const Observation& observation : observations) {
    if (!map.is_registered(observation.view)) {
      continue;
    }
    const auto sighting = make_sighting(
        map.camera_of(observation.view), map.pose(observation.view), map.pixel(observation));
    if (sighting) {
      found.sightings.push_back(*sighting);
      found.observations.push_back(observation);
    }
  }
  return found;
}

struct NewLandmark {
  Eigen::Vector3d position_in_world;
  std::vector<Observation> observations;
};

std::optional<NewLandmark> triangulate_track(const Map& map,
                                             std::span<const Observation> track,
                                             const TriangulationOptions& options) {
  const Sightings seen = sightings_of(map, track);
  if (seen.sightings.size() < 2) {
    return std::nullopt;
  }
  const RobustTriangulation result = triangulate_robust(seen.sightings, options);
  if (result.best.outcome != TriangulationOutcome::kOk) {
    return std::nullopt;
  }
  NewLandmark landmark{result.best.point_in_world, {}};
  for (std::size_t i = 0; i < seen.observations.size(); ++i) {
    if (result.inliers[i] != 0) {
      landmark.observations.push_back(seen.observations[i]);
    }
  }
  return landmark;
}

std::vector<Observation> wrong_observations(const Map& map, LandmarkId id, double max_error_px) {
  std::vector<Observation> wrong;
  for (const Observation& observation : map.landmark(id).track) {
    if (!(reprojection_error_px(map, id, observation) <= max_error_px)) {
      wrong.push_back(observation);
    }
  }
  return wrong;
}

}  // namespace

double reprojection_error_px(const Map& map, LandmarkId landmark, const Observation& observation) {
  const auto pixel = project(map.camera_of(observation.view),
                             map.pose(observation.view) * map.landmark(landmark).position_in_world);
  return pixel ? (*pixel - map.pixel(observation)).norm() : std::numeric_limits<double>::infinity();
}

double largest_triangulation_angle(const Map& map, LandmarkId landmark) {
  const Landmark& point = map.landmark(landmark);
  std::vector<Eigen::Vector3d> rays;
  rays.reserve(point.track.size());
  for (const Observation& observation : point.track) {
    rays.push_back(
        (camera_center(map.pose(observation.view)) - point.position_in_world).normalized());
  }
  double least_cosine = 1.0;
  std::pair<std::size_t, std::size_t> widest(0, 0);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    for (std::size_t j = i + 1; j < rays.size(); ++j) {
      if (const double cosine = rays[i].dot(rays[j]); cosine < least_cosine) {
        least_cosine = cosine;
        widest = {i, j};
      }
    }
  }
  if (rays.empty()) {
    return 0.0;
  }
  return triangulation_angle(rays[widest.first], rays[widest.second], Eigen::Vector3d::Zero());
}

std::size_t Structure::triangulate(Map& map, std::span<const TrackId> tracks) const {
  const TriangulationOptions options = triangulation_options(*options_);
  std::vector<std::optional<NewLandmark>> results(tracks.size());
  for_each_block(*executor_, tracks.size(), [&](std::size_t i) {
    if (map.landmark_of(tracks[i]) == kNoLandmark) {
      results[i] = triangulate_track(map, tracks_->observations(tracks[i]), options);
    }
  });
  std::size_t added = 0;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (results[i] && map.landmark_of(tracks[i]) == kNoLandmark) {
      map.add_landmark(tracks[i], results[i]->position_in_world, results[i]->observations);
      ++added;
    }
  }
  return added;
}

std::size_t Structure::triangulate_all(Map& map) const {
  std::vector<TrackId> open;
  for (std::size_t i = 0; i < tracks_->size(); ++i) {
    const auto track = id_of<TrackId>(i);
    const auto seen = tracks_->observations(track);
    const auto registered = std::count_if(
        seen.begin(), seen.end(), [&](const Observation& o) { return map.is_registered(o.view); });
    if (registered >= 2 && map.landmark_of(track) == kNoLandmark) {
      open.push_back(track);
    }
  }
  return triangulate(map, open);
}

std::size_t Structure::complete(Map& map) const {
  std::size_t added = 0;
  for (const LandmarkId id : map.landmarks()) {
    for (const Observation& observation : tracks_->observations(map.track_of(id))) {
      const bool free =
          map.is_registered(observation.view) &&
          map.scene().views[index(observation.view)].landmarks[index(observation.feature)] ==
              kNoLandmark;
      if (free && reprojection_error_px(map, id, observation) <= options_->max_reprojection_px) {
        map.add_observation(id, observation);
        ++added;
      }
    }
  }
  return added;
}

void Structure::reposition(Map& map) const {
  TriangulationOptions options = triangulation_options(*options_);
  options.max_error_px = std::numeric_limits<double>::max();
  options.min_angle_rad = 0.0;
  const std::vector<LandmarkId> ids = map.landmarks();
  std::vector<std::optional<Eigen::Vector3d>> positions(ids.size());
  for_each_block(*executor_, ids.size(), [&](std::size_t i) {
    const Triangulation result =
        trigmesh::triangulate(sightings_of(map, map.landmark(ids[i]).track).sightings, options);
    if (result.outcome == TriangulationOutcome::kOk) {
      positions[i] = result.point_in_world;
    }
  });
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (positions[i]) {
      map.set_position(ids[i], *positions[i]);
    }
  }
}

Structure::FilterReport Structure::filter(Map& map, double max_error_px) const {
  const std::vector<LandmarkId> ids = map.landmarks();
  std::vector<std::vector<Observation>> wrong(ids.size());
  for_each_block(*executor_, ids.size(), [&](std::size_t i) {
    wrong[i] = wrong_observations(map, ids[i], max_error_px);
  });
  FilterReport report;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    report.removed_observations += wrong[i].size();
    for (const Observation& observation : wrong[i]) {
      if (map.exists(ids[i])) {
        map.remove_observation(ids[i], observation);
      }
    }
  }
  const double min_angle_rad = options_->min_triangulation_angle_deg * kRadPerDeg;
  std::vector<char> narrow(ids.size(), 0);
  for_each_block(*executor_, ids.size(), [&](std::size_t i) {
    narrow[i] =
        map.exists(ids[i]) && largest_triangulation_angle(map, ids[i]) < min_angle_rad ? 1 : 0;
  });
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (narrow[i] != 0) {
      map.remove_landmark(ids[i]);
    }
    report.removed_landmarks += map.exists(ids[i]) ? 0U : 1U;
  }
  return report;
}

}  // namespace trigmesh
