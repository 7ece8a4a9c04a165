#include "firmware/pipeline/report_history.hpp"

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <utility>

#include <nlohmann/json.hpp>

#include "firmware/base/check.hpp"
#include "firmware/pipeline/named_value.hpp"
#include "firmware/pipeline/report_json.hpp"

namespace trigmesh {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMaxCameraGroups = 100'000;
constexpr std::size_t kMaxMarkers = 1000;

constexpr std::array kTwoViewKinds{
    TwoViewKind::kNone,
    TwoViewKind::kGeneral,
    TwoViewKind::kPlanar,
    TwoViewKind::kPureRotation,
    TwoViewKind::kWatermark,
    TwoViewKind::kDuplicate,
    TwoViewKind::kLookAlike,
};
constexpr std::array kVerdicts{
    FrameVerdict::kKept,
    FrameVerdict::kBlurred,
    FrameVerdict::kTooLittleMotion,
    FrameVerdict::kTooFast,
    FrameVerdict::kExposureJump,
    FrameVerdict::kDuplicate,
    FrameVerdict::kTrackLost,
    FrameVerdict::kOverBudget,
};
constexpr std::array kGapKinds{GapKind::kHole, GapKind::kWeak};
constexpr std::array kScaleOutcomes{
    ScaleOutcome::kOk,
    ScaleOutcome::kNothingMeasured,
    ScaleOutcome::kDisagreement,
};
constexpr std::array kSquareOutcomes{
    SquareOutcome::kOk,
    SquareOutcome::kTooFewViews,
    SquareOutcome::kSmallAngle,
    SquareOutcome::kInconsistent,
};
constexpr std::array kUpSources{UpSource::kNone, UpSource::kCard};
constexpr std::array kOrigins{
    IntrinsicsOrigin::kGiven, IntrinsicsOrigin::kPriorRefined, IntrinsicsOrigin::kSolved};

tl::unexpected<Error> bad_member(const char* name, const char* reason) {
  return fail(ErrorCode::kCorruptData, "cannot read the report: member \"{}\" {}", name, reason);
}

Result<std::string> text_of(const Json& object, const char* name) {
  const auto member = object.find(name);
  if (member == object.end() || !member->is_string()) {
    return bad_member(name, "is no text");
  }
  return member->get<std::string>();
}

Result<std::size_t> count_of(const Json& object, const char* name) {
  const auto member = object.find(name);
  if (member == object.end() || !member->is_number_unsigned()) {
    return bad_member(name, "is no whole number of 0 or more");
  }
  return member->get<std::size_t>();
}

Result<double> number_of(const Json& object, const char* name) {
  const auto member = object.find(name);
  if (member == object.end() || !member->is_number()) {
    return bad_member(name, "is no number");
  }
  return member->get<double>();
}

template <typename Enum>
Result<Enum> one_of(const Json& object, const char* name, std::span<const Enum> values) {
  TM_ASSIGN_OR_RETURN(const std::string text, text_of(object, name));
  if (const std::optional<Enum> value = named_value(values, text)) {
    return *value;
  }
  return bad_member(name, "has a value that is not known");
}

/// Calls `parse` for each element of the array `name`.
template <typename Parse>
Result<> for_each_in(const Json& document, const char* name, const Parse& parse) {
  const auto array = document.find(name);
  if (array == document.end() || !array->is_array()) {
    return bad_member(name, "is no list");
  }
  for (const Json& element : *array) {
    if (!element.is_object()) {
      return bad_member(name, "has an element that is no object");
    }
    TM_RETURN_IF_ERROR(parse(element));
  }
  return {};
}

/// What `parse` makes of each element of the array `name`, behind what is in `list`.
template <typename T, typename Parse>
Result<> read_list(const Json& document,
                   const char* name,
                   const Parse& parse,
                   std::vector<T>& list) {
  return for_each_in(document, name, [&](const Json& element) -> Result<> {
    TM_ASSIGN_OR_RETURN(T value, parse(element));
    list.push_back(std::move(value));
    return {};
  });
}

Result<ImageOutcome> parse_image(const Json& json) {
  ImageOutcome image;
  TM_ASSIGN_OR_RETURN(image.name, text_of(json, "name"));
  TM_ASSIGN_OR_RETURN(image.reason, one_of<RefusalReason>(json, "status", kAllRefusalReasons));
  TM_ASSIGN_OR_RETURN(image.detail, text_of(json, "detail"));
  TM_ASSIGN_OR_RETURN(image.features, count_of(json, "features"));
  TM_ASSIGN_OR_RETURN(image.overlapping_images, count_of(json, "overlapping_images"));
  TM_ASSIGN_OR_RETURN(image.map_matches, count_of(json, "map_matches"));
  TM_ASSIGN_OR_RETURN(image.map_inliers, count_of(json, "map_inliers"));
  return image;  // the rest is computed from the scenes
}

Result<LiveMapping> parse_live(const Json& json) {
  LiveMapping live;
  TM_ASSIGN_OR_RETURN(live.following, text_of(json, "following"));
  TM_ASSIGN_OR_RETURN(live.duration_s, number_of(json, "seconds"));
  TM_ASSIGN_OR_RETURN(live.waiting, count_of(json, "waiting"));
  return live;
}

Result<VideoFrameSection> parse_frame(const Json& json) {
  VideoFrameSection frame;
  FrameMeasures& measures = frame.measures;
  TM_ASSIGN_OR_RETURN(frame.name, text_of(json, "name"));
  TM_ASSIGN_OR_RETURN(frame.time_s, number_of(json, "time_s"));
  TM_ASSIGN_OR_RETURN(frame.verdict, one_of<FrameVerdict>(json, "verdict", kVerdicts));
  TM_ASSIGN_OR_RETURN(measures.sharpness, number_of(json, "sharpness"));
  TM_ASSIGN_OR_RETURN(measures.relative_sharpness, number_of(json, "relative_sharpness"));
  TM_ASSIGN_OR_RETURN(measures.brightness, number_of(json, "brightness"));
  TM_ASSIGN_OR_RETURN(measures.motion_deg, number_of(json, "motion_deg"));
  TM_ASSIGN_OR_RETURN(measures.parallax_deg, number_of(json, "parallax_deg"));
  TM_ASSIGN_OR_RETURN(measures.overlap, number_of(json, "overlap"));
  if (const auto live = json.find("live"); live != json.end()) {
    TM_ASSIGN_OR_RETURN(frame.live, parse_live(*live));
  }
  return frame;
}

Result<PairEvidence> parse_pair(const Json& json, std::size_t image_count) {
  PairEvidence pair;
  TM_ASSIGN_OR_RETURN(const std::size_t first, count_of(json, "first"));
  TM_ASSIGN_OR_RETURN(const std::size_t second, count_of(json, "second"));
  if (first >= second || second >= image_count) {
    return bad_member("second", "is not the position of a later image");
  }
  pair.pair = {id_of<ViewId>(first), id_of<ViewId>(second)};
  TM_ASSIGN_OR_RETURN(pair.kind, one_of<TwoViewKind>(json, "kind", kTwoViewKinds));
  TM_ASSIGN_OR_RETURN(pair.candidates, count_of(json, "candidates"));
  TM_ASSIGN_OR_RETURN(pair.inliers, count_of(json, "inliers"));
  return pair;
}

Result<ReportSetting> parse_setting(const Json& json) {
  ReportSetting setting;
  TM_ASSIGN_OR_RETURN(setting.name, text_of(json, "name"));
  TM_ASSIGN_OR_RETURN(setting.value, text_of(json, "value"));
  return setting;
}

Result<Eigen::Vector3d> point_of(const Json& object, const char* name) {
  const auto member = object.find(name);
  if (member == object.end() || !member->is_array() || member->size() != 3) {
    return bad_member(name, "is no point");
  }
  Eigen::Vector3d point;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!(*member)[i].is_number()) {
      return bad_member(name, "is no point");
    }
    point[static_cast<Eigen::Index>(i)] = (*member)[i].get<double>();
  }
  return point;
}

