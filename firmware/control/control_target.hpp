#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/session/retention.hpp"
#include "firmware/session/state_machine.hpp"

namespace trigmesh {

/// What the rig says about itself.
struct ControlStatus {
  RigPhase phase = RigPhase::kIdle;
  bool camera_present = false;
  StorageLevel storage = StorageLevel::kOk;
  std::string session_id;    ///< of the open session; empty: none
  std::uint32_t frames = 0;  ///< kept in it
  JobState job = JobState::kNone;
  std::uint32_t queued_models = 0;    ///< closed sessions that wait for their model
  std::uint64_t available_bytes = 0;  ///< that may still be captured
  std::string software_version;
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
  /// Closes the session.
  [[nodiscard]] virtual Result<> finish() = 0;
  /// One frame now.
  [[nodiscard]] virtual Result<> still() = 0;
  [[nodiscard]] virtual Result<std::vector<SessionInfo>> sessions() = 0;
};

}  // namespace trigmesh
