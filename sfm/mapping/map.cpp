#include "sfm/mapping/map.hpp"

#include <algorithm>
#include <utility>

#include "firmware/base/check.hpp"

namespace trigmesh {

void Map::add_view(View view) {
  view.landmarks.assign(view.keypoints_px.size(), kNoLandmark);
  scene_.views.push_back(std::move(view));
  visible_count_.push_back(0);
}

void Map::register_view(ViewId view, const Rigid3& cam_from_world) {
  TM_CHECK(!is_registered(view));
  scene_.views[index(view)].cam_from_world = cam_from_world;
  registered_.push_back(view);
}

void Map::unregister_view(ViewId view) {
  View& leaving = scene_.views[index(view)];
  for (std::size_t i = 0; i < leaving.landmarks.size(); ++i) {
    if (leaving.landmarks[i] != kNoLandmark) {
      remove_observation(leaving.landmarks[i], {view, id_of<FeatureIndex>(i)});
    }
  }
  leaving.cam_from_world.reset();
  std::erase(registered_, view);
}

void Map::add_landmark(TrackId track,
                       const Eigen::Vector3d& position_in_world,
                       std::span<const Observation> observations) {
  TM_CHECK(observations.size() >= 2 && landmark_of(track) == kNoLandmark);
  const auto id = id_of<LandmarkId>(scene_.landmarks.size());
  Landmark& added = scene_.landmarks.emplace_back();
  added.position_in_world = position_in_world;
  added.track.assign(observations.begin(), observations.end());
  std::sort(added.track.begin(), added.track.end());
  for (const Observation& observation : added.track) {
    scene_.views[index(observation.view)].landmarks[index(observation.feature)] = id;
  }
  track_of_landmark_.push_back(track);
  if (landmark_of_track_.size() <= index(track)) {
    landmark_of_track_.resize(std::max(tracks_->size(), index(track) + 1), kNoLandmark);
  }
  landmark_of_track_[index(track)] = id;
  ++landmark_count_;
  count_visible(track, +1);
}

void Map::add_observation(LandmarkId landmark, Observation observation) {
  std::vector<Observation>& track = scene_.landmarks[index(landmark)].track;
  track.insert(std::lower_bound(track.begin(), track.end(), observation), observation);
  scene_.views[index(observation.view)].landmarks[index(observation.feature)] = landmark;
}

void Map::remove_observation(LandmarkId landmark, Observation observation) {
  std::vector<Observation>& track = scene_.landmarks[index(landmark)].track;
  if (track.size() <= 2) {
    remove_landmark(landmark);
    return;
  }
  std::erase(track, observation);
  scene_.views[index(observation.view)].landmarks[index(observation.feature)] = kNoLandmark;
}

void Map::remove_landmark(LandmarkId landmark) {
  const TrackId track = track_of_landmark_[index(landmark)];
  detach(landmark);
  count_visible(track, -1);
}

void Map::detach(LandmarkId landmark) {
  Landmark& gone = scene_.landmarks[index(landmark)];
  for (const Observation& observation : gone.track) {
    scene_.views[index(observation.view)].landmarks[index(observation.feature)] = kNoLandmark;
  }
  gone.track.clear();
  landmark_of_track_[index(track_of_landmark_[index(landmark)])] = kNoLandmark;
  --landmark_count_;
}

void Map::tracks_changed(std::span<const TrackId> absorbed) {
  for (const TrackId track : absorbed) {
    if (landmark_of(track) != kNoLandmark) {
      detach(landmark_of(track));
    }
  }
  std::fill(visible_count_.begin(), visible_count_.end(), 0);
  for (const LandmarkId landmark : landmarks()) {
    count_visible(track_of_landmark_[index(landmark)], +1);
  }
}

void Map::count_visible(TrackId track, int change) {
  for (const Observation& observation : tracks_->observations(track)) {
    visible_count_[index(observation.view)] += static_cast<std::size_t>(change);
  }
}

std::vector<Map::Candidate> Map::candidates(ViewId view) const {
  std::vector<Candidate> found;
  const std::span<const TrackId> tracks = tracks_->tracks_of(view);
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (tracks[i] == kNoTrack) {
      continue;
    }
    const LandmarkId landmark = landmark_of(tracks[i]);
    if (landmark != kNoLandmark) {
      found.push_back({id_of<FeatureIndex>(i), landmark});
    }
  }
  return found;
}

std::vector<LandmarkId> Map::landmarks() const {
  std::vector<LandmarkId> ids;
  ids.reserve(landmark_count_);
  for (std::size_t i = 0; i < scene_.landmarks.size(); ++i) {
    if (!scene_.landmarks[i].track.empty()) {
      ids.push_back(id_of<LandmarkId>(i));
    }
  }
  return ids;
}

Scene Map::compact() const {
  Scene scene;
  scene.cameras = scene_.cameras;
  scene.views = scene_.views;
  for (View& view : scene.views) {
    std::fill(view.landmarks.begin(), view.landmarks.end(), kNoLandmark);
  }
  for (const Landmark& landmark : scene_.landmarks) {
    if (landmark.track.empty()) {
      continue;
    }
    const auto id = id_of<LandmarkId>(scene.landmarks.size());
    for (const Observation& observation : landmark.track) {
      scene.views[index(observation.view)].landmarks[index(observation.feature)] = id;
    }
    scene.landmarks.push_back(landmark);
  }
  return scene;
}

}  // namespace trigmesh
