#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/session/retention.hpp"
#include "firmware/session/session_export.hpp"
#include "firmware/session/state_machine.hpp"

namespace trigmesh {

/// What the rig says about itself.
struct ControlStatus {
  RigPhase phase = RigPhase::kIdle;
  bool camera_present = false;
  StorageLevel storage = StorageLevel::kOk;
  std::string session_id;    ///< of the open session; empty: none
  std::uint32_t frames = 0;  ///< kept in it
  std::string advice;        ///< what the operator should do now, one sentence; empty: go on
  JobState job = JobState::kNone;
  std::uint32_t queued_models = 0;    ///< closed sessions that wait for their model
  std::uint64_t available_bytes = 0;  ///< that may still be captured
  std::string software_version;
  std::string session_root;       ///< folder of all sessions
  std::string fault;              ///< what keeps it from capturing, one sentence; empty: nothing
  std::string model_session_id;   ///< whose model is being made; empty: none
  std::string model_stage;        ///< of its making: "mapping"
  std::uint64_t model_done = 0;   ///< pieces of the stage that are finished
  std::uint64_t model_total = 0;  ///< all pieces of the stage; 0: not known
  std::uint64_t last_event = 0;   ///< number of the newest event; the server fills it in
};

/// Something that is plugged into the rig.
struct DeviceInfo {
  std::string kind;         ///< "camera", "gpio chip"
  std::string stable_name;  ///< what settings call it: the same after a restart
  std::string model;        ///< as it calls itself
  std::string note;         ///< for people, e.g. "/dev/video0, in use"; may be empty

  bool operator==(const DeviceInfo&) const = default;
};

/// What can be asked of the rig from outside. Called from several threads at once: thread-safe.
class ControlTarget {
 public:
  ControlTarget() = default;
  ControlTarget(const ControlTarget&) = delete;
  ControlTarget& operator=(const ControlTarget&) = delete;
  ControlTarget(ControlTarget&&) = delete;
  ControlTarget& operator=(ControlTarget&&) = delete;
  virtual ~ControlTarget() = default;

  [[nodiscard]] virtual Result<ControlStatus> status() = 0;
  /// Begins a session, and in video mode the stream. An Error says why not (kInsufficientData: not
  /// now; kNoSpace).
  [[nodiscard]] virtual Result<> start() = 0;
  /// Opens a closed session again and goes on as start() does. kInvalidArgument (no id, another
  /// camera profile), kNotFound, kInsufficientData: not now, or its model is being made.
  [[nodiscard]] virtual Result<> continue_session(const std::string& id) = 0;
  /// Closes the session.
  [[nodiscard]] virtual Result<> finish() = 0;
  /// One frame now.
  [[nodiscard]] virtual Result<> still() = 0;
  /// Discards the frame of the open session that was kept last. kInsufficientData: there is none.
  [[nodiscard]] virtual Result<> undo() = 0;
  /// Ends the making of the model; the session stays without one. kInsufficientData: none is made.
  [[nodiscard]] virtual Result<> cancel_model() = 0;
  [[nodiscard]] virtual Result<std::vector<SessionInfo>> sessions() = 0;
  /// Removes a session with its model. kInvalidArgument (no id), kNotFound, kInsufficientData: it
  /// is open, its model is being made or it is being exported.
  [[nodiscard]] virtual Result<> remove_session(const std::string& id) = 0;
  /// A verified copy in the folder `destination` (absolute). Returns when it is done, which takes
  /// as long as the stick needs; tells events "export" meanwhile. Errors of export_session, and
  /// kInsufficientData: the session is open, or another export is on its way.
  [[nodiscard]] virtual Result<ExportReport> export_session(
      const std::string& id, const std::filesystem::path& destination) = 0;
  /// Cameras and GPIO chips that are there.
  [[nodiscard]] virtual Result<std::vector<DeviceInfo>> devices() = 0;
};

}  // namespace trigmesh
