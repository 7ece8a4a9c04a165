#include "firmware/daemon/live_mapper.hpp"

#include <utility>

#include <malloc.h>
#include <signal.h>

#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/daemon/background_thread.hpp"
#include "firmware/daemon/logging.hpp"
#include "firmware/photos/session_options.hpp"

namespace trigmesh {
namespace {

MapFollowing following_of(SequenceFollowing following) {
  switch (following) {
    case SequenceFollowing::kWaiting:
      return MapFollowing::kWaiting;
    case SequenceFollowing::kTracked:
      return MapFollowing::kTracked;
    case SequenceFollowing::kLost:
      break;
  }
  return MapFollowing::kLost;
}

}  // namespace

LiveMapper::LiveMapper(LiveMapperOptions options, const Clock& clock, OnFollowed on_followed)
    : options_(std::move(options)),
      clock_(clock),
      on_followed_(std::move(on_followed)),
      thread_([this](const std::stop_token& end) { serve(end); }) {
  TM_CHECK(options_.max_waiting > 0);
}

LiveMapper::~LiveMapper() = default;  // the thread is asked to stop, and joined

void LiveMapper::follow(CaptureNews news) {
  {
    const std::lock_guard lock(mutex_);
    if (const auto* begin = std::get_if<CaptureBegan>(&news)) {
      told_id_ = begin->session_id;
      unfinished_.insert(told_id_);
      overrun_ = false;
    } else if (std::holds_alternative<CaptureFrame>(news)) {
      if (waiting_ >= options_.max_waiting) {
        overrun_ = true;
      }
      if (overrun_) {
        return;
      }
      ++waiting_;
    }
    news_.push_back(std::move(news));
  }
  changed_.notify_all();
}

void LiveMapper::wait_for_end(const std::string& session_id, const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  (void)changed_.wait(lock, stop, [&] { return !unfinished_.contains(session_id); });
}

void LiveMapper::serve(const std::stop_token& end) {
  become_background_thread("tm-live", options_.nice);
  end_ = end;
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, end, [this] { return !news_.empty(); })) {
    const CaptureNews news = std::move(news_.front());
    news_.pop_front();
    waiting_ -= std::holds_alternative<CaptureFrame>(news) ? 1U : 0U;
    lock.unlock();
    std::visit([this](const auto& one) { hear(one); }, news);
    ++progress_count_;
    lock.lock();
    changed_.notify_all();
  }
}

void LiveMapper::hear(const CaptureBegan& news) {
  walk_ = {news, {}, nullptr};
  if (const auto begun = begin_following(); !begun) {
    give_up(begun.error().message);
  }
}

Result<> LiveMapper::begin_following() {
  ReconstructionOptions options = options_.reconstruction;
  TM_ASSIGN_OR_RETURN(options.cameras,
                      cameras_of_profile(walk_.begin.camera_profile, walk_.begin.session_id));
  TM_ASSIGN_OR_RETURN(walk_.follower, WalkFollower::create(options, walk_.begin.work_folder, end_));
  return {};
}

void LiveMapper::hear(const CaptureFrame& news) {
  if (!walk_.follower) {
    return;
  }
  if (is_overrun()) {
    give_up(fmt::format("{} frames wait", options_.max_waiting));
    return;
  }
  const std::chrono::nanoseconds begin = clock_.now();
  walk_.frames.push_back(news);
  const auto state = add(news);
  if (!state) {
    give_up(state.error().message);
    return;
  }
  tell(news, *state, clock_.now() - begin);
}

Result<WalkState> LiveMapper::add(const CaptureFrame& frame) {
  return walk_.follower->add(frame.file.filename().string(), frame.file);
}

/// As if the frame had never been taken: all others again, from what is in the work folder.
void LiveMapper::hear(const CaptureUndone& /*news*/) {
  if (!walk_.follower || walk_.frames.empty()) {
    return;
  }
  walk_.frames.pop_back();
  walk_.follower.reset();
  if (const auto begun = begin_following(); !begun) {
    give_up(begun.error().message);
    return;
  }
  for (const CaptureFrame& frame : walk_.frames) {
    if (const auto state = add(frame); !state) {
      give_up(state.error().message);
      return;
    }
  }
}

void LiveMapper::hear(const CaptureEnded& /*news*/) {
  const std::string id = walk_.begin.session_id;
  walk_ = {};
  ::malloc_trim(0);
  const std::lock_guard lock(mutex_);
  if (const auto found = unfinished_.find(id); found != unfinished_.end()) {
    unfinished_.erase(found);
  }
}

void LiveMapper::give_up(const std::string& why) {
  walk_.follower.reset();
  if (!end_.stop_requested()) {
    write_log(LogLevel::kWarn,
              fmt::format("the capture is not mapped while it goes on, but afterwards: {}", why),
              {{"session", walk_.begin.session_id}});
  }
}

void LiveMapper::tell(const CaptureFrame& frame,
                      const WalkState& state,
                      std::chrono::nanoseconds duration) {
  if (on_followed_) {
    on_followed_({walk_.begin.session_id,
                  {frame.number,
                   following_of(state.following),
                   duration,
                   static_cast<std::uint32_t>(waiting_count())},
                  state.photographs,
                  state.tracked,
                  state.closes_loop});
  }
}

bool LiveMapper::is_overrun() const {
  const std::lock_guard lock(mutex_);
  return overrun_ && told_id_ == walk_.begin.session_id;
}

std::size_t LiveMapper::waiting_count() const {
  const std::lock_guard lock(mutex_);
  return waiting_;
}

}  // namespace trigmesh
