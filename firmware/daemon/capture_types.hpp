#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <optional>

#include "drivers/camera/frame.hpp"
#include "firmware/daemon/frame_times.hpp"
#include "firmware/session/journal_records.hpp"

namespace trigmesh {

/// Counts the sessions that one run of the program opens. Orders and answers carry it; what belongs
/// to an earlier session is not listened to.
enum class SessionSerial : std::uint64_t {};

/// Counts the stills that were asked for.
enum class StillTicket : std::uint64_t {};

/// A frame with its times, and a sequence that goes on over restarts of the camera.
struct TimedFrame {
  Frame frame;
  FrameTimes times;
  std::uint64_t sequence = 0;
};

/// What the session's records say about it.
[[nodiscard]] inline FrameMetadata metadata_of(const TimedFrame& timed) {
  FrameMetadata metadata;
  metadata.timestamp = timed.times.middle;
  metadata.exposure = timed.frame.info().exposure;
  metadata.gain = timed.frame.info().gain;
  metadata.sensor_sequence = timed.sequence;
  return metadata;
}

/// Frames that never came as far as a decision, since the program began. Counted by the capture
/// thread, read by the storage thread.
struct FrameDrops {
  std::atomic<std::uint64_t> sensor = 0;
  std::atomic<std::uint64_t> queue = 0;
  std::atomic<std::uint64_t> corrupt = 0;

  [[nodiscard]] DropCounts now() const { return {sensor, queue, corrupt}; }
};

}  // namespace trigmesh
