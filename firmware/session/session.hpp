#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "firmware/base/clock.hpp"
#include "firmware/base/file_system.hpp"
#include "firmware/base/result.hpp"
#include "firmware/session/journal.hpp"
#include "firmware/session/manifest.hpp"
#include "firmware/session/space_budget.hpp"

namespace trigmesh {

/// What a session works with; all of it outlives the session; none is null.
struct SessionContext {
  FileSystem* files;
  const Clock* clock;
  const WallClock* wall_clock;
  SpaceBudget* budget;
};

/// What opening a session found to be put right.
struct SessionRecovery {
  bool was_open = false;                ///< it was being captured when the program ended
  std::uint64_t torn_bytes = 0;         ///< cut off the end of the journal
  std::vector<JournalDamage> damages;   ///< of the journal
  std::size_t removed_files = 0;        ///< half-written, or never acknowledged
  std::vector<std::uint32_t> missing;   ///< frames of the journal without a whole file
  std::vector<std::uint32_t> unlisted;  ///< frames that a damaged journal does not tell of; kept

  [[nodiscard]] bool damaged() const {
    return !damages.empty() || !missing.empty() || !unlisted.empty();
  }
};

/// One session on disk. A frame is acknowledged when add_frame returns: from then on it survives a
/// power cut at any instant. Used as
///
///     session.record(EdgeRecord{..});
///     TM_ASSIGN_OR_RETURN(auto number, session.add_frame(jpeg, metadata));
///     session.close("long press");
///     session.set_state(SessionState::kReconstructing, "..");
///     // put a model together in session.staged_model()
///     session.publish_model();  // again for each part that is added
///     session.set_state(SessionState::kModelReady, "..");
///     session.discard_work();
///
/// Thread-compatible.
class Session {
 public:
  struct Opened;

  /// Opens the folder of a session and puts right what a crash left: the torn tail of the journal
  /// is cut, half-written and never acknowledged files go, a model that was being put in place is
  /// there whole or not at all, the frame table and the manifest say what the journal says. A
  /// session that was being captured becomes kInterrupted. kNotFound, kCorruptData (manifest), kIo.
  [[nodiscard]] static Result<Opened> open(const SessionContext& context,
                                           const std::filesystem::path& folder);

  /// Stores a picture as it is. Its number, once the file and its record are on the disk. After an
  /// error nothing of it remains. kNoSpace: quota, reserve or disk; kInvalidArgument: no bytes, a
  /// time before 0, or the session is closed; kIo.
  [[nodiscard]] Result<std::uint32_t> add_frame(std::span<const std::uint8_t> jpeg,
                                                const FrameMetadata& metadata);

  /// Discards the frame that was added last: its number. kInsufficientData when there is none,
  /// kInvalidArgument when the session is closed, kIo.
  [[nodiscard]] Result<std::uint32_t> undo_last_frame();

  /// Writes into the journal what is neither a frame kept or undone nor a state: those have
  /// functions of their own (kInvalidArgument). kNoSpace, kIo.
  [[nodiscard]] Result<> record(JournalEntry entry);

  /// A later state, with the reason for people. kReconstructing makes the work folder, kClosed is
  /// close(). kNoSpace, kIo.
  [[nodiscard]] Result<> set_state(SessionState state, const std::string& why);

  /// Takes frames again, after the last one; its model, if it has one, stays until the next is in
  /// its place. kNoSpace, kIo.
  [[nodiscard]] Result<> reopen(const std::string& why);

  /// No more frames; writes the frame table. Again: no failure. kNoSpace, kIo.
  [[nodiscard]] Result<> close(const std::string& why);

  /// Where a model is put together, in sight of nobody.
  [[nodiscard]] std::filesystem::path staged_model() const;

  /// Where the published model is; missing before the first publish_model().
  [[nodiscard]] std::filesystem::path model() const;

  /// Puts what is in staged_model() in the place of model/ in one step, after an fsync of all of
  /// it. The state is set_state()'s: a model whose session was left kReconstructing may be half
  /// done, and is made again. kNotFound when nothing is staged, kNoSpace, kIo.
  [[nodiscard]] Result<> publish_model();

  /// Where finished pieces of the model are kept while it is made, hidden from exports. It stays
  /// over a restart until the session has its model, or it is certain that it will have none.
  [[nodiscard]] std::filesystem::path work_folder() const;

  /// Removes the work folder; no failure when there is none. kIo.
  [[nodiscard]] Result<> discard_work();

  [[nodiscard]] Result<> mark_exported();

  [[nodiscard]] const SessionManifest& manifest() const { return manifest_; }

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

  /// Kept frames in the order of their numbers.
  [[nodiscard]] const std::vector<FrameKept>& frames() const { return frames_; }

  [[nodiscard]] std::filesystem::path frame_path(std::uint32_t number) const;

  /// See JournalWriter: open the session again to go on.
  [[nodiscard]] bool is_broken() const { return journal_.is_broken(); }

 private:
  friend class SessionOpener;
  friend class SessionStore;

  Session(const SessionContext& context,
          std::filesystem::path folder,
          JournalWriter journal,
          SessionManifest manifest)
      : context_(context),
        folder_(std::move(folder)),
        journal_(std::move(journal)),
        manifest_(std::move(manifest)) {}

  [[nodiscard]] bool accepts_frames() const;
  [[nodiscard]] Result<> change_state(SessionState state, const std::string& why);
  [[nodiscard]] Result<> write_frame_table();

  SessionContext context_;
  std::filesystem::path folder_;
  JournalWriter journal_;
  SessionManifest manifest_;
  std::vector<FrameKept> frames_;
  std::uint32_t next_number_ = 1;
  /// Frames are there that no record tells of: a table without them would hide them.
  bool table_complete_ = true;
};

struct Session::Opened {
  Session session;
  SessionRecovery recovery;
};

/// frames.csv: name,timestamp_ns,exposure_ns,gain,lens_dioptres; empty where the camera does not
/// say. What Recording of drivers/camera/replay reads.
[[nodiscard]] std::string render_frame_table(std::span<const FrameKept> frames);

}  // namespace trigmesh
