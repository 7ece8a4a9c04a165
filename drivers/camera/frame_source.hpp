#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "firmware/base/result.hpp"

namespace trigmesh {

/// How the bytes of a frame are encoded.
enum class FrameFormat { kJpeg, kPng };

/// One picture as the sensor or the file gave it: still encoded, so that whoever has time decodes
/// it and so that a recording keeps the bytes untouched.
struct Frame {
  std::size_t index = 0;  ///< position in the sequence, from 0
  std::string
      name;  ///< file name relative to the image folder, '/' as separator; unique in the sequence
  /// Middle of the exposure on the clock of the recording; absent for plain photographs.
  std::optional<std::chrono::nanoseconds> timestamp;
  FrameFormat format = FrameFormat::kJpeg;
  std::vector<std::uint8_t> bytes;
};

/// Where frames come from: a camera, a folder of photographs, a recorded session. Used as
///
///     while (true) {
///       TM_ASSIGN_OR_RETURN(std::optional<Frame> frame, source.next());
///       if (!frame) break;            // the end
///       use(*frame);
///     }
///
/// Thread-compatible: one thread calls next().
class FrameSource {
 public:
  FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;
  FrameSource(FrameSource&&) = delete;
  FrameSource& operator=(FrameSource&&) = delete;
  virtual ~FrameSource() = default;

  /// The next frame in capture order; nothing at the end. An Error concerns this frame only when
  /// its code is kIo, kNotFound, kCorruptData or kLimitExceeded: calling again goes on with the
  /// frame after it.
  [[nodiscard]] virtual Result<std::optional<Frame>> next() = 0;
};

}  // namespace trigmesh
