#pragma once

#include <span>
#include <string>
#include <string_view>

#include "firmware/control/control_target.hpp"

namespace trigmesh {

// What the control interface says, as one line of JSON each.

[[nodiscard]] std::string render_status(const ControlStatus& status);
[[nodiscard]] std::string render_sessions(std::span<const SessionInfo> sessions);
/// {"error": "..."}
[[nodiscard]] std::string render_error(std::string_view message);

/// The HTTP status that tells a caller what he can do.
[[nodiscard]] int http_status_of(ErrorCode code);

}  // namespace trigmesh
