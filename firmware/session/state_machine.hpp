#pragma once

#include <chrono>
#include <cstdint>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "firmware/session/press_detector.hpp"
#include "firmware/session/space_budget.hpp"

namespace trigmesh {

// The rig as a pure function: what is, and what happens, give what is next and what is to be done.
// Nothing here waits, reads a clock or touches a device.

enum class CaptureMode { kStill, kVideo };
enum class VideoTrigger { kHold, kToggle };

struct RigOptions {
  CaptureMode mode = CaptureMode::kVideo;
  VideoTrigger video_trigger = VideoTrigger::kHold;
  bool makes_models = true;  ///< a closed session goes on to a reconstruction
};

/// What the rig is to whoever looks at it.
enum class RigPhase { kIdle, kCapturing, kWorking, kFault };

/// The model that is being made.
enum class JobState {
  kNone,
  kRunning,
  kPausing,  ///< asked to stop because a capture needs the machine; finished stages are kept
  kPaused,   ///< goes on when the capture is over
};

struct RigState {
  bool session_open = false;
  bool streaming = false;    ///< video frames are being kept
  bool closing = false;      ///< closes when the last awaited answer has come
  std::uint32_t stills = 0;  ///< asked for and not answered
  std::uint32_t drains = 0;  ///< streams that were stopped and may still store frames
  std::uint32_t undos = 0;   ///< asked for and not answered
  std::uint32_t frames = 0;  ///< kept in the open session
  bool camera_present = true;
  StorageLevel storage = StorageLevel::kOk;
  JobState job = JobState::kNone;
  std::uint32_t queued = 0;  ///< closed sessions that wait for their model, the job's not included
  bool stopping = false;     ///< asked to end: no press is taken any more
  bool ended = false;        ///< EndProgram was given
  bool resume_streaming = false;  ///< the camera went while streaming

  bool operator==(const RigState&) const = default;
};

[[nodiscard]] RigPhase phase_of(const RigState& state);

// Events.
struct FrameStored {};  ///< of a stream, acknowledged by the store

struct StillStored {};  ///< answers TakeStill: acknowledged by the store

struct StillMissed {};  ///< answers TakeStill: no frame came in time, or it could not be stored

struct StreamEnded {};  ///< answers StopStreaming: what it had was stored, no frame follows

struct FrameUndone {};  ///< answers UndoLastFrame

struct UndoFailed {};  ///< answers UndoLastFrame: the frame is still there

/// It could not be begun, or its journal is broken: it is no longer open, and no answer that
/// belongs to it follows. What it has is safe, the next start of the program closes it.
struct SessionFailed {};

/// The session that was opened had frames already: it is continued.
struct SessionContinued {
  std::uint32_t frames = 0;
};

struct CameraLost {};

struct CameraBack {};

struct StorageChanged {
  StorageLevel level = StorageLevel::kOk;
};

struct JobDone {};

struct JobFailed {};

struct JobCancelled {};  ///< answers PauseJob; else the operator cancelled it, and it is over

/// Closed sessions without a model were found: they wait for it.
struct ModelsFound {
  std::uint32_t count = 0;
};

struct StartRequest {};  ///< a command: begin a session, and in video mode stream

struct FinishRequest {};  ///< a command: close the session

struct StillRequest {  ///< a command: one frame now
  std::chrono::nanoseconds time{};
};

struct UndoRequest {};  ///< a command: discard the last frame

struct StopRequest {};  ///< the program shall end

using RigEvent = std::variant<Press,
                              FrameStored,
                              StillStored,
                              StillMissed,
                              StreamEnded,
                              FrameUndone,
                              UndoFailed,
                              SessionFailed,
                              SessionContinued,
                              CameraLost,
                              CameraBack,
                              StorageChanged,
                              JobDone,
                              JobFailed,
                              JobCancelled,
                              ModelsFound,
                              StartRequest,
                              FinishRequest,
                              StillRequest,
                              UndoRequest,
                              StopRequest>;

enum class PressRefusal {
  kNoCamera,
  kStorageFull,
  kStopping,
  kClosing,      ///< the session waits for its last frames
  kNothingToDo,  ///< nothing to finish or to discard
};

[[nodiscard]] std::string_view to_string(PressRefusal reason);

// Actions, to be done in their order.
struct OpenSession {};

/// Answered by StillStored or StillMissed.
struct TakeStill {
  std::chrono::nanoseconds time{};  ///< of the press: the frame contains or follows it
};

struct StartStreaming {};

struct StopStreaming {};  ///< answered by StreamEnded

struct UndoLastFrame {};  ///< answered by FrameUndone or UndoFailed

struct CloseSession {};

struct DiscardSession {};  ///< close and remove: it has no frames

struct QueueModel {};  ///< the session that was just closed waits for its model

struct StartJob {};  ///< of the oldest waiting session; also goes on with a paused one

struct PauseJob {};  ///< answered by JobCancelled (or JobDone, JobFailed: it was quicker)

struct RefusePress {
  PressRefusal reason = PressRefusal::kNothingToDo;
};

struct EndProgram {};  ///< everything is closed

using RigAction = std::variant<OpenSession,
                               TakeStill,
                               StartStreaming,
                               StopStreaming,
                               UndoLastFrame,
                               CloseSession,
                               DiscardSession,
                               QueueModel,
                               StartJob,
                               PauseJob,
                               RefusePress,
                               EndProgram>;

struct RigStep {
  RigState state;
  std::vector<RigAction> actions;
};

/// One step. Rules:
/// - still: a short press takes one frame (and begins the session if none is open); a long press
///   closes the session; a double press discards the last frame.
/// - video, hold: the button's way down begins (or continues) the stream, its way up ends it and
///   closes the session. Long, short and double presses say nothing more.
/// - video, toggle: a short press begins the stream, the next ends it and closes the session; a
/// long
///   press closes too; a double press discards the last frame.
/// - Every press that asks for something is answered by what it asks for or by RefusePress.
/// - A session closes only when every still, stream and undo was answered: no frame that the store
///   has acknowledged comes too late for it. Without frames it is discarded.
/// - A capture pauses the job; the job goes on when no session is open. A capture never waits.
/// - A full disk or a lost camera: nothing new begins. Full: the session is closed. Lost: it stays
///   open, and a stream goes on when the camera is back.
[[nodiscard]] RigStep step(const RigOptions& options, RigState state, const RigEvent& event);

}  // namespace trigmesh
