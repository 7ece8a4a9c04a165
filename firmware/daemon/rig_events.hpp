#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "firmware/session/space_budget.hpp"
#include "firmware/session/state_machine.hpp"

namespace trigmesh {

// Events for people, besides those of firmware/control/control_events.hpp; one line of JSON each.

inline constexpr std::string_view kCameraEvent = "camera";
inline constexpr std::string_view kStorageEvent = "storage";
inline constexpr std::string_view kRefusedEvent = "pressrefused";

enum class CameraPresence : std::uint8_t { kAway, kThere };

/// {"present":true}
[[nodiscard]] std::string render_camera_event(CameraPresence presence);

/// {"level":"ok","available_bytes":12}
[[nodiscard]] std::string render_storage_event(StorageLevel level, std::uint64_t available_bytes);

/// {"reason":"no camera"}
[[nodiscard]] std::string render_refused_event(PressRefusal reason);

}  // namespace trigmesh
