#pragma once

#include <span>
#include <string>
#include <string_view>

#include "firmware/control/control_target.hpp"

namespace trigmesh {

// What the control interface says, as one line of JSON each.

[[nodiscard]] std::string render_status(const ControlStatus& status);
[[nodiscard]] std::string render_sessions(std::span<const SessionInfo> sessions);
[[nodiscard]] std::string render_devices(std::span<const DeviceInfo> devices);
[[nodiscard]] std::string render_export(const ExportReport& report);
/// {"destination": "..."}: the body of the request for an export.
[[nodiscard]] std::string render_export_request(const std::filesystem::path& destination);
/// {"error": "..."}
[[nodiscard]] std::string render_error(std::string_view message);

/// "idle", "capturing", "working", "fault".
[[nodiscard]] std::string_view to_string(RigPhase phase);
/// "none", "running", "pausing", "paused".
[[nodiscard]] std::string_view to_string(JobState job);

/// The HTTP status that tells a caller what he can do.
[[nodiscard]] int http_status_of(ErrorCode code);
/// The way back, for a client; several codes share a status.
[[nodiscard]] ErrorCode error_code_of(int http_status);

}  // namespace trigmesh
