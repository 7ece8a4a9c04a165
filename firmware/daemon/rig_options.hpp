#pragma once

#include <string>

#include "firmware/base/result.hpp"
#include "firmware/daemon/capture.hpp"
#include "firmware/daemon/rig.hpp"
#include "firmware/daemon/storage.hpp"
#include "firmware/settings/settings.hpp"

namespace trigmesh {

/// The options of all threads of the rig.
struct DaemonOptions {
  RigLoopOptions rig;
  CaptureOptions capture;
  StorageOptions storage;
  std::size_t stream_queue_frames = 8;  ///< kept frames of a stream that wait for the storage
  std::size_t copies = 20;              ///< buffers for frames outside the camera
  std::chrono::milliseconds command_patience{30'000};
  std::chrono::nanoseconds repeat_interval = std::chrono::seconds(60);  ///< of lines in the log
  std::string software_version;
};

/// What the settings mean for the rooms below. `profile`: the camera profile as text; empty: none.
[[nodiscard]] DaemonOptions options_of_settings(const Settings& settings,
                                                const std::string& profile,
                                                const std::string& software_version);

}  // namespace trigmesh
