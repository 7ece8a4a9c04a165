#include "firmware/session/store.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "firmware/base/atomic_files.hpp"
#include "firmware/base/check.hpp"
#include "firmware/base/file_bytes.hpp"
#include "firmware/session/layout.hpp"
#include "firmware/session/session_id.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;

/// A new session must have room for at least this: its journal, manifest and a few frames.
constexpr std::uint64_t kFirstBytes = std::uint64_t{4} << 20U;

Result<std::vector<FolderEntry>> entries_of(FileSystem& files, const fs::path& folder) {
  auto entries = files.list(folder);
  if (!entries) {
    return tl::unexpected<Error>(system_error(entries.error(), "cannot list", folder));
  }
  return *std::move(entries);
}

bool is_settled(SessionState state) {
  return state == SessionState::kClosed || state == SessionState::kModelReady ||
         state == SessionState::kModelFailed;
}

/// Whether something was left half done. Pieces of a model that is still to be made are none.
bool has_leftovers(const std::vector<FolderEntry>& entries, SessionState state) {
  return std::any_of(entries.begin(), entries.end(), [state](const FolderEntry& entry) {
    const bool is_needed = entry.name == kWorkName && state == SessionState::kClosed;
    return (is_hidden_name(entry.name) && !is_needed) || entry.name.ends_with(".old");
  });
}

}  // namespace

SessionStore::SessionStore(FileSystem& files,
                           const Clock& clock,
                           const WallClock& wall_clock,
                           const StoreOptions& options)
    : files_(&files),
      clock_(&clock),
      wall_clock_(&wall_clock),
      options_(options),
      budget_(std::make_unique<SpaceBudget>(files, options.root, options.limits)) {}

Result<SessionStore> SessionStore::open(FileSystem& files,
                                        const Clock& clock,
                                        const WallClock& wall_clock,
                                        const StoreOptions& options) {
  TM_RETURN_IF_ERROR(make_directory(files, options.root, Durability::kSynced));
  SessionStore store(files, clock, wall_clock, options);
  TM_RETURN_IF_ERROR(store.recover());
  TM_RETURN_IF_ERROR(store.measure());
  return store;
}

Result<> SessionStore::measure() {
  TM_ASSIGN_OR_RETURN(const std::uint64_t used_bytes, tree_size_bytes(*files_, options_.root));
  budget_->set_used(used_bytes);
  return {};
}

Result<> SessionStore::recover() {
  TM_ASSIGN_OR_RETURN(const std::vector<FolderEntry> entries, entries_of(*files_, options_.root));
  for (const FolderEntry& entry : entries) {
    if (entry.name.starts_with(kNewPrefix) || entry.name.starts_with(kTrashPrefix)) {
      TM_RETURN_IF_ERROR(remove_tree(*files_, options_.root / entry.name));
    } else if (entry.status.kind == FileKind::kFolder && is_session_id(entry.name)) {
      if (const Result<> done = recover_session(entry.name); !done) {
        recovery_.unreadable.push_back({entry.name, done.error()});
      }
    }
  }
  return sync_directory(*files_, options_.root);
}

Result<> SessionStore::recover_session(const std::string& id) {
  const fs::path folder = folder_of(id);
  TM_ASSIGN_OR_RETURN(const SessionManifest manifest, read_manifest(*files_, folder));
  TM_ASSIGN_OR_RETURN(const std::vector<FolderEntry> entries, entries_of(*files_, folder));
  if (is_settled(manifest.state) && !has_leftovers(entries, manifest.state)) {
    return {};  // closed in order: nothing to read
  }
  TM_ASSIGN_OR_RETURN(Session::Opened opened, Session::open(context(), folder));
  recovery_.recovered.push_back({id, std::move(opened.recovery)});
  return {};
}

Result<std::string> SessionStore::stage_new(const NewSession& what) {
  TM_ASSIGN_OR_RETURN(const std::vector<FolderEntry> entries, entries_of(*files_, options_.root));
  std::string newest;
  for (const FolderEntry& entry : entries) {
    newest = is_session_id(entry.name) ? std::max(newest, entry.name) : newest;
  }
  SessionManifest manifest;
  manifest.created_wall = wall_clock_->now();
  manifest.id = next_session_id(newest, manifest.created_wall, what.entropy);
  manifest.mode = what.mode;
  manifest.camera_profile = what.camera_profile;
  manifest.settings = what.settings;
  manifest.software_version = options_.software_version;
  const fs::path staged = options_.root / fmt::format("{}{}", kNewPrefix, manifest.id);
  TM_RETURN_IF_ERROR(remove_tree(*files_, staged));
  TM_RETURN_IF_ERROR(make_directory(*files_, staged / kFramesName));
  TM_RETURN_IF_ERROR(write_manifest(*files_, staged, manifest));
  TM_ASSIGN_OR_RETURN(JournalWriter::Opened journal,
                      JournalWriter::open(*files_, staged / kJournalName, *clock_, *wall_clock_));
  TM_RETURN_IF_ERROR(journal.writer.append(SettingsUsed{what.settings, what.seed}));
  TM_RETURN_IF_ERROR(
      journal.writer.append(StateChange{SessionState::kCapturing, "the session begins"}));
  TM_RETURN_IF_ERROR(sync_tree(*files_, staged));
  return manifest.id;
}

