#include "sfm/mapping/map_builder.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "firmware/base/check.hpp"
#include "sfm/mapping/focal_vote.hpp"
#include "sfm/mapping/map_joining.hpp"
#include "sfm/mapping/seed_pair.hpp"
#include "sfm/mapping/view_registration.hpp"

namespace trigmesh {

namespace {

// The next view is chosen by how well its matches are spread, among this many with most matches.
constexpr std::size_t kRankedBySpread = 8;
// A view that failed is tried again when its map matches have grown by this factor.
constexpr double kRetryGrowth = 1.2;
// While intrinsics are not known yet, poses may be this much worse.
constexpr double kUnknownLensSlack = 2.0;
constexpr int kToConvergence = 40;  // iterations of an adjustment of all
constexpr int kFinalRounds = 3;
// Rounds but the last go so far: what does not fit yet holds them up, and is dropped after them.
constexpr int kRoundIterations = 4;
// Final rounds end when less than this part of all observations changes.
constexpr double kSettledRatio = 0.002;
// Up to this many views every registration is followed by an adjustment of all.
constexpr std::size_t kSmallMap = 4;

std::size_t observation_count(const Map& map) {
  std::size_t count = 0;
  for (const LandmarkId id : map.landmarks()) {
    count += map.landmark(id).track.size();
  }
  return count;
}

}  // namespace

MapBuilder::MapBuilder(ImageStore& store, const MapperOptions& options, Executor& executor)
    : store_(&store),
      options_(&options),
      executor_(&executor),
      structure_(store.tracks, options, executor),
      map_(store.tracks) {
  follow_store({});
}

void MapBuilder::follow_store(std::span<const TrackId> absorbed) {
  for (std::size_t i = map_.scene().cameras.size(); i < store_->cameras.size(); ++i) {
    map_.add_camera(store_->cameras[i].camera);
  }
  for (std::size_t i = map_.scene().views.size(); i < store_->images.size(); ++i) {
    const ImageRecord& image = store_->images[i];
    map_.add_view({image.name, image.camera, std::nullopt, image.keypoints_px, {}});
    matches_at_failure_.push_back(0);
  }
  map_.tracks_changed(absorbed);
}

ModelAdjustment MapBuilder::adjustment() const {
  ModelAdjustment adjustment(*options_, store_->sigmas_px, *executor_);
  for (const CameraRecord& camera : store_->cameras) {
    adjustment.add_camera(camera.camera, camera.knowledge);
  }
  return adjustment;
}

bool MapBuilder::seed() {
  const auto found = choose_seed_pair(*store_, map_.scene().cameras, *options_, *executor_);
  if (!found) {
    return false;
  }
  map_.register_view(found->pair.first, Rigid3{});
  map_.register_view(found->pair.second, found->second_from_first);
  (void)structure_.triangulate_all(map_);  // judged by the count below
  adjustment().adjust_all(map_, kToConvergence);
  structure_.filter(map_, kUnknownLensSlack * options_->max_reprojection_px);
  if (map_.landmark_count() < static_cast<std::size_t>(options_->min_seed_landmarks)) {
    return false;
  }
  for (const ViewId view : map_.registered()) {
    store_->images[index(view)].registered = true;
  }
  views_at_last_global_ = map_.registered().size();
  return true;
}

bool MapBuilder::worth_trying(ViewId view) const {
  const std::size_t matches = map_.visible_count(view);
  const auto needed =
      std::max(static_cast<double>(options_->min_pose_inliers),
               kRetryGrowth * static_cast<double>(matches_at_failure_[index(view)]));
  return !store_->images[index(view)].registered && static_cast<double>(matches) >= needed;
}

std::vector<ViewId> MapBuilder::ranked_views() const {
  std::vector<ViewId> views;
  for (std::size_t i = 0; i < store_->images.size(); ++i) {
    if (worth_trying(id_of<ViewId>(i))) {
      views.push_back(id_of<ViewId>(i));
    }
  }
  std::stable_sort(views.begin(), views.end(), [&](ViewId a, ViewId b) {
    return map_.visible_count(a) > map_.visible_count(b);
  });
  const std::size_t head = std::min(views.size(), kRankedBySpread);
  std::vector<std::pair<double, ViewId>> spread;
  for (std::size_t i = 0; i < head; ++i) {
    spread.emplace_back(visibility_score(map_, views[i]), views[i]);
  }
  std::stable_sort(
      spread.begin(), spread.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  for (std::size_t i = 0; i < head; ++i) {
    views[i] = spread[i].second;
  }
  return views;
}

std::optional<StepReport> MapBuilder::register_next() {
  for (const ViewId view : ranked_views()) {
    if (try_register(view)) {
      settle(view);
      return StepReport{StepKind::kRegistered,
                        view,
                        store_->images[index(view)].attempt.inliers,
                        map_.landmark_count()};
    }
  }
  return std::nullopt;
}

bool MapBuilder::try_register(ViewId view) {
  ImageRecord& image = store_->images[index(view)];
  const bool known = store_->cameras[index(image.camera)].knowledge == IntrinsicsKnowledge::kGiven;
  const double max_error_px = options_->max_pose_error_px * (known ? 1.0 : kUnknownLensSlack);
  ViewPose pose = estimate_view_pose(map_, view, max_error_px, FocalMode::kAsIs, *options_);
  const bool camera_has_view =
      std::any_of(map_.registered().begin(), map_.registered().end(), [&](ViewId other) {
        return store_->images[index(other)].camera == image.camera;
      });
  if (!pose.found && !known && !camera_has_view) {
    pose = estimate_view_pose(map_, view, max_error_px, FocalMode::kEstimated, *options_);
  }
  image.attempt = {pose.map_matches, pose.inliers.size(), RefusalReason::kNone};
  if (!pose.found) {
    image.attempt.reason = RefusalReason::kPoseRejected;
    matches_at_failure_[index(view)] = pose.map_matches;
    return false;
  }
  if (pose.focal_px) {
    Camera& camera = map_.scene_for_adjustment().cameras[index(image.camera)];
    camera.fx_px = camera.fy_px = *pose.focal_px;
  }
  map_.register_view(view, pose.cam_from_world);
  for (const Map::Candidate& inlier : pose.inliers) {
    map_.add_observation(inlier.landmark, {view, inlier.feature});
  }
  image.registered = true;
  return true;
}

void MapBuilder::settle(ViewId view) {
  const std::span<const TrackId> seen = store_->tracks.tracks_of(view);
  std::vector<TrackId> tracks;
  std::copy_if(seen.begin(), seen.end(), std::back_inserter(tracks), [](TrackId track) {
    return track != kNoTrack;
  });
  (void)structure_.triangulate(map_,
                               tracks);  // how many new landmarks there are does not matter here
  const std::size_t views = map_.registered().size();
  const bool grown = static_cast<double>(views) >=
                     options_->global_growth_ratio * static_cast<double>(views_at_last_global_);
  if (views > kSmallMap && !grown) {
    adjustment().adjust_around(map_, view);
    return;
  }
  views_at_last_global_ = views;
  adjustment().adjust_skeleton(map_);
  structure_.reposition(map_);
  structure_.filter(map_, options_->max_reprojection_px);
  (void)structure_.triangulate_all(map_);
}

bool MapBuilder::refine() {
  const std::size_t views = map_.registered().size();
  if (views == views_at_last_refine_) {
    return false;
  }
  views_at_last_refine_ = views;
  views_at_last_global_ = views;
  adjustment().adjust_skeleton(map_);
  structure_.reposition(map_);
  structure_.filter(map_, options_->max_reprojection_px);
  (void)structure_.complete(map_);
  (void)structure_.triangulate_all(map_);
  std::fill(matches_at_failure_.begin(), matches_at_failure_.end(), 0);
  return true;
}

void MapBuilder::extend() {
  (void)structure_.complete(map_);
  (void)structure_.triangulate_all(map_);  // how many does not matter here
}

void MapBuilder::finish() {
  MapperOptions strict_options = *options_;
  strict_options.max_reprojection_px = options_->final_reprojection_px;
  const Structure strict(store_->tracks, strict_options, *executor_);
  for (int round = 0; round < kFinalRounds; ++round) {
    const std::size_t completed = strict.complete(map_);
    const std::size_t added = strict.triangulate_all(map_);
    const bool is_last = round + 1 == kFinalRounds;
    const BundleReport adjusted =
        adjustment().adjust_all(map_, is_last ? kToConvergence : kRoundIterations);
    const Structure::FilterReport filtered = strict.filter(map_, options_->final_reprojection_px);
    const std::size_t changed = filtered.removed_observations + completed + 2 * added;
    if (adjusted.outcome == BundleOutcome::kConverged &&
        static_cast<double>(changed) <
            kSettledRatio * static_cast<double>(observation_count(map_))) {
      break;
    }
  }
  drop_unsupported_views();
  drop_model_without_parallax();
  for (const LandmarkId id : map_.landmarks()) {
    double sum = 0.0;
    for (const Observation& observation : map_.landmark(id).track) {
      sum += reprojection_error_px(map_, id, observation);
    }
    map_.set_error(id, sum / static_cast<double>(map_.landmark(id).track.size()));
  }
}

void MapBuilder::join(const Map& other, const Sim3& map_from_other) {
  absorb(map_, other, map_from_other);
  adjustment().adjust_skeleton(map_);
  structure_.reposition(map_);
  structure_.filter(map_, options_->max_reprojection_px);
}

void MapBuilder::drop_unsupported_views() {
  const double min_angle_rad = options_->min_view_parallax_deg * std::numbers::pi / 180.0;
  std::vector<std::size_t> supported(store_->images.size(), 0);
  for (const LandmarkId id : map_.landmarks()) {
    if (largest_triangulation_angle(map_, id) < min_angle_rad) {
      continue;
    }
    for (const Observation& observation : map_.landmark(id).track) {
      ++supported[index(observation.view)];
    }
  }
  const std::vector<ViewId> registered(map_.registered().begin(), map_.registered().end());
  for (const ViewId view : registered) {
    if (supported[index(view)] >= static_cast<std::size_t>(options_->min_supported_landmarks)) {
      continue;
    }
    drop_view(view, supported[index(view)]);
  }
}

void MapBuilder::drop_model_without_parallax() {
  std::vector<double> angles_deg;
  for (const LandmarkId id : map_.landmarks()) {
    angles_deg.push_back(largest_triangulation_angle(map_, id) * 180.0 / std::numbers::pi);
  }
  if (angles_deg.empty()) {
    return;
  }
  const auto middle = angles_deg.begin() + static_cast<std::ptrdiff_t>(angles_deg.size() / 2);
  std::nth_element(angles_deg.begin(), middle, angles_deg.end());
  if (*middle >= options_->min_model_parallax_deg) {
    return;
  }
  const std::vector<ViewId> registered(map_.registered().begin(), map_.registered().end());
  for (const ViewId view : registered) {
    drop_view(view, 0);
    store_->images[index(view)].attempt.model_parallax_deg = *middle;
  }
}

void MapBuilder::drop_view(ViewId view, std::size_t supported_landmarks) {
  map_.unregister_view(view);
  ImageRecord& image = store_->images[index(view)];
  image.registered = false;
  image.attempt.reason = RefusalReason::kNoParallax;
  image.attempt.inliers = supported_landmarks;
}

}  // namespace trigmesh
