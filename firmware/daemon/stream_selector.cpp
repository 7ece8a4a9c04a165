#include "firmware/daemon/stream_selector.hpp"

#include <utility>

namespace trigmesh {

void StreamSelector::begin(std::chrono::nanoseconds from) {
  is_streaming_ = true;
  from_ = from;
  in_group_ = 0;
  best_.reset();
  counts_ = {};
}

std::optional<TimedFrame> StreamSelector::offer(const Frame& frame,
                                                const FrameTimes& times,
                                                std::uint64_t sequence) {
  if (times.end < from_) {
    return std::nullopt;
  }
  ++counts_.seen;
  ++in_group_;
  compare(frame, times, sequence);
  return in_group_ == group_size_ ? finish_group() : std::nullopt;
}

void StreamSelector::compare(const Frame& frame, const FrameTimes& times, std::uint64_t sequence) {
  double sharpness = 0.0;
  if (group_size_ > 1) {
    const Result<double> measured = meter_.measure(frame.info().layout, frame.bytes());
    if (!measured) {
      ++counts_.damaged;
      return;
    }
    sharpness = *measured;
  }
  if (best_ && sharpness <= best_sharpness_) {
    ++counts_.less_sharp;
    return;
  }
  Frame copy = copies_.copy(frame, sequence);
  if (copy.empty()) {
    ++counts_.no_buffer;
    return;
  }
  counts_.less_sharp += best_ ? 1U : 0U;
  best_ = TimedFrame{std::move(copy), times, sequence};
  best_sharpness_ = sharpness;
}

std::optional<TimedFrame> StreamSelector::finish_group() {
  in_group_ = 0;
  counts_.kept += best_ ? 1U : 0U;
  return std::exchange(best_, std::nullopt);
}

std::optional<TimedFrame> StreamSelector::end() {
  is_streaming_ = false;
  if (2 * in_group_ >= group_size_ || counts_.kept == 0) {
    return finish_group();
  }
  counts_.less_sharp += best_ ? 1U : 0U;
  best_.reset();
  return std::nullopt;
}

}  // namespace trigmesh
