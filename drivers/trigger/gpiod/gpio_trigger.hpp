#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <vector>

#include "drivers/gpio/gpio_line.hpp"
#include "drivers/trigger/debouncer.hpp"
#include "drivers/trigger/trigger_source.hpp"
#include "firmware/base/clock.hpp"
#include "firmware/base/result.hpp"

namespace trigmesh {

/// A button and its line. Active means pressed.
struct GpioButton {
  std::uint32_t button = 0;
  GpioSpec line;
};

struct GpioTriggerOptions {
  std::vector<GpioButton> buttons;  ///< at least one, each number once
  /// How long a contact must be at rest, [0, 100] ms. Small push buttons bounce for 1 to 6 ms.
  std::chrono::milliseconds settle{10};

  [[nodiscard]] Result<> validate() const;
};

/// Opens a line; open_gpio_input, or a test's.
using GpioOpener = std::function<DeviceResult<std::unique_ptr<GpioInput>>(const GpioSpec&)>;

/// Buttons on GPIO lines.
class GpioTrigger final : public TriggerSource {
 public:
  /// `clock` is that of the kernel's timestamps (SteadyClock) and outlives the source.
  /// kInvalidArgument: options; kIo: the system has no descriptors left.
  [[nodiscard]] static Result<std::unique_ptr<GpioTrigger>> create(GpioTriggerOptions options,
                                                                   GpioOpener open,
                                                                   const Clock& clock);

  [[nodiscard]] DeviceResult<> start() override;
  void stop() override;
  [[nodiscard]] TriggerEvent wait(std::chrono::nanoseconds timeout) override;

  void request_stop() noexcept override { stop_requested_.set(); }

  /// Edges that were taken for bounce or noise since it was made.
  [[nodiscard]] std::uint64_t suppressed_count() const;

 private:
  struct Line {
    std::uint32_t button = 0;
    std::unique_ptr<GpioInput> input;
    Debouncer debouncer;
    bool is_pressed = false;  ///< as we have told
  };

  GpioTrigger(GpioTriggerOptions options, GpioOpener open, const Clock& clock);

  [[nodiscard]] DeviceResult<> read_edges(Line& line);
  [[nodiscard]] DeviceResult<> settle(Line& line);
  [[nodiscard]] DeviceResult<> look(std::chrono::nanoseconds until);
  void add(Line& line, std::optional<TriggerEdge> edge);
  void close_lines();

  const GpioTriggerOptions options_;
  const GpioOpener open_;
  const Clock& clock_;
  WakeEvent stop_requested_;
  std::vector<Line> lines_;  ///< empty when stopped
  std::deque<TriggerEdge> ready_;
  std::uint64_t suppressed_before_ = 0;  ///< by lines that were closed
};

}  // namespace trigmesh
