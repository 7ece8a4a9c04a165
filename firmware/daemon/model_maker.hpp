#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <variant>

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

// What a maker of models hears of a capture that goes on, in this order: begin, frames and
// discarded frames, end.

struct CaptureBegan {
  std::string session_id;
  std::filesystem::path work_folder;
  std::string camera_profile;  ///< as in the manifest
};

/// A frame of a video is stored for good.
struct CaptureFrame {
  std::uint32_t number = 0;
  std::filesystem::path file;
};

/// The last frame was discarded.
struct CaptureUndone {};

struct CaptureEnded {};

using CaptureNews = std::variant<CaptureBegan, CaptureFrame, CaptureUndone, CaptureEnded>;

/// What the map says of a frame.
struct MapFollowed {
  std::string session_id;
  FrameMapped frame;
  std::size_t photographs = 0;  ///< mapped so far
  std::size_t tracked = 0;      ///< of these, with a pose
  bool closes_loop = false;     ///< it shows what was seen long before
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

  /// News of a capture. Returns at once.
  virtual void follow(CaptureNews news) = 0;

  /// Asks it to stop soon: answered by kCancelled, or by what came first. Nothing when idle.
  virtual void request_stop() = 0;

  /// Counts up whenever the work gets on; stands still when idle. Thread-safe. A watchdog looks at
  /// it.
  [[nodiscard]] virtual std::uint64_t progress_count() const = 0;
};

}  // namespace trigmesh
