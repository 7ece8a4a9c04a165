#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "firmware/daemon/frame_copies.hpp"
#include "firmware/daemon/stream_selector.hpp"
#include "firmware/imaging/sharpness.hpp"

namespace trigmesh {

/// Keeps the sharpest frame of each group of frames that follow each other; at the end that of a
/// group that has half of its frames, or that is the first. Gives no verdicts. Thread-compatible.
class SharpestOfGroup final : public StreamSelector {
 public:
  /// `group_size` >= 1; 1 keeps all frames. `copies` outlives it.
  SharpestOfGroup(std::size_t group_size, FrameCopies& copies)
      : group_size_(group_size), copies_(copies) {}

  void begin(std::chrono::nanoseconds from) override;
  void offer(const Frame& frame,
             const FrameTimes& times,
             std::uint64_t sequence,
             StreamChoice& choice) override;
  void end(StreamChoice& choice) override;

  [[nodiscard]] bool is_streaming() const override { return is_streaming_; }

  [[nodiscard]] const StreamCounts& counts() const override { return counts_; }

 private:
  void compare(const Frame& frame, const FrameTimes& times, std::uint64_t sequence);
  void finish_group(StreamChoice& choice);

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
