#include "firmware/control/control_json.hpp"

#include <nlohmann/json.hpp>

namespace trigmesh {
namespace {

using Json = nlohmann::ordered_json;

std::string line_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string_view name_of(RigPhase phase) {
  switch (phase) {
    case RigPhase::kIdle:
      return "idle";
    case RigPhase::kCapturing:
      return "capturing";
    case RigPhase::kWorking:
      return "working";
    case RigPhase::kFault:
      return "fault";
  }
  return "unknown";
}

std::string_view name_of(JobState job) {
  switch (job) {
    case JobState::kNone:
      return "none";
    case JobState::kRunning:
      return "running";
    case JobState::kPausing:
      return "pausing";
    case JobState::kPaused:
      return "paused";
  }
  return "unknown";
}

}  // namespace

std::string render_status(const ControlStatus& status) {
  Json json;
  json["phase"] = name_of(status.phase);
  json["camera_present"] = status.camera_present;
  json["storage"] = to_string(status.storage);
  json["session"] = status.session_id;
  json["frames"] = status.frames;
  json["job"] = name_of(status.job);
  json["queued_models"] = status.queued_models;
  json["available_bytes"] = status.available_bytes;
  json["software_version"] = status.software_version;
  return line_of(json);
}

std::string render_sessions(std::span<const SessionInfo> sessions) {
  Json list = Json::array();
  for (const SessionInfo& session : sessions) {
    Json json;
    json["id"] = session.manifest.id;
    json["state"] = to_string(session.manifest.state);
    json["mode"] = session.manifest.mode;
    json["frames"] = session.manifest.frame_count;
    json["has_model"] = session.has_model;
    json["exported"] = session.manifest.exported;
    json["size_bytes"] = session.size_bytes;
    list.push_back(std::move(json));
  }
  return line_of(list);
}

std::string render_error(std::string_view message) {
  Json json;
  json["error"] = message;
  return line_of(json);
}

int http_status_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInvalidArgument:
      return 400;
    case ErrorCode::kNotFound:
      return 404;
    case ErrorCode::kInsufficientData:
    case ErrorCode::kCancelled:
      return 409;
    case ErrorCode::kLimitExceeded:
      return 413;
    case ErrorCode::kNoSpace:
      return 507;
    case ErrorCode::kUnsupported:
      return 501;
    case ErrorCode::kCorruptData:
    case ErrorCode::kIo:
    case ErrorCode::kInternal:
      break;
  }
  return 500;
}

}  // namespace trigmesh
