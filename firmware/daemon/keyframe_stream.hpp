#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <vector>

#include "firmware/daemon/frame_copies.hpp"
#include "firmware/daemon/stream_selector.hpp"
#include "firmware/imaging/grey_reducer.hpp"
#include "sfm/keyframes/keyframe_selector.hpp"

namespace trigmesh {

/// Keeps the keyframes of a stream (sfm/keyframes), with a verdict on every frame that it could
/// look at. Holds copies of the frames that may still become one, at most options.max_waiting.
/// Thread-compatible.
class KeyframeStream final : public StreamSelector {
 public:
  /// Precondition: `options` are valid. `copies` outlives it.
  KeyframeStream(const KeyframeOptions& options, FrameCopies& copies);

  void begin(std::chrono::nanoseconds from) override;
  void offer(const Frame& frame,
             const FrameTimes& times,
             std::uint64_t sequence,
             StreamChoice& choice) override;
  void end(StreamChoice& choice) override;

  [[nodiscard]] bool is_streaming() const override { return is_streaming_; }

  [[nodiscard]] const StreamCounts& counts() const override { return counts_; }

 private:
  void carry_out(std::span<const FrameDecision> decisions, StreamChoice& choice);
  [[nodiscard]] TimedFrame take_held(std::uint64_t sequence);

  KeyframeSelector selector_;
  FrameCopies& copies_;
  GreyReducer reducer_;
  bool is_streaming_ = false;
  std::chrono::nanoseconds from_{};
  cv::Size size_;  ///< of the frames of this stream, reduced
  std::chrono::nanoseconds last_time_{};
  std::vector<TimedFrame> held_;  ///< without a decision so far, in the order of their sequences
  StreamCounts counts_;
};

/// Most frames that wait for a decision at a time, when they come at this interval (> 0) and there
/// is room for all: for KeyframeOptions::max_waiting.
[[nodiscard]] std::size_t most_waiting_keyframes(const KeyframeOptions& options,
                                                 std::chrono::nanoseconds frame_interval);

}  // namespace trigmesh
