#include "firmware/daemon/sharpest_of_group.hpp"

#include <utility>

namespace trigmesh {

void SharpestOfGroup::begin(std::chrono::nanoseconds from) {
  is_streaming_ = true;
  from_ = from;
  in_group_ = 0;
  best_.reset();
  counts_ = {};
}

StreamChoice SharpestOfGroup::offer(const Frame& frame,
                                    const FrameTimes& times,
                                    std::uint64_t sequence) {
  if (times.end < from_) {
    return {};
  }
  ++counts_.seen;
  ++in_group_;
  compare(frame, times, sequence);
  return in_group_ == group_size_ ? finish_group() : StreamChoice{};
}

void SharpestOfGroup::compare(const Frame& frame, const FrameTimes& times, std::uint64_t sequence) {
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
    ++counts_.not_chosen;
    return;
  }
  Frame copy = copies_.copy(frame, sequence);
  if (copy.empty()) {
    ++counts_.no_buffer;
    return;
  }
  counts_.not_chosen += best_ ? 1U : 0U;
  best_ = TimedFrame{std::move(copy), times, sequence};
  best_sharpness_ = sharpness;
}

StreamChoice SharpestOfGroup::finish_group() {
  in_group_ = 0;
  StreamChoice choice;
  if (best_) {
    ++counts_.kept;
    choice.kept.push_back(*std::move(best_));
    best_.reset();
  }
  return choice;
}

StreamChoice SharpestOfGroup::end() {
  is_streaming_ = false;
  if (2 * in_group_ >= group_size_ || counts_.kept == 0) {
    return finish_group();
  }
  counts_.not_chosen += best_ ? 1U : 0U;
  best_.reset();
  return {};
}

}  // namespace trigmesh
