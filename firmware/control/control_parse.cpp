#include "firmware/control/control_parse.hpp"

#include <cstdint>
#include <initializer_list>
#include <limits>
#include <utility>

#include <nlohmann/json.hpp>

#include "firmware/base/check.hpp"
#include "firmware/control/control_json.hpp"

namespace trigmesh {
namespace {

using Json = nlohmann::ordered_json;

/// Nothing for what is no JSON.
Json parsed(std::string_view text) {
  return Json::parse(text, nullptr, /*allow_exceptions=*/false);
}

/// Takes typed values out of one object. The first complaint stays; what is taken after it is
/// empty, so that a reader asks once, at its end.
class Fields {
 public:
  explicit Fields(const Json& json) : json_(json) {
    if (!json.is_object()) {
      complain("the whole answer", "an object of JSON");
    }
  }

  [[nodiscard]] std::string text(const char* key) {
    const Json* value = find(key);
    if (value == nullptr || !value->is_string()) {
      complain(key, "a text");
      return {};
    }
    return value->get<std::string>();
  }

  [[nodiscard]] bool truth(const char* key) {
    const Json* value = find(key);
    if (value == nullptr || !value->is_boolean()) {
      complain(key, "true or false");
      return false;
    }
    return value->get<bool>();
  }

  template <typename Count>
  [[nodiscard]] Count count(const char* key) {
    const Json* value = find(key);
    const bool whole = value != nullptr && value->is_number_unsigned();
    if (!whole || value->get<std::uint64_t>() > std::numeric_limits<Count>::max()) {
      complain(key, "a whole number from 0");
      return 0;
    }
    return static_cast<Count>(value->get<std::uint64_t>());
  }

  /// One of `values` by its to_string.
  template <typename Enum>
  [[nodiscard]] Enum choice(const char* key, std::initializer_list<Enum> values) {
    const std::string name = text(key);
    for (const Enum value : values) {
      if (to_string(value) == name) {
        return value;
      }
    }
    complain(key, "a word that this version knows");
    return *values.begin();
  }

  template <typename Value>
  [[nodiscard]] Result<Value> finish(Value value) const {
    if (!complaint_.empty()) {
      return fail(ErrorCode::kCorruptData, "the answer of the rig cannot be read: {}", complaint_);
    }
    return value;
  }

 private:
  [[nodiscard]] const Json* find(const char* key) const {
    if (!json_.is_object()) {
      return nullptr;
    }
    const auto found = json_.find(key);
    return found == json_.end() ? nullptr : &*found;
  }

  void complain(std::string_view key, std::string_view what) {
    if (complaint_.empty()) {
      complaint_ = fmt::format("\"{}\" must be {}", key, what);
    }
  }

