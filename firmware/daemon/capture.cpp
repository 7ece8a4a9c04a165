#include "firmware/daemon/capture.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "firmware/daemon/keyframe_stream.hpp"
#include "firmware/daemon/sharpest_of_group.hpp"

namespace trigmesh {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

/// Orders are looked at between frames; a camera that is silent holds them up no longer than this.
constexpr milliseconds kLongestWait(100);
/// So many damaged frames in a row are a fault of the camera.
constexpr std::uint64_t kMostDamaged = 30;
/// A record of the journal holds so many where no keyframe comes.
constexpr std::size_t kVerdictsPerRecord = 32;

std::string note_of(const StreamCounts& counts) {
  return fmt::format(
      "stream ended: {} frames seen, {} kept, {} not chosen, {} damaged, {} without a buffer",
      counts.seen,
      counts.kept,
      counts.not_chosen,
      counts.damaged,
      counts.no_buffer);
}

std::unique_ptr<StreamSelector> make_selector(const CaptureOptions& options, FrameCopies& copies) {
  if (options.group_size == 0) {
    return std::make_unique<KeyframeStream>(options.keyframes, copies);
  }
  return std::make_unique<SharpestOfGroup>(options.group_size, copies);
}

}  // namespace

Capture::Capture(const CaptureOptions& options, const CaptureParts& parts)
    : options_(options),
      parts_(parts),
      shelf_(options.stills, parts.copies),
      stream_(make_selector(options, parts.copies)),
      hold_(options.hold),
      interval_(options.frame_interval) {}

void Capture::run(const std::stop_token& stop, const std::function<void()>& on_first_try) {
  const std::stop_callback wake(stop, [this] { parts_.source.request_stop(); });
  while (!stop.stop_requested()) {
    parts_.heartbeat.beat();
    start_once(stop, on_first_try);
    if (!is_running_) {
      continue;
    }
    const Ending ending = take_frames(stop);
    is_running_ = false;
    parts_.source.stop();
    first_sequence_ = next_sequence_;
    if (ending == Ending::kEndOfFrames && !was_found_) {
      lose("the recording has no frame that can be read");
      wait_to_retry(stop, retries_.delay_after(FaultKind::kNoSignal));
    } else if (ending == Ending::kFault) {
      wait_to_retry(stop, retries_.delay_after(last_fault_.kind));
    }
  }
  parts_.source.stop();
}

void Capture::start_once(const std::stop_token& stop, const std::function<void()>& on_first_try) {
  const DeviceResult<> started = parts_.source.start();
  if (std::exchange(first_try_, false)) {
    on_first_try();
  }
  if (!started) {
    lose(started.error().message);
    wait_to_retry(stop, retries_.delay_after(started.error().kind));
    return;
  }
  is_running_ = true;
  was_found_ = false;
  const SourceInfo info = parts_.source.info();
  interval_ = info.frame_interval.count() > 0 ? info.frame_interval : options_.frame_interval;
  last_frame_ = parts_.clock.now();
  write_log(LogLevel::kDebug, "camera started", {{"camera", info.stable_name}});
  tell(hold_.on_camera_start(controls()));
  if (is_session_open_ && !hold_.is_holding()) {
    tell(hold_.hold(controls()));
  }
}

Capture::Ending Capture::take_frames(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    parts_.heartbeat.beat();
    do_orders();
    shelf_.on_time(parts_.clock.now());
    hand_out_stills();
    check_hold();
    if (const auto ending = use(parts_.source.wait(longest_wait()))) {
      return *ending;
    }
  }
  return Ending::kStopped;
}

std::chrono::nanoseconds Capture::longest_wait() const {
  const auto deadline = shelf_.deadline();
  const nanoseconds left = deadline ? *deadline - parts_.clock.now() : nanoseconds(kLongestWait);
  return std::clamp<nanoseconds>(left, milliseconds(1), kLongestWait);
}

std::optional<Capture::Ending> Capture::use(FrameEvent event) {
  if (const auto* frame = std::get_if<Frame>(&event)) {
    use_frame(*frame);
    return std::nullopt;
  }
  if (auto* fault = std::get_if<DeviceFault>(&event)) {
    return use_fault(std::move(*fault));
  }
  return std::holds_alternative<EndOfFrames>(event) ? Ending::kEndOfFrames : Ending::kStopped;
}

std::optional<Capture::Ending> Capture::use_fault(DeviceFault fault) {
  const nanoseconds silent = parts_.clock.now() - last_frame_;
  if (fault.kind == FaultKind::kTimeout && silent < options_.silence) {
    return std::nullopt;
  }
  if (fault_policy(fault.kind).action == FaultAction::kContinue) {
    found_damaged(fault);
    return std::nullopt;
  }
  // A camera that is only started anew is not lost until that did not help.
  const bool may_recover = fault_policy(fault.kind).action == FaultAction::kRestart;
  if (!may_recover || retries_.tries() > 0) {
    lose(fault.message);
  } else {
    write_log(LogLevel::kWarn, fmt::format("camera is started anew: {}", fault.message));
  }
  last_fault_ = std::move(fault);
  return Ending::kFault;
}

void Capture::found_damaged(const DeviceFault& fault) {
  if (fault.kind == FaultKind::kGap) {
    return;  // counted with the frame that follows
  }
  ++parts_.drops.corrupt;
  ++next_sequence_;
  last_frame_ = parts_.clock.now();
  if (++damaged_in_row_ == kMostDamaged) {
    lose(fmt::format("{} damaged frames in a row, the last: {}", kMostDamaged, fault.message));
  }
}

