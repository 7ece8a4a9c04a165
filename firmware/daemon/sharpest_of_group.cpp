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

void SharpestOfGroup::offer(const Frame& frame,
                            const FrameTimes& times,
                            std::uint64_t sequence,
                            StreamChoice& choice) {
  if (times.end < from_) {
    return;
  }
  ++counts_.seen;
  ++in_group_;
  compare(frame, times, sequence);
  if (in_group_ == group_size_) {
    finish_group(choice);
  }
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

void SharpestOfGroup::finish_group(StreamChoice& choice) {
  in_group_ = 0;
  if (best_) {
    ++counts_.kept;
    choice.kept.push_back(*std::move(best_));
    best_.reset();
  }
}

void SharpestOfGroup::end(StreamChoice& choice) {
  is_streaming_ = false;
  if (2 * in_group_ >= group_size_ || counts_.kept == 0) {
    finish_group(choice);
    return;
  }
  counts_.not_chosen += best_ ? 1U : 0U;
  best_.reset();
}

}  // namespace trigmesh