  const Json& json_;
  std::string complaint_;
};

Result<SessionInfo> session_of(const Json& json) {
  Fields fields(json);
  SessionInfo session;
  session.manifest.id = fields.text("id");
  session.manifest.state = fields.choice("state",
                                         {SessionState::kCapturing,
                                          SessionState::kInterrupted,
                                          SessionState::kClosed,
                                          SessionState::kReconstructing,
                                          SessionState::kModelReady,
                                          SessionState::kModelFailed});
  session.manifest.mode = fields.text("mode");
  session.manifest.frame_count = fields.count<std::uint32_t>("frames");
  session.has_model = fields.truth("has_model");
  session.manifest.exported = fields.truth("exported");
  session.size_bytes = fields.count<std::uint64_t>("size_bytes");
  return fields.finish(std::move(session));
}

Result<DeviceInfo> device_of(const Json& json) {
  Fields fields(json);
  DeviceInfo device;
  device.kind = fields.text("kind");
  device.stable_name = fields.text("name");
  device.model = fields.text("model");
  device.note = fields.text("note");
  return fields.finish(std::move(device));
}

template <typename Item>
Result<std::vector<Item>> list_of(std::string_view text, Result<Item> (*item_of)(const Json&)) {
  const Json json = parsed(text);
  if (!json.is_array()) {
    return fail(ErrorCode::kCorruptData,
                "the answer of the rig cannot be read: it must be a list of JSON");
  }
  std::vector<Item> items;
  for (const Json& entry : json) {
    TM_ASSIGN_OR_RETURN(Item item, item_of(entry));
    items.push_back(std::move(item));
  }
  return items;
}

}  // namespace

Result<std::filesystem::path> parse_export_request(std::string_view json) {
  const Json request = parsed(json);
  const auto found = request.is_object() ? request.find("destination") : request.end();
  if (!request.is_object() || found == request.end() || !found->is_string()) {
    return fail(ErrorCode::kInvalidArgument,
                "the request must be an object of JSON with the text \"destination\", a folder");
  }
  const auto& text = found->get_ref<const std::string&>();
  std::filesystem::path destination(text);
  if (!destination.is_absolute() || text.find('\0') != std::string::npos) {
    return fail(ErrorCode::kInvalidArgument,
                "\"destination\" must be an absolute path: the rig has no current folder");
  }
  return destination;
}

Result<ControlStatus> parse_status(std::string_view json) {
  const Json object = parsed(json);
  Fields fields(object);
  ControlStatus status;
  status.phase = fields.choice(
      "phase", {RigPhase::kIdle, RigPhase::kCapturing, RigPhase::kWorking, RigPhase::kFault});
  status.camera_present = fields.truth("camera_present");
  status.storage =
      fields.choice("storage", {StorageLevel::kOk, StorageLevel::kLow, StorageLevel::kFull});
  status.session_id = fields.text("session");
  status.frames = fields.count<std::uint32_t>("frames");
  status.advice = fields.text("advice");
  status.job = fields.choice(
      "job", {JobState::kNone, JobState::kRunning, JobState::kPausing, JobState::kPaused});
  status.queued_models = fields.count<std::uint32_t>("queued_models");
  status.available_bytes = fields.count<std::uint64_t>("available_bytes");
  status.software_version = fields.text("software_version");
  status.session_root = fields.text("session_root");
  status.fault = fields.text("fault");
  status.model_session_id = fields.text("model_session");
  status.model_stage = fields.text("model_stage");
  status.model_done = fields.count<std::uint64_t>("model_done");
  status.model_total = fields.count<std::uint64_t>("model_total");
  status.last_event = fields.count<std::uint64_t>("last_event");
  return fields.finish(std::move(status));
}

Result<std::vector<SessionInfo>> parse_sessions(std::string_view json) {
  return list_of(json, &session_of);
}

Result<std::vector<DeviceInfo>> parse_devices(std::string_view json) {
  return list_of(json, &device_of);
}

Result<ExportReport> parse_export(std::string_view json) {
  const Json object = parsed(json);
  Fields fields(object);
  ExportReport report;
  report.folder = fields.text("folder");
  report.file_count = fields.count<std::size_t>("files");
  report.size_bytes = fields.count<std::uint64_t>("size_bytes");
  return fields.finish(std::move(report));
}

Result<std::string> parse_phase_session(std::string_view json) {
  const Json object = parsed(json);
  Fields fields(object);
  std::string session = fields.text("session");
  return fields.finish(std::move(session));
}

Result<std::uint32_t> parse_frame_event(std::string_view json) {
  const Json object = parsed(json);
  Fields fields(object);
  const auto frames = fields.count<std::uint32_t>("frames");
  return fields.finish(frames);
}

Result<ModelEvent> parse_model_event(std::string_view json) {
  const Json object = parsed(json);
  Fields fields(object);
  ModelEvent event;
  event.session_id = fields.text("session");
  event.outcome = fields.choice("outcome",
                                {ModelEventOutcome::kReady,
                                 ModelEventOutcome::kNone,
                                 ModelEventOutcome::kFailed,
                                 ModelEventOutcome::kCancelled});
  event.message = fields.text("message");
  return fields.finish(std::move(event));
}

Result<ProgressEvent> parse_progress_event(std::string_view json) {
  const Json object = parsed(json);
  Fields fields(object);
  ProgressEvent event;
  event.session_id = fields.text("session");
  event.stage = fields.text("stage");
  event.done = fields.count<std::uint64_t>("done");
  event.total = fields.count<std::uint64_t>("total");
  return fields.finish(std::move(event));
}

Result<ExportEvent> parse_export_event(std::string_view json) {
  const Json object = parsed(json);
  Fields fields(object);
  ExportEvent event;
  event.session_id = fields.text("session");
  event.copied_bytes = fields.count<std::uint64_t>("copied_bytes");
  event.all_bytes = fields.count<std::uint64_t>("all_bytes");
  return fields.finish(std::move(event));
}

std::string parse_error(std::string_view json) {
  const Json object = parsed(json);
  const auto found = object.is_object() ? object.find("error") : object.end();
  if (object.is_object() && found != object.end() && found->is_string()) {
    return found->get<std::string>();
  }
  return std::string(json);
}

}  // namespace trigmesh
