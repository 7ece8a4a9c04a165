#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/report_sections.hpp"

namespace trigmesh {

/// The photographs of one reconstruction. Whatever they come from (folder, list, recording) looks
/// like this here.
struct PhotoSet {
  std::vector<std::string> names;  ///< unique, in input order
  bool ordered = false;            ///< neighbours in the list are neighbours in time
  /// They are keyframes of a walk, chosen so that neighbours overlap.
  bool is_walk = false;
  /// When each was taken, rising, for the frames of a video from which keyframes may be chosen;
  /// empty: every photograph is wanted.
  std::vector<std::chrono::nanoseconds> timestamps{};
  /// What was said of the frames of the video that they are from, for the report.
  std::vector<VideoFrameSection> frames{};
  std::string description;              ///< for the report, e.g. "photo folder, 25 photographs"
  std::vector<std::string> warnings{};  ///< what is wrong with the input as a whole, for the report
  /// The encoded bytes (JPEG or PNG) of a photograph. Thread-safe.
  std::function<Result<std::vector<std::uint8_t>>(std::size_t)> read;
  /// The encoded mask of a photograph, white = leave out; nothing when it has none. Thread-safe;
  /// may be empty: no photograph has a mask.
  std::function<Result<std::optional<std::vector<std::uint8_t>>>(std::size_t)> read_mask;
};

/// The photographs at these positions, ascending. Reads from `photos`, which outlives it.
[[nodiscard]] PhotoSet subset(const PhotoSet& photos, const std::vector<std::size_t>& positions);

/// The encoded mask of a photograph; nothing when it has none.
[[nodiscard]] Result<std::optional<std::vector<std::uint8_t>>> read_mask(const PhotoSet& photos,
                                                                         std::size_t photo);

/// A mask in our convention: CV_8UC1 of the photograph's size, 0 = leave out, 255 = use. `name`: of
/// the photograph, for the message. kCorruptData: not a picture, or of another size.
[[nodiscard]] Result<cv::Mat> decode_mask(std::span<const std::uint8_t> mask,
                                          const std::string& name,
                                          int width_px,
                                          int height_px);

/// Both: the mask of a photograph, an empty Mat when it has none. kCorruptData, kIo.
[[nodiscard]] Result<cv::Mat> load_mask(const PhotoSet& photos,
                                        std::size_t photo,
                                        int width_px,
                                        int height_px);

}  // namespace trigmesh
