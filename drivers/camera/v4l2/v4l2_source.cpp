#include "drivers/camera/v4l2/v4l2_source.hpp"

#include <array>
#include <cerrno>
#include <utility>

#include <poll.h>

#include "drivers/camera/picture_in.hpp"
#include "drivers/camera/v4l2/agreed_format.hpp"
#include "drivers/camera/v4l2/camera_list.hpp"
#include "drivers/camera/v4l2/camera_mode.hpp"
#include "drivers/camera/v4l2/input_signal.hpp"

namespace trigmesh {
namespace {

constexpr std::size_t kFewestBuffers = 2;
constexpr std::size_t kMostBuffers = 32;  // VIDEO_MAX_FRAME

}  // namespace

Result<> V4l2Options::validate() const {
  if (wish.width_px <= 0 || wish.height_px <= 0 || !(wish.rate_hz > 0.0)) {
    return fail(ErrorCode::kInvalidArgument,
                "a camera cannot be asked for {} x {} pixels {} times a second",
                wish.width_px,
                wish.height_px,
                wish.rate_hz);
  }
  if (wish.format && fourcc_of(*wish.format) == 0) {
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

Result<std::unique_ptr<V4l2Source>> V4l2Source::create(V4l2Options options,
                                                       std::shared_ptr<Kernel> kernel,
                                                       const Clock& clock) {
  TM_RETURN_IF_ERROR(options.validate());
  std::unique_ptr<V4l2Source> source(new V4l2Source(std::move(options), std::move(kernel), clock));
  if (!source->stop_requested_.valid()) {
    return fail(ErrorCode::kIo, "cannot use a camera: the system has no file descriptors left");
  }
  return source;
}

V4l2Source::V4l2Source(V4l2Options options, std::shared_ptr<Kernel> kernel, const Clock& clock)
    : options_(std::move(options)), kernel_(std::move(kernel)), clock_(clock), controls_(kernel_) {
  info_.stable_name = options_.camera;
}

DeviceResult<> V4l2Source::start() {
  if (buffers_ != nullptr) {
    return {};
  }
  DeviceResult<> started = open_and_start();
  if (!started) {
    controls_.let_go();
    counters_.faults.add(started.error().kind);
  }
  return started;
}

DeviceResult<> V4l2Source::open_and_start() {
  TM_ASSIGN_OR_FAULT(const CameraNode node, find_camera(*kernel_, options_.camera));
  KernelFd device(kernel_, kernel_->open(node.path));
  if (!device.valid()) {
    return tl::unexpected<DeviceFault>(
        fault_of_errno(-device.get(), "cannot open camera", node.path));
  }
  watch_signal(*kernel_, device.get());
  TM_RETURN_IF_FAULT(check_signal(*kernel_, device.get(), node.path));
  const std::vector<CameraMode> modes = list_modes(*kernel_, device.get(), options_.wish);
  TM_ASSIGN_OR_FAULT(const CameraMode mode, choose_mode(modes, options_.wish, node.path));
  TM_ASSIGN_OR_FAULT(const AgreedFormat agreed,
                     agree_on_format(*kernel_, device.get(), mode, node.path));
  controls_.attach(device.get(), node.path);
  TM_RETURN_IF_FAULT(controls_.restore_lock());
  TM_ASSIGN_OR_FAULT(buffers_,
                     MappedBuffers::start(std::move(device), options_.buffer_count, node.path));
  options_.camera = node.stable_name;
  info_ = {.stable_name = node.stable_name,
           .model = node.model,
           .layout = agreed.layout,
           .frame_interval = agreed.frame_interval,
           .buffer_count = buffers_->count()};
  sequence_ = FrameSequence();
  missed_ = 0;
  last_timestamp_.reset();
  return {};
}

void V4l2Source::stop() {
  stop_requested_.clear();
  controls_.let_go();
  if (buffers_ != nullptr) {
    buffers_->end();
    buffers_.reset();
  }
}

FrameEvent V4l2Source::wait(std::chrono::nanoseconds timeout) {
  const std::chrono::nanoseconds deadline = deadline_after(clock_.now(), timeout);
  while (true) {
    if (stop_requested_.is_set()) {
      return WaitStopped{};
    }
    if (buffers_ == nullptr) {
      return refuse({FaultKind::kNotStarted, "cannot wait for a frame: the camera is not started"});
    }
    if (std::optional<FrameEvent> event = take()) {
      return *std::move(event);
    }
    if (std::optional<FrameEvent> event = wait_for_device(deadline)) {
      return *std::move(event);
    }
  }
}

std::optional<FrameEvent> V4l2Source::take() {
  DeviceResult<std::optional<FilledBuffer>> filled = buffers_->dequeue();
  if (!filled) {
    return refuse(std::move(filled).error());
  }
  if (!*filled) {
    return std::nullopt;
  }
  return deliver(**filled);
}

FrameEvent V4l2Source::deliver(const FilledBuffer& filled) {
  const FrameSequence::Place place = sequence_.place(filled.sequence);
  counters_.missed += place.missed_before;
  missed_ += place.missed_before;
  if (place.missed_before > 0) {
    counters_.faults.add(FaultKind::kGap);
  }
  const std::span<const std::uint8_t> memory = buffers_->memory(filled.slot);
  DeviceResult<std::span<const std::uint8_t>> picture = [&]() -> decltype(picture) {
    if (filled.is_damaged || filled.bytes_used > memory.size()) {
      return device_fault(FaultKind::kCorruptFrame, "the driver says that a frame is damaged");
    }
    return picture_in(memory.first(filled.bytes_used), info_.layout);
  }();
  if (!picture) {
    buffers_->give_back(filled.slot);
    return refuse(std::move(picture).error());
  }
  FrameInfo info;
  info.sequence = place.sequence;
  info.missed_before = std::exchange(missed_, 0);
  info.layout = info_.layout;
  info.exposure = controls_.held_exposure();
  stamp(filled, info);
  ++counters_.frames;
  return Frame(info, *picture, buffers_, filled.slot);
}

void V4l2Source::stamp(const FilledBuffer& filled, FrameInfo& info) {
  const std::chrono::nanoseconds now = clock_.now();
  const bool is_plausible = filled.timestamp && *filled.timestamp <= now &&
                            (!last_timestamp_ || *last_timestamp_ < *filled.timestamp);
  info.timestamp = is_plausible ? *filled.timestamp : now;
  info.moment = is_plausible ? filled.moment : FrameMoment::kReceived;
  last_timestamp_ = info.timestamp;
}

std::optional<FrameEvent> V4l2Source::wait_for_device(std::chrono::nanoseconds deadline) {
  const std::chrono::nanoseconds now = clock_.now();
  if (now >= deadline) {
    return refuse(silence());
  }
  // Also while frames hold all buffers: the first that is released is filled and wakes us.
  std::array<pollfd, 2> entries = {pollfd{stop_requested_.fd(), POLLIN, 0},
                                   pollfd{buffers_->fd(), POLLIN | POLLPRI, 0}};
  const int ready = kernel_->poll(entries, poll_milliseconds(deadline - now));
  if (ready < 0 && ready != -EINTR) {
    return refuse(fault_of_errno(-ready, "cannot wait for camera", info_.stable_name));
  }
  if (ready > 0 && (entries[1].revents & POLLPRI) != 0) {
    return look_at_signal();
  }
  if (ready <= 0 || (entries[1].revents & (POLLERR | POLLHUP | POLLNVAL)) == 0) {
    return std::nullopt;
  }
  // An error without a frame: the next call of the driver says which.
  if (std::optional<FrameEvent> event = take()) {
    return event;
  }
  return refuse({FaultKind::kIo,
                 fmt::format("the driver of camera {} reports an error and does not tell which",
                             info_.stable_name)});
}

std::optional<FrameEvent> V4l2Source::look_at_signal() {
  if (take_signal_changes(*kernel_, buffers_->fd())) {
    DeviceResult<> signal = check_signal(*kernel_, buffers_->fd(), info_.stable_name);
    if (!signal) {
      return refuse(std::move(signal).error());
    }
  }
  return std::nullopt;
}

DeviceFault V4l2Source::silence() const {
  if (buffers_->queued_count() == 0) {
    return {FaultKind::kTimeout,
            fmt::format("no frame from camera {} in the time given: all {} buffers are held by "
                        "frames that were not released",
                        info_.stable_name,
                        buffers_->count())};
  }
  return {FaultKind::kTimeout,
          fmt::format("no frame from camera {} in the time given", info_.stable_name)};
}

FrameEvent V4l2Source::refuse(DeviceFault fault) {
  counters_.faults.add(fault.kind);
  const bool goes_on = fault_policy(fault.kind).action == FaultAction::kContinue ||
                       fault.kind == FaultKind::kTimeout || fault.kind == FaultKind::kNotStarted;
  if (!goes_on) {
    // The device is let go at once, so that it can come back under its name.
    controls_.let_go();
    buffers_->end();
    buffers_.reset();
  }
  return fault;
}

}  // namespace trigmesh
