#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "firmware/daemon/guide.hpp"
#include "firmware/daemon/model_maker.hpp"
#include "firmware/session/space_budget.hpp"
#include "firmware/session/state_machine.hpp"

namespace trigmesh {

// Events for people, besides those of firmware/control/control_events.hpp; one line of JSON each.

inline constexpr std::string_view kCameraEvent = "camera";
inline constexpr std::string_view kStorageEvent = "storage";
inline constexpr std::string_view kRefusedEvent = "pressrefused";
inline constexpr std::string_view kAdviceEvent = "advice";
inline constexpr std::string_view kMapEvent = "map";

enum class CameraPresence : std::uint8_t { kAway, kThere };

/// {"present":true}
[[nodiscard]] std::string render_camera_event(CameraPresence presence);

/// {"level":"ok","available_bytes":12}
[[nodiscard]] std::string render_storage_event(StorageLevel level, std::uint64_t available_bytes);

/// {"reason":"no camera"}
[[nodiscard]] std::string render_refused_event(PressRefusal reason);

/// {"advice":"slower","text":"too fast: .."}
[[nodiscard]] std::string render_advice_event(Advice advice);

/// {"session":"..","frame":12,"following":"tracked","photographs":12,"tracked":11,"waiting":0,
/// "milliseconds":31.5}
[[nodiscard]] std::string render_map_event(const MapFollowed& map);

}  // namespace trigmesh
