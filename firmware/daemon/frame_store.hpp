#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "firmware/daemon/capture_types.hpp"
#include "firmware/daemon/storage_inbox.hpp"
#include "firmware/session/store.hpp"

namespace trigmesh {

struct FrameStoreOptions {
  StoreOptions store;
  /// What new sessions are captured with.
  NewSession session;
  int jpeg_quality = 95;  ///< of frames that are no JPEG, [1, 100]
};

/// What the files work with; all of it outlives the store.
struct StorePlace {
  FileSystem& files;
  const Clock& clock;
  const WallClock& wall_clock;
};

/// The sessions on disk and the one that is open: opened again whenever the disk comes back. One
/// thread.
class FrameStore {
 public:
  FrameStore(FrameStoreOptions options, const StorePlace& place)
      : options_(std::move(options)), place_(place) {}

  /// What opening found.
  struct Found {
    StoreRecovery recovery;
    std::vector<std::string> for_models;  ///< ids that wait for a model, the oldest first
    std::vector<std::string> failed;      ///< ids whose model ended the program too often
    std::vector<std::string> removed;     ///< ids of sessions without a frame
  };

  /// After so many programs that ended while they made a model, it is not tried again.
  static constexpr int kMostModelTries = 3;

  /// Opens the folder of all sessions, and closes those that a crash left open. kIo, kNoSpace: the
  /// disk cannot be written. Precondition: no session that was given out is in use.
  [[nodiscard]] Result<Found> open();

  [[nodiscard]] bool is_open() const { return is_open_; }

  /// The disk failed: nothing is used until open() again.
  void give_up();

  /// What may still be captured, and how that is to be judged. kIo.
  struct Level {
    StorageLevel level = StorageLevel::kOk;
    std::uint64_t available_bytes = 0;
  };

  [[nodiscard]] Result<Level> level() const;

  /// Its id. Precondition: is_open(). kNoSpace, kIo.
  [[nodiscard]] Result<std::string> begin_session();

  /// Opens a closed session again for more frames; its id. Precondition: is_open(), nobody uses it.
  /// kNotFound, kCorruptData, kNoSpace, kIo; kInvalidArgument: it was captured with another camera
  /// profile.
  [[nodiscard]] Result<std::string> continue_session(const std::string& id);

  // The open session. Precondition of all but has_session: has_session().
  [[nodiscard]] bool has_session() const { return session_.has_value(); }

  [[nodiscard]] Session& session() { return *session_; }

  /// JPEG bytes as they are, others encoded. The number of the frame, once it is safe.
  [[nodiscard]] Result<std::uint32_t> add_frame(const TimedFrame& timed);

  /// Closes it with the counts of what was dropped since it began.
  [[nodiscard]] Result<> close_session(const std::string& why, const DropCounts& drops);

  /// Removes it.
  [[nodiscard]] Result<> discard_session();

  /// It can take nothing any more.
  void drop_session() { session_.reset(); }

  // Closed sessions. Precondition: is_open().
  [[nodiscard]] Result<Session> open_for_model(const std::string& id);
  /// Its model was stopped in order: the next start does not count it as a program that ended.
  /// kCancelled: and does not try again.
  [[nodiscard]] Result<> model_stopped(const std::string& id, ModelEnd end);

  [[nodiscard]] SessionStore& store() { return *store_; }

  [[nodiscard]] Result<> mark_exported(const std::string& id);

 private:
  [[nodiscard]] Result<> probe();
  [[nodiscard]] Result<> settle(const SessionInfo& info, Found& found);
  [[nodiscard]] Result<bool> has_no_more_tries(const Found& found, const std::string& id);

  FrameStoreOptions options_;
  StorePlace place_;
  std::optional<SessionStore> store_;
  std::optional<Session> session_;
  bool is_open_ = false;  ///< the store stays when it is given up: a session may be out
};

}  // namespace trigmesh
