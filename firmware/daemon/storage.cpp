#include "firmware/daemon/storage.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace trigmesh {
namespace {

/// How long the thread waits for an order before it shows that it lives.
constexpr std::chrono::milliseconds kTurn(500);

/// A disk that is full is well.
bool is_about_disk(const Error& error) {
  return error.code == ErrorCode::kIo || error.code == ErrorCode::kNotFound;
}

}  // namespace

void Storage::run() {
  while (!parts_.inbox.is_finished()) {
    parts_.heartbeat.beat();
    look_after_disk();
    if (auto order =
            parts_.inbox.pop(std::min<std::chrono::nanoseconds>(kTurn, options_.check_interval))) {
      std::visit([this](auto& one) { do_order(std::move(one)); }, *order);
    }
  }
  tell_capture_ended();
  if (store_.has_session()) {  // it was not closed in order: the next start does it
    store_.drop_session();
  }
}

void Storage::look_after_disk() {
  const std::chrono::nanoseconds now = parts_.clock.now();
  if (last_check_ && now - *last_check_ < options_.check_interval) {
    return;
  }
  last_check_ = now;
  if (!store_.is_open()) {
    open_store();
  }
  check_level();
}

void Storage::open_store() {
  if (!model_id_.empty()) {
    return;  // it still uses what is open; it was asked to stop
  }
  const auto found = store_.open();
  if (!found) {
    disk_failed(found.error());
    return;
  }
  parts_.faults.clear("storage");
  tell_found(*found);
}

void Storage::tell_found(const FrameStore::Found& found) {
  for (const StoreRecovery::Recovered& recovered : found.recovery.recovered) {
    const SessionRecovery& details = recovered.details;
    write_log(details.damaged() ? LogLevel::kError : LogLevel::kWarn,
              "a session was not closed in order and is put right",
              {{"session", recovered.id},
               {"torn_bytes", std::to_string(details.torn_bytes)},
               {"removed_files", std::to_string(details.removed_files)},
               {"damages", std::to_string(details.damages.size())},
               {"missing_frames", std::to_string(details.missing.size())}});
  }
  for (const StoreRecovery::Unreadable& unreadable : found.recovery.unreadable) {
    write_log(
        LogLevel::kError,
        fmt::format("a session cannot be read and is left alone: {}", unreadable.error.message),
        {{"session", unreadable.name}});
  }
  for (const std::string& id : found.failed) {
    write_log(LogLevel::kError,
              "the model of a session ended the program too often and is not tried again",
              {{"session", id}});
  }
  for (const std::string& id : found.removed) {
    write_log(LogLevel::kInfo, "a session without frames is removed", {{"session", id}});
  }
  (void)parts_.rig.push(ModelsWaiting{found.for_models});
}

void Storage::report(StorageLevel level, std::uint64_t available_bytes) {
  if (!told_ || told_->level != level || told_->available_bytes != available_bytes) {
    told_ = StorageReport{level, available_bytes};
    (void)parts_.rig.push(*told_);
  }
}

void Storage::check_level() {
  if (!store_.is_open()) {
    return;
  }
  const auto level = store_.level();
  if (!level) {
    disk_failed(level.error());
    return;
  }
  if (level->level == StorageLevel::kFull) {
    parts_.faults.report("storage",
                         "no space is left for frames: export and remove sessions, or change "
                         "quota_mb and reserve_mb");
  } else {
    parts_.faults.clear("storage");
  }
  report(level->level, level->available_bytes);
}

void Storage::disk_failed(const Error& error) {
  parts_.faults.report("storage",
                       fmt::format("{}; sessions cannot be kept until it can be written: look at "
                                   "the disk, its mount and the rights of the folder",
                                   error.message));
  if (store_.has_session()) {
    (void)parts_.rig.push(SessionLost{serial_, error});
  }
  tell_capture_ended();
  store_.give_up();
  parts_.models.request_stop();
  report(StorageLevel::kFull, 0);
}

void Storage::do_order(const OpenSessionOrder& order) {
  serial_ = order.serial;
  if (!store_.is_open()) {
    open_store();  // perhaps it is back
  }
  if (!store_.is_open()) {
    (void)parts_.rig.push(
        SessionLost{order.serial, Error{ErrorCode::kIo, parts_.faults.text_of("storage")}});
    return;
  }
  drops_at_begin_ = parts_.drops.now();
  const Result<std::string> id = open_session(order);
  if (!id) {
    (void)parts_.rig.push(SessionLost{order.serial, id.error()});
    // A session that has to be that one may simply not be there.
    const bool names_a_session = !order.continued_id.empty() && !order.or_a_new_one;
    if (is_about_disk(id.error()) && !names_a_session) {
      disk_failed(id.error());
    } else {
      check_level();
    }
    return;
  }
  write_log(LogLevel::kInfo, "session begins", {{"session", *id}});
  tell_capture_began();
  (void)parts_.rig.push(SessionOpened{
      order.serial, *id, static_cast<std::uint32_t>(store_.session().frames().size())});
}

