#include "drivers/camera/v4l2/v4l2_controls.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include <linux/videodev2.h>

namespace trigmesh {
namespace {

struct ControlCode {
  ControlId id;
  std::uint32_t code;
  /// Ours is the driver's times this: V4L2 counts exposure in 100 microseconds.
  std::int64_t scale;
};

constexpr std::array<ControlCode, 8> kCodes = {{
    {ControlId::kExposureAuto, V4L2_CID_EXPOSURE_AUTO, 1},
    {ControlId::kExposure, V4L2_CID_EXPOSURE_ABSOLUTE, 100},
    {ControlId::kGainAuto, V4L2_CID_AUTOGAIN, 1},
    {ControlId::kGain, V4L2_CID_GAIN, 1},
    {ControlId::kWhiteBalanceAuto, V4L2_CID_AUTO_WHITE_BALANCE, 1},
    {ControlId::kWhiteBalance, V4L2_CID_WHITE_BALANCE_TEMPERATURE, 1},
    {ControlId::kFocusAuto, V4L2_CID_FOCUS_AUTO, 1},
    {ControlId::kFocus, V4L2_CID_FOCUS_ABSOLUTE, 1},
}};

const ControlCode& code_of(ControlId id) {
  return kCodes[static_cast<std::size_t>(id)];
}

/// EINVAL and ERANGE are about the value, EACCES and EBUSY about a control that something else
/// steers now; the rest is about the device.
tl::unexpected<DeviceFault> refused(int error, ControlId id, const std::string& camera) {
  const std::string what = fmt::format("the control '{}' of camera {}", to_string(id), camera);
  DeviceFault fault = fault_of_errno(-error, "cannot use", what);
  if (error == -EINVAL || error == -ERANGE || error == -EACCES || error == -EBUSY) {
    fault.kind = FaultKind::kControlRefused;
  }
  return tl::unexpected<DeviceFault>(std::move(fault));
}

}  // namespace

void V4l2Controls::attach(int fd, std::string camera) {
  fd_ = fd;
  camera_ = std::move(camera);
}

DeviceResult<std::optional<ControlRange>> V4l2Controls::find(ControlId id) {
  if (fd_ < 0) {
    return device_fault(FaultKind::kNotStarted,
                        "cannot use the control '{}': the camera is not started",
                        to_string(id));
  }
  v4l2_queryctrl query{};
  query.id = code_of(id).code;
  if (const int status = kernel_->ioctl(fd_, VIDIOC_QUERYCTRL, &query); status < 0) {
    if (status == -EINVAL || status == -ENOTTY) {
      return std::nullopt;
    }
    return refused(status, id, camera_);
  }
  if ((query.flags & (V4L2_CTRL_FLAG_DISABLED | V4L2_CTRL_FLAG_READ_ONLY)) != 0U) {
    return std::nullopt;
  }
  const std::int64_t scale = code_of(id).scale;
  ControlRange range{.id = id,
                     .minimum = query.minimum * scale,
                     .maximum = query.maximum * scale,
                     .step = std::max<std::int64_t>(1, query.step) * scale,
                     .standard = query.default_value * scale};
  if (is_automatism(id)) {
    range = {.id = id, .minimum = 0, .maximum = 1, .step = 1, .standard = query.default_value};
    if (id == ControlId::kExposureAuto) {
      range.standard = query.default_value == V4L2_EXPOSURE_MANUAL ? 0 : 1;
    }
  }
  return range;
}

DeviceResult<std::vector<ControlRange>> V4l2Controls::list() {
  std::vector<ControlRange> ranges;
  for (const ControlCode& code : kCodes) {
    TM_ASSIGN_OR_FAULT(const std::optional<ControlRange> range, find(code.id));
    if (range) {
      ranges.push_back(*range);
    }
  }
  return ranges;
}

DeviceResult<std::int64_t> V4l2Controls::get(ControlId id) {
  TM_ASSIGN_OR_FAULT(const std::optional<ControlRange> range, find(id));
  if (!range) {
    return refused(-EINVAL, id, camera_);
  }
  v4l2_control control{};
  control.id = code_of(id).code;
  if (const int status = kernel_->ioctl(fd_, VIDIOC_G_CTRL, &control); status < 0) {
    return refused(status, id, camera_);
  }
  if (id == ControlId::kExposureAuto) {
    // Shutter priority leaves the exposure time to us: as manual, for our purpose.
    const bool is_ours =
        control.value == V4L2_EXPOSURE_MANUAL || control.value == V4L2_EXPOSURE_SHUTTER_PRIORITY;
    return is_ours ? 0 : 1;
  }
  return control.value * code_of(id).scale;
}

DeviceResult<std::int64_t> V4l2Controls::automatic_exposure_value() {
  // UVC cameras know aperture priority alone: the exposure time is automatic, the iris has no
  // motor.
  for (const int value : {V4L2_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY}) {
    v4l2_querymenu menu{};
    menu.id = V4L2_CID_EXPOSURE_AUTO;
    menu.index = static_cast<__u32>(value);
    if (kernel_->ioctl(fd_, VIDIOC_QUERYMENU, &menu) >= 0) {
      return value;
    }
  }
  return refused(-EINVAL, ControlId::kExposureAuto, camera_);
}

DeviceResult<std::int64_t> V4l2Controls::set(ControlId id, std::int64_t value) {
  TM_ASSIGN_OR_FAULT(const std::optional<ControlRange> range, find(id));
  if (!range) {
    return refused(-EINVAL, id, camera_);
  }
  if (value < range->minimum || value > range->maximum) {
    return device_fault(FaultKind::kControlRefused,
                        "cannot set the control '{}' of camera {} to {}: it takes {} to {}",
                        to_string(id),
                        camera_,
                        value,
                        range->minimum,
                        range->maximum);
  }
  std::int64_t raw = value / code_of(id).scale;
  if (id == ControlId::kExposureAuto) {
    raw = V4L2_EXPOSURE_MANUAL;
    if (value != 0) {
      TM_ASSIGN_OR_FAULT(raw, automatic_exposure_value());
    }
  }
  v4l2_control control{};
  control.id = code_of(id).code;
  control.value = static_cast<__s32>(raw);
  if (const int status = kernel_->ioctl(fd_, VIDIOC_S_CTRL, &control); status < 0) {
    return refused(status, id, camera_);
  }
  TM_ASSIGN_OR_FAULT(const std::int64_t taken, get(id));
  if (is_automatism(id) && taken != value) {
    return device_fault(FaultKind::kControlRefused,
                        "camera {} does not switch its control '{}' {}",
                        camera_,
                        to_string(id),
                        value != 0 ? "on" : "off");
  }
  return taken;
}

std::optional<std::chrono::nanoseconds> V4l2Controls::held_exposure() const {
  const ControlValue* exposure = find_value(lock_.held(), ControlId::kExposure);
  return exposure != nullptr
             ? std::optional<std::chrono::nanoseconds>(std::chrono::microseconds(exposure->value))
             : std::nullopt;
}

}  // namespace trigmesh