Result<FinishGap> parse_gap(const Json& json) {
  FinishGap gap;
  TM_ASSIGN_OR_RETURN(gap.kind, one_of<GapKind>(json, "kind", kGapKinds));
  TM_ASSIGN_OR_RETURN(gap.center_in_world, point_of(json, "center"));
  TM_ASSIGN_OR_RETURN(gap.area_ratio, number_of(json, "area_ratio"));
  TM_ASSIGN_OR_RETURN(gap.photograph, text_of(json, "photograph"));
  TM_ASSIGN_OR_RETURN(gap.turn_left_deg, number_of(json, "turn_left_deg"));
  TM_ASSIGN_OR_RETURN(gap.rise_deg, number_of(json, "rise_deg"));
  TM_ASSIGN_OR_RETURN(gap.advice, text_of(json, "advice"));
  return gap;
}

Result<LengthEvidence> parse_length(const Json& json) {
  LengthEvidence length;
  TM_ASSIGN_OR_RETURN(length.name, text_of(json, "name"));
  TM_ASSIGN_OR_RETURN(length.known_m, number_of(json, "known_m"));
  TM_ASSIGN_OR_RETURN(length.metres_per_unit, number_of(json, "metres_per_unit"));
  TM_ASSIGN_OR_RETURN(length.sd_ratio, number_of(json, "sd_ratio"));
  TM_ASSIGN_OR_RETURN(length.edge_sd_ratio, number_of(json, "edge_sd_ratio"));
  return length;
}

