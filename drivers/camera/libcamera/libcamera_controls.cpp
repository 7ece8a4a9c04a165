#include "drivers/camera/libcamera/libcamera_controls.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <poll.h>

#include "drivers/camera/libcamera/control_units.hpp"

namespace trigmesh {
namespace {

using std::chrono::nanoseconds;

constexpr std::array<ControlId, 8> kAll = {
    ControlId::kExposureAuto,
    ControlId::kExposure,
    ControlId::kGainAuto,
    ControlId::kGain,
    ControlId::kWhiteBalanceAuto,
    ControlId::kWhiteBalance,
    ControlId::kFocusAuto,
    ControlId::kFocus,
};

/// A sensor takes a value two or three frames after its request, a lens some more.
constexpr int kSettlingFrames = 12;
/// After this long without a frame it is looked whether the camera is still there.
constexpr nanoseconds kSilence = std::chrono::milliseconds(500);
/// Only a camera that hangs needs all of it.
constexpr std::chrono::seconds kPatience{5};

/// Pictures that nobody takes go back to the camera meanwhile, so that it does not stand still.
class RenewWhile {
 public:
  explicit RenewWhile(FrameExchange& exchange) : exchange_(exchange) {
    exchange_.set_when_full(FullExchange::kRenew);
  }

  ~RenewWhile() { exchange_.set_when_full(FullExchange::kKeep); }

  RenewWhile(const RenewWhile&) = delete;
  RenewWhile& operator=(const RenewWhile&) = delete;
  RenewWhile(RenewWhile&&) = delete;
  RenewWhile& operator=(RenewWhile&&) = delete;

 private:
  FrameExchange& exchange_;
};

}  // namespace

void LibcameraControls::attach(CameraStream& stream, std::string camera) {
  stream_ = &stream;
  camera_ = std::move(camera);
  taken_ = {};
}

DeviceResult<ControlRange> LibcameraControls::need(ControlId id) {
  if (stream_ == nullptr) {
    return device_fault(FaultKind::kNotStarted,
                        "cannot use the control '{}': the camera is not started",
                        to_string(id));
  }
  if (const std::optional<ControlRange> range = stream_->range(id)) {
    return *range;
  }
  return device_fault(FaultKind::kControlRefused,
                      "cannot use the control '{}' of camera {}: it has no such control",
                      to_string(id),
                      camera_);
}

DeviceResult<std::vector<ControlRange>> LibcameraControls::list() {
  std::vector<ControlRange> ranges;
  for (const ControlId id : kAll) {
    if (DeviceResult<ControlRange> range = need(id)) {
      ranges.push_back(*range);
    } else if (range.error().kind != FaultKind::kControlRefused) {
      return tl::unexpected<DeviceFault>(std::move(range).error());
    }
  }
  return ranges;
}

DeviceResult<std::int64_t> LibcameraControls::get(ControlId id) {
  TM_ASSIGN_OR_FAULT(const ControlRange range, need(id));
  FrameExchange::Progress progress = stream_->exchange()->progress();
  if (progress.filled_count == 0) {
    TM_ASSIGN_OR_FAULT(progress, wait_for_frame(0, clock_.now() + kPatience));
  }
  const std::optional<Taken>& taken = taken_[static_cast<std::size_t>(id)];
  const std::optional<std::int64_t>& told = progress.controls[id];
  if (id == ControlId::kWhiteBalance && progress.controls.blue_gain) {
    blue_gain_ = *progress.controls.blue_gain;
  }
  if (!told) {
    return taken ? taken->taken : range.standard;
  }
  // The last digit wavers from frame to frame where a camera computes what it tells.
  return taken && is_taken(id, taken->taken, *told) ? taken->taken : *told;
}

DeviceResult<std::int64_t> LibcameraControls::set(ControlId id, std::int64_t value) {
  TM_ASSIGN_OR_FAULT(const ControlRange range, need(id));
  if (value < range.minimum || value > range.maximum) {
    return device_fault(FaultKind::kControlRefused,
                        "cannot set the control '{}' of camera {} to {}: it takes {} to {}",
                        to_string(id),
                        camera_,
                        value,
                        range.minimum,
                        range.maximum);
  }
  const std::uint64_t round = stream_->send({{id, value}, blue_gain_});
  TM_ASSIGN_OR_FAULT(const std::int64_t taken, settle(round, id, value));
  if (is_automatism(id) && taken != value) {
    return device_fault(FaultKind::kControlRefused,
                        "camera {} does not switch its control '{}' {}",
                        camera_,
                        to_string(id),
                        value != 0 ? "on" : "off");
  }
  std::optional<Taken>& last = taken_[static_cast<std::size_t>(id)];
  // The same wish again: what it was then, not the last digit of now.
  if (!last || last->asked != value || !is_taken(id, last->taken, taken)) {
    last = Taken{value, taken};
  }
  return last->taken;
}

DeviceResult<std::int64_t> LibcameraControls::settle(std::uint64_t round,
                                                     ControlId id,
                                                     std::int64_t value) {
  FrameExchange& exchange = *stream_->exchange();
  const RenewWhile renewing(exchange);
  const nanoseconds deadline = clock_.now() + kPatience;
  std::uint64_t count = exchange.progress().filled_count;
  for (int frames_with_it = 0; true;) {
    TM_ASSIGN_OR_FAULT(const FrameExchange::Progress progress, wait_for_frame(count, deadline));
    count = progress.filled_count;
    if (progress.control_round < round) {
      continue;
    }
    const std::optional<std::int64_t>& told = progress.controls[id];
    if (!told || is_taken(id, value, *told)) {
      // Asked for 10000 and told 9987 is 9987; told nothing is believed.
      return told.value_or(value);
    }
    if (++frames_with_it >= kSettlingFrames) {
      return *told;
    }
  }
}

DeviceResult<FrameExchange::Progress> LibcameraControls::wait_for_frame(std::uint64_t count,
                                                                        nanoseconds deadline) {
  FrameExchange& exchange = *stream_->exchange();
  while (true) {
    exchange.ready().clear();
    const FrameExchange::Progress progress = exchange.progress();
    if (exchange.is_gone()) {
      return device_fault(FaultKind::kDisconnected, "camera {} was unplugged", camera_);
    }
    if (progress.filled_count > count) {
      return progress;
    }
    const nanoseconds now = clock_.now();
    if (now >= deadline) {
      return device_fault(FaultKind::kTimeout,
                          "no frame from camera {} shows its controls; {} of {} buffers are held "
                          "by frames that were not released",
                          camera_,
                          exchange.count() - exchange.queued_count(),
                          exchange.count());
    }
    std::array<pollfd, 1> entries = {pollfd{exchange.ready().fd(), POLLIN, 0}};
    const int ready = poll_until(entries, std::min(deadline - now, kSilence), clock_);
    if (ready == 0) {
      stream_->notice_loss();
    }
    if (ready < 0) {
      return tl::unexpected<DeviceFault>(fault_of_errno(-ready, "cannot wait for camera", camera_));
    }
  }
}

std::vector<SentControl> LibcameraControls::held() const {
  std::vector<SentControl> sent;
  for (const ControlValue& value : lock_.held()) {
    sent.push_back({value, blue_gain_});
  }
  return sent;
}

}  // namespace trigmesh
