#include "firmware/daemon/frame_times.hpp"

#include <algorithm>

namespace trigmesh {

using std::chrono::nanoseconds;

FrameTimes times_of_frame(const FrameInfo& info, nanoseconds interval, nanoseconds received) {
  const nanoseconds time = info.timestamp.value_or(received);
  const FrameMoment moment = info.timestamp ? info.moment : FrameMoment::kReceived;
  const nanoseconds exposure = std::max(info.exposure.value_or(nanoseconds(0)), nanoseconds(0));
  FrameTimes times;
  switch (moment) {
    case FrameMoment::kExposureMiddle:
      times.end = time + exposure / 2;
      times.middle = time;
      break;
    case FrameMoment::kExposureStart:
      times.end = time + exposure;
      times.middle = time + exposure / 2;
      break;
    case FrameMoment::kFrameEnd:
      times.end = time - interval;
      times.middle = time - exposure / 2;
      break;
    case FrameMoment::kReceived:
      times.end = time - 2 * interval;
      times.middle = time - interval;
      break;
  }
  times.begin = times.end - exposure;
  times.middle = std::max(times.middle, nanoseconds(0));
  return times;
}

}  // namespace trigmesh
