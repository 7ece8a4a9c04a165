#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "drivers/camera/pixel_format.hpp"
#include "firmware/base/result.hpp"

namespace trigmesh {

/// Whether pictures in folders inside the image folder belong to the recording.
enum class Subfolders { kIgnore, kInclude };

/// Bounds on what a folder from outside may make us do.
struct RecordingOptions {
  /// Largest number of frames; more is kLimitExceeded. > 0.
  std::size_t max_frames = 100'000;
  /// Largest size of one picture file, bytes. > 0. A 100 megapixel JPEG has about 50 MB.
  std::size_t max_frame_bytes = std::size_t{256} << 20U;
  /// Largest size of a list file or timestamps.csv, bytes. > 0.
  std::size_t max_table_bytes = std::size_t{16} << 20U;

  /// kInclude: sets of several cameras, a folder each; names are then "left/001.jpg". Links to
  /// folders are never followed.
  Subfolders subfolders = Subfolders::kIgnore;

  [[nodiscard]] Result<> validate() const;
};

/// What an input on disk turned out to be.
enum class RecordingKind {
  kPhotoFolder,  ///< a folder with JPEG and PNG files, in natural order of their names (img2 before
                 ///< img10)
  kListFile,     ///< a text file with one path a line, relative to the list file; the order of the
                 ///< lines
  kRecording,    ///< a folder with images/ and perhaps timestamps.csv; the order of the timestamps
  kSession,      ///< a folder with frames/ and perhaps frames.csv, which the rig writes; the same
};

/// "photo folder", "list file", "recording", "session".
[[nodiscard]] std::string_view to_string(RecordingKind kind);

/// One picture of a recording, not yet read.
struct RecordedFrame {
  std::string
      name;  ///< relative to the image folder (list file: as written there), '/' as separator
  std::filesystem::path path;
  std::optional<std::chrono::nanoseconds> timestamp;
  PixelFormat format = PixelFormat::kJpeg;  ///< kJpeg or kPng
  std::filesystem::path mask_path;  ///< masks/NAME.png of a recording or photo folder; empty: none
};

/// The table of contents of a recording or folder of photographs. Opening reads names and
/// timestamps only; pictures are read when asked for, in any order. Thread-safe after opening: all
/// members are const, so worker threads may read different frames at once. A file that disappears
/// later gives an Error for its frame only.
class Recording {
 public:
  /// Finds out what `input` is and lists its frames. kNotFound: no such path, or no pictures in it
  /// (says where was looked); kIo: not readable; kCorruptData: a bad line in a list file or
  /// table (names file and line); kLimitExceeded: more frames or bytes than the options
  /// allow; kUnsupported: a file that is not a list.
  [[nodiscard]] static Result<Recording> open(const std::filesystem::path& input,
                                              const RecordingOptions& options = {});

  [[nodiscard]] RecordingKind kind() const { return kind_; }

  [[nodiscard]] std::size_t size() const { return frames_.size(); }

  [[nodiscard]] const std::vector<RecordedFrame>& frames() const { return frames_; }

  /// Names of files in the image folder that are not used: not *.jpg, *.jpeg or *.png, or not in
  /// the table; sorted.
  [[nodiscard]] const std::vector<std::string>& ignored() const { return ignored_; }

  /// Reads the file of one picture into the memory of `reuse`, which is moved in and out.
  /// Precondition: index < size(). kNotFound, kIo, kLimitExceeded; kCorruptData when the file is
  /// empty.
  [[nodiscard]] Result<std::vector<std::uint8_t>> read(std::size_t index,
                                                       std::vector<std::uint8_t> reuse = {}) const;

  /// Reads the mask of one picture, a PNG of its size in which white is to be left out; nothing
  /// when it has none. NAME of masks/NAME.png is that of the picture with or without its ending.
  /// Precondition: index < size(). kIo, kLimitExceeded.
  [[nodiscard]] Result<std::optional<std::vector<std::uint8_t>>> mask(std::size_t index) const;

 private:
  Recording() = default;

  RecordingOptions options_;
  RecordingKind kind_ = RecordingKind::kPhotoFolder;
  std::vector<RecordedFrame> frames_;
  std::vector<std::string> ignored_;
};

}  // namespace trigmesh
