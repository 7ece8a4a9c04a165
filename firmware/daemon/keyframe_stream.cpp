#include "firmware/daemon/keyframe_stream.hpp"

#include <algorithm>
#include <utility>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

KeyframeSelector valid_selector(const KeyframeOptions& options) {
  auto selector = KeyframeSelector::create(options);
  TM_CHECK(selector.has_value());
  return *std::move(selector);
}

}  // namespace

std::size_t most_waiting_keyframes(const KeyframeOptions& options,
                                   std::chrono::nanoseconds frame_interval) {
  // A stretch, and what is looked through before and after it for a sharper frame.
  const std::chrono::nanoseconds longest = options.stretch + 2 * options.patience;
  return static_cast<std::size_t>(longest / frame_interval) + 3;
}

KeyframeStream::KeyframeStream(const KeyframeOptions& options, FrameCopies& copies)
    : selector_(valid_selector(options)), copies_(copies) {}

void KeyframeStream::begin(std::chrono::nanoseconds from) {
  (void)selector_.finish();  // begins anew
  held_.clear();
  is_streaming_ = true;
  from_ = from;
  size_ = {};
  last_time_ = std::chrono::nanoseconds::min();
  counts_ = {};
}

void KeyframeStream::offer(const Frame& frame,
                           const FrameTimes& times,
                           std::uint64_t sequence,
                           StreamChoice& choice) {
  if (times.end < from_) {
    return;
  }
  ++counts_.seen;
  const Result<> reduced = reducer_.reduce(frame.info().layout, frame.bytes());
  const cv::Mat& grey = reducer_.grey();
  if (!reduced || (!size_.empty() && grey.size() != size_) || times.middle <= last_time_) {
    ++counts_.damaged;
    return;
  }
  size_ = grey.size();
  last_time_ = times.middle;
  Frame copy = copies_.copy(frame, sequence);
  if (copy.empty()) {
    ++counts_.no_buffer;
    return;
  }
  held_.push_back({std::move(copy), times, sequence});
  carry_out(selector_.offer({sequence, times.middle, grey}), choice);
}

void KeyframeStream::end(StreamChoice& choice) {
  is_streaming_ = false;
  carry_out(selector_.finish(), choice);
  held_.clear();
}

void KeyframeStream::carry_out(std::span<const FrameDecision> decisions, StreamChoice& choice) {
  for (const FrameDecision& decision : decisions) {
    TimedFrame frame = take_held(decision.id);
    choice.judged.push_back({decision.id, frame.times.middle, decision.verdict, decision.measures});
    if (decision.verdict == FrameVerdict::kKept) {
      ++counts_.kept;
      choice.kept.push_back(std::move(frame));
    } else {
      ++counts_.not_chosen;
    }
  }
  std::sort(choice.kept.begin(), choice.kept.end(), [](const TimedFrame& a, const TimedFrame& b) {
    return a.sequence < b.sequence;
  });
}

TimedFrame KeyframeStream::take_held(std::uint64_t sequence) {
  const auto found = std::find_if(held_.begin(), held_.end(), [&](const TimedFrame& held) {
    return held.sequence == sequence;
  });
  TM_CHECK(found != held_.end());
  TimedFrame frame = std::move(*found);
  held_.erase(found);
  return frame;
}

}  // namespace trigmesh
