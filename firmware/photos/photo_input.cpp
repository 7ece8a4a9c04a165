#include "firmware/photos/photo_input.hpp"

#include <algorithm>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/base/file_system.hpp"
#include "firmware/photos/session_frames.hpp"
#include "firmware/session/manifest.hpp"

namespace trigmesh {

namespace {

/// A session of the rig knows more than its pictures; one without a manifest is a folder of frames.
Result<> tell_of_session(const std::filesystem::path& session,
                         PhotoSet& photos,
                         std::string& title) {
  const auto manifest = read_manifest(real_file_system(), session);
  if (!manifest && manifest.error().code == ErrorCode::kNotFound) {
    return {};
  }
  TM_RETURN_IF_ERROR(manifest);
  title = manifest->id;
  if (manifest->mode == "video") {
    photos.is_walk = true;
    TM_ASSIGN_OR_RETURN(photos.frames, read_session_frames(session));
  }
  return {};
}

}  // namespace

Result<PhotoSet> open_photos(const std::string& input, Subfolders subfolders, MaskUse masks) {
  RecordingOptions options;
  options.subfolders = subfolders;
  TM_ASSIGN_OR_RETURN(const Recording recording, Recording::open(input, options));
  PhotoSet photos;
  const std::filesystem::path path = std::filesystem::path(input).lexically_normal();
  const std::filesystem::path name =
      path.has_filename() ? path.filename() : path.parent_path().filename();
  std::string title = name.string();
  if (recording.kind() == RecordingKind::kSession) {
    TM_RETURN_IF_ERROR(tell_of_session(path, photos, title));
  }
  for (const RecordedFrame& frame : recording.frames()) {
    photos.names.push_back(frame.name);
  }
  photos.ordered = (recording.kind() == RecordingKind::kRecording ||
                    recording.kind() == RecordingKind::kSession) &&
                   recording.frames().front().timestamp.has_value();
  // The rig chose the frames of a session when it recorded them.
  if (photos.ordered && recording.kind() == RecordingKind::kRecording) {
    for (const RecordedFrame& frame : recording.frames()) {
      photos.timestamps.push_back(*frame.timestamp);
    }
  }
  const auto masked = std::count_if(
      recording.frames().begin(), recording.frames().end(), [](const RecordedFrame& frame) {
        return !frame.mask_path.empty();
      });
  photos.description =
      fmt::format("{}: {}, {} photographs", title, to_string(recording.kind()), recording.size());
  photos.read = [recording](std::size_t i) { return recording.read(i); };
  if (masks == MaskUse::kUse && masked > 0) {
    photos.description += fmt::format(", {} with a mask", masked);
    photos.read_mask = [recording](std::size_t i) { return recording.mask(i); };
  }
  return photos;
}

}  // namespace trigmesh
