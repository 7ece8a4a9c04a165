#include "firmware/control/control_events.hpp"

#include <nlohmann/json.hpp>

#include "firmware/control/control_json.hpp"

namespace trigmesh {
namespace {

using Json = nlohmann::ordered_json;

std::string line_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

std::string render_phase_event(RigPhase phase, std::string_view session_id) {
  return line_of({{"phase", to_string(phase)}, {"session", session_id}});
}

std::string render_frame_event(std::string_view session_id, std::uint32_t frames) {
  return line_of({{"session", session_id}, {"frames", frames}});
}

std::string_view to_string(ModelEventOutcome outcome) {
  switch (outcome) {
    case ModelEventOutcome::kReady:
      return "ready";
    case ModelEventOutcome::kNone:
      return "none";
    case ModelEventOutcome::kFailed:
      return "failed";
    case ModelEventOutcome::kCancelled:
      return "cancelled";
  }
  return "unknown";
}

std::string render_model_event(const ModelEvent& event) {
  return line_of({{"session", event.session_id},
                  {"outcome", to_string(event.outcome)},
                  {"message", event.message}});
}

std::string render_progress_event(const ProgressEvent& event) {
  return line_of({{"session", event.session_id},
                  {"stage", event.stage},
                  {"done", event.done},
                  {"total", event.total}});
}

std::string render_export_event(const ExportEvent& event) {
  return line_of({{"session", event.session_id},
                  {"copied_bytes", event.copied_bytes},
                  {"all_bytes", event.all_bytes}});
}

}  // namespace trigmesh
