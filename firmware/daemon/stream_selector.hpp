#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "firmware/daemon/capture_types.hpp"
#include "firmware/daemon/frame_copies.hpp"
#include "firmware/imaging/sharpness.hpp"

namespace trigmesh {

/// What became of the frames of one stream.
struct StreamCounts {
  std::uint64_t seen = 0;
  std::uint64_t kept = 0;
  std::uint64_t less_sharp = 0;
  std::uint64_t damaged = 0;    ///< could not be measured: no picture
  std::uint64_t no_buffer = 0;  ///< the storage had all buffers
};

/// Keeps the sharpest frame of each group of frames that follow each other. Thread-compatible.
class StreamSelector {
 public:
  /// `group_size` >= 1; 1 keeps all frames. `copies` outlives it.
  StreamSelector(std::size_t group_size, FrameCopies& copies)
      : group_size_(group_size), copies_(copies) {}

  /// A stream begins: frames that were exposed before `from` do not belong to it.
  void begin(std::chrono::nanoseconds from);

  /// A frame came. The frame that is kept, when it completes a group. Precondition: is_streaming().
  [[nodiscard]] std::optional<TimedFrame> offer(const Frame& frame,
                                                const FrameTimes& times,
                                                std::uint64_t sequence);

  /// The stream ends. The sharpest of a group that has half of its frames, or that is the first.
  [[nodiscard]] std::optional<TimedFrame> end();

  [[nodiscard]] bool is_streaming() const { return is_streaming_; }

  /// Of the stream that runs, or ended last.
  [[nodiscard]] const StreamCounts& counts() const { return counts_; }

 private:
  void compare(const Frame& frame, const FrameTimes& times, std::uint64_t sequence);
  [[nodiscard]] std::optional<TimedFrame> finish_group();

  std::size_t group_size_;
  FrameCopies& copies_;
  SharpnessMeter meter_;
  bool is_streaming_ = false;
  std::chrono::nanoseconds from_{};
  std::size_t in_group_ = 0;
  std::optional<TimedFrame> best_;
  double best_sharpness_ = 0.0;
  StreamCounts counts_;
};

}  // namespace trigmesh
