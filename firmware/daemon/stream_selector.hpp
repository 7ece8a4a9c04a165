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

/// What became certain. Emptied and used again, it takes no more memory.
struct StreamChoice {
  std::vector<TimedFrame> kept;     ///< of one frame that came: in the order of their times
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

  /// A frame came; adds what became certain with it to `choice`. Precondition: is_streaming().
  virtual void offer(const Frame& frame,
                     const FrameTimes& times,
                     std::uint64_t sequence,
                     StreamChoice& choice) = 0;

  /// The stream ends: decides what is left, and adds it to `choice`.
  virtual void end(StreamChoice& choice) = 0;

  [[nodiscard]] virtual bool is_streaming() const = 0;

  /// Of the stream that runs, or ended last.
  [[nodiscard]] virtual const StreamCounts& counts() const = 0;
};

}  // namespace trigmesh
