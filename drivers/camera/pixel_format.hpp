#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace trigmesh {

/// How the bytes of a frame are to be read.
enum class PixelFormat : std::uint8_t {
  kJpeg,       ///< a whole JPEG file, Motion JPEG included
  kPng,        ///< a whole PNG file
  kYuyv,       ///< 4:2:2, bytes Y0 Cb Y1 Cr for two pixels
  kUyvy,       ///< 4:2:2, bytes Cb Y0 Cr Y1 for two pixels
  kNv12,       ///< 4:2:0, plane of Y, then plane of Cb Cr at half size in both directions
  kGrey,       ///< one byte of brightness a pixel
  kBayerRggb,  ///< one byte a pixel; the first row begins red, green, the second green, blue
  kBayerGrbg,
  kBayerGbrg,
  kBayerBggr,
  kRgb24,  ///< bytes red, green, blue
  kBgr24,  ///< bytes blue, green, red
};

/// "JPEG", "YUYV", "NV12", ...: for messages, settings and journals; stable.
[[nodiscard]] std::string_view to_string(PixelFormat format);

[[nodiscard]] constexpr bool is_encoded(PixelFormat format) {
  return format == PixelFormat::kJpeg || format == PixelFormat::kPng;
}

/// Where the pixels lie in the bytes of a frame.
struct FrameLayout {
  PixelFormat format = PixelFormat::kJpeg;
  int width_px = 0;   ///< 0 when only the encoded bytes know
  int height_px = 0;  ///< 0 when only the encoded bytes know
  /// Distance of two rows; at least the bytes of a row. NV12: of both planes. Encoded: 0.
  std::size_t stride_bytes = 0;

  bool operator==(const FrameLayout&) const = default;
};

/// Bytes that the pixels of one row take, without padding. Encoded: 0. Width >= 0.
[[nodiscard]] std::size_t row_bytes(PixelFormat format, int width_px);

/// Bytes from the first to the last pixel of a raw frame; the padding behind the last row is not
/// counted, for not every driver sends it. Encoded: 0.
[[nodiscard]] std::size_t needed_bytes(const FrameLayout& layout);

}  // namespace trigmesh
