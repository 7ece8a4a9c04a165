#include "firmware/daemon/rig_options.hpp"

#include <algorithm>

#include "firmware/daemon/keyframe_stream.hpp"
#include "sfm/exchange/camera_profile.hpp"

namespace trigmesh {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr std::uint64_t kBytesPerMb = 1'000'000;
/// An edge is heard of when the contact is at rest; threads and the camera's driver are late, too.
constexpr milliseconds kLateness(100);
constexpr std::size_t kMostHistory = 32;

std::uint64_t bytes_of_mb(int megabytes) {
  return static_cast<std::uint64_t>(megabytes) * kBytesPerMb;
}

std::vector<WantedControl> wanted_controls(const CameraSettings& camera) {
  std::vector<WantedControl> wanted;
  if (camera.exposure.count() > 0) {
    wanted.push_back({ControlId::kExposure, static_cast<double>(camera.exposure.count())});
  }
  if (camera.gain > 0.0) {
    wanted.push_back({ControlId::kGain, camera.gain});
  }
  if (camera.white_balance_k > 0) {
    wanted.push_back({ControlId::kWhiteBalance, static_cast<double>(camera.white_balance_k)});
  }
  if (camera.focus_dioptres >= 0.0) {
    wanted.push_back({ControlId::kFocus, camera.focus_dioptres});
  }
  return wanted;
}

RigLoopOptions rig_options(const Settings& settings) {
  const CaptureSettings& capture = settings.capture;
  RigLoopOptions options;
  options.rig.mode =
      capture.mode == CaptureSettings::Mode::kStill ? CaptureMode::kStill : CaptureMode::kVideo;
  options.rig.video_trigger = capture.video_trigger == CaptureSettings::VideoTrigger::kHold
                                  ? VideoTrigger::kHold
                                  : VideoTrigger::kToggle;
  options.rig.makes_models = settings.reconstruction.enabled;
  options.presses.long_press = settings.trigger.long_press;
  options.presses.double_press = settings.trigger.double_press;
  options.edge_delay = settings.trigger.debounce + milliseconds(20);
  options.continue_within = capture.continue_within;
  return options;
}

/// Frames that come before a press is heard of.
std::size_t frames_until_heard(const Settings& settings) {
  const nanoseconds interval = nanoseconds(std::chrono::seconds(1)) / settings.camera.rate_hz;
  const auto late = static_cast<std::size_t>((settings.trigger.debounce + kLateness) / interval);
  return std::clamp<std::size_t>(late + 3, 4, kMostHistory);
}

/// Copies that a selector of frames holds: the best of a group and its successor, or all that may
/// still become keyframes.
std::size_t selector_copies(const CaptureOptions& options) {
  return options.group_size == 0 ? options.keyframes.max_waiting : 2;
}

/// What the selector of keyframes has to know of the lens. A profile that cannot be read is told by
/// whoever makes a model with it.
KeyframeOptions keyframe_options(const std::string& profile) {
  KeyframeOptions options;
  if (const auto parsed = parse_camera_profile(profile, "camera profile"); parsed) {
    const Camera& camera = parsed->camera;
    options.focal_ratio = focal_ratio_of(camera.fx_px, std::max(camera.width_px, camera.height_px));
  }
  return options;
}

CaptureOptions capture_options(const Settings& settings, const std::string& profile) {
  CaptureOptions options;
  options.keyframes = keyframe_options(profile);
  options.frame_interval = nanoseconds(std::chrono::seconds(1)) / settings.camera.rate_hz;
  options.keyframes.max_waiting = most_waiting_keyframes(options.keyframes, options.frame_interval);
  options.stills.wait = settings.capture.still_wait;
  options.stills.history = 0;
  if (settings.capture.mode == CaptureSettings::Mode::kStill) {
    options.stills.history = frames_until_heard(settings);
  }
  options.group_size = static_cast<std::size_t>(settings.capture.every_nth_sharp_frame);
  if (settings.capture.mode == CaptureSettings::Mode::kVideo) {
    options.pre_trigger_frames = frames_until_heard(settings);
  }
  options.hold = {wanted_controls(settings.camera), settings.camera.lock_controls};
  options.silence = std::max<nanoseconds>(std::chrono::seconds(2), 10 * options.frame_interval);
  return options;
}

StorageOptions storage_options(const Settings& settings,
                               const std::string& profile,
                               const std::string& software_version) {
  const StorageSettings& storage = settings.storage;
  StorageOptions options;
  options.store.store.root = storage.root;
  options.store.store.limits = {
      bytes_of_mb(storage.quota_mb), bytes_of_mb(storage.reserve_mb), bytes_of_mb(storage.warn_mb)};
  options.store.store.retention = {storage.remove_old == StorageSettings::Removal::kWhenNeeded
                                       ? RetentionRules::Removal::kWhenNeeded
                                       : RetentionRules::Removal::kNever,
                                   storage.remove_without_model,
                                   storage.remove_not_exported};
  options.store.store.software_version = software_version;
  NewSession& session = options.store.session;
  session.mode = settings.capture.mode == CaptureSettings::Mode::kStill ? "still" : "video";
  session.camera_profile = profile;
  session.settings = render_settings(settings);
  session.seed = static_cast<std::uint64_t>(settings.reconstruction.seed);
  options.store.jpeg_quality = settings.capture.jpeg_quality;
  options.tells_captures = settings.capture.mode == CaptureSettings::Mode::kVideo &&
                           settings.reconstruction.enabled && settings.reconstruction.live;
  return options;
}

}  // namespace

DaemonOptions options_of_settings(const Settings& settings,
                                  const std::string& profile,
                                  const std::string& software_version) {
  DaemonOptions options;
  options.rig = rig_options(settings);
  options.capture = capture_options(settings, profile);
  options.storage = storage_options(settings, profile, software_version);
  options.stream_queue_frames = static_cast<std::size_t>(settings.capture.queue_frames);
  // What the shelf or the ring before a press holds, what the selector holds, what waits, one being
  // stored and one on its way.
  options.copies = options.capture.stills.history + options.capture.pre_trigger_frames +
                   options.stream_queue_frames + 2;
  if (settings.capture.mode == CaptureSettings::Mode::kVideo) {
    options.copies += selector_copies(options.capture);
  }
  options.command_patience = settings.capture.still_wait + milliseconds(30'000);
  options.repeat_interval = settings.log.repeat_interval;
  options.software_version = software_version;
  return options;
}

}  // namespace trigmesh
