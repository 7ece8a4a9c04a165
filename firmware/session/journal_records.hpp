#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "sfm/keyframes/frame_verdict.hpp"

namespace trigmesh {

/// What a journal tells. A closed list: the number of a kind on disk is its place in JournalEntry,
/// so new kinds go to the end and none goes away.

enum class EdgeDirection : std::uint8_t { kPress, kRelease };

/// The trigger line changed.
struct EdgeRecord {
  EdgeDirection direction = EdgeDirection::kPress;
  std::chrono::nanoseconds kernel_time{};  ///< the kernel's monotonic clock

  bool operator==(const EdgeRecord&) const = default;
};

/// What the camera said about a frame.
struct FrameMetadata {
  std::chrono::nanoseconds timestamp{};  ///< middle of the exposure, kernel's monotonic clock; >= 0
  std::optional<std::chrono::nanoseconds> exposure;
  std::optional<double> gain;           ///< 1 = none
  std::optional<double> lens_dioptres;  ///< focus, 1/m
  std::uint64_t sensor_sequence = 0;    ///< counts all frames of the sensor, gaps included

  bool operator==(const FrameMetadata&) const = default;
};

/// A frame is stored: its file was on the disk before this record was written, and whoever offered
/// it has been told so only after this record was on the disk too.
struct FrameKept {
  std::uint32_t number = 0;        ///< of the file, frames/NUMBER.jpg; from 1, never used twice
  std::uint64_t size_bytes = 0;    ///< of the file
  std::uint64_t content_hash = 0;  ///< XXH3, 64 bit, of the file
  FrameMetadata metadata;

  bool operator==(const FrameKept&) const = default;
};

enum class FrameRefusal : std::uint8_t {
  kUndone,           ///< it was kept, then discarded by the operator
  kBlurred,          ///< value: its sharpness
  kTooLittleMotion,  ///< value: parallax to the last keyframe, degrees
  kTooFast,          ///< value: share of corners that were lost
  kExposureJump,     ///< value: ratio of brightness
  kDuplicate,        ///< the camera gave the same frame again
  kCorrupt,          ///< its bytes are no picture
  kNoSpace,          ///< quota or reserve
  kNotStored,        ///< writing it failed
};

[[nodiscard]] std::string_view to_string(FrameRefusal reason);

/// A frame was not kept, or is kept no longer.
struct FrameRefused {
  FrameRefusal reason = FrameRefusal::kUndone;
  std::uint32_t number = 0;  ///< of the kept frame (kUndone), else 0
  std::uint64_t sensor_sequence = 0;
  double value = 0.0;  ///< what decided, see the reason; else 0

  bool operator==(const FrameRefused&) const = default;
};

/// A kept frame became a keyframe of the map.
struct KeyframeChosen {
  std::uint32_t number = 0;

  bool operator==(const KeyframeChosen&) const = default;
};

/// Where a session stands.
enum class SessionState : std::uint8_t {
  kCapturing,       ///< frames may come
  kInterrupted,     ///< found open after a crash, or the camera is away; may go on
  kClosed,          ///< no more frames; waits for its model
  kReconstructing,  ///< its model is being made
  kModelReady,
  kModelFailed,
};

[[nodiscard]] std::string_view to_string(SessionState state);

/// Why the state changed of a session that was found at work: the program or the power had ended.
inline constexpr std::string_view kFoundAfterEnd = "found after the program had ended";

struct StateChange {
  SessionState state = SessionState::kCapturing;
  std::string why;  ///< for people; at most kMaxJournalTextBytes

  bool operator==(const StateChange&) const = default;
};

/// What the session was captured with: enough to do it again.
struct SettingsUsed {
  std::string toml;
  std::uint64_t seed = 0;

  bool operator==(const SettingsUsed&) const = default;
};

/// Frames that never came as far as a decision, since the session began.
struct DropCounts {
  std::uint64_t sensor = 0;   ///< gaps in the sensor's sequence
  std::uint64_t queue = 0;    ///< dropped because the program was busy
  std::uint64_t corrupt = 0;  ///< short or broken buffers

  bool operator==(const DropCounts&) const = default;
};

struct Note {
  std::string text;

  bool operator==(const Note&) const = default;
};

/// What the selector of keyframes said of a frame of a stream.
struct FrameJudged {
  std::uint64_t sensor_sequence = 0;
  std::chrono::nanoseconds timestamp{};  ///< middle of the exposure; >= 0
  FrameVerdict verdict = FrameVerdict::kKept;
  FrameMeasures measures;

  bool operator==(const FrameJudged&) const = default;
};

/// Verdicts, in the order in which they became certain: several in a record, at most
/// kMaxJudgedFrames.
struct FramesJudged {
  std::vector<FrameJudged> frames;

  bool operator==(const FramesJudged&) const = default;
};

inline constexpr std::size_t kMaxJudgedFrames = 1024;

/// How a frame stood to the map that grew while it was captured.
enum class MapFollowing : std::uint8_t {
  kWaiting,  ///< no map yet: no parallax so far
  kTracked,
  kLost,
};

/// "waiting", "tracked", "lost".
[[nodiscard]] std::string_view to_string(MapFollowing following);

/// A kept frame was mapped while the capture went on.
struct FrameMapped {
  std::uint32_t number = 0;
  MapFollowing following = MapFollowing::kTracked;
  std::chrono::nanoseconds duration{};  ///< of the mapping; >= 0
  std::uint32_t waiting = 0;            ///< frames that waited to be mapped, then

  bool operator==(const FrameMapped&) const = default;
};

using JournalEntry = std::variant<EdgeRecord,
                                  FrameKept,
                                  FrameRefused,
                                  KeyframeChosen,
                                  StateChange,
                                  SettingsUsed,
                                  DropCounts,
                                  Note,
                                  FramesJudged,
                                  FrameMapped>;

/// An entry with the times at which it was written.
struct JournalRecord {
  std::uint32_t sequence = 0;            ///< 0, 1, 2, .. in one journal
  std::chrono::nanoseconds monotonic{};  ///< since the start of the machine
  std::chrono::nanoseconds wall{};       ///< since 1970; may jump
  JournalEntry entry;

  bool operator==(const JournalRecord&) const = default;
};

/// Longest text in a record; a settings file fits many times.
inline constexpr std::size_t kMaxJournalTextBytes = std::size_t{256} << 10U;

}  // namespace trigmesh
