#include "firmware/daemon/camera_hold.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace trigmesh {
namespace {

constexpr std::array<std::pair<ControlId, ControlId>, 4> kAutomatisms = {{
    {ControlId::kExposureAuto, ControlId::kExposure},
    {ControlId::kGainAuto, ControlId::kGain},
    {ControlId::kWhiteBalanceAuto, ControlId::kWhiteBalance},
    {ControlId::kFocusAuto, ControlId::kFocus},
}};

const ControlRange* find_range(const std::vector<ControlRange>& ranges, ControlId id) {
  const auto found = std::find_if(
      ranges.begin(), ranges.end(), [id](const ControlRange& range) { return range.id == id; });
  return found == ranges.end() ? nullptr : &*found;
}

}  // namespace

bool CameraHold::is_wanted(ControlId id) const {
  return std::any_of(options_.wanted.begin(),
                     options_.wanted.end(),
                     [id](const WantedControl& value) { return value.id == id; });
}

std::vector<ControlValue> CameraHold::wanted_of(const std::vector<ControlRange>& ranges,
                                                std::vector<std::string>& refused) const {
  std::vector<ControlValue> wanted;
  for (const WantedControl& one : options_.wanted) {
    const ControlRange* range = find_range(ranges, one.id);
    if (range == nullptr || range->per_unit == 0) {
      refused.push_back(fmt::format(
          "the camera cannot be set to {} {}: it has no such control; leave the setting out",
          to_string(one.id),
          one.value));
      continue;
    }
    wanted.push_back({one.id, std::llround(one.value * static_cast<double>(range->per_unit))});
  }
  return wanted;
}

std::vector<std::string> CameraHold::on_camera_start(CameraControls* controls) {
  std::vector<std::string> refused;
  if (controls == nullptr || is_holding_) {
    return refused;  // start() has set the lock of the session again
  }
  const auto ranges = controls->list();
  if (!ranges) {
    return {ranges.error().message};
  }
  if (was_held_) {
    refused = free_automatisms(*controls);
  }
  for (const ControlValue& value : wanted_of(*ranges, refused)) {
    for (const auto& [automatic, steered] : kAutomatisms) {
      if (steered == value.id && find_range(*ranges, automatic) != nullptr) {
        if (const auto off = controls->set(automatic, 0); !off) {
          refused.push_back(off.error().message);
        }
      }
    }
    if (const auto set = controls->set(value.id, value.value); !set) {
      refused.push_back(set.error().message);
    }
  }
  return refused;
}

std::vector<std::string> CameraHold::hold(CameraControls* controls) {
  if (controls == nullptr || !options_.locks) {
    return {};
  }
  const auto ranges = controls->list();
  if (!ranges) {
    return {ranges.error().message};
  }
  std::vector<std::string> told_before;  // when the camera was started
  const std::vector<ControlValue> wanted = wanted_of(*ranges, told_before);
  if (const auto held = controls->lock(wanted); !held) {
    return {held.error().message};
  }
  is_holding_ = true;
  was_held_ = true;
  return {};
}

std::vector<std::string> CameraHold::check(CameraControls* controls) {
  if (controls == nullptr || !is_holding_) {
    return {};
  }
  const auto checked = controls->check_lock();
  return checked ? std::vector<std::string>() : std::vector{checked.error().message};
}

std::vector<std::string> CameraHold::release(CameraControls* controls) {
  if (!is_holding_) {
    return {};
  }
  is_holding_ = false;
  return controls == nullptr ? std::vector<std::string>() : free_automatisms(*controls);
}

std::vector<std::string> CameraHold::free_automatisms(CameraControls& controls) {
  const auto ranges = controls.list();
  if (!ranges) {
    return {ranges.error().message};
  }
  std::vector<std::string> refused;
  for (const auto& [automatic, steered] : kAutomatisms) {
    if (find_range(*ranges, automatic) != nullptr && !is_wanted(steered)) {
      if (const auto on = controls.set(automatic, 1); !on) {
        refused.push_back(on.error().message);
      }
    }
  }
  return refused;
}

}  // namespace trigmesh
