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

std::string render_advice_event(Advice advice) {
  return Json{{"advice", to_string(advice)}, {"text", sentence_of(advice)}}.dump();
}

std::string render_map_event(const MapFollowed& map) {
  const std::chrono::duration<double, std::milli> duration = map.frame.duration;
  return Json{{"session", map.session_id},
              {"frame", map.frame.number},
              {"following", to_string(map.frame.following)},
              {"photographs", map.photographs},
              {"tracked", map.tracked},
              {"waiting", map.frame.waiting},
              {"milliseconds", duration.count()}}
      .dump();
}

}  // namespace trigmesh
