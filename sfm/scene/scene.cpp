#include "sfm/scene/scene.hpp"

#include <algorithm>
#include <cmath>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

bool is_unit(const Eigen::Quaterniond& rotation) {
  constexpr double kTolerance = 1e-6;
  return std::abs(rotation.squaredNorm() - 1.0) <= kTolerance;  // false for NaN too
}

Result<> validate_view(const Scene& scene, std::size_t position) {
  const View& view = scene.views[position];
  if (index(view.camera) >= scene.cameras.size()) {
    return fail(ErrorCode::kCorruptData,
                "view {} ({}) refers to camera {}, but there are {}",
                position,
                view.name,
                index(view.camera),
                scene.cameras.size());
  }
  if (view.landmarks.size() != view.keypoints_px.size()) {
    return fail(ErrorCode::kCorruptData,
                "view {} ({}) has {} keypoints but {} landmark entries",
                position,
                view.name,
                view.keypoints_px.size(),
                view.landmarks.size());
  }
  if (view.cam_from_world &&
      !(is_unit(view.cam_from_world->rotation) && view.cam_from_world->translation.allFinite())) {
    return fail(ErrorCode::kCorruptData,
                "view {} ({}) has a pose that is no rigid motion",
                position,
                view.name);
  }
  for (std::size_t i = 0; i < view.keypoints_px.size(); ++i) {
    if (!view.keypoints_px[i].allFinite()) {
      return fail(ErrorCode::kCorruptData,
                  "view {} ({}): keypoint {} is not finite",
                  position,
                  view.name,
                  i);
    }
  }
  return {};
}

/// `id` is the position of the landmark that holds the observation.
Result<> validate_observation(const Scene& scene, const Observation& observation, std::size_t id) {
  if (index(observation.view) >= scene.views.size()) {
    return fail(ErrorCode::kCorruptData,
                "landmark {} is seen by view {}, but there are {}",
                id,
                index(observation.view),
                scene.views.size());
  }
  const View& view = scene.views[index(observation.view)];
  const std::size_t feature = index(observation.feature);
  if (feature >= view.landmarks.size() || view.landmarks[feature] != id_of<LandmarkId>(id)) {
    return fail(ErrorCode::kCorruptData,
                "landmark {} is seen by keypoint {} of view {} ({}), which does not know of it",
                id,
                feature,
                index(observation.view),
                view.name);
  }
  if (!view.cam_from_world) {
    return fail(ErrorCode::kCorruptData,
                "landmark {} is seen by view {} ({}), which has no pose",
                id,
                index(observation.view),
                view.name);
  }
  return {};
}

Result<> validate_landmark(const Scene& scene, std::size_t position) {
  const Landmark& landmark = scene.landmarks[position];
  if (!landmark.position_in_world.allFinite() || !std::isfinite(landmark.error_px)) {
    return fail(ErrorCode::kCorruptData, "landmark {} has a position that is not finite", position);
  }
  if (landmark.track.size() < 2) {
    return fail(ErrorCode::kCorruptData,
                "landmark {} is seen by {} views, at least 2 are needed",
                position,
                landmark.track.size());
  }
  for (std::size_t i = 0; i < landmark.track.size(); ++i) {
    if (i > 0 && landmark.track[i].view <= landmark.track[i - 1].view) {
      return fail(ErrorCode::kCorruptData,
                  "the track of landmark {} is not sorted or has a view twice",
                  position);
    }
    TM_RETURN_IF_ERROR(validate_observation(scene, landmark.track[i], position));
  }
  return {};
}

}  // namespace

Result<> Scene::validate() const {
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (const Result<> camera = cameras[i].validate(); !camera) {
      return fail(ErrorCode::kCorruptData, "camera {}: {}", i, camera.error().message);
    }
  }
  std::size_t claimed = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    TM_RETURN_IF_ERROR(validate_view(*this, i));
    claimed += static_cast<std::size_t>(
        std::ranges::count_if(views[i].landmarks, [](LandmarkId id) { return id != kNoLandmark; }));
  }
  std::size_t tracked = 0;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    TM_RETURN_IF_ERROR(validate_landmark(*this, i));
    tracked += landmarks[i].track.size();
  }
  // Every track entry was found in its view; equal counts leave no keypoint that claims more.
  if (claimed != tracked) {
    return fail(ErrorCode::kCorruptData,
                "{} keypoints name a landmark, but the tracks hold {} observations",
                claimed,
                tracked);
  }
  return {};
}

std::size_t Scene::registered_count() const {
  return static_cast<std::size_t>(std::ranges::count_if(
      views, [](const View& view) { return view.cam_from_world.has_value(); }));
}

}  // namespace trigmesh
