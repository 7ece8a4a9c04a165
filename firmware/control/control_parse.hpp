#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/control/control_events.hpp"
#include "firmware/control/control_target.hpp"

namespace trigmesh {

// The way back from the JSON of control_json: requests for the server, answers for a client.
// Unknown keys are not looked at. Each complaint names the key: kCorruptData, for a request
// kInvalidArgument.

/// The destination of an export: an absolute path without a byte 0.
[[nodiscard]] Result<std::filesystem::path> parse_export_request(std::string_view json);

[[nodiscard]] Result<ControlStatus> parse_status(std::string_view json);
/// Of the manifests: id, state, mode, frame_count, exported.
[[nodiscard]] Result<std::vector<SessionInfo>> parse_sessions(std::string_view json);
[[nodiscard]] Result<std::vector<DeviceInfo>> parse_devices(std::string_view json);
[[nodiscard]] Result<ExportReport> parse_export(std::string_view json);

/// What an event says (see control_events).
/// Of a phase event: the open session; empty: none.
[[nodiscard]] Result<std::string> parse_phase_session(std::string_view json);
[[nodiscard]] Result<std::uint32_t> parse_frame_event(std::string_view json);
[[nodiscard]] Result<ModelEvent> parse_model_event(std::string_view json);
[[nodiscard]] Result<ProgressEvent> parse_progress_event(std::string_view json);
[[nodiscard]] Result<ExportEvent> parse_export_event(std::string_view json);

/// The message of {"error": ".."}; the text itself when it is something else.
[[nodiscard]] std::string parse_error(std::string_view json);

}  // namespace trigmesh
