#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "firmware/base/bounded_queue.hpp"
#include "firmware/base/result.hpp"
#include "firmware/daemon/capture_types.hpp"
#include "firmware/daemon/model_maker.hpp"
#include "firmware/daemon/rig_events.hpp"
#include "firmware/session/journal_records.hpp"
#include "firmware/session/space_budget.hpp"

namespace trigmesh {

// What the rig's loop hears from the other threads.

/// The button moved.
struct EdgeSeen {
  EdgeRecord edge;
};

/// The camera gives frames, or gives none any more.
struct CameraChanged {
  CameraPresence presence = CameraPresence::kAway;
};

struct SessionOpened {
  SessionSerial serial{};
  std::string id;
  std::uint32_t frames = 0;  ///< that it has already: it is continued
};

/// It could not be begun, or can take nothing any more.
struct SessionLost {
  SessionSerial serial{};
  Error error;
};

struct StreamFrameStored {
  SessionSerial serial{};
  std::uint32_t number = 0;
};

/// What was said of a frame of the stream.
struct FrameSeen {
  SessionSerial serial{};
  FrameJudged frame;
};

/// Answers a still: the number of the frame, or why there is none.
struct StillAnswered {
  SessionSerial serial{};
  StillTicket ticket{};
  Result<std::uint32_t> number = 0;
};

/// Everything of a stream that was ended is stored.
struct StreamDrained {
  SessionSerial serial{};
};

struct UndoAnswered {
  SessionSerial serial{};
  Result<std::uint32_t> number = 0;  ///< of the frame that went
};

struct StorageReport {
  StorageLevel level = StorageLevel::kOk;
  std::uint64_t available_bytes = 0;
};

/// Sessions that wait for a model, the oldest first; found when the store was opened.
struct ModelsWaiting {
  std::vector<std::string> ids;
};

enum class CommandKind : std::uint8_t { kStart, kContinue, kFinish, kStill, kUndo, kCancelModel };

using CommandAnswer = std::function<void(Result<>)>;

/// From outside; answered once.
struct Command {
  CommandKind kind = CommandKind::kStart;
  std::chrono::nanoseconds time{};  ///< when it was asked for
  CommandAnswer answer;
  std::string session_id{};  ///< of kContinue
};

/// The program shall end.
struct EndRequest {};

using RigInput = std::variant<EdgeSeen,
                              CameraChanged,
                              SessionOpened,
                              SessionLost,
                              StreamFrameStored,
                              FrameSeen,
                              MapFollowed,
                              StillAnswered,
                              StreamDrained,
                              UndoAnswered,
                              StorageReport,
                              ModelsWaiting,
                              ModelAnswer,
                              Command,
                              EndRequest>;

using RigQueue = BoundedQueue<RigInput>;

// What the capture thread is told.

/// The button went down: its frame is held until it is known what the press means.
struct ExpectPress {
  std::chrono::nanoseconds time{};
};

/// Presses up to and with this one are no stills, unless they were asked for.
struct ForgetPresses {
  std::chrono::nanoseconds until{};
};

struct TakeStillFrame {
  SessionSerial serial{};
  StillTicket ticket{};
  std::chrono::nanoseconds time{};
};

struct BeginStream {
  SessionSerial serial{};
  std::chrono::nanoseconds from{};
};

struct EndStream {
  SessionSerial serial{};
};

/// A session begins.
struct HoldCamera {
  SessionSerial serial{};
};

/// The session is over.
struct ReleaseCamera {
  SessionSerial serial{};
};

using CaptureOrder = std::variant<ExpectPress,
                                  ForgetPresses,
                                  TakeStillFrame,
                                  BeginStream,
                                  EndStream,
                                  HoldCamera,
                                  ReleaseCamera>;

using CaptureQueue = BoundedQueue<CaptureOrder>;

}  // namespace trigmesh
