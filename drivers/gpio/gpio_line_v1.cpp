// libgpiod 1.6: lines belong to a chip that stays open.
#include <cerrno>
#include <memory>
#include <utility>
#include <vector>

#include <gpiod.h>

#include "drivers/device/text_lines.hpp"
#include "drivers/gpio/gpio_line.hpp"

namespace trigmesh {
namespace {

constexpr const char* kConsumer = "trigmesh";

struct ChipCloser {
  void operator()(gpiod_chip* chip) const { gpiod_chip_close(chip); }
};

using Chip = std::unique_ptr<gpiod_chip, ChipCloser>;

std::string name_of(const GpioSpec& spec) {
  return fmt::format("line {} of {}", spec.line, spec.chip);
}

tl::unexpected<DeviceFault> failed(std::string_view attempt, const GpioSpec& spec) {
  return tl::unexpected<DeviceFault>(fault_of_errno(errno, attempt, name_of(spec)));
}

/// A chip and one of its lines, not yet requested.
struct OpenLine {
  Chip chip;
  gpiod_line* line = nullptr;  ///< owned by the chip
};

DeviceResult<OpenLine> open_line(const GpioSpec& spec) {
  OpenLine open;
  open.chip.reset(gpiod_chip_open_lookup(spec.chip.c_str()));
  if (open.chip == nullptr) {
    return failed("cannot open the chip of GPIO", spec);
  }
  const auto number = whole_number(spec.line);
  open.line = number ? gpiod_chip_get_line(open.chip.get(), static_cast<unsigned>(*number))
                     : gpiod_chip_find_line(open.chip.get(), spec.line.c_str());
  if (open.line == nullptr) {
    return device_fault(FaultKind::kNotFound, "there is no GPIO {}", name_of(spec));
  }
  return open;
}

int flags_of(const GpioSpec& spec) {
  int flags = spec.active == GpioActive::kLow ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
  if (spec.bias == GpioBias::kPullUp) {
    flags |= GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_UP;
  } else if (spec.bias == GpioBias::kPullDown) {
    flags |= GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_DOWN;
  }
  return flags;
}

class InputV1 final : public GpioInput {
 public:
  InputV1(OpenLine open, GpioSpec spec) : open_(std::move(open)), spec_(std::move(spec)) {}

  [[nodiscard]] int fd() const override { return gpiod_line_event_get_fd(open_.line); }

  [[nodiscard]] DeviceResult<std::size_t> read(std::span<GpioEdge> edges) override {
    events_.resize(edges.size());
    const int count = gpiod_line_event_read_multiple(
        open_.line, events_.data(), static_cast<unsigned>(events_.size()));
    if (count < 0) {
      return failed("cannot read edges of GPIO", spec_);
    }
    const auto got = static_cast<std::size_t>(count);
    for (std::size_t i = 0; i < got; ++i) {
      edges[i] = {std::chrono::seconds(events_[i].ts.tv_sec) +
                      std::chrono::nanoseconds(events_[i].ts.tv_nsec),
                  events_[i].event_type == GPIOD_LINE_EVENT_RISING_EDGE ? GpioLevel::kActive
                                                                        : GpioLevel::kInactive};
    }
    return got;
  }

  [[nodiscard]] DeviceResult<GpioLevel> level() override {
    const int value = gpiod_line_get_value(open_.line);
    if (value < 0) {
      return failed("cannot read GPIO", spec_);
    }
    return value != 0 ? GpioLevel::kActive : GpioLevel::kInactive;
  }

 private:
  OpenLine open_;
  GpioSpec spec_;
  std::vector<gpiod_line_event> events_;
};

class OutputV1 final : public GpioOutput {
 public:
  OutputV1(OpenLine open, GpioSpec spec) : open_(std::move(open)), spec_(std::move(spec)) {}

  [[nodiscard]] DeviceResult<> set(GpioLevel level) override {
    if (gpiod_line_set_value(open_.line, level == GpioLevel::kActive ? 1 : 0) < 0) {
      return failed("cannot switch GPIO", spec_);
    }
    return {};
  }

 private:
  OpenLine open_;
  GpioSpec spec_;
};

}  // namespace

DeviceResult<std::unique_ptr<GpioInput>> open_gpio_input(const GpioSpec& spec) {
  TM_ASSIGN_OR_FAULT(OpenLine open, open_line(spec));
  if (gpiod_line_request_both_edges_events_flags(open.line, kConsumer, flags_of(spec)) < 0) {
    return failed("cannot watch GPIO", spec);
  }
  return std::make_unique<InputV1>(std::move(open), spec);
}

DeviceResult<std::unique_ptr<GpioOutput>> open_gpio_output(const GpioSpec& spec) {
  TM_ASSIGN_OR_FAULT(OpenLine open, open_line(spec));
  if (gpiod_line_request_output_flags(open.line, kConsumer, flags_of(spec), 0) < 0) {
    return failed("cannot drive GPIO", spec);
  }
  return std::make_unique<OutputV1>(std::move(open), spec);
}

std::string gpio_library_version() {
  return gpiod_version_string();
}

}  // namespace trigmesh
