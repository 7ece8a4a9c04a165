#include "drivers/camera/libcamera/frame_stamp.hpp"

namespace trigmesh {

FrameStamp choose_stamp(const ToldTimes& told,
                        std::chrono::nanoseconds now,
                        std::optional<std::chrono::nanoseconds> last) {
  // A frame that waited longer in our buffers than this was not wanted; another clock is off by
  // more.
  constexpr std::chrono::minutes kOldest{1};
  const auto is_plausible = [&](const std::optional<std::chrono::nanoseconds>& time) {
    return time && *time <= now && *time >= now - kOldest && (!last || *last < *time);
  };
  if (is_plausible(told.sensor)) {
    return {*told.sensor, FrameMoment::kExposureStart};
  }
  if (is_plausible(told.buffer)) {
    return {*told.buffer, FrameMoment::kFrameEnd};
  }
  return {now, FrameMoment::kReceived};
}

}  // namespace trigmesh
