#include "firmware/control/control_json.hpp"

#include <nlohmann/json.hpp>

namespace trigmesh {
namespace {

using Json = nlohmann::ordered_json;

std::string line_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

std::string_view to_string(RigPhase phase) {
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

std::string_view to_string(JobState job) {
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

std::string render_status(const ControlStatus& status) {
  Json json;
  json["phase"] = to_string(status.phase);
  json["camera_present"] = status.camera_present;
  json["storage"] = to_string(status.storage);
  json["session"] = status.session_id;
  json["frames"] = status.frames;
  json["advice"] = status.advice;
  json["job"] = to_string(status.job);
  json["queued_models"] = status.queued_models;
  json["available_bytes"] = status.available_bytes;
  json["software_version"] = status.software_version;
  json["session_root"] = status.session_root;
  json["fault"] = status.fault;
  json["model_session"] = status.model_session_id;
  json["model_stage"] = status.model_stage;
  json["model_done"] = status.model_done;
  json["model_total"] = status.model_total;
  json["last_event"] = status.last_event;
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

std::string render_devices(std::span<const DeviceInfo> devices) {
  Json list = Json::array();
  for (const DeviceInfo& device : devices) {
    list.push_back({{"kind", device.kind},
                    {"name", device.stable_name},
                    {"model", device.model},
                    {"note", device.note}});
  }
  return line_of(list);
}

std::string render_export(const ExportReport& report) {
  Json json;
  json["folder"] = report.folder.string();
  json["files"] = report.file_count;
  json["size_bytes"] = report.size_bytes;
  return line_of(json);
}

std::string render_export_request(const std::filesystem::path& destination) {
  Json json;
  json["destination"] = destination.string();
  return line_of(json);
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

ErrorCode error_code_of(int http_status) {
  switch (http_status) {
    case 400:
      return ErrorCode::kInvalidArgument;
    case 404:
      return ErrorCode::kNotFound;
    case 409:
      return ErrorCode::kInsufficientData;
    case 413:
    case 503:
      return ErrorCode::kLimitExceeded;
    case 501:
      return ErrorCode::kUnsupported;
    case 507:
      return ErrorCode::kNoSpace;
    default:
      return ErrorCode::kIo;
  }
}

}  // namespace trigmesh
