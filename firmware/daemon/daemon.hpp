#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <thread>
#include <vector>

#include "drivers/camera/frame_source.hpp"
#include "drivers/device/wake_event.hpp"
#include "drivers/trigger/trigger_source.hpp"
#include "firmware/daemon/control_adapter.hpp"
#include "firmware/daemon/heartbeat.hpp"
#include "firmware/daemon/rig_options.hpp"
#include "firmware/daemon/trigger_reader.hpp"

namespace trigmesh {

/// What a maker of models tells; all functions are thread-safe.
struct ModelObserver {
  std::function<void(ModelAnswer)> on_answer;
  std::function<void(const ProgressEvent&)> on_progress;
  std::function<void(const MapFollowed&)> on_followed;
};

/// The devices of the rig and what stands around it, chosen by the composition root (or a test).
struct DaemonDevices {
  std::unique_ptr<FrameSource> camera;
  std::unique_ptr<TriggerSource> trigger;  ///< nothing: commands only
  IndicatorOpener open_light;              ///< empty: no light
  std::function<std::unique_ptr<ModelMaker>(ModelObserver)> make_models;
  std::function<Result<std::vector<DeviceInfo>>()> list_devices;
};

/// Where it is: files and clocks outlive the daemon.
struct DaemonPlace {
  FileSystem& files;
  const Clock& clock;
  const WallClock& wall_clock;
};

/// All threads of the rig. Used as
///
///     Daemon daemon(options, std::move(devices), place, publish);
///     daemon.start();
///     poll(daemon.camera_tried()), then tell that it is ready
///     daemon.request_end();
///     poll(daemon.ended());
///     daemon.stop();
///
/// Thread-compatible; target() is thread-safe.
class Daemon {
 public:
  /// `publish` tells watchers; thread-safe, outlives the daemon.
  Daemon(DaemonOptions options,
         DaemonDevices devices,
         const DaemonPlace& place,
         std::function<void(std::string_view, const std::string&)> publish);
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;
  Daemon(Daemon&&) = delete;
  Daemon& operator=(Daemon&&) = delete;
  ~Daemon();

  void start();

  /// Set when the camera was started, or could not be.
  [[nodiscard]] const WakeEvent& camera_tried() const { return camera_tried_; }

  /// Set when everything is closed after request_end().
  [[nodiscard]] const WakeEvent& ended() const { return ended_; }

  /// Closes the session in order, stops the model. Thread-safe.
  void request_end();

  /// Joins all threads; what was acknowledged is stored. Again: nothing happens.
  void stop();

  [[nodiscard]] ControlTarget& target() { return control_; }

  [[nodiscard]] const Heartbeats& heartbeats() const { return heartbeats_; }

  [[nodiscard]] const Faults& faults() const { return faults_; }

  [[nodiscard]] const StatusBoard& status() const { return status_; }

  [[nodiscard]] const ModelMaker& models() const { return *models_; }

  [[nodiscard]] InboxCounters inbox_counters() const { return inbox_.counters(); }

 private:
  [[nodiscard]] ModelObserver observer();
  void tell_progress(const ProgressEvent& event);

  const DaemonOptions options_;
  DaemonDevices devices_;
  const Clock& clock_;
  const std::function<void(std::string_view, const std::string&)> publish_;
  Faults faults_;
  Heartbeats heartbeats_;
  StatusBoard status_;
  std::chrono::nanoseconds progress_told_{};  ///< guarded by the lock of status_
  FrameDrops drops_;
  RigQueue rig_queue_;
  CaptureQueue capture_queue_;
  StorageInbox inbox_;
  FrameCopies copies_;
  WakeEvent camera_tried_;
  WakeEvent ended_;
  std::unique_ptr<ModelMaker> models_;
  Light light_;
  Capture capture_;
  Storage storage_;
  Rig rig_;
  std::unique_ptr<TriggerReader> trigger_;
  ControlAdapter control_;
  // Joined in reverse order of the data flow by stop().
  std::jthread light_thread_;
  std::jthread storage_thread_;
  std::jthread rig_thread_;
  std::jthread capture_thread_;
  std::jthread trigger_thread_;
};

}  // namespace trigmesh
