#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "firmware/base/result.hpp"

namespace trigmesh {

// What the operator may set; one struct a section of trigmesh.toml, one field a key. Units, ranges
// and the words of every key stand in settings_description.hpp, from which the file is read and
// config/trigmesh.toml is written.

struct CameraSettings {
  enum class Backend { kAuto, kV4l2, kLibcamera, kReplay };
  enum class Format { kAuto, kMjpg, kYuyv, kNv12, kGrey };
  enum class ReplaySpeed { kRecorded, kFastest, kLockstep };

  Backend backend = Backend::kAuto;
  std::string device;
  int width_px = 1280;
  int height_px = 720;
  int rate_hz = 30;
  Format format = Format::kAuto;
  std::chrono::microseconds exposure{0};
  double gain = 0.0;
  int white_balance_k = 0;
  double focus_dioptres = -1.0;
  bool lock_controls = true;
  std::string profile;
  ReplaySpeed replay_speed = ReplaySpeed::kRecorded;

  bool operator==(const CameraSettings&) const = default;
};

struct TriggerSettings {
  enum class Backend { kNone, kGpiod };
  enum class Bias { kNone, kPullUp, kPullDown };

  Backend backend = Backend::kGpiod;
  std::string chip = "gpiochip0";
  int line = 17;
  Bias bias = Bias::kPullUp;
  bool active_low = true;
  std::chrono::milliseconds debounce{10};
  std::chrono::milliseconds long_press{1000};
  std::chrono::milliseconds double_press{300};

  bool operator==(const TriggerSettings&) const = default;
};

struct IndicatorSettings {
  enum class Backend { kNone, kGpiod };

  Backend backend = Backend::kGpiod;
  std::string chip = "gpiochip0";
  int light_line = 27;
  int buzzer_line = -1;
  bool active_low = false;

  bool operator==(const IndicatorSettings&) const = default;
};

struct CaptureSettings {
  enum class Mode { kStill, kVideo };
  enum class VideoTrigger { kHold, kToggle };

  Mode mode = Mode::kVideo;
  VideoTrigger video_trigger = VideoTrigger::kHold;
  int every_nth_sharp_frame = 0;
  std::chrono::milliseconds still_wait{2000};
  std::chrono::seconds continue_within{0};
  int queue_frames = 8;
  int jpeg_quality = 95;

  bool operator==(const CaptureSettings&) const = default;
};

struct StorageSettings {
  enum class Removal { kNever, kWhenNeeded };

  std::string root = "/var/lib/trigmesh/sessions";
  int quota_mb = 0;
  int reserve_mb = 1000;
  int warn_mb = 1000;
  Removal remove_old = Removal::kNever;
  bool remove_without_model = false;
  bool remove_not_exported = false;

  bool operator==(const StorageSettings&) const = default;
};

struct ReconstructionSettings {
  enum class Preset { kPreview, kStandard, kFine };

  bool enabled = true;
  bool live = true;
  Preset preset = Preset::kStandard;
  int memory_limit_mb = 0;
  int threads = 0;
  int priority = 10;
  int seed = 0;
  std::chrono::seconds stall_limit{900};

  bool operator==(const ReconstructionSettings&) const = default;
};

struct ScaleSettings {
  enum class Dictionary {
    kBits4Of50,
    kBits4Of100,
    kBits4Of250,
    kBits4Of1000,
    kBits5Of50,
    kBits5Of100,
    kBits5Of250,
    kBits5Of1000,
    kBits6Of50,
    kBits6Of100,
    kBits6Of250,
    kBits6Of1000,
  };
  enum class Up { kNone, kCard };

  Dictionary dictionary = Dictionary::kBits4Of50;
  double marker_side_m = 0.0;
  std::map<int, double> marker_sides_m;                      ///< by number
  std::map<std::pair<int, int>, double> marker_distances_m;  ///< the smaller number first
  Up up = Up::kNone;

  bool operator==(const ScaleSettings&) const = default;
};

struct LogSettings {
  enum class Level { kError, kWarn, kInfo, kDebug };

  Level level = Level::kInfo;
  std::chrono::seconds repeat_interval{60};

  bool operator==(const LogSettings&) const = default;
};

struct Settings {
  CameraSettings camera;
  TriggerSettings trigger;
  IndicatorSettings indicator;
  CaptureSettings capture;
  StorageSettings storage;
  ReconstructionSettings reconstruction;
  ScaleSettings scale;
  LogSettings log;

  bool operator==(const Settings&) const = default;
};

/// Largest settings file, bytes.
inline constexpr std::size_t kMaxSettingsBytes = std::size_t{64} << 10U;

/// Reads the text of a settings file; a key that is missing keeps its default. kInvalidArgument:
/// all that is wrong, a line each, in the order of the file: `FILE:LINE: key: what must be` - a
/// value of the wrong type or out of its range, an unknown key (with the nearest known one), two
/// values that do not go together; or no TOML. kLimitExceeded when it is longer than
/// kMaxSettingsBytes.
[[nodiscard]] Result<Settings> parse_settings(std::string_view text, std::string_view file);

/// The same from a file. kNotFound, kIo as well.
[[nodiscard]] Result<Settings> load_settings(const std::filesystem::path& file);

/// The commented file with these values: every key with what it does, unit, range and default.
[[nodiscard]] std::string render_settings(const Settings& settings);

}  // namespace trigmesh
