#include "firmware/session/session_opener.hpp"

#include <algorithm>
#include <utility>

#include "firmware/base/atomic_files.hpp"
#include "firmware/base/check.hpp"
#include "firmware/base/file_bytes.hpp"
#include "firmware/session/layout.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;

Result<std::vector<FolderEntry>> entries_of(FileSystem& files, const fs::path& folder) {
  auto entries = files.list(folder);
  if (!entries) {
    return tl::unexpected<Error>(system_error(entries.error(), "cannot list", folder));
  }
  return *std::move(entries);
}

/// Also while frames come: a capture is mapped while it goes on.
bool still_gets_model(SessionState state) {
  return state != SessionState::kModelReady && state != SessionState::kModelFailed;
}

}  // namespace

Result<Session::Opened> Session::open(const SessionContext& context, const fs::path& folder) {
  return SessionOpener(context, folder).open();
}

Result<Session::Opened> SessionOpener::open() {
  TM_ASSIGN_OR_RETURN(SessionManifest manifest, read_manifest(*context_.files, folder_));
  TM_ASSIGN_OR_RETURN(
      JournalWriter::Opened opened,
      JournalWriter::open(
          *context_.files, folder_ / kJournalName, *context_.clock, *context_.wall_clock));
  recovery_.torn_bytes = opened.scan.torn_bytes;
  recovery_.damages = std::move(opened.scan.damages);
  replay_journal(opened.scan.records);
  TM_RETURN_IF_ERROR(remove_leftovers());
  TM_RETURN_IF_ERROR(match_frame_files());
  Session session(context_, folder_, std::move(opened.writer), std::move(manifest));
  for (const auto& [number, frame] : kept_) {
    session.frames_.push_back(frame);
  }
  session.next_number_ = last_number_ + 1;
  session.table_complete_ = recovery_.unlisted.empty();
  TM_RETURN_IF_ERROR(settle_state(session));
  return Session::Opened{std::move(session), std::move(recovery_)};
}

void SessionOpener::replay_journal(const std::vector<JournalRecord>& records) {
  for (const JournalRecord& record : records) {
    if (const auto* kept = std::get_if<FrameKept>(&record.entry)) {
      kept_[kept->number] = *kept;
      last_number_ = std::max(last_number_, kept->number);
    } else if (const auto* refused = std::get_if<FrameRefused>(&record.entry)) {
      if (refused->reason == FrameRefusal::kUndone) {
        kept_.erase(refused->number);
      }
    } else if (const auto* change = std::get_if<StateChange>(&record.entry)) {
      state_ = change->state;
    }
  }
}

Result<> SessionOpener::remove_leftovers() {
  TM_RETURN_IF_ERROR(finish_replacement(*context_.files, folder_ / kModelName));
  TM_ASSIGN_OR_RETURN(const std::vector<FolderEntry> entries, entries_of(*context_.files, folder_));
  for (const FolderEntry& entry : entries) {
    const bool is_needed = entry.name == kWorkName && still_gets_model(state_);
    if (is_hidden_name(entry.name) && !is_needed) {
      TM_RETURN_IF_ERROR(remove_tree(*context_.files, folder_ / entry.name));
      ++recovery_.removed_files;
    }
  }
  return {};
}

Result<> SessionOpener::match_frame_files() {
  const fs::path frames = folder_ / kFramesName;
  TM_ASSIGN_OR_RETURN(const std::vector<FolderEntry> entries, entries_of(*context_.files, frames));
  std::map<std::uint32_t, std::uint64_t> sizes_bytes;
  for (const FolderEntry& entry : entries) {
    const std::optional<std::uint32_t> number = frame_number_of(entry.name);
    const bool recorded = number && kept_.contains(*number);
    if (number) {
      last_number_ = std::max(last_number_, *number);
    }
    if (recorded) {
      sizes_bytes[*number] = entry.status.size_bytes;
    } else if (number && !recovery_.damages.empty()) {
      recovery_.unlisted.push_back(*number);  // its record may be the damaged one
    } else if (number || is_hidden_name(entry.name)) {
      TM_RETURN_IF_ERROR(remove_tree(*context_.files, frames / entry.name));
      ++recovery_.removed_files;
    }
  }
  std::erase_if(kept_, [&](const auto& item) {
    const auto found = sizes_bytes.find(item.first);
    const bool whole = found != sizes_bytes.end() && found->second == item.second.size_bytes;
    if (!whole) {
      recovery_.missing.push_back(item.first);
    }
    return !whole;
  });
  return sync_directory(*context_.files, frames);
}

Result<> SessionOpener::settle_state(Session& session) {
  recovery_.was_open = state_ == SessionState::kCapturing;
  SessionState settled = state_;
  if (recovery_.was_open) {
    settled = SessionState::kInterrupted;
  } else if (state_ == SessionState::kReconstructing) {
    settled = SessionState::kClosed;  // the model may lack parts; what is finished is found again
  }
  // The table first: a manifest of a settled state promises that it is there.
  const fs::path table = folder_ / kFrameTableName;
  const auto written = read_file(*context_.files, table, kMaxJournalBytes);
  if (!session.table_complete_) {
    TM_RETURN_IF_ERROR(remove_tree(*context_.files, table));
  } else if (!written || *written != render_frame_table(session.frames_)) {
    TM_RETURN_IF_ERROR(session.write_frame_table());
  }
  if (settled != state_) {
    session.manifest_.recoveries += recovery_.was_open ? 1 : 0;
    return session.change_state(settled, std::string(kFoundAfterEnd));
  }
  if (session.manifest_.state != state_) {
    session.manifest_.state = state_;
    session.manifest_.frame_count = static_cast<std::uint32_t>(session.frames_.size());
    session.manifest_.exported = false;
    return write_manifest(*context_.files, folder_, session.manifest_);
  }
  return {};
}

}  // namespace trigmesh
