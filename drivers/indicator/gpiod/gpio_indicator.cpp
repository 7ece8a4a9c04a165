#include "drivers/indicator/gpiod/gpio_indicator.hpp"

#include <utility>

namespace trigmesh {
namespace {

GpioLevel level_of(bool is_on) {
  return is_on ? GpioLevel::kActive : GpioLevel::kInactive;
}

}  // namespace

DeviceResult<std::unique_ptr<GpioIndicator>> GpioIndicator::create(
    const GpioIndicatorOptions& options, const GpioOutputOpener& open) {
  TM_ASSIGN_OR_FAULT(std::unique_ptr<GpioOutput> light, open(options.light));
  std::unique_ptr<GpioOutput> buzzer;
  if (options.buzzer) {
    TM_ASSIGN_OR_FAULT(buzzer, open(*options.buzzer));
  }
  return std::unique_ptr<GpioIndicator>(new GpioIndicator(std::move(light), std::move(buzzer)));
}

GpioIndicator::GpioIndicator(std::unique_ptr<GpioOutput> light, std::unique_ptr<GpioOutput> buzzer)
    : light_(std::move(light)), buzzer_(std::move(buzzer)) {}

GpioIndicator::~GpioIndicator() {
  (void)show({});  // a chip that is gone shows nothing anyway
}

DeviceResult<> GpioIndicator::show(const IndicatorLevels& levels) {
  const std::optional<IndicatorLevels> before = std::exchange(shown_, std::nullopt);
  if (!before || before->light != levels.light) {
    TM_RETURN_IF_FAULT(light_->set(level_of(levels.light)));
  }
  if (buzzer_ != nullptr && (!before || before->buzzer != levels.buzzer)) {
    TM_RETURN_IF_FAULT(buzzer_->set(level_of(levels.buzzer)));
  }
  shown_ = levels;
  return {};
}

}  // namespace trigmesh
