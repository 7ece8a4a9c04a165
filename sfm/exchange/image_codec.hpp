#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "firmware/base/result.hpp"

namespace trigmesh {

/// File formats that are read and written; recognised by their first bytes, never by a file name.
enum class ImageFormat { kJpeg, kPng };

/// "JPEG", "PNG".
[[nodiscard]] std::string_view to_string(ImageFormat format);

/// What a picture says about itself before it is decoded.
struct ImageInfo {
  ImageFormat format = ImageFormat::kJpeg;
  int width_px = 0;
  int height_px = 0;
};

/// Which planes to produce. Grey alone is the fastest: JPEG stores it as a plane of its own.
enum class ImageChannels { kGrey, kRgb, kGreyAndRgb };

struct DecodeOptions {
  ImageChannels channels = ImageChannels::kGreyAndRgb;
  /// Largest width times height, pixels, > 0. Checked before memory is taken.
  std::int64_t max_pixels = 200'000'000;
};

/// Pixels as stored: the EXIF orientation is **not** applied, because calibrations, camera groups
/// and ground truth are in the order in which the sensor wrote the pixels. Row 0 is the top row.
struct DecodedImage {
  cv::Mat grey;  ///< CV_8UC1 luma (BT.601, the Y of JPEG), or empty when not asked for
  cv::Mat rgb;   ///< CV_8UC3 in the order red, green, blue, or empty when not asked for
};

/// Reads size and format. kCorruptData: neither JPEG nor PNG, or a broken header.
[[nodiscard]] Result<ImageInfo> probe_image(std::span<const std::uint8_t> bytes);

/// Decodes a JPEG (baseline or progressive; grey, YCbCr, RGB) or PNG (1 to 16 bits, grey, RGB,
/// palette). 16 bits are reduced to 8; transparent pixels are laid over black. The same bytes give
/// the same pixels on every run. kCorruptData: truncated or damaged (also where a viewer would show
/// grey blocks); kUnsupported: CMYK JPEG; kLimitExceeded: more than `max_pixels`; kInvalidArgument:
/// options.
[[nodiscard]] Result<DecodedImage> decode_image(std::span<const std::uint8_t> bytes,
                                                const DecodeOptions& options = {});

/// Encodes CV_8UC1 or CV_8UC3 (red, green, blue) without loss. kInvalidArgument: empty or of
/// another type.
[[nodiscard]] Result<std::vector<std::uint8_t>> encode_png(const cv::Mat& image);

/// Encodes CV_8UC1 or CV_8UC3 (red, green, blue) as baseline JPEG, chroma at half resolution.
/// `quality` in [1, 100]. kInvalidArgument: empty, of another type, more than 65500 pixels on a
/// side, quality out of range.
[[nodiscard]] Result<std::vector<std::uint8_t>> encode_jpeg(const cv::Mat& image, int quality = 90);

}  // namespace trigmesh
