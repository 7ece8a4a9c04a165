#include "firmware/pipeline/scale_stage.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "firmware/base/check.hpp"
#include "sfm/calibration/aruco.hpp"
#include "sfm/exchange/image_codec.hpp"
#include "sfm/scale/metric_scale.hpp"
#include "sfm/scene/scene_transform.hpp"

namespace trigmesh {
namespace {

constexpr double kDegPerRad = 180.0 / std::numbers::pi;
constexpr double kPercent = 100.0;

using Detections = std::vector<MarkerDetection>;

/// Whether a corner lies where the mask says that nothing counts.
bool is_masked(const MarkerDetection& marker, const cv::Mat& usable) {
  return !usable.empty() &&
         std::any_of(
             marker.corners_px.begin(), marker.corners_px.end(), [&](const Eigen::Vector2d& p) {
               const int x = std::clamp(static_cast<int>(std::lround(p.x())), 0, usable.cols - 1);
               const int y = std::clamp(static_cast<int>(std::lround(p.y())), 0, usable.rows - 1);
               return usable.at<std::uint8_t>(y, x) == 0;
             });
}

Result<Detections> markers_in(const PhotoSet& photos,
                              std::size_t photo,
                              const MarkerDictionary& dictionary) {
  TM_ASSIGN_OR_RETURN(const auto bytes, photos.read(photo));
  TM_ASSIGN_OR_RETURN(const DecodedImage image,
                      decode_image(bytes, {.channels = ImageChannels::kGrey}));
  TM_ASSIGN_OR_RETURN(Detections markers, detect_markers(image.grey, dictionary));
  if (!markers.empty()) {
    TM_ASSIGN_OR_RETURN(const cv::Mat usable,
                        load_mask(photos, photo, image.grey.cols, image.grey.rows));
    std::erase_if(markers, [&](const MarkerDetection& m) { return is_masked(m, usable); });
  }
  return markers;
}

/// What was found in the photographs that have a pose, by name.
using FoundMarkers = std::map<std::string, Detections, std::less<>>;

std::vector<std::size_t> photos_with_pose(const PhotoSet& photos,
                                          const std::vector<Scene>& components) {
  std::map<std::string, std::size_t, std::less<>> position;
  for (std::size_t i = 0; i < photos.names.size(); ++i) {
    position.emplace(photos.names[i], i);
  }
  std::vector<std::size_t> result;
  for (const Scene& scene : components) {
    for (const View& view : scene.views) {
      const auto photo = position.find(view.name);
      if (view.cam_from_world && photo != position.end()) {
        result.push_back(photo->second);
      }
    }
  }
  return result;
}

Result<FoundMarkers> find_markers(const PhotoSet& photos,
                                  const std::vector<Scene>& components,
                                  const MarkerDictionary& dictionary,
                                  const StageContext& context) {
  const std::vector<std::size_t> wanted = photos_with_pose(photos, components);
  std::vector<Result<Detections>> found(wanted.size());
  StageProgress progress(context, Stage::kScale, wanted.size());
  context.executor.for_each_index(wanted.size(), [&](std::size_t i) {
    found[i] = markers_in(photos, wanted[i], dictionary);
    progress.advance();
  });
  FoundMarkers result;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const std::string& name = photos.names[wanted[i]];
    if (!found[i]) {
      return fail(found[i].error().code,
                  "cannot look for markers in {}: {}",
                  name,
                  found[i].error().message);
    }
    result.emplace(name, std::move(*found[i]));
  }
  return result;
}

std::vector<Detections> detections_of(const Scene& scene, const FoundMarkers& found) {
  std::vector<Detections> detections;
  for (const View& view : scene.views) {
    const auto markers = found.find(view.name);
    detections.push_back(markers == found.end() ? Detections() : markers->second);
  }
  return detections;
}

std::string why_unused(int id, const SquareFit& fit) {
  switch (fit.outcome) {
    case SquareOutcome::kTooFewViews:
      return fmt::format("marker {} is seen in too few registered images: {} of {} needed",
                         id,
                         fit.views_seen,
                         SquareFitOptions{}.min_views);
    case SquareOutcome::kSmallAngle:
      return fmt::format("marker {} is seen from one side only, move further around it", id);
    case SquareOutcome::kInconsistent:
      return fmt::format(
          "only {} of {} images agree on where marker {} is", fit.views_used, fit.views_seen, id);
    case SquareOutcome::kOk:
      break;
  }
  return fmt::format("of marker {} no length is known that can be used", id);
}

std::string nothing_measured(const FittedMarkers& named) {
  if (named.empty()) {
    return "no registered image shows a marker of which a length is known";
  }
  std::vector<std::string> reasons;
  for (const auto& [id, fit] : named) {
    reasons.push_back(why_unused(id, fit));
  }
  return fmt::format("no known length can be measured; {}", fmt::join(reasons, "; "));
}

/// "marker 3 (0.12 m) one unit is 0.59 m"
std::string what_they_say(const ScaleEstimate& estimate, const std::vector<std::size_t>& lengths) {
  std::vector<std::string> names;
  double log_sum = 0.0;
  for (const std::size_t i : lengths) {
    const LengthEvidence& length = estimate.lengths[i];
    names.push_back(fmt::format("{} ({:.6g} m)", length.name, length.known_m));
    log_sum += std::log(length.metres_per_unit);
  }
  return fmt::format("by {} one unit is {:.5g} m",
                     fmt::join(names, ", "),
                     std::exp(log_sum / static_cast<double>(lengths.size())));
}

std::string disagreement(const ScaleEstimate& estimate) {
  const auto [least, most] = std::minmax_element(
      estimate.lengths.begin(), estimate.lengths.end(), [](const auto& a, const auto& b) {
        return a.metres_per_unit < b.metres_per_unit;
      });
  return fmt::format(
      "the known lengths disagree by up to {:.1f} %: {}, {}; at least one of these lengths is "
      "wrong",
      kPercent * (most->metres_per_unit / least->metres_per_unit - 1.0),
      what_they_say(estimate, estimate.odd_ones),
      what_they_say(estimate, estimate.others));
}

/// The axes of the card, if they are wanted and known.
std::optional<UpEstimate> find_up(const FittedMarkers& markers,
                                  const ScaleOptions& options,
                                  ScaleSection& section) {
  if (options.up == UpSource::kNone) {
    return std::nullopt;
  }
  UpEstimate up = estimate_up(markers, options.known);
  if (up.outcome != UpOutcome::kOk) {
    section.up_problem =
        fmt::format("markers look to directions {:.1f} degrees apart, so they do not all lie flat",
                    kDegPerRad * up.largest_angle_rad);
    return std::nullopt;
  }
  section.z_is_up = true;
  section.up_sd_deg = kDegPerRad * up.sd_rad;
  return up;
}

/// Whether what one view took for a marker, of which nobody spoke, is of no account.
bool is_chance(int id, const SquareFit& fit, const KnownLengths& known) {
  KnownLengths spoken_of = known;
  spoken_of.marker_side_m.reset();
  return fit.views_seen < 2 && !spoken_of.names(id);
}

/// Brings one model into metres when its known lengths allow it.
ScaleSection scale_model(Scene& scene, const FoundMarkers& found, const ScaleOptions& options) {
  FittedMarkers markers = fit_markers(scene, detections_of(scene, found));
  std::erase_if(markers, [&](const auto& marker) {
    const auto& [id, fit] = marker;
    return !options.known.names(id) || is_chance(id, fit, options.known);
  });
  ScaleSection section;
  for (const auto& [id, fit] : markers) {
    section.markers.push_back({id, fit.outcome, fit.views_seen, fit.views_used, fit.rms_px});
  }
  const ScaleEstimate estimate = estimate_scale(markers, options.known);
  section.outcome = estimate.outcome;
  section.lengths = estimate.lengths;
  if (estimate.outcome == ScaleOutcome::kNothingMeasured) {
    section.problem = nothing_measured(markers);
  } else if (estimate.outcome == ScaleOutcome::kDisagreement) {
    section.problem = disagreement(estimate);
  } else {
    section.metres_per_unit = estimate.metres_per_unit;
    section.sd_ratio = estimate.sd_ratio;
    scene = transform_scene(
        metric_from_world(estimate.metres_per_unit, find_up(markers, options, section)),
        std::move(scene));
  }
  return section;
}

}  // namespace

Result<> ScaleOptions::validate() const {
  TM_RETURN_IF_ERROR(known.validate(dictionary.count));
  if (up == UpSource::kCard && !known.any()) {
    return fail(ErrorCode::kInvalidArgument,
                "up can be taken from a card only when the side of a marker or a distance between "
                "two is known");
  }
  return {};
}

Result<ScaledModels> find_metric_scale(const PhotoSet& photos,
                                       std::vector<Scene> components,
                                       const ScaleOptions& options,
                                       const StageContext& context) {
  ScaledModels models{std::move(components), {}};
  if (!options.known.any()) {
    return models;
  }
  TM_ASSIGN_OR_RETURN(const FoundMarkers found,
                      find_markers(photos, models.components, options.dictionary, context));
  for (Scene& scene : models.components) {
    models.scale.push_back(scale_model(scene, found, options));
  }
  return models;
}

}  // namespace trigmesh
