#include "drivers/camera/libcamera/control_lists.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include <libcamera/control_ids.h>
#include <libcamera/controls.h>

#include "drivers/camera/control_lock.hpp"
#include "drivers/camera/libcamera/control_units.hpp"

namespace trigmesh {
namespace {

namespace controls = libcamera::controls;

/// nullptr: libcamera has nothing of the kind.
const libcamera::ControlId* control_of(ControlId id) {
  switch (id) {
    case ControlId::kExposureAuto:
      return &controls::AeEnable;
    case ControlId::kExposure:
      return &controls::ExposureTime;
    case ControlId::kGainAuto:
      return nullptr;
    case ControlId::kGain:
      return &controls::AnalogueGain;
    case ControlId::kWhiteBalanceAuto:
      return &controls::AwbEnable;
    case ControlId::kWhiteBalance:
      return &controls::ColourGains;
    case ControlId::kFocusAuto:
      return &controls::AfMode;
    case ControlId::kFocus:
      return &controls::LensPosition;
  }
  return nullptr;
}

/// The value, or the first of several; nothing for what is no number.
std::optional<double> number_in(const libcamera::ControlValue& value) {
  const auto read = [&value]<typename T>(T) -> std::optional<double> {
    if (!value.isArray()) {
      return static_cast<double>(value.get<T>());
    }
    const auto several = value.get<libcamera::Span<const T>>();
    return several.empty() ? std::nullopt : std::optional(static_cast<double>(several[0]));
  };
  switch (value.type()) {
    case libcamera::ControlTypeBool:
      return read(bool{});
    case libcamera::ControlTypeInteger32:
      return read(std::int32_t{});
    case libcamera::ControlTypeInteger64:
      return read(std::int64_t{});
    case libcamera::ControlTypeFloat:
      return read(float{});
    default:
      return std::nullopt;
  }
}

/// AfMode counts manual, once, continuous; a mode that follows the scene is what automatic means.
std::int32_t focus_mode(std::int64_t is_automatic) {
  return is_automatic != 0 ? std::int32_t{controls::AfModeContinuous}
                           : std::int32_t{controls::AfModeManual};
}

}  // namespace

std::optional<ControlRange> range_of(const libcamera::ControlInfoMap& camera, ControlId id) {
  const libcamera::ControlId* const control = control_of(id);
  const auto found = control != nullptr ? camera.find(control->id()) : camera.end();
  if (found == camera.end()) {
    return std::nullopt;
  }
  const libcamera::ControlInfo& info = found->second;
  const double standard = number_in(info.def()).value_or(0.0);
  if (is_automatism(id)) {
    return ControlRange{
        .id = id, .minimum = 0, .maximum = 1, .step = 1, .standard = standard != 0.0 ? 1 : 0};
  }
  // A pipeline that does not know its bounds tells none, or an upper one that is not above the
  // lower.
  const double low = number_in(info.min()).value_or(0.0);
  const double high = number_in(info.max()).value_or(0.0);
  constexpr double kNoBound = std::numeric_limits<std::int32_t>::max();
  const double upper = high > low ? high : std::max(low, kNoBound);
  return ControlRange{.id = id,
                      .minimum = to_our_unit(id, low),
                      .maximum = to_our_unit(id, upper),
                      .step = 1,
                      .standard = to_our_unit(id, std::clamp(standard, low, upper)),
                      // White balance is a gain here, which no colour temperature tells.
                      .per_unit = id == ControlId::kWhiteBalance ? 0 : std::llround(unit_of(id))};
}

void write_control(libcamera::ControlList& request, ControlValue control, float blue_gain) {
  const auto theirs = static_cast<float>(to_their_unit(control.id, control.value));
  switch (control.id) {
    case ControlId::kExposureAuto:
      request.set(controls::AeEnable, control.value != 0);
      break;
    case ControlId::kExposure:
      request.set(controls::ExposureTime, static_cast<std::int32_t>(control.value));
      break;
    case ControlId::kGainAuto:
      break;
    case ControlId::kGain:
      request.set(controls::AnalogueGain, theirs);
      break;
    case ControlId::kWhiteBalanceAuto:
      request.set(controls::AwbEnable, control.value != 0);
      break;
    case ControlId::kWhiteBalance: {
      const std::array<float, 2> gains = {theirs, blue_gain};
      request.set(controls::ColourGains, libcamera::Span<const float, 2>(gains));
      break;
    }
    case ControlId::kFocusAuto:
      request.set(controls::AfMode, focus_mode(control.value));
      break;
    case ControlId::kFocus:
      request.set(controls::LensPosition, theirs);
      break;
  }
}

ToldControls read_controls(const libcamera::ControlList& metadata) {
  ToldControls told;
  const auto tell = [&told](ControlId id, const auto& value) {
    if (value) {
      told[id] = to_our_unit(id, static_cast<double>(*value));
    }
  };
  tell(ControlId::kExposureAuto, metadata.get(controls::AeEnable));
  tell(ControlId::kExposure, metadata.get(controls::ExposureTime));
  tell(ControlId::kGain, metadata.get(controls::AnalogueGain));
  tell(ControlId::kWhiteBalanceAuto, metadata.get(controls::AwbEnable));
  tell(ControlId::kFocus, metadata.get(controls::LensPosition));
  if (const auto gains = metadata.get(controls::ColourGains)) {
    told[ControlId::kWhiteBalance] =
        to_our_unit(ControlId::kWhiteBalance, static_cast<double>((*gains)[0]));
    told.blue_gain = (*gains)[1];
  }
  return told;
}

}  // namespace trigmesh
