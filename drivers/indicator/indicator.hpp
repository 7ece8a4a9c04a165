#pragma once

#include "drivers/device/device_fault.hpp"
#include "drivers/indicator/pattern.hpp"

namespace trigmesh {

/// A light and perhaps a buzzer. Single thread. Used as
///
///     while (...) {
///       indicator.show(levels_at(pattern, now - begin));
///       wait until begin + *next_change(pattern, now - begin), or until the pattern changes
///     }
class Indicator {
 public:
  Indicator() = default;
  Indicator(const Indicator&) = delete;
  Indicator& operator=(const Indicator&) = delete;
  Indicator(Indicator&&) = delete;
  Indicator& operator=(Indicator&&) = delete;
  virtual ~Indicator() = default;

  /// Switches what has to be switched. A rig without a buzzer is silent.
  [[nodiscard]] virtual DeviceResult<> show(const IndicatorLevels& levels) = 0;
};

}  // namespace trigmesh
