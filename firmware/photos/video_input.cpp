#include "firmware/photos/video_input.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "firmware/base/atomic_files.hpp"
#include "firmware/base/check.hpp"
#include "firmware/base/file.hpp"
#include "firmware/base/file_bytes.hpp"
#include "firmware/pipeline/checkpoint.hpp"
#include "firmware/video/video_file.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// What the frames were made from lies beside them.
constexpr const char* kNoteName = "video.json";
constexpr std::size_t kMaxNoteBytes = std::size_t{1} << 16U;
// Goes up when the frames of the same video change.
constexpr int kNoteVersion = 1;
constexpr std::size_t kChunkBytes = std::size_t{1} << 20U;

fs::path frames_in(const fs::path& output) {
  return output / "frames";
}

/// XXH3 of the whole file, as 16 hexadecimal digits.
Result<std::string> hash_of_file(const fs::path& path, const std::stop_token& stop) {
  TM_ASSIGN_OR_RETURN(File file, File::open(real_file_system(), path, OpenMode::kRead));
  std::vector<char> chunk(kChunkBytes);
  std::uint64_t hash = 0;
  while (true) {
    if (stop.stop_requested()) {
      return fail(ErrorCode::kCancelled, "stopped while reading {}", path.string());
    }
    TM_ASSIGN_OR_RETURN(const std::size_t got, file.read(chunk));
    if (got == 0) {
      return fmt::format("{:016x}", hash);
    }
    hash = content_hash(std::string_view(chunk.data(), got), hash);
  }
}

/// The warnings in the note of `folder`, if its frames come from this very video.
std::optional<std::vector<std::string>> finished_frames(const fs::path& folder,
                                                        const std::string& hash) {
  const auto text = read_file(folder / kNoteName, kMaxNoteBytes);
  const json note = text ? json::parse(*text, nullptr, false) : json();
  if (!note.is_object() || note.value("version", json()) != kNoteVersion ||
      note.value("content_xxh3", json()) != hash || !note.value("warnings", json()).is_array()) {
    return std::nullopt;
  }
  std::vector<std::string> warnings;
  for (const json& warning : note["warnings"]) {
    if (!warning.is_string()) {
      return std::nullopt;
    }
    warnings.push_back(warning);
  }
  return warnings;
}

/// Nothing of the user's own may be replaced.
Result<> check_place(const fs::path& frames) {
  std::error_code error;
  if (fs::exists(frames, error) && !fs::exists(frames / kNoteName, error)) {
    return fail(ErrorCode::kInvalidArgument,
                "the frames of the video would go to {}, which is there and was not made from a "
                "video: move it away or choose another output",
                frames.string());
  }
  return {};
}

/// A video whose frames are wanted.
struct WantedVideo {
  const fs::path& file;
  std::string hash;
  VideoStream stream;
};

Result<> write_note(const fs::path& folder,
                    const WantedVideo& video,
                    const ExtractedFrames& extracted) {
  const json note{{"version", kNoteVersion},
                  {"video", video.file.filename().string()},
                  {"content_xxh3", video.hash},
                  {"frames", extracted.frames},
                  {"warnings", extracted.warnings}};
  const std::string text = note.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
  return write_file_atomically(folder / kNoteName, text, Durability::kCache);
}

/// Puts the frames of the video into the empty folder `staged`, on the disk; returns the warnings.
Result<std::vector<std::string>> write_frames(const WantedVideo& video,
                                              const fs::path& staged,
                                              int num_threads,
                                              ProgressListener& listener,
                                              const std::stop_token& stop) {
  const std::size_t total = video.stream.frame_count.value_or(0);
  const auto on_frame = [&](std::size_t done) {
    listener.on_work();
    listener.on_progress({Stage::kReadVideo, done, total > 0 ? std::max(done, total) : 0});
  };
  TM_ASSIGN_OR_RETURN(
      ExtractedFrames extracted,
      extract_frames(
          video.file, video.stream, staged, {.num_threads = num_threads}, on_frame, stop));
  TM_RETURN_IF_ERROR(write_note(staged, video, extracted));
  TM_RETURN_IF_ERROR(sync_tree(real_file_system(), staged));
  return std::move(extracted.warnings);
}

/// The same, and in the place of `output`/frames when they are complete.
Result<std::vector<std::string>> publish_frames(const WantedVideo& video,
                                                const fs::path& output,
                                                int num_threads,
                                                ProgressListener& listener,
                                                const std::stop_token& stop) {
  const fs::path staged = output / ".frames.part";
  TM_RETURN_IF_ERROR(make_directory(output));
  TM_RETURN_IF_ERROR(remove_tree(real_file_system(), staged));
  TM_RETURN_IF_ERROR(make_directory(staged));
  auto warnings = write_frames(video, staged, num_threads, listener, stop);
  if (!warnings) {
    (void)remove_tree(real_file_system(), staged);  // what is left there is hidden and of no use
    return warnings;
  }
  TM_RETURN_IF_ERROR(replace_directory(staged, frames_in(output)));
  return warnings;
}

}  // namespace

bool is_video_input(const fs::path& input) {
  std::string extension = input.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char letter) {
    return static_cast<char>(std::tolower(letter));
  });
  constexpr std::array<std::string_view, 3> kPictures{".jpg", ".jpeg", ".png"};
  return std::find(kPictures.begin(), kPictures.end(), extension) == kPictures.end() &&
         is_binary_file(input);
}

Result<PhotoSet> open_video(const fs::path& input,
                            const fs::path& output,
                            MaskUse masks,
                            int num_threads,
                            ProgressListener& listener,
                            const std::stop_token& stop) {
  listener.on_progress({Stage::kReadVideo, 0, 0});
  const fs::path frames = frames_in(output);
  TM_RETURN_IF_ERROR(check_place(frames));
  TM_ASSIGN_OR_RETURN(const std::string hash, hash_of_file(input, stop));
  auto warnings = finished_frames(frames, hash);
  if (!warnings) {
    TM_ASSIGN_OR_RETURN(const VideoStream stream, probe_video(input, stop));
    TM_ASSIGN_OR_RETURN(warnings,
                        publish_frames({input, hash, stream}, output, num_threads, listener, stop));
  }
  TM_ASSIGN_OR_RETURN(PhotoSet photos, open_photos(frames.string(), Subfolders::kIgnore, masks));
  photos.description =
      fmt::format("{}: video, {} frames", input.filename().string(), photos.names.size());
  photos.warnings = std::move(*warnings);
  return photos;
}

}  // namespace trigmesh
