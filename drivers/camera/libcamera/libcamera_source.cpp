#include "drivers/camera/libcamera/libcamera_source.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <poll.h>

#include "drivers/camera/libcamera/drm_format.hpp"
#include "drivers/camera/picture_in.hpp"

namespace trigmesh {
namespace {

constexpr std::size_t kFewestBuffers = 3;
/// After this long without a frame it is looked whether the camera is still there.
constexpr std::chrono::nanoseconds kSilence = std::chrono::milliseconds(500);
constexpr std::size_t kMostBuffers = 32;  // of V4L2, on which pipelines stand

}  // namespace

Result<> LibcameraOptions::validate() const {
  if (wish.width_px <= 0 || wish.height_px <= 0 || !(wish.rate_hz > 0.0)) {
    return fail(ErrorCode::kInvalidArgument,
                "a camera cannot be asked for {} x {} pixels {} times a second",
                wish.width_px,
                wish.height_px,
                wish.rate_hz);
  }
  if (wish.format && drm_code_of(*wish.format) == 0) {
    return fail(ErrorCode::kInvalidArgument, "no camera delivers {}", to_string(*wish.format));
  }
  if (buffer_count < kFewestBuffers || buffer_count > kMostBuffers) {
    return fail(ErrorCode::kInvalidArgument,
                "buffer_count is {}, must be in [{}, {}]",
                buffer_count,
                kFewestBuffers,
                kMostBuffers);
  }
  return {};
}

Result<std::unique_ptr<LibcameraSource>> LibcameraSource::create(LibcameraOptions options,
                                                                 const Clock& clock) {
  TM_RETURN_IF_ERROR(options.validate());
  std::unique_ptr<LibcameraSource> source(new LibcameraSource(std::move(options), clock));
  if (!source->stop_requested_.valid()) {
    return fail(ErrorCode::kIo, "cannot use a camera: the system has no file descriptors left");
  }
  return source;
}

LibcameraSource::LibcameraSource(LibcameraOptions options, const Clock& clock)
    : options_(std::move(options)), clock_(clock), controls_(clock) {
  info_.stable_name = options_.camera;
}

DeviceResult<> LibcameraSource::start() {
  if (stream_ != nullptr) {
    return {};
  }
  DeviceResult<> started = open_and_start();
  if (!started) {
    close();
    counters_.faults.add(started.error().kind);
  }
  return started;
}

DeviceResult<> LibcameraSource::open_and_start() {
  if (is_abandoned_) {
    return device_fault(FaultKind::kDisconnected,
                        "camera {} went without libcamera noticing, which cannot open it again; "
                        "connect it and restart the program",
                        info_.stable_name);
  }
  if (hub_ == nullptr) {
    TM_ASSIGN_OR_FAULT(hub_, CameraHub::open());
  }
  TM_ASSIGN_OR_FAULT(const LibcameraCamera camera, hub_->find(options_.camera));
  TM_ASSIGN_OR_FAULT(stream_,
                     CameraStream::start(*hub_,
                                         camera.stable_name,
                                         {.wish = options_.wish,
                                          .use = options_.use,
                                          .buffer_count = options_.buffer_count,
                                          .controls = controls_.held()}));
  options_.camera = camera.stable_name;
  info_ = {.stable_name = camera.stable_name,
           .model = camera.model,
           .layout = stream_->layout(),
           .frame_interval = stream_->frame_interval(),
           .buffer_count = stream_->exchange()->count()};
  controls_.attach(*stream_, camera.stable_name);
  TM_RETURN_IF_FAULT(restore_lock());
  sequence_ = FrameSequence();
  missed_ = 0;
  last_timestamp_.reset();
  return {};
}

DeviceResult<> LibcameraSource::restore_lock() {
  if (controls_.held().empty()) {
    return {};
  }
  TM_RETURN_IF_FAULT(controls_.restore_lock());
  stream_->exchange()->discard_filled();  // taken before the lock held again
  return {};
}

void LibcameraSource::close() {
  controls_.let_go();
  if (stream_ == nullptr) {
    return;
  }
  stream_->end();
  if (stream_->is_abandoned()) {
    // Left alive on purpose, with their hub: libcamera can neither stop nor forget such a camera,
    // and ends the process when it is made to.
    is_abandoned_ = true;
    (void)stream_.release();
    (void)hub_.release();
  } else if (stream_->exchange()->is_gone()) {
    gone_stream_ = std::move(stream_);
  }
  stream_.reset();
}

void LibcameraSource::stop() {
  stop_requested_.clear();
  close();
}

FrameEvent LibcameraSource::wait(std::chrono::nanoseconds timeout) {
  const std::chrono::nanoseconds deadline = deadline_after(clock_.now(), timeout);
  while (true) {
    if (stop_requested_.is_set()) {
      return WaitStopped{};
    }
    if (stream_ == nullptr) {
      return refuse({FaultKind::kNotStarted, "cannot wait for a frame: the camera is not started"});
    }
    stream_->exchange()->ready().clear();  // before looking: what comes now sets it again
    if (const std::optional<FilledSlot> filled = stream_->exchange()->take()) {
      return deliver(*filled);
    }
    if (stream_->exchange()->is_gone()) {
      return refuse(
          {FaultKind::kDisconnected, fmt::format("camera {} was unplugged", info_.stable_name)});
    }
    if (std::optional<FrameEvent> event = wait_for_device(deadline)) {
      return *std::move(event);
    }
  }
}

FrameEvent LibcameraSource::deliver(const FilledSlot& filled) {
  const FrameSequence::Place place = sequence_.place(filled.sequence);
  counters_.missed += place.missed_before;
  missed_ += place.missed_before;
  if (place.missed_before > 0) {
    counters_.faults.add(FaultKind::kGap);
  }
  const std::shared_ptr<FrameExchange>& exchange = stream_->exchange();
  const std::span<const std::uint8_t> memory = exchange->memory(filled.slot);
  DeviceResult<std::span<const std::uint8_t>> picture = [&]() -> decltype(picture) {
    if (filled.is_damaged || filled.bytes_used > memory.size()) {
      return device_fault(FaultKind::kCorruptFrame, "libcamera says that a frame is damaged");
    }
    return picture_in(memory.first(filled.bytes_used), info_.layout);
  }();
  if (!picture) {
    exchange->give_back(filled.slot);
    return refuse(std::move(picture).error());
  }
  const FrameStamp stamp = choose_stamp(filled.times, clock_.now(), last_timestamp_);
  last_timestamp_ = stamp.time;
  FrameInfo info;
  info.timestamp = stamp.time;
  info.moment = stamp.moment;
  info.sequence = place.sequence;
  info.missed_before = std::exchange(missed_, 0);
  info.layout = info_.layout;
  info.exposure = filled.exposure;
  info.gain = filled.gain;
  ++counters_.frames;
  return Frame(info, *picture, exchange, filled.slot);
}

std::optional<FrameEvent> LibcameraSource::wait_for_device(std::chrono::nanoseconds deadline) {
  const std::chrono::nanoseconds now = clock_.now();
  if (now >= deadline) {
    return refuse(silence());
  }
  std::array<pollfd, 2> entries = {pollfd{stop_requested_.fd(), POLLIN, 0},
                                   pollfd{stream_->exchange()->ready().fd(), POLLIN, 0}};
  const int ready = poll_until(entries, std::min(deadline - now, kSilence), clock_);
  if (ready == 0) {
    stream_->notice_loss();
  }
  if (ready < 0) {
    return refuse(fault_of_errno(-ready, "cannot wait for camera", info_.stable_name));
  }
  return std::nullopt;
}

DeviceFault LibcameraSource::silence() const {
  const FrameExchange& exchange = *stream_->exchange();
  if (exchange.queued_count() == 0) {
    return {FaultKind::kTimeout,
            fmt::format("no frame from camera {} in the time given: all {} buffers are held by "
                        "frames that were not released",
                        info_.stable_name,
                        exchange.count())};
  }
  return {FaultKind::kTimeout,
          fmt::format("no frame from camera {} in the time given", info_.stable_name)};
}

FrameEvent LibcameraSource::refuse(DeviceFault fault) {
  counters_.faults.add(fault.kind);
  const bool goes_on = fault_policy(fault.kind).action == FaultAction::kContinue ||
                       fault.kind == FaultKind::kTimeout || fault.kind == FaultKind::kNotStarted;
  if (!goes_on) {
    // The camera is let go at once, so that it can come back under its name.
    close();
  }
  return fault;
}

}  // namespace trigmesh
