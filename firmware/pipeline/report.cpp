#include "firmware/pipeline/report.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <numeric>
#include <unordered_map>
#include <utility>

#include "firmware/base/check.hpp"
#include "firmware/pipeline/report_scale.hpp"

namespace trigmesh {
namespace {

constexpr double kErrorBinPx = 0.1;
constexpr std::size_t kErrorBins = 41;
constexpr double kTrackBinStart = 2.0;
constexpr std::size_t kTrackBins = 29;
constexpr double kAngleBinDeg = 2.0;
constexpr std::size_t kAngleBins = 61;
constexpr double kFullFrameDiagonalMm = 43.2666;
constexpr double kDegPerRad = 180.0 / std::numbers::pi;

/// Errors of one component and, beside it, of each of its views.
struct ErrorSums {
  std::vector<double> errors_px;
  std::vector<double> view_squared_sums;
  std::vector<std::size_t> view_observations;
  std::vector<std::size_t> view_projected;
};

void add_to(Histogram& histogram, double value) {
  const double bin = std::floor((value - histogram.start) / histogram.bin_width);
  const double last = static_cast<double>(histogram.counts.size() - 1);
  ++histogram.counts[static_cast<std::size_t>(std::clamp(bin, 0.0, last))];
}

Histogram empty_histogram(double start, double bin_width, std::size_t bins) {
  return {.start = start, .bin_width = bin_width, .counts = std::vector<std::size_t>(bins, 0)};
}

std::optional<double> reprojection_error_px(const Scene& scene,
                                            const Landmark& landmark,
                                            Observation observation) {
  const View& view = scene.views[index(observation.view)];
  if (!view.cam_from_world) {
    return std::nullopt;
  }
  const Eigen::Vector3d point_in_cam = *view.cam_from_world * landmark.position_in_world;
  const std::optional<Eigen::Vector2d> pixel =
      project(scene.cameras[index(view.camera)], point_in_cam);
  if (!pixel) {
    return std::nullopt;
  }
  return (*pixel - view.keypoints_px[index(observation.feature)].cast<double>()).norm();
}

ErrorSums collect_errors(const Scene& scene) {
  ErrorSums sums;
  sums.view_squared_sums.resize(scene.views.size(), 0.0);
  sums.view_observations.resize(scene.views.size(), 0);
  sums.view_projected.resize(scene.views.size(), 0);
  for (const Landmark& landmark : scene.landmarks) {
    for (const Observation& observation : landmark.track) {
      const std::size_t view = index(observation.view);
      ++sums.view_observations[view];
      if (const std::optional<double> error = reprojection_error_px(scene, landmark, observation)) {
        sums.errors_px.push_back(*error);
        sums.view_squared_sums[view] += *error * *error;
        ++sums.view_projected[view];
      }
    }
  }
  return sums;
}

double median(std::vector<double> values) {
  if (values.empty()) {
    return 0.0;
  }
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) {
    return *middle;
  }
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

void fill_error_numbers(ComponentReport& report, const std::vector<double>& errors_px) {
  if (report.points > 0) {
    report.mean_track_length =
        static_cast<double>(report.observations) / static_cast<double>(report.points);
  }
  if (errors_px.empty()) {
    return;
  }
  const double count = static_cast<double>(errors_px.size());
  double sum = 0.0;
  double squared_sum = 0.0;
  for (const double error : errors_px) {
    sum += error;
    squared_sum += error * error;
  }
  report.mean_error_px = sum / count;
  report.rmse_px = std::sqrt(squared_sum / count);
  report.median_error_px = median(errors_px);
}

/// Largest angle between two rays from the point to the cameras that see it.
double triangulation_angle_deg(const Landmark& landmark,
                               const std::vector<Eigen::Vector3d>& centers) {
  double smallest_cosine = 1.0;
  for (std::size_t i = 0; i < landmark.track.size(); ++i) {
    const Eigen::Vector3d ray_i =
        landmark.position_in_world - centers[index(landmark.track[i].view)];
    for (std::size_t j = i + 1; j < landmark.track.size(); ++j) {
      const Eigen::Vector3d ray_j =
          landmark.position_in_world - centers[index(landmark.track[j].view)];
      const double lengths = ray_i.norm() * ray_j.norm();
      if (lengths > 0.0) {
        smallest_cosine = std::min(smallest_cosine, ray_i.dot(ray_j) / lengths);
      }
    }
  }
  return std::acos(std::clamp(smallest_cosine, -1.0, 1.0)) * kDegPerRad;
}

void add_landmarks(ReconstructionReport& report, const Scene& scene) {
  std::vector<Eigen::Vector3d> centers(scene.views.size(), Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    if (scene.views[i].cam_from_world) {
      centers[i] = camera_center(*scene.views[i].cam_from_world);
    }
  }
  for (const Landmark& landmark : scene.landmarks) {
    add_to(report.track_length, static_cast<double>(landmark.track.size()));
    add_to(report.triangulation_angle_deg, triangulation_angle_deg(landmark, centers));
  }
}

double horizontal_fov_deg(const Camera& camera) {
  const double half_width_ratio = 0.5 * camera.width_px / camera.fx_px;
  const double half_angle =
      camera.model == CameraModel::kKannalaBrandt ? half_width_ratio : std::atan(half_width_ratio);
  return 2.0 * half_angle * kDegPerRad;
}

void add_cameras(ReconstructionReport& report, const ReportInput& input, std::size_t component) {
  const Scene& scene = input.components[component];
  std::vector<std::size_t> images(scene.cameras.size(), 0);
  for (const View& view : scene.views) {
    if (view.cam_from_world) {
      ++images[index(view.camera)];
    }
  }
  for (std::size_t group = 0; group < scene.cameras.size(); ++group) {
    if (images[group] == 0) {
      continue;
    }
    const Camera& camera = scene.cameras[group];
    const double diagonal_px = std::hypot(camera.width_px, camera.height_px);
    report.cameras.push_back({
        .component = component,
        .group = group,
        .camera = camera,
        .origin = group < input.intrinsics_origins.size() ? input.intrinsics_origins[group]
                                                          : IntrinsicsOrigin::kSolved,
        .images = images[group],
        .focal_35mm_equivalent =
            0.5 * (camera.fx_px + camera.fy_px) * kFullFrameDiagonalMm / diagonal_px,
        .horizontal_fov_deg = horizontal_fov_deg(camera),
    });
  }
}

using RowByName = std::unordered_map<std::string_view, std::size_t>;

void add_views(ReconstructionReport& report,
               const RowByName& rows,
               const Scene& scene,
               const ErrorSums& sums) {
  const std::size_t component = report.components.size();
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const View& view = scene.views[i];
    const auto row = rows.find(view.name);
    if (row == rows.end()) {
      continue;
    }
    ImageReport& image = report.images[row->second];
    if (!view.cam_from_world || image.component) {
      continue;
    }
    image.component = component;
    image.group = index(view.camera);
    image.observations = sums.view_observations[i];
    image.rmse_px =
        sums.view_projected[i] == 0
            ? 0.0
            : std::sqrt(sums.view_squared_sums[i] / static_cast<double>(sums.view_projected[i]));
  }
}

void add_components(ReconstructionReport& report, const ReportInput& input) {
  RowByName rows;
  for (std::size_t i = 0; i < input.images.size(); ++i) {
    rows.emplace(input.images[i].name, i);
  }
  std::vector<double> all_errors_px;
  for (std::size_t c = 0; c < input.components.size(); ++c) {
    const Scene& scene = input.components[c];
    const ErrorSums sums = collect_errors(scene);
    add_views(report, rows, scene, sums);
    add_landmarks(report, scene);
    add_cameras(report, input, c);
    ComponentReport component;
    component.registered_images = scene.registered_count();
    component.points = scene.landmarks.size();
    component.observations = std::accumulate(
        sums.view_observations.begin(), sums.view_observations.end(), std::size_t{0});
    fill_error_numbers(component, sums.errors_px);
    report.overall.registered_images += component.registered_images;
    report.overall.points += component.points;
    report.overall.observations += component.observations;
    all_errors_px.insert(all_errors_px.end(), sums.errors_px.begin(), sums.errors_px.end());
    report.components.push_back(component);
  }
  for (const double error : all_errors_px) {
    add_to(report.reprojection_error_px, error);
  }
  fill_error_numbers(report.overall, all_errors_px);
}

std::vector<ImageReport> rows_of(std::span<const ImageOutcome> outcomes) {
  std::vector<ImageReport> rows;
  rows.reserve(outcomes.size());
  for (const ImageOutcome& outcome : outcomes) {
    ImageReport row;
    row.name = outcome.name;
    row.reason = outcome.reason;
    row.detail = outcome.detail;
    row.advice = advice(outcome.reason);
    row.features = outcome.features;
    row.overlapping_images = outcome.overlapping_images;
    row.map_matches = outcome.map_matches;
    row.map_inliers = outcome.map_inliers;
    row.observations = outcome.observations;
    row.rmse_px = outcome.rmse_px;
    rows.push_back(std::move(row));
  }
  return rows;
}

std::string_view are(std::size_t count) {
  return count == 1 ? "is" : "are";
}

std::string_view plural(std::size_t count) {
  return count == 1 ? "" : "s";
}

/// ", 3 are in 1 separate model, 2 are refused"
std::string rest_sentence(const ReconstructionReport& report) {
  std::string text;
  if (report.images_in_other_components > 0) {
    const std::size_t others = report.components.size() - 1;
    text += fmt::format(", {} {} in {} separate model{}",
                        report.images_in_other_components,
                        are(report.images_in_other_components),
                        others,
                        plural(others));
  }
  if (report.images_refused > 0) {
    text += fmt::format(", {} {} refused", report.images_refused, are(report.images_refused));
  }
  return text;
}

void decide_verdict(ReconstructionReport& report) {
  const std::size_t total = report.images_total;
  const std::size_t registered = report.images_registered;
  if (total == 0) {
    report.verdict_sentence = "Not ready: there were no images.";
  } else if (registered == 0) {
    report.verdict_sentence =
        total == 1
            ? "Not ready: one image is not enough, depth needs at least two from different places."
            : fmt::format("Not ready: none of the {} images could be registered.", total);
  } else if (registered == total) {
    report.verdict = Verdict::kComplete;
    report.verdict_sentence = fmt::format("All {} images are registered in one model.", total);
  } else if (2 * registered >= total) {
    report.verdict = Verdict::kPartial;
    report.verdict_sentence =
        fmt::format("{} of {} images are registered{}.", registered, total, rest_sentence(report));
  } else {
    report.verdict_sentence = fmt::format("Not ready: only {} of {} images {} registered{}.",
                                          registered,
                                          total,
                                          are(registered),
                                          rest_sentence(report));
  }
}

void count_images(ReconstructionReport& report) {
  report.images_total = report.images.size();
  for (const ImageReport& image : report.images) {
    if (!image.component) {
      ++report.images_refused;
    } else if (*image.component == 0) {
      ++report.images_registered;
    } else {
      ++report.images_in_other_components;
    }
  }
}

}  // namespace

