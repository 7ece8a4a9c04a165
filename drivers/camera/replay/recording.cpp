#include "drivers/camera/replay/recording.hpp"

#include <algorithm>
#include <cctype>
#include <map>
#include <system_error>
#include <utility>

#include "drivers/camera/replay/file_buffer.hpp"
#include "drivers/camera/replay/frame_tables.hpp"
#include "firmware/base/check.hpp"
#include "firmware/base/file_bytes.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kWhatIsAccepted =
    "give a folder of *.jpg, *.jpeg or *.png files, a text file that lists them one a line, a "
    "recording (a folder with images/ or frames/), or, to trigmesh reconstruct, a video file";

/// By the extension, upper or lower case; nothing for files that are not pictures.
std::optional<PixelFormat> format_of(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) {
    return static_cast<char>(std::tolower(c));
  });
  if (extension == ".jpg" || extension == ".jpeg") {
    return PixelFormat::kJpeg;
  }
  if (extension == ".png") {
    return PixelFormat::kPng;
  }
  return std::nullopt;
}

bool is_hidden(const std::string& name) {
  return !name.empty() && name.front() == '.';
}

/// Frames of a folder in natural order of their names, and what else lies in it.
struct FolderContents {
  std::vector<RecordedFrame> frames;
  std::vector<std::string> ignored;
};

Result<FolderContents> list_folder(const fs::path& folder, const RecordingOptions& options) {
  FolderContents contents;
  std::error_code error;
  fs::recursive_directory_iterator entry(folder, error);  // does not follow links to folders
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().lexically_relative(folder).generic_string();
    std::error_code type_error;
    const bool is_folder = entry->is_directory(type_error);
    if (is_hidden(entry->path().filename().string())) {
      entry.disable_recursion_pending();
      continue;
    }
    if (is_folder && options.subfolders == Subfolders::kInclude) {
      continue;  // its files follow
    }
    entry.disable_recursion_pending();
    const std::optional<PixelFormat> format = format_of(entry->path());
    if (!format || !entry->is_regular_file(type_error) || !is_safe_frame_name(name)) {
      contents.ignored.push_back(name);
    } else {
      contents.frames.push_back({name, entry->path(), std::nullopt, *format, {}});
    }
    if (contents.frames.size() + contents.ignored.size() > options.max_frames) {
      return fail(ErrorCode::kLimitExceeded,
                  "{} holds more than {} files, the declared limit",
                  folder.string(),
                  options.max_frames);
    }
  }
  if (error) {
    return fail(ErrorCode::kIo, "cannot list folder {}: {}", folder.string(), error.message());
  }
  std::sort(
      contents.frames.begin(),
      contents.frames.end(),
      [](const RecordedFrame& a, const RecordedFrame& b) { return natural_less(a.name, b.name); });
  std::sort(contents.ignored.begin(), contents.ignored.end());
  return contents;
}

/// The rows of the table as frames, in the order of time; what the folder has beyond the table goes
/// to `ignored`.
Result<FolderContents> order_by_time(FolderContents contents,
                                     const std::vector<TimestampRow>& rows,
                                     const fs::path& images,
                                     const fs::path& table) {
  FolderContents ordered;
  ordered.ignored = std::move(contents.ignored);
  std::map<std::string, PixelFormat, std::less<>> unlisted;
  for (const RecordedFrame& frame : contents.frames) {
    unlisted.emplace(frame.name, frame.format);
  }
  for (const TimestampRow& row : rows) {
    // A listed picture that is not there stays in the list: it becomes an Error of its own when it
    // is read.
    const std::optional<PixelFormat> format = format_of(row.name);
    if (!format) {
      return fail(ErrorCode::kCorruptData,
                  "{}: '{}' is not a *.jpg, *.jpeg or *.png file",
                  table.string(),
                  row.name);
    }
    ordered.frames.push_back({row.name, images / row.name, row.timestamp, *format, {}});
    unlisted.erase(row.name);
  }
  std::stable_sort(ordered.frames.begin(),
                   ordered.frames.end(),
                   [](const RecordedFrame& a, const RecordedFrame& b) {
                     return a.timestamp != b.timestamp ? a.timestamp < b.timestamp
                                                       : natural_less(a.name, b.name);
                   });
  for (const auto& [name, format] : unlisted) {
    ordered.ignored.push_back(name);
  }
  std::sort(ordered.ignored.begin(), ordered.ignored.end());
  return ordered;
}

/// Pictures in `images`, their times in `table` if there is one.
Result<FolderContents> list_recording(const fs::path& images,
                                      const fs::path& table,
                                      const RecordingOptions& options) {
  TM_ASSIGN_OR_RETURN(FolderContents contents, list_folder(images, options));
  std::error_code error;
  if (!fs::exists(table, error)) {
    return contents;
  }
  TM_ASSIGN_OR_RETURN(const std::string text, read_file(table, options.max_table_bytes));
  TM_ASSIGN_OR_RETURN(const std::vector<TimestampRow> rows,
                      parse_timestamps(text, table.string(), options.max_frames));
  return order_by_time(std::move(contents), rows, images, table);
}

