#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/camera/pixel_format.hpp"
#include "firmware/base/result.hpp"
#include "sfm/exchange/image_codec.hpp"

namespace trigmesh {

/// The pixels of a frame as the rest of the house has them: CV_8UC1 grey and CV_8UC3 red, green,
/// blue. Encoded frames are decoded (decode_image); raw ones converted: YUV of BT.601 in video
/// range (black 16, white 235), which is what cameras send; Bayer patterns by bilinear demosaicing.
/// Grey is made from the colours with the weights of JPEG. Rows may be padded, sizes odd.
/// kCorruptData: fewer bytes than the layout needs, or rows shorter than their pixels;
/// kLimitExceeded: more than `max_pixels`; kUnsupported: Bayer with a side below 3 pixels;
/// kInvalidArgument: options.
[[nodiscard]] Result<DecodedImage> image_of_frame(const FrameLayout& layout,
                                                  std::span<const std::uint8_t> bytes,
                                                  const DecodeOptions& options = {});

/// A frame as a JPEG file: JPEG bytes are copied untouched, PNG and raw frames encoded with
/// `quality` in [1, 100]. Errors as image_of_frame and encode_jpeg.
[[nodiscard]] Result<std::vector<std::uint8_t>> jpeg_of_frame(const FrameLayout& layout,
                                                              std::span<const std::uint8_t> bytes,
                                                              int quality);

}  // namespace trigmesh
