#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware/base/check.hpp"
#include "sfm/exchange/image_codec.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

/// What decodes has the size that the probe announced, in all modes.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::uint8_t> bytes(data, size);
  const auto info = trigmesh::probe_image(bytes);
  for (const auto channels :
       {trigmesh::ImageChannels::kGreyAndRgb, trigmesh::ImageChannels::kGrey}) {
    const auto image = trigmesh::decode_image(bytes, {.channels = channels, .max_pixels = 100'000});
    if (image) {
      TM_CHECK(info && image->grey.cols == info->width_px && image->grey.rows == info->height_px);
      TM_CHECK(image->rgb.empty() == (channels == trigmesh::ImageChannels::kGrey));
    }
  }
  return 0;
}
