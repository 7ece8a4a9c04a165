#include "firmware/pipeline/report_json.hpp"

#include <cmath>

#include <nlohmann/json.hpp>

namespace trigmesh {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kIndent = 2;
constexpr int kPixelDigits = 4;
constexpr int kAngleDigits = 3;
constexpr int kRatioDigits = 3;
constexpr int kDistortionDigits = 8;

/// Rounded to `digits` behind the point; null when not finite.
Json rounded(double value, int digits) {
  if (!std::isfinite(value)) {
    return nullptr;
  }
  const double scale = std::pow(10.0, digits);
  const double result = std::round(value * scale) / scale;
  return result == 0.0 ? 0.0 : result;  // no negative zero
}

Json to_json(const ComponentReport& component) {
  return {
      {"registered_images", component.registered_images},
      {"points", component.points},
      {"observations", component.observations},
      {"mean_track_length", rounded(component.mean_track_length, kRatioDigits)},
      {"reprojection_rmse_px", rounded(component.rmse_px, kPixelDigits)},
      {"reprojection_median_px", rounded(component.median_error_px, kPixelDigits)},
      {"reprojection_mean_px", rounded(component.mean_error_px, kPixelDigits)},
  };
}

Json to_json(const Histogram& histogram) {
  return {
      {"start", histogram.start}, {"bin_width", histogram.bin_width}, {"counts", histogram.counts}};
}

Json distortion_to_json(const Camera& camera) {
  static constexpr std::array<const char*, 4> kBrownNames{"k1", "k2", "p1", "p2"};
  static constexpr std::array<const char*, 4> kFisheyeNames{"k1", "k2", "k3", "k4"};
  const auto& names = camera.model == CameraModel::kKannalaBrandt ? kFisheyeNames : kBrownNames;
  Json distortion = Json::object();
  for (std::size_t i = 0; i < static_cast<std::size_t>(distortion_count(camera.model)); ++i) {
    distortion[names[i]] = rounded(camera.distortion[i], kDistortionDigits);
  }
  return distortion;
}

Json to_json(const CameraReport& report) {
  const Camera& camera = report.camera;
  return {
      {"component", report.component},
      {"group", report.group},
      {"images", report.images},
      {"origin", to_string(report.origin)},
      {"model", to_string(camera.model)},
      {"width_px", camera.width_px},
      {"height_px", camera.height_px},
      {"fx_px", rounded(camera.fx_px, kPixelDigits)},
      {"fy_px", rounded(camera.fy_px, kPixelDigits)},
      {"cx_px", rounded(camera.cx_px, kPixelDigits)},
      {"cy_px", rounded(camera.cy_px, kPixelDigits)},
      {"distortion", distortion_to_json(camera)},
      {"focal_35mm_equivalent_mm", rounded(report.focal_35mm_equivalent, 2)},
      {"horizontal_fov_deg", rounded(report.horizontal_fov_deg, kAngleDigits)},
  };
}

Json to_json(const std::optional<std::size_t>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json to_json(const ImageReport& image) {
  return {
      {"name", image.name},
      {"status", to_string(image.reason)},
      {"detail", image.detail},
      {"advice", image.advice},
      {"component", to_json(image.component)},
      {"camera_group", to_json(image.group)},
      {"features", image.features},
      {"overlapping_images", image.overlapping_images},
      {"map_matches", image.map_matches},
      {"map_inliers", image.map_inliers},
      {"observations", image.observations},
      {"reprojection_rmse_px", rounded(image.rmse_px, kPixelDigits)},
  };
}

Json to_json(const LiveMapping& live) {
  return {
      {"following", live.following},
      {"seconds", rounded(live.duration_s, kRatioDigits)},
      {"waiting", live.waiting},
  };
}

Json to_json(const VideoFrameSection& frame) {
  const FrameMeasures& measures = frame.measures;
  Json json = {
      {"name", frame.name},
      {"time_s", rounded(frame.time_s, kRatioDigits)},
      {"verdict", to_string(frame.verdict)},
      {"sharpness", rounded(measures.sharpness, 2)},
      {"relative_sharpness", rounded(measures.relative_sharpness, kRatioDigits)},
      {"brightness", rounded(measures.brightness, 1)},
      {"motion_deg", rounded(measures.motion_deg, kAngleDigits)},
      {"parallax_deg", rounded(measures.parallax_deg, kAngleDigits)},
      {"overlap", rounded(measures.overlap, kRatioDigits)},
  };
  if (frame.live) {
    json["live"] = to_json(*frame.live);
  }
  return json;
}

Json to_json(const PairEvidence& pair) {
  return {
      {"first", index(pair.pair.first)},
      {"second", index(pair.pair.second)},
      {"kind", to_string(pair.kind)},
      {"candidates", pair.candidates},
      {"inliers", pair.inliers},
  };
}

Json to_json(const ReportSetting& setting) {
  return {{"name", setting.name}, {"value", setting.value}};
}

Json to_json(const ReportNote& note) {
  return {{"severity", to_string(note.severity)}, {"text", note.text}};
}

Json to_json(const std::optional<double>& value, int digits) {
  return value ? rounded(*value, digits) : Json(nullptr);
}

/// Lengths in scene units may be of any size, so they get significant digits.
Json significant(double value) {
  constexpr int kDigits = 6;
  if (!std::isfinite(value) || value == 0.0) {
    return std::isfinite(value) ? Json(0.0) : Json(nullptr);
  }
  const int magnitude = static_cast<int>(std::floor(std::log10(std::abs(value))));
  const double scale = std::pow(10.0, kDigits - 1 - magnitude);
  return std::isfinite(scale) && scale > 0.0 ? Json(std::round(value * scale) / scale)
                                             : Json(value);
}

Json to_json(const DenseSection& dense) {
  return {
      {"views", dense.views},
      {"map_width_px", dense.map_width_px},
      {"map_height_px", dense.map_height_px},
      {"filled_ratio", rounded(dense.filled_ratio, kRatioDigits)},
      {"points", dense.points},
      {"mean_view_count", rounded(dense.mean_view_count, kRatioDigits)},
      {"lowered", dense.lowered},
  };
}

Json to_json(const Eigen::Vector3d& point) {
  return {significant(point.x()), significant(point.y()), significant(point.z())};
}

Json to_json(const OpenHole& hole) {
  return {
      {"center", to_json(hole.center_in_world)},
      {"perimeter", significant(hole.perimeter)},
  };
}

Json to_json(const FinishGap& gap) {
  return {
      {"kind", to_string(gap.kind)},
      {"center", to_json(gap.center_in_world)},
      {"area_ratio", rounded(gap.area_ratio, kPixelDigits)},
      {"photograph", gap.photograph},
      {"turn_left_deg", rounded(gap.turn_left_deg, 1)},
      {"rise_deg", rounded(gap.rise_deg, 1)},
      {"advice", gap.advice},
  };
}

Json to_json(const MovingImage& image) {
  return {{"name", image.name}, {"masked_ratio", rounded(image.masked_ratio, kRatioDigits)}};
}

Json to_json(const LengthEvidence& length) {
  return {
      {"name", length.name},
      {"known_m", length.known_m},
      {"metres_per_unit", significant(length.metres_per_unit)},
      {"sd_ratio", significant(length.sd_ratio)},
      {"edge_sd_ratio", significant(length.edge_sd_ratio)},
  };
}

Json to_json(const MarkerSection& marker) {
  return {
      {"id", marker.id},
      {"outcome", to_string(marker.outcome)},
      {"views_seen", marker.views_seen},
      {"views_used", marker.views_used},
      {"rms_px", rounded(marker.rms_px, kPixelDigits)},
  };
}

Json to_json(const ScaleSection& scale);

template <typename T>
Json list(const std::vector<T>& values) {
  Json array = Json::array();
  for (const T& value : values) {
    array.push_back(to_json(value));
  }
  return array;
}

Json to_json(const MovingSection& moving) {
  return {
      {"images", list(moving.images)},
      {"masked_ratio", rounded(moving.masked_ratio, kRatioDigits)},
  };
}

Json to_json(const SurfaceSection& surface) {
  return {
      {"vertices", surface.vertices},
      {"faces", surface.faces},
      {"components", surface.components},
      {"area", significant(surface.area)},
      {"seen_ratio", to_json(surface.seen_ratio, kRatioDigits)},
      {"holes_filled", surface.holes_filled},
      {"holes_open", surface.holes_open},
      {"largest_holes", list(surface.largest_holes)},
      {"lowered", surface.lowered},
  };
}

Json to_json(const TextureSection& texture) {
  return {
      {"views_used", texture.views_used},
      {"charts", texture.charts},
      {"pages", texture.pages},
      {"page_size_px", texture.page_size_px},
      {"textured_ratio", rounded(texture.textured_ratio, kRatioDigits)},
      {"held_out_views", texture.held_out_views},
      {"psnr_db", to_json(texture.psnr_db, 2)},
      {"ssim", to_json(texture.ssim, kRatioDigits)},
      {"lowered", texture.lowered},
  };
}

Json to_json(const FinishSection& finish) {
  return {
      {"ready", finish.ready},
      {"sentence", finish.sentence},
      {"gap_ratio", rounded(finish.gap_ratio, kPixelDigits)},
      {"gaps", list(finish.gaps)},
  };
}

/// Stages that did not run have no member.
template <typename T>
void add_section(Json& document, const char* name, const std::optional<T>& section) {
  if (section) {
    document[name] = to_json(*section);
  }
}

Json to_json(const ScaleSection& scale) {
  const bool metric = scale.outcome == ScaleOutcome::kOk;
  return {
      {"unit", metric ? "metre" : "arbitrary"},
      {"outcome", to_string(scale.outcome)},
      {"metres_per_mapping_unit", significant(scale.metres_per_unit)},
      {"sd_ratio", significant(scale.sd_ratio)},
      {"lengths", list(scale.lengths)},
      {"markers", list(scale.markers)},
      {"problem", scale.problem},
      {"up", scale.z_is_up ? "card" : "none"},
      {"up_sd_deg", rounded(scale.up_sd_deg, kAngleDigits)},
      {"up_problem", scale.up_problem},
  };
}

Json summary(const ReconstructionReport& report) {
  Json totals = {
      {"images", report.images_total},
      {"images_registered", report.images_registered},
      {"images_in_other_components", report.images_in_other_components},
      {"images_refused", report.images_refused},
      {"components", report.components.size()},
  };
  Json numbers = to_json(report.overall);
  numbers.erase("registered_images");
  totals.update(numbers);
  return totals;
}

}  // namespace

std::string render_report_json(const ReconstructionReport& report) {
  Json document = {
      {"schema", kReportSchema},
      {"software", "trigmesh " + report.software_version},
      {"input", report.input_description},
      {"verdict", to_string(report.verdict)},
      {"verdict_sentence", report.verdict_sentence},
      {"units", report.units_sentence},
      {"metres_per_unit",
       report.metres_per_unit ? significant(*report.metres_per_unit) : Json(nullptr)},
      {"totals", summary(report)},
      {"notes", list(report.notes)},
      {"components", list(report.components)},
      {"cameras", list(report.cameras)},
      {"images", list(report.images)},
      {"frames", list(report.frames)},
      {"pairs", list(report.pairs)},
      {"histograms",
       {
           {"reprojection_error_px", to_json(report.reprojection_error_px)},
           {"track_length", to_json(report.track_length)},
           {"triangulation_angle_deg", to_json(report.triangulation_angle_deg)},
       }},
      {"settings", list(report.settings)},
  };
  if (!report.scale.empty()) {
    document["scale"] = list(report.scale);
  }
  add_section(document, "dense", report.dense);
  add_section(document, "moving", report.moving);
  add_section(document, "surface", report.surface);
  add_section(document, "texture", report.texture);
  add_section(document, "finish", report.finish);
  return document.dump(kIndent, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace trigmesh
