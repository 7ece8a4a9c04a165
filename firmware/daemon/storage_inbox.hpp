#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/daemon/capture_types.hpp"
#include "firmware/session/journal_records.hpp"
#include "firmware/session/retention.hpp"

namespace trigmesh {

// What the storage thread is told, done in this order.

struct OpenSessionOrder {
  SessionSerial serial{};
  std::string continued_id{};  ///< a closed session that is continued; empty: a new one
  bool or_a_new_one = false;   ///< where that cannot be continued: a press is not lost
};

/// Into the journal of the open session; when none is open it is left out.
struct RecordOrder {
  SessionSerial serial{};
  JournalEntry entry;
};

/// A frame of a stream.
struct StreamFrameOrder {
  SessionSerial serial{};
  TimedFrame frame;
};

/// The frame of a press.
struct StillFrameOrder {
  SessionSerial serial{};
  StillTicket ticket{};
  TimedFrame frame;
};

/// Nothing of a stream follows.
struct StreamDoneOrder {
  SessionSerial serial{};
  std::string note;  ///< for the journal
};

struct UndoOrder {
  SessionSerial serial{};
};

enum class SessionEnd : std::uint8_t { kKeep, kDiscard };

struct CloseOrder {
  SessionSerial serial{};
  SessionEnd end = SessionEnd::kKeep;
  std::string why;
};

struct BeginModelOrder {
  std::string id;
};

/// Asks the model to stop soon.
struct StopModelOrder {};

enum class ModelEnd : std::uint8_t {
  kOver,       ///< it is there, or there is none
  kStopped,    ///< by request, in order: it may go on later
  kCancelled,  ///< by the operator: it stays without a model
};

/// The model of this session is not at work any more.
struct ModelEndedOrder {
  std::string id;
  ModelEnd end = ModelEnd::kOver;
};

// Questions. `answer` is called on the storage thread, once.

struct ListOrder {
  std::function<void(Result<std::vector<SessionInfo>>)> answer;
};

struct RemoveOrder {
  std::string id;
  std::function<void(Result<>)> answer;
};

/// Keeps a session from being removed or exported twice. The answer is its folder.
struct BeginExportOrder {
  std::string id;
  std::function<void(Result<std::filesystem::path>)> answer;
};

enum class ExportEnd : std::uint8_t { kVerified, kFailed };

struct EndExportOrder {
  std::string id;
  ExportEnd end = ExportEnd::kFailed;
  std::function<void(Result<>)> answer;
};

using StorageOrder = std::variant<OpenSessionOrder,
                                  RecordOrder,
                                  StreamFrameOrder,
                                  StillFrameOrder,
                                  StreamDoneOrder,
                                  UndoOrder,
                                  CloseOrder,
                                  BeginModelOrder,
                                  StopModelOrder,
                                  ModelEndedOrder,
                                  ListOrder,
                                  RemoveOrder,
                                  BeginExportOrder,
                                  EndExportOrder>;

struct InboxCounters {
  std::uint64_t dropped_frames = 0;
  std::size_t most_frames = 0;
};

/// Orders to the storage thread in the order in which they were given. At most `max_stream_frames`
/// frames of streams wait: one more drops the oldest of them and is counted. Nothing else is ever
/// dropped: stills are as many as there are copies of frames (FrameCopies), and whoever gives more
/// than `max_others` other orders waits. Thread-safe.
class StorageInbox {
 public:
  StorageInbox(std::size_t max_stream_frames, std::size_t max_others)
      : max_stream_frames_(max_stream_frames), max_others_(max_others) {}

  /// Waits for room where the order is neither a frame nor a still. After close() it is dropped.
  void push(StorageOrder order);

  /// The next order; nothing when none came within `timeout`, or when it is closed and empty.
  [[nodiscard]] std::optional<StorageOrder> pop(std::chrono::nanoseconds timeout);

  /// No more orders: what is there can still be taken.
  void close();

  /// Closed, and everything was taken.
  [[nodiscard]] bool is_finished() const;

  [[nodiscard]] InboxCounters counters() const;

 private:
  /// The oldest frame of a stream. Precondition: mutex_ is held, there is one.
  [[nodiscard]] StorageOrder take_oldest_stream_frame();

  const std::size_t max_stream_frames_;
  const std::size_t max_others_;
  mutable std::mutex mutex_;
  std::condition_variable has_order_;
  std::condition_variable has_room_;
  std::deque<StorageOrder> orders_;  ///< guarded by mutex_, as what follows
  std::size_t stream_frames_ = 0;
  std::size_t stills_ = 0;
  bool is_closed_ = false;
  InboxCounters counters_;
};

}  // namespace trigmesh
