#include "firmware/session/press_detector.hpp"

#include <algorithm>
#include <utility>

#include "firmware/base/check.hpp"

namespace trigmesh {

using std::chrono::nanoseconds;

Result<> PressOptions::validate() const {
  if (long_press.count() <= 0 || double_press.count() < 0) {
    return fail(ErrorCode::kInvalidArgument,
                "long_press ({} ns) must be longer than 0, double_press ({} ns) 0 or longer",
                long_press.count(),
                double_press.count());
  }
  return {};
}

PressDetector::PressDetector(const PressOptions& options) : options_(options) {
  TM_CHECK(options.validate().has_value());
}

std::optional<nanoseconds> PressDetector::deadline() const {
  if (down_since_) {
    return long_told_ ? std::nullopt : std::optional(*down_since_ + options_.long_press);
  }
  return waiting_press_ ? std::optional(waiting_since_ + options_.double_press) : std::nullopt;
}

std::vector<Press> PressDetector::on_time(nanoseconds now) {
  last_time_ = std::max(last_time_, now);
  std::vector<Press> presses;
  if (down_since_ && !long_told_ && last_time_ - *down_since_ >= options_.long_press) {
    if (waiting_press_) {  // the first was a press of its own after all
      presses.push_back({PressKind::kShort, *std::exchange(waiting_press_, std::nullopt)});
    }
    presses.push_back({PressKind::kLong, *down_since_});
    long_told_ = true;
  }
  // Later than the limit: a press exactly then still makes it double.
  if (!down_since_ && waiting_press_ && last_time_ - waiting_since_ > options_.double_press) {
    presses.push_back({PressKind::kShort, *std::exchange(waiting_press_, std::nullopt)});
  }
  return presses;
}

std::vector<Press> PressDetector::on_edge(const EdgeRecord& edge) {
  const nanoseconds time = std::max(edge.kernel_time, last_time_);
  std::vector<Press> presses = on_time(time);
  if (edge.direction == EdgeDirection::kPress) {
    if (down_since_) {  // its release was lost
      end_press(time, presses);
    }
    presses.push_back({PressKind::kDown, time});
    down_since_ = time;
    long_told_ = false;
  } else if (down_since_) {
    end_press(time, presses);
  } else {
    ++stray_edges_;
  }
  return presses;
}

void PressDetector::end_press(nanoseconds release, std::vector<Press>& presses) {
  const nanoseconds pressed = *std::exchange(down_since_, std::nullopt);
  presses.push_back({PressKind::kUp, release});
  if (long_told_) {
    return;
  }
  if (waiting_press_) {
    presses.push_back({PressKind::kDouble, *std::exchange(waiting_press_, std::nullopt)});
  } else if (options_.double_press.count() == 0) {
    presses.push_back({PressKind::kShort, pressed});
  } else {
    waiting_press_ = pressed;
    waiting_since_ = release;
  }
}

}  // namespace trigmesh