Result<MarkerSection> parse_marker(const Json& json) {
  MarkerSection marker;
  TM_ASSIGN_OR_RETURN(const std::size_t id, count_of(json, "id"));
  if (id >= kMaxMarkers) {
    return bad_member("id", "is too large");
  }
  marker.id = static_cast<int>(id);
  TM_ASSIGN_OR_RETURN(marker.outcome, one_of<SquareOutcome>(json, "outcome", kSquareOutcomes));
  TM_ASSIGN_OR_RETURN(marker.views_seen, count_of(json, "views_seen"));
  TM_ASSIGN_OR_RETURN(marker.views_used, count_of(json, "views_used"));
  TM_ASSIGN_OR_RETURN(marker.rms_px, number_of(json, "rms_px"));
  return marker;
}

Result<ScaleSection> parse_scale(const Json& json) {
  ScaleSection scale;
  TM_ASSIGN_OR_RETURN(scale.outcome, one_of<ScaleOutcome>(json, "outcome", kScaleOutcomes));
  TM_ASSIGN_OR_RETURN(scale.metres_per_unit, number_of(json, "metres_per_mapping_unit"));
  TM_ASSIGN_OR_RETURN(scale.sd_ratio, number_of(json, "sd_ratio"));
  TM_RETURN_IF_ERROR(read_list(json, "lengths", parse_length, scale.lengths));
  TM_RETURN_IF_ERROR(read_list(json, "markers", parse_marker, scale.markers));
  TM_ASSIGN_OR_RETURN(scale.problem, text_of(json, "problem"));
  TM_ASSIGN_OR_RETURN(const UpSource up, one_of<UpSource>(json, "up", kUpSources));
  scale.z_is_up = up == UpSource::kCard;
  TM_ASSIGN_OR_RETURN(scale.up_sd_deg, number_of(json, "up_sd_deg"));
  TM_ASSIGN_OR_RETURN(scale.up_problem, text_of(json, "up_problem"));
  return scale;
}

Result<FinishSection> parse_finish(const Json& json) {
  FinishSection finish;
  const auto ready = json.find("ready");
  if (ready == json.end() || !ready->is_boolean()) {
    return bad_member("ready", "is not true or false");
  }
  finish.ready = ready->get<bool>();
  TM_ASSIGN_OR_RETURN(finish.sentence, text_of(json, "sentence"));
  TM_ASSIGN_OR_RETURN(finish.gap_ratio, number_of(json, "gap_ratio"));
  TM_RETURN_IF_ERROR(read_list(json, "gaps", parse_gap, finish.gaps));
  return finish;
}

Result<> add_origin(const Json& camera, std::vector<IntrinsicsOrigin>& origins) {
  TM_ASSIGN_OR_RETURN(const std::size_t group, count_of(camera, "group"));
  if (group >= kMaxCameraGroups) {
    return bad_member("group", "is too large");
  }
  if (origins.size() <= group) {
    origins.resize(group + 1, IntrinsicsOrigin::kSolved);
  }
  TM_ASSIGN_OR_RETURN(origins[group], one_of<IntrinsicsOrigin>(camera, "origin", kOrigins));
  return {};
}

}  // namespace

Result<ReportHistory> parse_report_history(std::string_view json) {
  const Json document = Json::parse(json, nullptr, false);
  if (!document.is_object()) {
    return fail(ErrorCode::kCorruptData, "cannot read the report: it is not a JSON object");
  }
  TM_ASSIGN_OR_RETURN(const std::size_t schema, count_of(document, "schema"));
  if (schema != kReportSchema) {
    return bad_member("schema", "is not that of this program");
  }
  ReportHistory history;
  TM_ASSIGN_OR_RETURN(history.input_description, text_of(document, "input"));
  TM_RETURN_IF_ERROR(read_list(document, "images", parse_image, history.images));
  if (document.contains("frames")) {  // the first reports had none
    TM_RETURN_IF_ERROR(read_list(document, "frames", parse_frame, history.frames));
  }
  const auto parse_pair_of = [&](const Json& element) {
    return parse_pair(element, history.images.size());
  };
  TM_RETURN_IF_ERROR(read_list(document, "pairs", parse_pair_of, history.pairs));
  if (document.contains("scale")) {  // where somebody knew a length
    TM_RETURN_IF_ERROR(read_list(document, "scale", parse_scale, history.scale));
  }
  TM_RETURN_IF_ERROR(read_list(document, "settings", parse_setting, history.settings));
  TM_RETURN_IF_ERROR(for_each_in(document, "cameras", [&](const Json& element) {
    return add_origin(element, history.intrinsics_origins);
  }));
  if (const auto finish = document.find("finish"); finish != document.end()) {
    TM_ASSIGN_OR_RETURN(history.finish, parse_finish(*finish));
  }
  return history;
}

}  // namespace trigmesh