void Capture::use_frame(const Frame& frame) {
  const nanoseconds now = parts_.clock.now();
  last_frame_ = now;
  damaged_in_row_ = 0;
  const std::uint64_t sequence = first_sequence_ + frame.info().sequence;
  next_sequence_ = sequence + 1;
  parts_.drops.sensor += frame.info().missed_before;
  found();
  const FrameTimes times = times_of_frame(frame.info(), interval_, now);
  if (!shelf_.offer(frame, times, sequence)) {
    ++parts_.drops.queue;
  }
  if (stream_->is_streaming()) {
    offer_to_stream(frame, times, sequence);
  } else {
    hold_before_press(frame, times, sequence);
  }
}

void Capture::offer_to_stream(const Frame& frame, const FrameTimes& times, std::uint64_t sequence) {
  const std::uint64_t without_buffer = stream_->counts().no_buffer;
  stream_->offer(frame, times, sequence, choice_);
  hand_out_choice();
  parts_.drops.queue += stream_->counts().no_buffer - without_buffer;
}

/// The rig hears of every verdict at once, the journal of those up to a keyframe in one record.
void Capture::hand_out_choice() {
  for (const FrameJudged& judged : choice_.judged) {
    (void)parts_.rig.push(FrameSeen{session_, judged});
    verdicts_.push_back(judged);
  }
  choice_.judged.clear();
  for (TimedFrame& kept : choice_.kept) {
    parts_.storage.push(StreamFrameOrder{session_, std::move(kept)});
  }
  if (!choice_.kept.empty() || verdicts_.size() >= kVerdictsPerRecord) {
    record_verdicts();
  }
  choice_.kept.clear();
}

void Capture::record_verdicts() {
  if (!verdicts_.empty()) {
    parts_.storage.push(RecordOrder{session_, FramesJudged{verdicts_}});
    verdicts_.clear();
  }
}

/// The oldest goes first, so that its buffer can take the newest.
void Capture::hold_before_press(const Frame& frame,
                                const FrameTimes& times,
                                std::uint64_t sequence) {
  if (options_.pre_trigger_frames == 0) {
    return;
  }
  while (before_press_.size() >= options_.pre_trigger_frames) {
    before_press_.erase(before_press_.begin());
  }
  if (Frame copy = parts_.copies.copy(frame, sequence); !copy.empty()) {
    before_press_.push_back({std::move(copy), times, sequence});
  }
}

void Capture::lose(const std::string& message) {
  parts_.faults.report("camera", message);
  if (std::exchange(is_present_, false)) {
    (void)parts_.rig.push(CameraChanged{CameraPresence::kAway});
  }
}

void Capture::found() {
  retries_.reset();
  was_found_ = true;
  if (!std::exchange(is_present_, true)) {
    parts_.faults.clear("camera");
    (void)parts_.rig.push(CameraChanged{CameraPresence::kThere});
  }
}

void Capture::wait_to_retry(const std::stop_token& stop, nanoseconds delay) {
  const nanoseconds until = parts_.clock.now() + delay;
  while (!stop.stop_requested()) {
    parts_.heartbeat.beat();
    shelf_.on_time(parts_.clock.now());
    hand_out_stills();
    const nanoseconds left = until - parts_.clock.now();
    if (left.count() <= 0) {
      return;
    }
    if (auto order = parts_.orders.pop(stop, std::min<nanoseconds>(left, kLongestWait))) {
      std::visit([this](const auto& one) { do_order(one); }, *order);
    }
  }
}

void Capture::do_orders() {
  while (auto order = parts_.orders.try_pop()) {
    std::visit([this](const auto& one) { do_order(one); }, *order);
  }
}

void Capture::do_order(const BeginStream& order) {
  session_ = order.serial;
  stream_->begin(order.from);
  for (TimedFrame& held : before_press_) {
    // Its buffer is free before the next one is copied.
    const TimedFrame frame = std::move(held);
    offer_to_stream(frame.frame, frame.times, frame.sequence);
  }
  before_press_.clear();
}

void Capture::do_order(const EndStream& order) {
  tell(hold_.check(controls()));
  stream_->end(choice_);
  hand_out_choice();
  record_verdicts();
  parts_.storage.push(StreamDoneOrder{order.serial, note_of(stream_->counts())});
}

void Capture::do_order(const HoldCamera& order) {
  session_ = order.serial;
  is_session_open_ = true;
  last_hold_check_ = parts_.clock.now();
  tell(hold_.hold(controls()));
}

void Capture::do_order(const ReleaseCamera& /*order*/) {
  is_session_open_ = false;
  tell(hold_.release(controls()));
}

CameraControls* Capture::controls() {
  return is_running_ ? parts_.source.controls() : nullptr;
}

void Capture::check_hold() {
  const nanoseconds now = parts_.clock.now();
  if (hold_.is_holding() && now - last_hold_check_ >= options_.hold_check) {
    last_hold_check_ = now;
    tell(hold_.check(controls()));
  }
}

void Capture::tell(const std::vector<std::string>& sentences) {
  for (const std::string& sentence : sentences) {
    write_log(LogLevel::kWarn, fmt::format("camera: {}", sentence));
    parts_.storage.push(RecordOrder{session_, Note{sentence}});
  }
}

void Capture::hand_out_stills() {
  for (StillResult& result : shelf_.take_results()) {
    if (result.frame) {
      parts_.storage.push(StillFrameOrder{result.serial, result.ticket, *std::move(result.frame)});
      continue;
    }
    (void)parts_.rig.push(
        StillAnswered{result.serial,
                      result.ticket,
                      fail(ErrorCode::kInsufficientData, "no frame came from the camera in time")});
  }
}

}  // namespace trigmesh
