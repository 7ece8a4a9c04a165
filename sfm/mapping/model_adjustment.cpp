#include "sfm/mapping/model_adjustment.hpp"

#include <algorithm>
#include <map>

namespace trigmesh {

namespace {

// Local adjustment: the new view and this many neighbours move.
constexpr std::size_t kLocalNeighbours = 5;
// A held view must share this many landmarks to count.
constexpr std::size_t kMinSharedWithHeld = 10;
constexpr int kLocalIterations = 8;
constexpr int kSkeletonIterations = 12;
// Relative decrease of the cost at which adjustment ends. Measured on Herz-Jesus-P25: from 1e-3 on,
// smaller values move no camera by more than 0.02 mm and cost four times the iterations.
constexpr double kQuickTolerance = 1e-3;
// Self-calibration: the focal length from two views on (its first value is a vote or a guess),
// distortion once enough views bind it.
constexpr std::size_t kViewsForFocal = 3;
constexpr std::size_t kViewsForDistortion = 4;
// EXIF focal lengths are rounded to a few per cent.
constexpr double kExifFocalSigmaRatio = 0.1;
// Weak, so that a scene that does not bind the lens leaves it near zero.
constexpr double kDistortionSigma = 0.1;

/// Registered views that share landmarks with `view`, those that share most first, ties by id.
std::vector<ViewId> covisible_views(const Map& map, ViewId view, std::size_t count) {
  std::map<ViewId, std::size_t> shared;
  for (const LandmarkId landmark : map.scene().views[index(view)].landmarks) {
    if (landmark == kNoLandmark) {
      continue;
    }
    for (const Observation& observation : map.landmark(landmark).track) {
      ++shared[observation.view];
    }
  }
  shared.erase(view);
  std::vector<std::pair<ViewId, std::size_t>> ranked(shared.begin(), shared.end());
  std::stable_sort(ranked.begin(), ranked.end(), [](const auto& a, const auto& b) {
    return a.second > b.second;
  });
  std::vector<ViewId> views;
  for (std::size_t i = 0; i < std::min(count, ranked.size()); ++i) {
    views.push_back(ranked[i].first);
  }
  return views;
}

}  // namespace

void ModelAdjustment::add_camera(const Camera& prior, IntrinsicsKnowledge knowledge) {
  cameras_.push_back({prior, knowledge});
}

BundleOptions ModelAdjustment::bundle_options(const Map& map) const {
  BundleOptions options;
  options.loss = RobustLoss::kCauchy;
  options.loss_scale_px = options_->loss_scale_px;
  options.intrinsics.resize(cameras_.size());
  std::vector<std::size_t> views_of_camera(cameras_.size(), 0);
  for (const ViewId view : map.registered()) {
    ++views_of_camera[index(map.scene().views[index(view)].camera)];
  }
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    if (cameras_[i].knowledge == IntrinsicsKnowledge::kGiven) {
      continue;
    }
    IntrinsicsFreedom& freedom = options.intrinsics[i];
    const std::size_t views = std::max(views_of_camera[i], map.registered().size() / 2);
    freedom.prior = cameras_[i].prior;
    freedom.focal = views_of_camera[i] > 0 && map.registered().size() >= kViewsForFocal;
    freedom.distortion =
        views >= kViewsForDistortion ? distortion_count(cameras_[i].prior.model) : 0;
    freedom.distortion_sigma = kDistortionSigma;
    if (cameras_[i].knowledge == IntrinsicsKnowledge::kPrior) {
      freedom.focal_sigma_ratio = kExifFocalSigmaRatio;
    }
  }
  return options;
}

std::vector<LandmarkId> ModelAdjustment::spread_landmarks(const Map& map,
                                                          std::span<const LandmarkId> from) const {
  std::vector<LandmarkId> ranked(from.begin(), from.end());
  std::stable_sort(ranked.begin(), ranked.end(), [&](LandmarkId a, LandmarkId b) {
    return map.landmark(a).track.size() > map.landmark(b).track.size();
  });
  const auto quota = static_cast<std::size_t>(options_->landmarks_per_view);
  std::vector<std::size_t> taken(map.scene().views.size(), 0);
  std::vector<LandmarkId> chosen;
  for (const LandmarkId id : ranked) {
    const std::vector<Observation>& track = map.landmark(id).track;
    const bool needed = std::any_of(track.begin(), track.end(), [&](const Observation& o) {
      return taken[index(o.view)] < quota;
    });
    if (!needed) {
      continue;
    }
    for (const Observation& observation : track) {
      ++taken[index(observation.view)];
    }
    chosen.push_back(id);
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

BundleReport ModelAdjustment::adjust_around(Map& map, ViewId view) const {
  std::vector<ViewId> variable = covisible_views(map, view, kLocalNeighbours);
  variable.push_back(view);
  if (map.registered().size() <= variable.size() + 1) {
    return adjust_skeleton(map);
  }
  BundleSelection selection = select_around(map.scene(), variable, kMinSharedWithHeld);
  selection.landmarks = spread_landmarks(map, selection.landmarks);
  BundleOptions options = bundle_options(map);
  options.intrinsics.clear();
  options.max_iterations = kLocalIterations;
  options.function_tolerance = kQuickTolerance;
  return adjust_bundle(map.scene_for_adjustment(), selection, options, *sigmas_px_, *executor_);
}

BundleReport ModelAdjustment::adjust_skeleton(Map& map) const {
  BundleSelection selection = select_everything(map.scene());
  selection.landmarks = spread_landmarks(map, selection.landmarks);
  BundleOptions options = bundle_options(map);
  options.max_iterations = kSkeletonIterations;
  options.function_tolerance = kQuickTolerance;
  return adjust_bundle(map.scene_for_adjustment(), selection, options, *sigmas_px_, *executor_);
}

BundleReport ModelAdjustment::adjust_all(Map& map, int max_iterations) const {
  BundleOptions options = bundle_options(map);
  options.max_iterations = max_iterations;
  options.function_tolerance = kQuickTolerance;
  return adjust_bundle(
      map.scene_for_adjustment(), select_everything(map.scene()), options, *sigmas_px_, *executor_);
}

}  // namespace trigmesh