Result<std::string> Storage::open_session(const OpenSessionOrder& order) {
  if (order.continued_id.empty()) {
    return store_.begin_session();
  }
  Result<std::string> id = check_unused(order.continued_id).and_then([&] {
    return store_.continue_session(order.continued_id);
  });
  if (id || !order.or_a_new_one) {
    return id;
  }
  write_log(LogLevel::kWarn,
            fmt::format("a new session begins instead: {}", id.error().message),
            {{"session", order.continued_id}});
  return store_.begin_session();
}

void Storage::do_order(RecordOrder order) {
  if (!is_current(order.serial)) {
    return;
  }
  if (const auto recorded = store_.session().record(std::move(order.entry)); !recorded) {
    parts_.faults.report("journal", recorded.error().message);
    if (store_.session().is_broken()) {
      disk_failed(recorded.error());
    }
  } else {
    parts_.faults.clear("journal");
  }
}

Result<std::uint32_t> Storage::store_frame(const TimedFrame& timed) {
  Result<std::uint32_t> number = store_.add_frame(timed);
  if (number) {
    write_log(LogLevel::kDebug,
              "frame is stored",
              {{"session", store_.session().manifest().id}, {"frame", std::to_string(*number)}});
    tell_capture(CaptureFrame{*number, store_.session().frame_path(*number)});
    return number;
  }
  refuse(timed, number.error());
  return number;
}

void Storage::tell_capture(CaptureNews news) {
  if (is_capture_told_) {
    parts_.models.follow(std::move(news));
  }
}

void Storage::tell_capture_began() {
  is_capture_told_ = options_.tells_captures;
  const Session& session = store_.session();
  tell_capture(CaptureBegan{
      session.manifest().id, session.work_folder(), session.manifest().camera_profile});
  for (const FrameKept& frame : session.frames()) {  // of a session that is continued
    tell_capture(CaptureFrame{frame.number, session.frame_path(frame.number)});
  }
}

void Storage::tell_capture_ended() {
  tell_capture(CaptureEnded{});
  is_capture_told_ = false;
}

void Storage::refuse(const TimedFrame& timed, const Error& error) {
  FrameRefused refused;
  refused.reason = FrameRefusal::kNotStored;
  if (error.code == ErrorCode::kNoSpace) {
    refused.reason = FrameRefusal::kNoSpace;
  } else if (error.code == ErrorCode::kCorruptData) {
    refused.reason = FrameRefusal::kCorrupt;
  }
  refused.sensor_sequence = timed.sequence;
  (void)store_.session().record(refused);  // where the disk is gone, so is its record
  write_log(LogLevel::kError,
            fmt::format("a frame is not stored: {}", error.message),
            {{"session", store_.session().manifest().id}});
}

void Storage::do_order(StreamFrameOrder order) {
  if (!is_current(order.serial)) {
    return;
  }
  const Result<std::uint32_t> number = store_frame(order.frame);
  if (number) {
    (void)parts_.rig.push(StreamFrameStored{order.serial, *number});
    check_level();
  } else if (is_about_disk(number.error())) {
    disk_failed(number.error());
  } else {
    check_level();
  }
}

void Storage::do_order(StillFrameOrder order) {
  if (!is_current(order.serial)) {
    return;
  }
  Result<std::uint32_t> number = store_frame(order.frame);
  const bool is_disk_gone = !number && is_about_disk(number.error());
  const Error error = number ? Error{} : number.error();
  (void)parts_.rig.push(StillAnswered{order.serial, order.ticket, std::move(number)});
  if (is_disk_gone) {
    disk_failed(error);
  } else {
    check_level();
  }
}

void Storage::do_order(StreamDoneOrder order) {
  if (!is_current(order.serial)) {
    return;
  }
  do_order(RecordOrder{order.serial, Note{std::move(order.note)}});
  (void)parts_.rig.push(StreamDrained{order.serial});
}

void Storage::do_order(UndoOrder order) {
  if (!is_current(order.serial)) {
    return;
  }
  Result<std::uint32_t> number = store_.session().undo_last_frame();
  if (number) {
    tell_capture(CaptureUndone{});
  }
  const bool is_broken = store_.session().is_broken();
  const Error error = number ? Error{} : number.error();
  (void)parts_.rig.push(UndoAnswered{order.serial, std::move(number)});
  if (is_broken) {
    disk_failed(error);
  }
}

void Storage::do_order(const CloseOrder& order) {
  if (!is_current(order.serial)) {
    return;
  }
  const std::string id = store_.session().manifest().id;
  tell_capture_ended();
  // A session that was continued for nothing has its earlier frames.
  const bool keeps = order.end == SessionEnd::kKeep || !store_.session().frames().empty();
  const auto done =
      keeps ? store_.close_session(order.why, drops_of_session()) : store_.discard_session();
  if (done) {
    write_log(LogLevel::kInfo,
              keeps ? "session is closed" : "session without frames is removed",
              {{"session", id}});
    check_level();
    return;
  }
  // What was acknowledged is safe; the next opening of the store closes it.
  store_.drop_session();
  disk_failed(done.error());
}

DropCounts Storage::drops_of_session() const {
  const DropCounts now = parts_.drops.now();
  return {now.sensor - drops_at_begin_.sensor,
          now.queue - drops_at_begin_.queue,
          now.corrupt - drops_at_begin_.corrupt};
}

}  // namespace trigmesh
