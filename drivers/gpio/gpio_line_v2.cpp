// libgpiod 2.x: a request owns its lines; the chip may be closed after it.
#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include <gpiod.h>

#include "drivers/device/text_lines.hpp"
#include "drivers/gpio/gpio_line.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;

constexpr const char* kConsumer = "trigmesh";
/// As many as the kernel keeps for one line.
constexpr std::size_t kMostEdges = 16;

template <auto close>
struct Closer {
  template <typename T>
  void operator()(T* object) const {
    close(object);
  }
};

using Chip = std::unique_ptr<gpiod_chip, Closer<gpiod_chip_close>>;
using ChipInfo = std::unique_ptr<gpiod_chip_info, Closer<gpiod_chip_info_free>>;
using Settings = std::unique_ptr<gpiod_line_settings, Closer<gpiod_line_settings_free>>;
using LineConfig = std::unique_ptr<gpiod_line_config, Closer<gpiod_line_config_free>>;
using RequestConfig = std::unique_ptr<gpiod_request_config, Closer<gpiod_request_config_free>>;
using Request = std::unique_ptr<gpiod_line_request, Closer<gpiod_line_request_release>>;
using EventBuffer = std::unique_ptr<gpiod_edge_event_buffer, Closer<gpiod_edge_event_buffer_free>>;

std::string name_of(const GpioSpec& spec) {
  return fmt::format("line {} of {}", spec.line, spec.chip);
}

tl::unexpected<DeviceFault> failed(std::string_view attempt, const GpioSpec& spec) {
  return tl::unexpected<DeviceFault>(fault_of_errno(errno, attempt, name_of(spec)));
}