Result<FolderContents> list_from_file(const fs::path& list, const RecordingOptions& options) {
  if (format_of(list)) {
    return fail(
        ErrorCode::kUnsupported, "{} is a single picture; {}", list.string(), kWhatIsAccepted);
  }
  TM_ASSIGN_OR_RETURN(const std::string text, read_file(list, options.max_table_bytes));
  TM_ASSIGN_OR_RETURN(const std::vector<std::string> paths,
                      parse_frame_list(text, list.string(), options.max_frames));
  FolderContents contents;
  for (const std::string& path : paths) {
    const std::optional<PixelFormat> format = format_of(path);
    if (format) {
      contents.frames.push_back({path, list.parent_path() / path, std::nullopt, *format, {}});
    } else {
      contents.ignored.push_back(path);
    }
  }
  return contents;
}

/// masks/NAME.png for each frame that has one, NAME with or without the ending of the picture.
void find_masks(const fs::path& masks, std::vector<RecordedFrame>& frames) {
  std::error_code error;
  if (!fs::is_directory(masks, error)) {
    return;
  }
  for (RecordedFrame& frame : frames) {
    for (const fs::path& candidate :
         {masks / fs::path(frame.name).replace_extension(".png"), masks / (frame.name + ".png")}) {
      if (fs::is_regular_file(candidate, error)) {
        frame.mask_path = candidate;
        break;
      }
    }
  }
}

Result<RecordingKind> kind_of(const fs::path& input) {
  std::error_code error;
  const fs::file_status status = fs::status(input, error);
  if (status.type() == fs::file_type::not_found) {
    return fail(ErrorCode::kNotFound, "there is no {}; {}", input.string(), kWhatIsAccepted);
  }
  if (error) {
    return fail(ErrorCode::kIo, "cannot look at {}: {}", input.string(), error.message());
  }
  if (status.type() != fs::file_type::directory) {
    return RecordingKind::kListFile;
  }
  if (fs::is_directory(input / "images", error)) {
    return RecordingKind::kRecording;
  }
  return fs::is_directory(input / "frames", error) ? RecordingKind::kSession
                                                   : RecordingKind::kPhotoFolder;
}

}  // namespace

Result<> RecordingOptions::validate() const {
  if (max_frames == 0 || max_frame_bytes == 0 || max_table_bytes == 0) {
    return fail(
        ErrorCode::kInvalidArgument,
        "max_frames ({}), max_frame_bytes ({}) and max_table_bytes ({}) must be greater than 0",
        max_frames,
        max_frame_bytes,
        max_table_bytes);
  }
  return {};
}

std::string_view to_string(RecordingKind kind) {
  switch (kind) {
    case RecordingKind::kPhotoFolder:
      return "photo folder";
    case RecordingKind::kListFile:
      return "list file";
    case RecordingKind::kRecording:
      return "recording";
    case RecordingKind::kSession:
      return "session";
  }
  return "unknown";
}

Result<Recording> Recording::open(const fs::path& input, const RecordingOptions& options) {
  TM_RETURN_IF_ERROR(options.validate());
  Recording recording;
  recording.options_ = options;
  TM_ASSIGN_OR_RETURN(recording.kind_, kind_of(input));
  Result<FolderContents> contents = [&] {
    switch (recording.kind_) {
      case RecordingKind::kRecording:
        return list_recording(input / "images", input / "timestamps.csv", options);
      case RecordingKind::kSession:
        return list_recording(input / "frames", input / "frames.csv", options);
      case RecordingKind::kListFile:
        return list_from_file(input, options);
      case RecordingKind::kPhotoFolder:
        break;
    }
    return list_folder(input, options);
  }();
  if (!contents) {
    return tl::unexpected<Error>(std::move(contents).error());
  }
  if (contents->frames.empty()) {
    return fail(ErrorCode::kNotFound,
                "no pictures in {} {} ({} other files); {}",
                to_string(recording.kind_),
                input.string(),
                contents->ignored.size(),
                kWhatIsAccepted);
  }
  recording.frames_ = std::move(contents->frames);
  if (recording.kind_ != RecordingKind::kListFile) {
    find_masks(input / "masks", recording.frames_);
  }
  recording.ignored_ = std::move(contents->ignored);
  return recording;
}

Result<std::vector<std::uint8_t>> Recording::read(std::size_t index,
                                                  std::vector<std::uint8_t> reuse) const {
  TM_CHECK(index < frames_.size());
  const fs::path& path = frames_[index].path;
  TM_ASSIGN_OR_RETURN(std::vector<std::uint8_t> bytes,
                      read_file_again(path, options_.max_frame_bytes, std::move(reuse)));
  if (bytes.empty()) {
    return fail(ErrorCode::kCorruptData, "{} is empty", path.string());
  }
  return bytes;
}

Result<std::optional<std::vector<std::uint8_t>>> Recording::mask(std::size_t index) const {
  TM_CHECK(index < frames_.size());
  const fs::path& path = frames_[index].mask_path;
  if (path.empty()) {
    return std::optional<std::vector<std::uint8_t>>();
  }
  TM_ASSIGN_OR_RETURN(std::vector<std::uint8_t> bytes,
                      read_file_bytes(path, options_.max_frame_bytes));
  return std::optional(std::move(bytes));
}

}  // namespace trigmesh
