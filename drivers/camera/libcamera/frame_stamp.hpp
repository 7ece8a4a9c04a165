#pragma once

#include <chrono>
#include <optional>

#include "drivers/camera/frame.hpp"

namespace trigmesh {

/// When a frame was taken, and what that is the time of.
struct FrameStamp {
  std::chrono::nanoseconds time{0};
  FrameMoment moment = FrameMoment::kReceived;

  bool operator==(const FrameStamp&) const = default;
};

/// The times that libcamera tells of a frame.
struct ToldTimes {
  /// Of the sensor: the first row is exposed. libcamera's text says CLOCK_BOOTTIME; its pipelines
  /// pass on the driver's CLOCK_MONOTONIC. The two part when the board was suspended.
  std::optional<std::chrono::nanoseconds> sensor;
  /// Of the buffer: the driver's stamp, at the end of the frame as far as is known.
  std::optional<std::chrono::nanoseconds> buffer;
};

/// The best of what is told that can be true on CLOCK_MONOTONIC: not in the future, later than the
/// frame before (`last`), and of the last minute; the sensor's before the buffer's. Otherwise
/// `now`, as kReceived.
[[nodiscard]] FrameStamp choose_stamp(const ToldTimes& told,
                                      std::chrono::nanoseconds now,
                                      std::optional<std::chrono::nanoseconds> last);

}  // namespace trigmesh