std::string_view to_string(IntrinsicsOrigin origin) {
  switch (origin) {
    case IntrinsicsOrigin::kGiven:
      return "given";
    case IntrinsicsOrigin::kPriorRefined:
      return "prior_refined";
    case IntrinsicsOrigin::kSolved:
      return "solved";
  }
  return "solved";
}

std::string_view to_string(NoteSeverity severity) {
  switch (severity) {
    case NoteSeverity::kInfo:
      return "info";
    case NoteSeverity::kWarning:
      return "warning";
    case NoteSeverity::kError:
      return "error";
  }
  return "error";
}

std::string_view to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::kComplete:
      return "complete";
    case Verdict::kPartial:
      return "partial";
    case Verdict::kNotReady:
      return "not_ready";
  }
  return "not_ready";
}

ReconstructionReport build_report(const ReportInput& input) {
  ReconstructionReport report;
  report.software_version = input.software_version;
  report.input_description = input.input_description;
  report.scale.assign(input.scale.begin(), input.scale.end());
  report.metres_per_unit = is_metric(input.scale) ? std::optional(1.0) : std::nullopt;
  report.units_sentence = units_sentence(input.scale);
  report.dense = input.dense;
  report.moving = input.moving;
  report.surface = input.surface;
  report.texture = input.texture;
  report.finish = input.finish;
  report.reprojection_error_px = empty_histogram(0.0, kErrorBinPx, kErrorBins);
  report.track_length = empty_histogram(kTrackBinStart, 1.0, kTrackBins);
  report.triangulation_angle_deg = empty_histogram(0.0, kAngleBinDeg, kAngleBins);
  report.images = rows_of(input.images);
  add_components(report, input);
  count_images(report);
  decide_verdict(report);

  for (const PairEvidence& pair : input.pairs) {
    TM_CHECK(index(pair.pair.first) < input.images.size() &&
             index(pair.pair.second) < input.images.size());
  }
  report.pairs.assign(input.pairs.begin(), input.pairs.end());
  std::ranges::stable_sort(report.pairs, {}, &PairEvidence::pair);
  report.frames.assign(input.frames.begin(), input.frames.end());
  report.settings = input.settings;
  report.notes = input.notes;
  std::ranges::move(scale_notes(input.scale), std::back_inserter(report.notes));
  std::ranges::stable_sort(report.notes, [](const ReportNote& a, const ReportNote& b) {
    return a.severity > b.severity;
  });
  return report;
}

}  // namespace trigmesh
