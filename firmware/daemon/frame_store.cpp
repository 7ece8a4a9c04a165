#include "firmware/daemon/frame_store.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "firmware/base/atomic_files.hpp"
#include "firmware/base/check.hpp"
#include "firmware/imaging/frame_image.hpp"
#include "firmware/session/journal.hpp"
#include "firmware/session/layout.hpp"

namespace trigmesh {
namespace {

/// How often the program ended while it made the model of this session, since the work on it was
/// stopped in order or came to an end.
int tries_in(const JournalScan& scan) {
  int tries = 0;
  for (const JournalRecord& record : scan.records) {
    const auto* change = std::get_if<StateChange>(&record.entry);
    if (change == nullptr || change->state == SessionState::kReconstructing) {
      continue;
    }
    const bool has_ended = change->state == SessionState::kClosed && change->why == kFoundAfterEnd;
    tries = has_ended ? tries + 1 : 0;
  }
  return tries;
}

}  // namespace

Result<FrameStore::Found> FrameStore::open() {
  give_up();
  store_.reset();
  auto store = SessionStore::open(place_.files, place_.clock, place_.wall_clock, options_.store);
  if (!store) {
    return tl::unexpected<Error>(std::move(store).error());
  }
  store_.emplace(*std::move(store));
  Found found;
  found.recovery = store_->recovery();
  const auto settled = probe().and_then([&]() -> Result<> {
    TM_ASSIGN_OR_RETURN(const std::vector<SessionInfo> sessions, store_->list());
    for (const SessionInfo& info : sessions) {
      TM_RETURN_IF_ERROR(settle(info, found));
    }
    return {};
  });
  if (!settled) {
    return tl::unexpected<Error>(settled.error());
  }
  is_open_ = true;
  return found;
}

/// A read-only disk opens well.
Result<> FrameStore::probe() {
  const std::filesystem::path file =
      options_.store.root / fmt::format("{}probe", kNewPrefix);  // goes at the next start
  TM_RETURN_IF_ERROR(write_file_atomically(place_.files, file, "writable\n"));
  return remove_tree(place_.files, file);
}

Result<> FrameStore::settle(const SessionInfo& info, Found& found) {
  const std::string& id = info.manifest.id;
  const SessionState state = info.manifest.state;
  if (state == SessionState::kCapturing || state == SessionState::kInterrupted) {
    TM_ASSIGN_OR_RETURN(Session::Opened opened, store_->open_session(id));
    if (opened.session.frames().empty() && !opened.recovery.damaged()) {
      found.removed.push_back(id);
      return store_->remove(id);
    }
    TM_RETURN_IF_ERROR(opened.session.close("the program had ended before it was closed"));
    found.for_models.push_back(id);
  } else if (state == SessionState::kClosed) {
    TM_ASSIGN_OR_RETURN(const bool is_hopeless, has_no_more_tries(found, id));
    if (!is_hopeless) {
      found.for_models.push_back(id);
      return {};
    }
    found.failed.push_back(id);
    TM_ASSIGN_OR_RETURN(Session::Opened opened, store_->open_session(id));
    return opened.session.set_state(
        SessionState::kModelFailed,
        fmt::format("the program ended {} times while it made the model", kMostModelTries));
  }
  return {};
}

/// Only of sessions that were put right just now: the program had ended.
Result<bool> FrameStore::has_no_more_tries(const Found& found, const std::string& id) {
  const auto& recovered = found.recovery.recovered;
  if (std::none_of(
          recovered.begin(), recovered.end(), [&id](const auto& one) { return one.id == id; })) {
    return false;
  }
  TM_ASSIGN_OR_RETURN(const JournalScan scan,
                      read_journal(place_.files, store_->folder_of(id) / kJournalName));
  return tries_in(scan) >= kMostModelTries;
}

void FrameStore::give_up() {
  session_.reset();
  is_open_ = false;
}

Result<FrameStore::Level> FrameStore::level() const {
  Level level;
  TM_ASSIGN_OR_RETURN(level.level, store_->budget().level());
  TM_ASSIGN_OR_RETURN(level.available_bytes, store_->budget().available_bytes());
  return level;
}

Result<std::string> FrameStore::begin_session() {
  NewSession what = options_.session;
  what.entropy ^= static_cast<std::uint64_t>(place_.clock.now().count());
  TM_ASSIGN_OR_RETURN(Session session, store_->create(what));
  session_.emplace(std::move(session));
  return session_->manifest().id;
}

Result<std::string> FrameStore::continue_session(const std::string& id) {
  TM_ASSIGN_OR_RETURN(Session::Opened opened, store_->open_session(id));
  if (opened.session.manifest().camera_profile != options_.session.camera_profile) {
    return fail(ErrorCode::kInvalidArgument,
                "cannot continue session {}: it was captured with another camera profile than the "
                "settings name now",
                id);
  }
  TM_RETURN_IF_ERROR(opened.session.reopen("continued by the operator"));
  session_.emplace(std::move(opened.session));
  return id;
}

Result<std::uint32_t> FrameStore::add_frame(const TimedFrame& timed) {
  const FrameLayout& layout = timed.frame.info().layout;
  if (layout.format == PixelFormat::kJpeg) {
    return session_->add_frame(timed.frame.bytes(), metadata_of(timed));
  }
  TM_ASSIGN_OR_RETURN(const std::vector<std::uint8_t> jpeg,
                      jpeg_of_frame(layout, timed.frame.bytes(), options_.jpeg_quality));
  return session_->add_frame(jpeg, metadata_of(timed));
}

Result<> FrameStore::close_session(const std::string& why, const DropCounts& drops) {
  TM_RETURN_IF_ERROR(session_->record(drops));
  TM_RETURN_IF_ERROR(session_->close(why));
  session_.reset();
  return {};
}

Result<> FrameStore::discard_session() {
  const std::string id = session_->manifest().id;
  session_.reset();
  return store_->remove(id);
}

Result<Session> FrameStore::open_for_model(const std::string& id) {
  TM_ASSIGN_OR_RETURN(Session::Opened opened, store_->open_session(id));
  const SessionState state = opened.session.manifest().state;
  if (state == SessionState::kCapturing || state == SessionState::kInterrupted) {
    TM_RETURN_IF_ERROR(opened.session.close("it could not be closed before"));
  }
  return std::move(opened.session);
}

Result<> FrameStore::model_stopped(const std::string& id, ModelEnd end) {
  TM_ASSIGN_OR_RETURN(Session::Opened opened, store_->open_session(id));
  if (end == ModelEnd::kCancelled) {
    return opened.session.set_state(SessionState::kModelFailed, "the operator cancelled it");
  }
  if (opened.session.manifest().state != SessionState::kReconstructing) {
    return {};
  }
  return opened.session.close("the making of its model was stopped in order");
}

Result<> FrameStore::mark_exported(const std::string& id) {
  TM_ASSIGN_OR_RETURN(Session::Opened opened, store_->open_session(id));
  return opened.session.mark_exported();
}

}  // namespace trigmesh
