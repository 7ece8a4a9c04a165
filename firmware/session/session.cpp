#include "firmware/session/session.hpp"

#include <string_view>
#include <utility>

#include <xxhash.h>

#include <fmt/format.h>

#include "firmware/base/atomic_files.hpp"
#include "firmware/base/check.hpp"
#include "firmware/session/layout.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;

std::string_view as_text(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

template <typename T>
std::string text_or_nothing(const std::optional<T>& value) {
  return value ? fmt::format("{}", *value) : std::string();
}

}  // namespace

std::string render_frame_table(std::span<const FrameKept> frames) {
  std::string table = "name,timestamp_ns,exposure_ns,gain,lens_dioptres\n";
  for (const FrameKept& frame : frames) {
    const FrameMetadata& metadata = frame.metadata;
    table += fmt::format(
        "{},{},{},{},{}\n",
        frame_file_name(frame.number),
        metadata.timestamp.count(),
        metadata.exposure ? fmt::format("{}", metadata.exposure->count()) : std::string(),
        text_or_nothing(metadata.gain),
        text_or_nothing(metadata.lens_dioptres));
  }
  return table;
}

bool Session::accepts_frames() const {
  return manifest_.state == SessionState::kCapturing ||
         manifest_.state == SessionState::kInterrupted;
}

fs::path Session::frame_path(std::uint32_t number) const {
  return folder_ / kFramesName / frame_file_name(number);
}

fs::path Session::staged_model() const {
  return folder_ / fmt::format(".{}.part", kModelName);
}

fs::path Session::model() const {
  return folder_ / kModelName;
}

fs::path Session::work_folder() const {
  return folder_ / kWorkName;
}

Result<> Session::discard_work() {
  return remove_tree(*context_.files, work_folder());
}

Result<std::uint32_t> Session::add_frame(std::span<const std::uint8_t> jpeg,
                                         const FrameMetadata& metadata) {
  if (!accepts_frames() || jpeg.empty() || metadata.timestamp.count() < 0) {
    return fail(
        ErrorCode::kInvalidArgument,
        "cannot add a frame of {} bytes at {} ns to session {} ({}): it must have bytes and "
        "a time, and the session must be open",
        jpeg.size(),
        metadata.timestamp.count(),
        manifest_.id,
        to_string(manifest_.state));
  }
  TM_RETURN_IF_ERROR(context_.budget->admit(jpeg.size()));
  const FrameKept frame{next_number_, jpeg.size(), XXH3_64bits(jpeg.data(), jpeg.size()), metadata};
  ++next_number_;  // also after a failure: a number stands for one picture only
  const fs::path path = frame_path(frame.number);
  Result<> stored = write_file_atomically(*context_.files, path, as_text(jpeg));
  if (stored) {
    stored = journal_.append(frame);
  }
  if (!stored) {
    if (!journal_.is_broken()) {  // else its record may be there; opening the session again tells
      (void)context_.files->remove_file(path);
    }
    return tl::unexpected<Error>(std::move(stored).error());
  }
  context_.budget->add(jpeg.size());
  frames_.push_back(frame);
  return frame.number;
}

Result<std::uint32_t> Session::undo_last_frame() {
  if (!accepts_frames()) {
    return fail(ErrorCode::kInvalidArgument,
                "cannot discard a frame of session {}: it is {}",
                manifest_.id,
                to_string(manifest_.state));
  }
  if (frames_.empty()) {
    return fail(ErrorCode::kInsufficientData,
                "cannot discard the last frame of session {}: it has none",
                manifest_.id);
  }
  const FrameKept frame = frames_.back();
  TM_RETURN_IF_ERROR(journal_.append(FrameRefused{
      FrameRefusal::kUndone, frame.number, frame.metadata.sensor_sequence, /*value=*/0.0}));
  frames_.pop_back();
  context_.budget->remove(frame.size_bytes);
  (void)context_.files->remove_file(frame_path(frame.number));  // else the next opening removes it
  return frame.number;
}

Result<> Session::record(JournalEntry entry) {
  if (std::holds_alternative<FrameKept>(entry) || std::holds_alternative<StateChange>(entry) ||
      (std::holds_alternative<FrameRefused>(entry) && must_be_durable(entry))) {
    return fail(ErrorCode::kInvalidArgument,
                "frames kept or undone and states of session {} are not recorded directly",
                manifest_.id);
  }
  return journal_.append(std::move(entry));
}

Result<> Session::set_state(SessionState state, const std::string& why) {
  if (state == SessionState::kReconstructing) {
    // Also the sign for the next start that the journal may know more than a settled manifest.
    TM_RETURN_IF_ERROR(make_directory(*context_.files, work_folder(), Durability::kSynced));
  }
  return state == SessionState::kClosed ? close(why) : change_state(state, why);
}

Result<> Session::change_state(SessionState state, const std::string& why) {
  TM_RETURN_IF_ERROR(journal_.append(StateChange{state, why}));
  SessionManifest changed = manifest_;
  changed.state = state;
  changed.frame_count = static_cast<std::uint32_t>(frames_.size());
  changed.exported = false;  // the copy does not have this
  manifest_ = changed;       // as the journal says, also when the manifest cannot be written now
  return write_manifest(*context_.files, folder_, manifest_);
}

Result<> Session::reopen(const std::string& why) {
  return accepts_frames() ? Result<>() : change_state(SessionState::kCapturing, why);
}

Result<> Session::close(const std::string& why) {
  if (manifest_.state == SessionState::kClosed) {
    return {};
  }
  TM_RETURN_IF_ERROR(write_frame_table());
  return change_state(SessionState::kClosed, why);
}

Result<> Session::write_frame_table() {
  if (!table_complete_) {
    return {};
  }
  return write_file_atomically(
      *context_.files, folder_ / kFrameTableName, render_frame_table(frames_));
}

Result<> Session::publish_model() {
  const fs::path staged = staged_model();
  TM_RETURN_IF_ERROR(sync_tree(*context_.files, staged));
  TM_ASSIGN_OR_RETURN(const std::uint64_t size_bytes, tree_size_bytes(*context_.files, staged));
  TM_ASSIGN_OR_RETURN(const std::uint64_t replaced_bytes,
                      tree_size_bytes(*context_.files, model()));
  TM_RETURN_IF_ERROR(replace_directory(*context_.files, staged, model()));
  context_.budget->add(size_bytes);
  context_.budget->remove(replaced_bytes);
  return {};
}

Result<> Session::mark_exported() {
  SessionManifest changed = manifest_;
  changed.exported = true;
  TM_RETURN_IF_ERROR(write_manifest(*context_.files, folder_, changed));
  manifest_ = std::move(changed);
  return {};
}

}  // namespace trigmesh
