#include "drivers/camera/control_lock.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace trigmesh {
namespace {

/// Automatisms and what each of them steers, in the order of ControlId.
constexpr std::array<std::pair<ControlId, ControlId>, 4> kPairs = {{
    {ControlId::kExposureAuto, ControlId::kExposure},
    {ControlId::kGainAuto, ControlId::kGain},
    {ControlId::kWhiteBalanceAuto, ControlId::kWhiteBalance},
    {ControlId::kFocusAuto, ControlId::kFocus},
}};

bool has(const std::vector<ControlRange>& ranges, ControlId id) {
  return std::any_of(
      ranges.begin(), ranges.end(), [id](const ControlRange& range) { return range.id == id; });
}

DeviceResult<> check_wanted(const std::vector<ControlValue>& wanted,
                            const std::vector<ControlRange>& ranges,
                            std::string_view camera) {
  for (const ControlValue& value : wanted) {
    const bool is_there = has(ranges, value.id);
    if (!is_there || is_automatism(value.id)) {
      return device_fault(FaultKind::kControlRefused,
                          "cannot hold the control '{}' of camera {} at {}: {}",
                          to_string(value.id),
                          camera,
                          value.value,
                          is_there ? "a lock turns automatisms off" : "it has no such control");
    }
  }
  return {};
}

/// What is to be held: the wish, else what the camera has now. Read while the automatisms still
/// hold it: some cameras forget it when those go off, and one automatism may steer two controls.
DeviceResult<std::vector<ControlValue>> choose_values(CameraControls& controls,
                                                      const std::vector<ControlRange>& ranges,
                                                      const std::vector<ControlValue>& wanted) {
  std::vector<ControlValue> chosen;
  for (const auto& [automatism, steered] : kPairs) {
    if (const ControlValue* given = find_value(wanted, steered)) {
      chosen.push_back(*given);
    } else if (has(ranges, steered)) {
      TM_ASSIGN_OR_FAULT(const std::int64_t value, controls.get(steered));
      chosen.push_back({steered, value});
    }
  }
  return chosen;
}

}  // namespace

bool is_automatism(ControlId id) {
  return std::any_of(
      kPairs.begin(), kPairs.end(), [id](const auto& pair) { return pair.first == id; });
}

const ControlValue* find_value(const std::vector<ControlValue>& values, ControlId id) {
  const auto found = std::find_if(
      values.begin(), values.end(), [id](const ControlValue& value) { return value.id == id; });
  return found == values.end() ? nullptr : &*found;
}

DeviceResult<> ControlLock::hold(CameraControls& controls, ControlValue value) {
  TM_ASSIGN_OR_FAULT(const std::int64_t taken, controls.set(value.id, value.value));
  held_.push_back({value.id, taken});
  return {};
}

DeviceResult<std::vector<ControlValue>> ControlLock::lock(CameraControls& controls,
                                                          std::string_view camera,
                                                          const std::vector<ControlValue>& wanted) {
  held_.clear();
  TM_ASSIGN_OR_FAULT(const std::vector<ControlRange> ranges, controls.list());
  TM_RETURN_IF_FAULT(check_wanted(wanted, ranges, camera));
  TM_ASSIGN_OR_FAULT(const std::vector<ControlValue> chosen,
                     choose_values(controls, ranges, wanted));
  for (const auto& [automatism, steered] : kPairs) {
    if (has(ranges, automatism)) {
      TM_RETURN_IF_FAULT(hold(controls, {automatism, 0}));
    }
    if (const ControlValue* value = find_value(chosen, steered)) {
      TM_RETURN_IF_FAULT(hold(controls, *value));
    }
  }
  return held_;
}

DeviceResult<> ControlLock::check(CameraControls& controls, std::string_view camera) const {
  for (const ControlValue& held : held_) {
    TM_ASSIGN_OR_FAULT(const std::int64_t now, controls.get(held.id));
    if (now != held.value) {
      return device_fault(FaultKind::kControlRefused,
                          "camera {} did not keep its control '{}': held at {}, now {}",
                          camera,
                          to_string(held.id),
                          held.value,
                          now);
    }
  }
  return {};
}

DeviceResult<> ControlLock::restore(CameraControls& controls, std::string_view camera) const {
  for (const ControlValue& held : held_) {
    TM_ASSIGN_OR_FAULT(const std::int64_t taken, controls.set(held.id, held.value));
    if (taken != held.value) {
      return device_fault(
          FaultKind::kControlRefused,
          "camera {} came back and does not take its control '{}' at {}: it says {}",
          camera,
          to_string(held.id),
          held.value,
          taken);
    }
  }
  return {};
}

}  // namespace trigmesh
