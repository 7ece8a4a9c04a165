#include "sfm/mapping/refusal.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sfm/mapping/structure.hpp"

namespace trigmesh {

namespace {

// Below this an image has hardly anything to match.
constexpr std::size_t kFewFeatures = 100;

struct OverlapCounts {
  std::size_t verified = 0;    ///< pairs with some geometry
  std::size_t rotation = 0;    ///< of these, without parallax
  std::size_t duplicate = 0;   ///< of these, the same picture
  std::size_t strongest = 0;   ///< most inliers of a verified pair
  std::size_t candidates = 0;  ///< most putative matches of any pair
};

OverlapCounts count_overlap(const ImageStore& store, const ImageRecord& image) {
  OverlapCounts counts;
  for (const std::size_t position : image.pairs) {
    const TwoViewGeometry& geometry = store.pairs[position].geometry;
    counts.candidates = std::max(counts.candidates, geometry.candidates);
    if (!shows_one_scene(geometry.kind)) {
      continue;
    }
    ++counts.verified;
    counts.rotation += geometry.kind == TwoViewKind::kPureRotation ? 1 : 0;
    counts.duplicate += geometry.kind == TwoViewKind::kDuplicate ? 1 : 0;
    counts.strongest = std::max(counts.strongest, geometry.inliers.size());
  }
  return counts;
}

}  // namespace

ImageOutcome explain_refusal(const ImageStore& store, ViewId view, const MapperOptions& options) {
  const ImageRecord& image = store.images[index(view)];
  const OverlapCounts overlap = count_overlap(store, image);
  ImageOutcome outcome;
  outcome.name = image.name;
  outcome.features = image.keypoints_px.size();
  outcome.overlapping_images = overlap.verified;
  outcome.map_matches = image.attempt.map_matches;
  outcome.map_inliers = image.attempt.inliers;
  if (outcome.features < kFewFeatures &&
      overlap.strongest < static_cast<std::size_t>(options.min_seed_landmarks)) {
    outcome.reason = RefusalReason::kTooFewFeatures;
    outcome.detail = fmt::format(
        "only {} features were found, at least {} are wanted", outcome.features, kFewFeatures);
  } else if (overlap.verified == 0) {
    outcome.reason = RefusalReason::kNoOverlap;
    outcome.detail = fmt::format(
        "none of the images it was compared with shows the same things (at most {} features look "
        "alike)",
        overlap.candidates);
  } else if (image.attempt.reason == RefusalReason::kNoParallax) {
    outcome.reason = RefusalReason::kNoParallax;
    outcome.detail =
        image.attempt.model_parallax_deg
            ? fmt::format(
                  "half of the points of its model are seen under {:.1f} degrees or less, "
                  "{:.1f} are needed: the camera turned but hardly moved",
                  *image.attempt.model_parallax_deg,
                  options.min_model_parallax_deg)
            : fmt::format(
                  "only {} of its points are seen under {:.1f} degrees or more, {} are needed",
                  image.attempt.inliers,
                  options.min_view_parallax_deg,
                  options.min_supported_landmarks);
  } else if (overlap.duplicate == overlap.verified) {
    outcome.reason = RefusalReason::kDuplicate;
    outcome.detail = "every image that it overlaps with is the same picture";
  } else if (overlap.rotation + overlap.duplicate == overlap.verified) {
    outcome.reason = RefusalReason::kPureRotation;
    outcome.detail = fmt::format("in all {} overlapping images the camera only turned on the spot",
                                 overlap.verified);
  } else if (image.attempt.reason == RefusalReason::kPoseRejected) {
    outcome.reason = RefusalReason::kPoseRejected;
    outcome.detail =
        fmt::format("{} of {} matches with the model agree with one pose, {} are needed",
                    outcome.map_inliers,
                    outcome.map_matches,
                    options.min_pose_inliers);
  } else if (image.attempt.reason == RefusalReason::kPoseUnstable) {
    outcome.reason = RefusalReason::kPoseUnstable;
    outcome.detail = "its pose lost its support when the model was adjusted";
  } else if (image.attempt.reason == RefusalReason::kTooFewMapMatches) {
    outcome.reason = RefusalReason::kTooFewMapMatches;
    outcome.detail = fmt::format("{} of its features are points of the model, {} are needed",
                                 outcome.map_matches,
                                 options.min_pose_inliers);
  } else {
    outcome.reason = RefusalReason::kNoParallax;
    outcome.detail = fmt::format(
        "overlaps with {} images, but no pair has {} points seen under {:.1f} degrees or more",
        overlap.verified,
        options.min_seed_landmarks,
        options.min_triangulation_angle_deg);
  }
  return outcome;
}

void describe_registration(ImageOutcome& outcome, const Map& map, ViewId view, int component) {
  double sum = 0.0;
  std::size_t count = 0;
  const std::vector<LandmarkId>& landmarks = map.scene().views[index(view)].landmarks;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    if (landmarks[i] != kNoLandmark) {
      const double error = reprojection_error_px(map, landmarks[i], {view, id_of<FeatureIndex>(i)});
      sum += error * error;
      ++count;
    }
  }
  outcome.component = component;
  outcome.observations = count;
  outcome.rmse_px = count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0.0;
  outcome.reason = component == 0 ? RefusalReason::kNone : RefusalReason::kOtherComponent;
  outcome.detail =
      component == 0
          ? fmt::format("sees {} points of the model", count)
          : fmt::format("registered in model {} with {} points; nothing links it to the main model",
                        component + 1,
                        count);
}

}  // namespace trigmesh