Result<Session> SessionStore::put_in_place(const std::string& id) {
  const fs::path staged = options_.root / fmt::format("{}{}", kNewPrefix, id);
  const fs::path folder = folder_of(id);
  if (const auto renamed = files_->rename(staged, folder); !renamed) {
    return tl::unexpected<Error>(
        system_error(renamed.error(), "cannot put the new session in place at", folder));
  }
  TM_RETURN_IF_ERROR(sync_directory(*files_, options_.root));
  TM_ASSIGN_OR_RETURN(SessionManifest manifest, read_manifest(*files_, folder));
  TM_ASSIGN_OR_RETURN(JournalWriter::Opened journal,
                      JournalWriter::open(*files_, folder / kJournalName, *clock_, *wall_clock_));
  return Session(context(), folder, std::move(journal.writer), std::move(manifest));
}

Result<Session> SessionStore::create(const NewSession& what) {
  TM_ASSIGN_OR_RETURN(const std::vector<std::string> removed, make_room(kFirstBytes));
  (void)removed;  // the list shows it
  TM_RETURN_IF_ERROR(budget_->admit(kFirstBytes));
  TM_ASSIGN_OR_RETURN(const std::string id, stage_new(what));
  Result<Session> session = put_in_place(id);
  if (!session) {  // what cannot be removed either is removed or recovered at the next start
    (void)remove_tree(*files_, options_.root / fmt::format("{}{}", kNewPrefix, id));
    (void)remove(id);
  }
  return session;
}

Result<Session::Opened> SessionStore::open_session(const std::string& id) {
  if (!is_session_id(id)) {
    return fail(ErrorCode::kInvalidArgument, "'{}' is not the id of a session", id);
  }
  return Session::open(context(), folder_of(id));
}

Result<std::vector<SessionInfo>> SessionStore::list() {
  TM_ASSIGN_OR_RETURN(const std::vector<FolderEntry> entries, entries_of(*files_, options_.root));
  std::vector<SessionInfo> sessions;
  for (const FolderEntry& entry : entries) {
    if (!is_session_id(entry.name)) {
      continue;
    }
    const fs::path folder = folder_of(entry.name);
    Result<SessionManifest> manifest = read_manifest(*files_, folder);
    if (!manifest || manifest->id != entry.name) {
      continue;  // told once, in recovery()
    }
    TM_ASSIGN_OR_RETURN(const std::uint64_t size_bytes, tree_size_bytes(*files_, folder));
    sessions.push_back(
        {*std::move(manifest), files_->status(folder / kModelName).has_value(), size_bytes});
  }
  return sessions;
}

Result<> SessionStore::remove(const std::string& id) {
  if (!is_session_id(id)) {
    return fail(ErrorCode::kInvalidArgument, "'{}' is not the id of a session", id);
  }
  const fs::path trash = options_.root / fmt::format("{}{}", kTrashPrefix, id);
  TM_RETURN_IF_ERROR(remove_tree(*files_, trash));
  if (const auto renamed = files_->rename(folder_of(id), trash); !renamed) {
    return tl::unexpected<Error>(system_error(renamed.error(), "cannot remove", folder_of(id)));
  }
  TM_RETURN_IF_ERROR(sync_directory(*files_, options_.root));
  TM_RETURN_IF_ERROR(remove_tree(*files_, trash));
  return measure();
}

Result<std::vector<std::string>> SessionStore::make_room(std::uint64_t bytes) {
  TM_ASSIGN_OR_RETURN(const std::uint64_t available, budget_->available_bytes());
  if (available >= bytes || options_.retention.removal == RetentionRules::Removal::kNever) {
    return std::vector<std::string>();
  }
  TM_ASSIGN_OR_RETURN(const std::vector<SessionInfo> sessions, list());
  std::vector<std::string> victims =
      choose_victims(sessions, options_.retention, bytes - available);
  for (const std::string& id : victims) {
    TM_RETURN_IF_ERROR(remove(id));
  }
  return victims;
}

}  // namespace trigmesh
