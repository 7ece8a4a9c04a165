#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "drivers/device/device_fault.hpp"

namespace trigmesh {

/// What holds a line when nothing drives it.
enum class GpioBias : std::uint8_t { kNone, kPullUp, kPullDown };

/// Which voltage means "active": a button to ground with a pull-up is active low.
enum class GpioActive : std::uint8_t { kHigh, kLow };

/// Whether a line is active, in the sense of GpioActive.
enum class GpioLevel : std::uint8_t { kInactive, kActive };

/// A line and how to use it.
struct GpioSpec {
  std::string chip;  ///< "/dev/gpiochip0", "gpiochip0", or the label of the chip
  std::string line;  ///< its number on the chip, or its name
  GpioBias bias = GpioBias::kNone;
  GpioActive active = GpioActive::kHigh;
};

/// A change that the kernel saw.
struct GpioEdge {
  std::chrono::nanoseconds timestamp{0};   ///< CLOCK_MONOTONIC
  GpioLevel level = GpioLevel::kInactive;  ///< after the edge
};

/// An open line that is watched. Single thread.
class GpioInput {
 public:
  GpioInput() = default;
  GpioInput(const GpioInput&) = delete;
  GpioInput& operator=(const GpioInput&) = delete;
  GpioInput(GpioInput&&) = delete;
  GpioInput& operator=(GpioInput&&) = delete;
  virtual ~GpioInput() = default;

  /// Readable when there are edges.
  [[nodiscard]] virtual int fd() const = 0;

  /// Takes edges off the queue of the kernel, oldest first; returns how many. Call it when fd() is
  /// readable: it blocks otherwise. The queue is short, and what does not fit is lost.
  [[nodiscard]] virtual DeviceResult<std::size_t> read(std::span<GpioEdge> edges) = 0;

  [[nodiscard]] virtual DeviceResult<GpioLevel> level() = 0;
};

/// An open line that we drive. Single thread; the line keeps its level or not when it is closed, as
/// the chip likes.
class GpioOutput {
 public:
  GpioOutput() = default;
  GpioOutput(const GpioOutput&) = delete;
  GpioOutput& operator=(const GpioOutput&) = delete;
  GpioOutput(GpioOutput&&) = delete;
  GpioOutput& operator=(GpioOutput&&) = delete;
  virtual ~GpioOutput() = default;

  [[nodiscard]] virtual DeviceResult<> set(GpioLevel level) = 0;
};

/// Watches both edges of a line. kNotFound: no such chip or line; kBusy: another program has it;
/// kPermission; kIo: the chip has no such bias, or no interrupts.
[[nodiscard]] DeviceResult<std::unique_ptr<GpioInput>> open_gpio_input(const GpioSpec& spec);

/// Drives a line, inactive at first. Faults as open_gpio_input.
[[nodiscard]] DeviceResult<std::unique_ptr<GpioOutput>> open_gpio_output(const GpioSpec& spec);

/// Version of libgpiod that this program was built for and runs with: "1.6.3".
[[nodiscard]] std::string gpio_library_version();

}  // namespace trigmesh
