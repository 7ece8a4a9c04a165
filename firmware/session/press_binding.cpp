#include "firmware/session/press_binding.hpp"

#include <algorithm>

#include "firmware/base/check.hpp"

namespace trigmesh {

using std::chrono::nanoseconds;

Result<> PressBindingOptions::validate() const {
  if (wait.count() <= 0 || history == 0 || reorder >= history) {
    return fail(ErrorCode::kInvalidArgument,
                "wait ({} ns) and history ({}) must be greater than 0, reorder ({}) less than "
                "history",
                wait.count(),
                history,
                reorder);
  }
  return {};
}

PressBinder::PressBinder(const PressBindingOptions& options) : options_(options) {
  TM_CHECK(options.validate().has_value());
}

std::vector<BoundPress> PressBinder::on_frame(const Exposure& frame) {
  TM_CHECK(frame.begin <= frame.end);
  const auto seen_at = std::lower_bound(seen_.begin(), seen_.end(), frame.sequence);
  const bool is_again = seen_at != seen_.end() && *seen_at == frame.sequence;
  const bool is_too_old = seen_at == seen_.begin() && seen_.size() == options_.history;
  if (is_again || is_too_old) {
    return {};
  }
  seen_.insert(seen_at, frame.sequence);
  const auto place = std::lower_bound(
      frames_.begin(),
      frames_.end(),
      frame.sequence,
      [](const Exposure& a, std::uint64_t sequence) { return a.sequence < sequence; });
  frames_.insert(place, frame);
  newest_sequence_ = std::max(newest_sequence_.value_or(0), frame.sequence);
  while (seen_.size() > options_.history) {
    seen_.pop_front();
  }
  std::vector<BoundPress> bound = bind_certain();
  while (frames_.size() > options_.history) {
    frames_.pop_front();
  }
  return bound;
}

std::vector<BoundPress> PressBinder::on_press(nanoseconds time) {
  presses_.push_back(presses_.empty() ? time : std::max(time, presses_.back()));
  return bind_certain();
}

std::vector<BoundPress> PressBinder::on_time(nanoseconds now) {
  std::vector<BoundPress> answers;
  while (!presses_.empty() && now - presses_.front() > options_.wait) {
    // A frame that was held back only because an earlier one might come is better than none.
    if (const auto bound = bind_oldest(Patience::kTakeWhatIsThere)) {
      answers.push_back(*bound);
    } else {
      answers.push_back({presses_.front(), std::nullopt});
      presses_.pop_front();
    }
  }
  return answers;
}

std::vector<BoundPress> PressBinder::finish() {
  std::vector<BoundPress> answers;
  while (const auto bound = bind_oldest(Patience::kTakeWhatIsThere)) {
    answers.push_back(*bound);
  }
  for (const nanoseconds time : presses_) {
    answers.push_back({time, std::nullopt});
  }
  presses_.clear();
  frames_.clear();
  seen_.clear();
  newest_sequence_.reset();
  return answers;
}

std::optional<nanoseconds> PressBinder::deadline() const {
  return presses_.empty() ? std::nullopt : std::optional(presses_.front() + options_.wait);
}

/// Whether the frame before this one is missing and may still arrive. Frames before that one do not
/// matter: if it was exposed before the press, so were they.
bool PressBinder::may_come_earlier(std::size_t index) const {
  const std::uint64_t sequence = frames_[index].sequence;
  return sequence > 0 && *newest_sequence_ - sequence < options_.reorder &&
         !std::binary_search(seen_.begin(), seen_.end(), sequence - 1);
}

std::vector<BoundPress> PressBinder::bind_certain() {
  std::vector<BoundPress> answers;
  while (const auto bound = bind_oldest(Patience::kWaitForMissing)) {
    answers.push_back(*bound);
  }
  return answers;
}

std::optional<BoundPress> PressBinder::bind_oldest(Patience patience) {
  if (presses_.empty()) {
    return std::nullopt;
  }
  const nanoseconds press = presses_.front();
  const auto frame = std::find_if(frames_.begin(), frames_.end(), [&](const Exposure& candidate) {
    return candidate.end >= press;
  });
  if (frame == frames_.end() ||
      (patience == Patience::kWaitForMissing &&
       may_come_earlier(static_cast<std::size_t>(frame - frames_.begin())))) {
    return std::nullopt;
  }
  const BoundPress bound{press, frame->sequence};
  presses_.pop_front();
  frames_.erase(frames_.begin(), frame + 1);  // later presses need later frames
  return bound;
}

}  // namespace trigmesh
