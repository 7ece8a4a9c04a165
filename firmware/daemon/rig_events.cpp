#include "firmware/daemon/rig_events.hpp"

#include <nlohmann/json.hpp>

namespace trigmesh {

using Json = nlohmann::ordered_json;

std::string render_camera_event(CameraPresence presence) {
  return Json{{"present", presence == CameraPresence::kThere}}.dump();
}

std::string render_storage_event(StorageLevel level, std::uint64_t available_bytes) {
  return Json{{"level", to_string(level)}, {"available_bytes", available_bytes}}.dump();
}

std::string render_refused_event(PressRefusal reason) {
  return Json{{"reason", to_string(reason)}}.dump();
}

}  // namespace trigmesh
