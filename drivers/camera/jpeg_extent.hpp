#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware/base/result.hpp"

namespace trigmesh {

/// Where a JPEG ends, and its size.
struct JpegExtent {
  std::size_t size_bytes = 0;  ///< up to and with the end-of-image marker
  int width_px = 0;
  int height_px = 0;
};

/// Walks the markers of a JPEG (ITU-T T.81, annex B) from the first byte to its end-of-image
/// marker, without decoding, and without taking memory unless it fails. Cameras send more bytes
/// than their picture has: a buffer with the tail of an older, longer frame, or padding. Thumbnails
/// lie inside segments and are stepped over. kCorruptData: no JPEG, cut off, or no picture in it.
[[nodiscard]] Result<JpegExtent> find_jpeg_extent(std::span<const std::uint8_t> bytes);

}  // namespace trigmesh
