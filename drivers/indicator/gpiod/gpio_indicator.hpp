#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "drivers/gpio/gpio_line.hpp"
#include "drivers/indicator/indicator.hpp"

namespace trigmesh {

/// The lines of a light and perhaps a buzzer; active means on.
struct GpioIndicatorOptions {
  GpioSpec light;
  std::optional<GpioSpec> buzzer;
};

/// Opens a line; open_gpio_output, or a test's.
using GpioOutputOpener = std::function<DeviceResult<std::unique_ptr<GpioOutput>>(const GpioSpec&)>;

/// A light and perhaps a buzzer on GPIO lines; both are off at first, and off when it goes.
class GpioIndicator final : public Indicator {
 public:
  /// Faults as open_gpio_output.
  [[nodiscard]] static DeviceResult<std::unique_ptr<GpioIndicator>> create(
      const GpioIndicatorOptions& options, const GpioOutputOpener& open);

  ~GpioIndicator() override;
  GpioIndicator(const GpioIndicator&) = delete;
  GpioIndicator& operator=(const GpioIndicator&) = delete;
  GpioIndicator(GpioIndicator&&) = delete;
  GpioIndicator& operator=(GpioIndicator&&) = delete;

  /// After a fault it is not known what shines: the next call switches both lines.
  [[nodiscard]] DeviceResult<> show(const IndicatorLevels& levels) override;

 private:
  GpioIndicator(std::unique_ptr<GpioOutput> light, std::unique_ptr<GpioOutput> buzzer);

  const std::unique_ptr<GpioOutput> light_;
  const std::unique_ptr<GpioOutput> buzzer_;  ///< nothing: there is none
  std::optional<IndicatorLevels> shown_ = IndicatorLevels{};
};

}  // namespace trigmesh
