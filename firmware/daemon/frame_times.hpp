#pragma once

#include <chrono>

#include "drivers/camera/frame.hpp"

namespace trigmesh {

/// When a frame was exposed, on the clock of the trigger edges.
struct FrameTimes {
  /// At the latest: where the camera does not tell, it is taken for earlier than it was. A frame
  /// whose `end` is not before a press was not exposed before the press.
  std::chrono::nanoseconds begin{};
  std::chrono::nanoseconds end{};  ///< >= begin
  /// The best guess of the middle, for the records; >= 0.
  std::chrono::nanoseconds middle{};

  bool operator==(const FrameTimes&) const = default;
};

/// From what the camera says of the frame. `interval`: between two frames, > 0; it bounds what is
/// not known: reading out and sending a frame takes no longer. `received`: now, for frames without
/// a time.
///
/// | FrameMoment | exposure ends not before |
/// |---|---|
/// | kExposureMiddle | time + half the exposure |
/// | kExposureStart | time + exposure |
/// | kFrameEnd | time - interval |
/// | kReceived | time - 2 intervals: it may have waited for us, too |
[[nodiscard]] FrameTimes times_of_frame(const FrameInfo& info,
                                        std::chrono::nanoseconds interval,
                                        std::chrono::nanoseconds received);

}  // namespace trigmesh
