#include "drivers/camera/replay/replay_source.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <poll.h>

namespace trigmesh {
namespace {

bool has_all_timestamps(const Recording& recording) {
  return std::all_of(recording.frames().begin(),
                     recording.frames().end(),
                     [](const RecordedFrame& frame) { return frame.timestamp.has_value(); });
}

}  // namespace

Result<> ReplayOptions::validate() const {
  if (buffer_count == 0) {
    return fail(ErrorCode::kInvalidArgument, "buffer_count is 0, must be greater than 0");
  }
  return {};
}

Result<std::unique_ptr<ReplaySource>> ReplaySource::create(Recording recording,
                                                           const ReplayOptions& options,
                                                           const Clock& clock) {
  TM_RETURN_IF_ERROR(options.validate());
  if (options.pace == ReplayPace::kRecordedSpeed && !has_all_timestamps(recording)) {
    return fail(ErrorCode::kInvalidArgument,
                "cannot replay {} at recorded speed: it has no timestamps.csv",
                recording.frames().front().path.parent_path().string());
  }
  std::unique_ptr<ReplaySource> source(
      new ReplaySource(std::make_shared<const Recording>(std::move(recording)), options, clock));
  if (!source->stop_requested_.valid() || !source->pool_->returned().valid()) {
    return fail(ErrorCode::kIo, "cannot replay: the system has no file descriptors left");
  }
  return source;
}

ReplaySource::ReplaySource(std::shared_ptr<const Recording> recording,
                           const ReplayOptions& options,
                           const Clock& clock)
    : recording_(std::move(recording)),
      options_(options),
      clock_(clock),
      pool_(std::make_shared<SlotPool>(options.buffer_count, recording_)) {}

DeviceResult<> ReplaySource::start() {
  if (!is_running_) {
    is_running_ = true;
    next_index_ = 0;
    start_time_ = clock_.now();
  }
  return {};
}

void ReplaySource::stop() {
  is_running_ = false;
  stop_requested_.clear();
}

std::chrono::nanoseconds ReplaySource::due_time() const {
  if (options_.pace != ReplayPace::kRecordedSpeed) {
    return start_time_;
  }
  const std::vector<RecordedFrame>& frames = recording_->frames();
  return start_time_ + (*frames[next_index_].timestamp - *frames.front().timestamp);
}

std::optional<std::size_t> ReplaySource::take_slot() {
  if (options_.pace == ReplayPace::kLockStep && pool_->out_count() > 0) {
    return std::nullopt;
  }
  return pool_->take();
}

FrameEvent ReplaySource::wait(std::chrono::nanoseconds timeout) {
  const std::chrono::nanoseconds deadline = deadline_after(clock_.now(), timeout);
  while (true) {
    if (stop_requested_.is_set()) {
      return WaitStopped{};
    }
    if (!is_running_) {
      return refuse({FaultKind::kNotStarted, "cannot wait for a frame: replay is not started"});
    }
    if (next_index_ == recording_->size()) {
      return EndOfFrames{};
    }
    pool_->returned().clear();  // before looking, so that no return is missed
    const std::chrono::nanoseconds now = clock_.now();
    const std::chrono::nanoseconds due = due_time();
    if (now >= due) {
      if (const std::optional<std::size_t> slot = take_slot()) {
        return deliver(*slot);
      }
    }
    if (now >= deadline) {
      return refuse({FaultKind::kTimeout,
                     now < due ? "no frame of the recording was due in the time given"
                               : "no frame buffer was released in the time given"});
    }
    const std::chrono::nanoseconds until = now < due ? std::min(due, deadline) : deadline;
    std::array<pollfd, 2> entries = {pollfd{stop_requested_.fd(), POLLIN, 0},
                                     pollfd{pool_->returned().fd(), POLLIN, 0}};
    // A buffer that comes back before the next frame is due is no reason to wake up.
    const std::span<pollfd> polled(entries.data(), now < due ? 1U : 2U);
    if (const int ready = poll_until(polled, until - now, clock_); ready < 0) {
      return refuse(fault_of_errno(-ready, "cannot wait for", "frames of a recording"));
    }
  }
}

FrameEvent ReplaySource::deliver(std::size_t slot) {
  const std::size_t index = next_index_++;
  std::vector<std::uint8_t>& buffer = pool_->bytes(slot);
  auto bytes = recording_->read(index, std::move(buffer));
  if (!bytes) {
    buffer.clear();
    pool_->give_back(slot);
    const bool is_empty = bytes.error().code == ErrorCode::kCorruptData;
    return refuse({is_empty ? FaultKind::kShortFrame : FaultKind::kCorruptFrame,
                   std::move(bytes).error().message});
  }
  buffer = *std::move(bytes);
  const RecordedFrame& entry = recording_->frames()[index];
  FrameInfo info;
  info.name = entry.name;
  info.timestamp = entry.timestamp;
  info.sequence = index;
  info.layout.format = entry.format;
  ++counters_.frames;
  return Frame(info, buffer, pool_, slot);
}

FrameEvent ReplaySource::refuse(DeviceFault fault) {
  counters_.faults.add(fault.kind);
  return fault;
}

SourceInfo ReplaySource::info() const {
  const std::vector<RecordedFrame>& frames = recording_->frames();
  SourceInfo info;
  info.stable_name = frames.front().path.parent_path().string();
  info.model = "recording";
  info.layout.format = frames.front().format;
  if (frames.size() > 1 && frames.front().timestamp && frames.back().timestamp) {
    info.frame_interval = (*frames.back().timestamp - *frames.front().timestamp) /
                          static_cast<std::int64_t>(frames.size() - 1);
  }
  info.buffer_count = options_.pace == ReplayPace::kLockStep ? 1 : options_.buffer_count;
  return info;
}

}  // namespace trigmesh
