#pragma once

#include <cstdint>
#include <string>

#include "firmware/session/session.hpp"

namespace trigmesh {

/// How the making of a model ended.
enum class ModelOutcome : std::uint8_t {
  kReady,      ///< it is in place
  kNone,       ///< the pictures give no model; the report in its place says why
  kFailed,     ///< the work could not be done: storage, memory, a file
  kCancelled,  ///< asked to stop; finished stages are kept
};

/// The answer to ModelMaker::begin.
struct ModelAnswer {
  std::string session_id;
  ModelOutcome outcome = ModelOutcome::kFailed;
  std::string message;  ///< one sentence for people
};

/// Makes the model of one closed session at a time, in the background. The answer comes once for
/// each begin(), by a function given when it is made, on a thread of its own. Thread-compatible.
class ModelMaker {
 public:
  ModelMaker() = default;
  ModelMaker(const ModelMaker&) = delete;
  ModelMaker& operator=(const ModelMaker&) = delete;
  ModelMaker(ModelMaker&&) = delete;
  ModelMaker& operator=(ModelMaker&&) = delete;
  virtual ~ModelMaker() = default;

  /// Begins, or goes on from the stages that are finished. It sets the states of the session, whose
  /// last state stays what it was when it is cancelled. Precondition: every begin() was answered.
  virtual void begin(Session session) = 0;

  /// Asks it to stop soon: answered by kCancelled, or by what came first. Nothing when idle.
  virtual void request_stop() = 0;

  /// Counts up whenever the work gets on; stands still when idle. Thread-safe. A watchdog looks at
  /// it.
  [[nodiscard]] virtual std::uint64_t progress_count() const = 0;
};

}  // namespace trigmesh
