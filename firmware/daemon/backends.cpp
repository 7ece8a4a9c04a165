#include "firmware/daemon/backends.hpp"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "drivers/camera/replay/replay_source.hpp"
#include "drivers/camera/v4l2/camera_list.hpp"
#include "drivers/camera/v4l2/v4l2_source.hpp"
#include "drivers/gpio/gpio_line.hpp"
#include "drivers/indicator/gpiod/gpio_indicator.hpp"
#include "drivers/trigger/gpiod/gpio_trigger.hpp"
#include "firmware/base/check.hpp"
#include "firmware/daemon/auto_source.hpp"
#include "firmware/daemon/model_worker.hpp"
#include "firmware/daemon/restamped_source.hpp"
#include "firmware/devices/device_list.hpp"
#ifdef TRIGMESH_WITH_LIBCAMERA
#include "drivers/camera/libcamera/libcamera_source.hpp"
#endif

namespace trigmesh {
namespace {

using Backend = CameraSettings::Backend;
using Source = Result<std::unique_ptr<FrameSource>>;

std::optional<PixelFormat> format_of(CameraSettings::Format format) {
  switch (format) {
    case CameraSettings::Format::kMjpg:
      return PixelFormat::kJpeg;
    case CameraSettings::Format::kYuyv:
      return PixelFormat::kYuyv;
    case CameraSettings::Format::kNv12:
      return PixelFormat::kNv12;
    case CameraSettings::Format::kGrey:
      return PixelFormat::kGrey;
    case CameraSettings::Format::kAuto:
      break;
  }
  return std::nullopt;
}

CameraWish wish_of(const CameraSettings& camera) {
  return {camera.width_px,
          camera.height_px,
          static_cast<double>(camera.rate_hz),
          format_of(camera.format)};
}

Source make_v4l2(const Settings& settings, const Clock& clock) {
  V4l2Options options;
  options.camera = settings.camera.device;
  options.wish = wish_of(settings.camera);
  TM_ASSIGN_OR_RETURN(auto source,
                      V4l2Source::create(options, std::make_shared<LinuxKernel>(), clock));
  return source;
}

#ifdef TRIGMESH_WITH_LIBCAMERA
Source make_libcamera(const Settings& settings, const Clock& clock) {
  LibcameraOptions options;
  options.camera = settings.camera.device;
  options.wish = wish_of(settings.camera);
  options.use = settings.capture.mode == CaptureSettings::Mode::kStill ? CameraUse::kStill
                                                                       : CameraUse::kVideo;
  TM_ASSIGN_OR_RETURN(auto source, LibcameraSource::create(options, clock));
  return source;
}
#else
Source make_libcamera(const Settings& /*settings*/, const Clock& /*clock*/) {
  return fail(ErrorCode::kUnsupported,
              "camera.backend is \"libcamera\", and this program was built without libcamera: use "
              "another backend or package");
}
#endif

ReplayPace pace_of(CameraSettings::ReplaySpeed speed) {
  switch (speed) {
    case CameraSettings::ReplaySpeed::kFastest:
      return ReplayPace::kAsFastAsPossible;
    case CameraSettings::ReplaySpeed::kLockstep:
      return ReplayPace::kLockStep;
    case CameraSettings::ReplaySpeed::kRecorded:
      break;
  }
  return ReplayPace::kRecordedSpeed;
}

Source make_replay(const Settings& settings, const Clock& clock) {
  if (settings.camera.device.empty()) {
    return fail(ErrorCode::kInvalidArgument,
                "camera.backend is \"replay\": camera.device must name the folder of a recording");
  }
  TM_ASSIGN_OR_RETURN(Recording recording, Recording::open(settings.camera.device));
  ReplayOptions options;
  options.pace = pace_of(settings.camera.replay_speed);
  TM_ASSIGN_OR_RETURN(auto source, ReplaySource::create(std::move(recording), options, clock));
  const Restamping restamping =
      options.pace == ReplayPace::kRecordedSpeed ? Restamping::kShifted : Restamping::kDelivered;
  return std::make_unique<RestampedSource>(std::move(source), restamping, clock);
}

Source make_auto(const Settings& settings, const Clock& clock) {
  std::vector<std::unique_ptr<FrameSource>> sources;
  TM_ASSIGN_OR_RETURN(auto v4l2, make_v4l2(settings, clock));
  sources.push_back(std::move(v4l2));
#ifdef TRIGMESH_WITH_LIBCAMERA
  TM_ASSIGN_OR_RETURN(auto libcamera, make_libcamera(settings, clock));
  sources.push_back(std::move(libcamera));
#endif
  return std::make_unique<AutoSource>(std::move(sources));
}

Source make_camera(const Settings& settings, const Clock& clock) {
  switch (settings.camera.backend) {
    case Backend::kV4l2:
      return make_v4l2(settings, clock);
    case Backend::kLibcamera:
      return make_libcamera(settings, clock);
    case Backend::kReplay:
      return make_replay(settings, clock);
    case Backend::kAuto:
      break;
  }
  return make_auto(settings, clock);
}

GpioActive active_of(bool is_active_low) {
  return is_active_low ? GpioActive::kLow : GpioActive::kHigh;
}

GpioBias bias_of(TriggerSettings::Bias bias) {
  switch (bias) {
    case TriggerSettings::Bias::kPullUp:
      return GpioBias::kPullUp;
    case TriggerSettings::Bias::kPullDown:
      return GpioBias::kPullDown;
    case TriggerSettings::Bias::kNone:
      break;
  }
  return GpioBias::kNone;
}

/// Nothing: there is no button.
Result<std::unique_ptr<TriggerSource>> make_trigger(const Settings& settings, const Clock& clock) {
  const TriggerSettings& trigger = settings.trigger;
  if (trigger.backend == TriggerSettings::Backend::kNone) {
    return std::unique_ptr<TriggerSource>();
  }
  GpioTriggerOptions options;
  options.buttons = {{0,
                      {trigger.chip,
                       std::to_string(trigger.line),
                       bias_of(trigger.bias),
                       active_of(trigger.active_low)}}};
  options.settle = trigger.debounce;
  TM_ASSIGN_OR_RETURN(auto source, GpioTrigger::create(options, open_gpio_input, clock));
  return source;
}

/// Empty: there is no light.
IndicatorOpener make_light(const IndicatorSettings& indicator) {
  if (indicator.backend == IndicatorSettings::Backend::kNone || indicator.light_line < 0) {
    return {};
  }
  const auto line = [&indicator](int number) {
    return GpioSpec{
        indicator.chip, std::to_string(number), GpioBias::kNone, active_of(indicator.active_low)};
  };
  GpioIndicatorOptions options;
  options.light = line(indicator.light_line);
  if (indicator.buzzer_line >= 0) {
    options.buzzer = line(indicator.buzzer_line);
  }
  return [options]() -> DeviceResult<std::unique_ptr<Indicator>> {
    TM_ASSIGN_OR_FAULT(auto opened, GpioIndicator::create(options, open_gpio_output));
    return opened;
  };
}

std::unique_ptr<ModelMaker> make_model_worker(const Settings& settings,
                                              const Clock& clock,
                                              ModelObserver observer) {
  auto on_progress = [tell = std::move(observer.on_progress)](const std::string& session_id,
                                                              const Progress& progress) {
    tell({session_id, std::string(to_string(progress.stage)), progress.done, progress.total});
  };
  return std::make_unique<ModelWorker>(
      model_worker_options(settings.reconstruction, settings.scale, TRIGMESH_VERSION),
      clock,
      ModelListeners{
          std::move(observer.on_answer), std::move(on_progress), std::move(observer.on_followed)});
}

}  // namespace

Result<DaemonDevices> make_devices(const Settings& settings, const Clock& clock) {
  DaemonDevices devices;
  TM_ASSIGN_OR_RETURN(devices.camera, make_camera(settings, clock));
  TM_ASSIGN_OR_RETURN(devices.trigger, make_trigger(settings, clock));
  devices.open_light = make_light(settings.indicator);
  devices.make_models = [settings, &clock](ModelObserver observer) {
    return make_model_worker(settings, clock, std::move(observer));
  };
  devices.list_devices = [] { return Result<std::vector<DeviceInfo>>(find_devices()); };
  return devices;
}

std::vector<std::string> unusable_devices(const Settings& settings, const Clock& clock) {
  std::vector<std::string> sentences;
  Result<DaemonDevices> devices = make_devices(settings, clock);
  if (!devices) {
    return {devices.error().message};
  }
  if (const auto started = devices->camera->start(); !started) {
    sentences.push_back(fmt::format("camera: {}", started.error().message));
  }
  devices->camera->stop();
  if (devices->trigger) {
    if (const auto started = devices->trigger->start(); !started) {
      sentences.push_back(fmt::format("trigger: {}", started.error().message));
    }
    devices->trigger->stop();
  }
  if (devices->open_light) {
    if (const auto opened = devices->open_light(); !opened) {
      sentences.push_back(fmt::format("light: {}", opened.error().message));
    }
  }
  return sentences;
}

}  // namespace trigmesh