std::vector<std::string> chip_paths() {
  std::vector<std::string> paths;
  std::error_code error;
  for (fs::directory_iterator entry("/dev", error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    if (entry->path().filename().string().rfind("gpiochip", 0) == 0) {
      paths.push_back(entry->path().string());
    }
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

bool is_called(gpiod_chip* chip, const std::string& name) {
  const ChipInfo info(gpiod_chip_get_info(chip));
  return info != nullptr && (name == gpiod_chip_info_get_name(info.get()) ||
                             name == gpiod_chip_info_get_label(info.get()));
}

/// By path, by name or by label; a chip that may not be opened is told apart from none.
DeviceResult<Chip> open_chip(const GpioSpec& spec) {
  if (!spec.chip.empty() && spec.chip.front() == '/') {
    Chip chip(gpiod_chip_open(spec.chip.c_str()));
    if (chip == nullptr) {
      return failed("cannot open the chip of GPIO", spec);
    }
    return chip;
  }
  bool is_forbidden = false;
  for (const std::string& path : chip_paths()) {
    Chip chip(gpiod_chip_open(path.c_str()));
    is_forbidden = is_forbidden || (chip == nullptr && (errno == EACCES || errno == EPERM));
    if (chip != nullptr && is_called(chip.get(), spec.chip)) {
      return chip;
    }
  }
  return device_fault(is_forbidden ? FaultKind::kPermission : FaultKind::kNotFound,
                      "there is no chip of GPIO {} among those that may be opened",
                      name_of(spec));
}

Settings settings_of(const GpioSpec& spec, gpiod_line_direction direction) {
  Settings settings(gpiod_line_settings_new());
  if (settings == nullptr) {
    return settings;
  }
  bool is_set = gpiod_line_settings_set_direction(settings.get(), direction) == 0;
  gpiod_line_settings_set_active_low(settings.get(), spec.active == GpioActive::kLow);
  if (direction == GPIOD_LINE_DIRECTION_INPUT) {
    is_set = is_set &&
             gpiod_line_settings_set_edge_detection(settings.get(), GPIOD_LINE_EDGE_BOTH) == 0 &&
             gpiod_line_settings_set_event_clock(settings.get(), GPIOD_LINE_CLOCK_MONOTONIC) == 0;
  } else {
    is_set = is_set &&
             gpiod_line_settings_set_output_value(settings.get(), GPIOD_LINE_VALUE_INACTIVE) == 0;
  }
  if (spec.bias != GpioBias::kNone) {
    const auto bias =
        spec.bias == GpioBias::kPullUp ? GPIOD_LINE_BIAS_PULL_UP : GPIOD_LINE_BIAS_PULL_DOWN;
    is_set = is_set && gpiod_line_settings_set_bias(settings.get(), bias) == 0;
  }
  return is_set ? std::move(settings) : nullptr;
}

/// A requested line and its number.
struct OpenLine {
  Request request;
  unsigned offset = 0;
};

DeviceResult<OpenLine> request_line(const GpioSpec& spec, gpiod_line_direction direction) {
  TM_ASSIGN_OR_FAULT(const Chip chip, open_chip(spec));
  const std::optional<std::int64_t> number = whole_number(spec.line);
  const int found = number ? static_cast<int>(std::min<std::int64_t>(*number, 1 << 20))
                           : gpiod_chip_get_line_offset_from_name(chip.get(), spec.line.c_str());
  if (found < 0) {
    return device_fault(FaultKind::kNotFound, "there is no GPIO {}", name_of(spec));
  }
  OpenLine open;
  open.offset = static_cast<unsigned>(found);
  const Settings settings = settings_of(spec, direction);
  const LineConfig lines(gpiod_line_config_new());
  const RequestConfig config(gpiod_request_config_new());
  if (settings == nullptr || lines == nullptr || config == nullptr ||
      gpiod_line_config_add_line_settings(lines.get(), &open.offset, 1, settings.get()) < 0) {
    return failed("cannot describe GPIO", spec);
  }
  gpiod_request_config_set_consumer(config.get(), kConsumer);
  open.request.reset(gpiod_chip_request_lines(chip.get(), config.get(), lines.get()));
  if (open.request == nullptr) {
    return failed("cannot use GPIO", spec);
  }
  return open;
}

class InputV2 final : public GpioInput {
 public:
  InputV2(OpenLine open, EventBuffer events, GpioSpec spec)
      : open_(std::move(open)), events_(std::move(events)), spec_(std::move(spec)) {}

  [[nodiscard]] int fd() const override { return gpiod_line_request_get_fd(open_.request.get()); }

  [[nodiscard]] DeviceResult<std::size_t> read(std::span<GpioEdge> edges) override {
    const int count = gpiod_line_request_read_edge_events(
        open_.request.get(), events_.get(), std::min(edges.size(), kMostEdges));
    if (count < 0) {
      return failed("cannot read edges of GPIO", spec_);
    }
    const auto got = static_cast<std::size_t>(count);
    for (std::size_t i = 0; i < got; ++i) {
      gpiod_edge_event* event = gpiod_edge_event_buffer_get_event(events_.get(), i);
      const bool is_rising = gpiod_edge_event_get_event_type(event) == GPIOD_EDGE_EVENT_RISING_EDGE;
      edges[i] = {std::chrono::nanoseconds(
                      static_cast<std::int64_t>(gpiod_edge_event_get_timestamp_ns(event))),
                  is_rising ? GpioLevel::kActive : GpioLevel::kInactive};
    }
    return got;
  }

  [[nodiscard]] DeviceResult<GpioLevel> level() override {
    const auto value = gpiod_line_request_get_value(open_.request.get(), open_.offset);
    if (value == GPIOD_LINE_VALUE_ERROR) {
      return failed("cannot read GPIO", spec_);
    }
    return value == GPIOD_LINE_VALUE_ACTIVE ? GpioLevel::kActive : GpioLevel::kInactive;
  }

 private:
  OpenLine open_;
  EventBuffer events_;
  GpioSpec spec_;
};

class OutputV2 final : public GpioOutput {
 public:
  OutputV2(OpenLine open, GpioSpec spec) : open_(std::move(open)), spec_(std::move(spec)) {}

  [[nodiscard]] DeviceResult<> set(GpioLevel level) override {
    const auto value =
        level == GpioLevel::kActive ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE;
    if (gpiod_line_request_set_value(open_.request.get(), open_.offset, value) < 0) {
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
  TM_ASSIGN_OR_FAULT(OpenLine open, request_line(spec, GPIOD_LINE_DIRECTION_INPUT));
  EventBuffer events(gpiod_edge_event_buffer_new(kMostEdges));
  if (events == nullptr) {
    return failed("cannot watch GPIO", spec);
  }
  return std::make_unique<InputV2>(std::move(open), std::move(events), spec);
}

DeviceResult<std::unique_ptr<GpioOutput>> open_gpio_output(const GpioSpec& spec) {
  TM_ASSIGN_OR_FAULT(OpenLine open, request_line(spec, GPIOD_LINE_DIRECTION_OUTPUT));
  return std::make_unique<OutputV2>(std::move(open), spec);
}

std::string gpio_library_version() {
  return gpiod_api_version();
}

}  // namespace trigmesh
