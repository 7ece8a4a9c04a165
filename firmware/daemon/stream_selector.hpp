#pragma once

#include <chrono>
#include <cstdint>
#include <vector>

#include "firmware/daemon/capture_types.hpp"

namespace trigmesh {

/// What became of the frames of one stream.
struct StreamCounts {
  std::uint64_t seen = 0;
  std::uint64_t kept = 0;
  std::uint64_t not_chosen = 0;  ///< another one was kept in its place, or none was needed
  std::uint64_t damaged = 0;     ///< could not be looked at: no picture
  std::uint64_t no_buffer = 0;   ///< the storage had all buffers
};

/// What became certain with a frame. Empty most of the time: then nothing is allocated.
struct StreamChoice {
  std::vector<TimedFrame> kept;     ///< in the order of their times
  std::vector<FrameJudged> judged;  ///< with reasons, where there are any
};

/// Chooses the frames of a stream that are kept. Thread-compatible.
class StreamSelector {
 public:
  StreamSelector() = default;
  StreamSelector(const StreamSelector&) = delete;
  StreamSelector& operator=(const StreamSelector&) = delete;
  StreamSelector(StreamSelector&&) = delete;
  StreamSelector& operator=(StreamSelector&&) = delete;
  virtual ~StreamSelector() = default;

  /// A stream begins: frames that were exposed before `from` do not belong to it.
  virtual void begin(std::chrono::nanoseconds from) = 0;

  /// A frame came. Precondition: is_streaming().
  [[nodiscard]] virtual StreamChoice offer(const Frame& frame,
                                           const FrameTimes& times,
                                           std::uint64_t sequence) = 0;

  /// The stream ends: decides what is left.
  [[nodiscard]] virtual StreamChoice end() = 0;

  [[nodiscard]] virtual bool is_streaming() const = 0;

  /// Of the stream that runs, or ended last.
  [[nodiscard]] virtual const StreamCounts& counts() const = 0;
};

}  // namespace trigmesh
