#include <cstddef>
#include <cstdint>
#include <span>

#include <turbojpeg.h>

#include "drivers/camera/jpeg_extent.hpp"
#include "firmware/base/check.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

/// What is accepted lies within the bytes, ends with the marker, is found again in itself, and has
/// the size that the library reads.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::uint8_t> bytes(data, size);
  const auto extent = trigmesh::find_jpeg_extent(bytes);
  if (!extent) {
    return 0;
  }
  TM_CHECK(extent->size_bytes <= size && extent->width_px > 0 && extent->height_px > 0);
  TM_CHECK(data[extent->size_bytes - 2] == 0xFF && data[extent->size_bytes - 1] == 0xD9);
  const auto again = trigmesh::find_jpeg_extent(bytes.first(extent->size_bytes));
  TM_CHECK(again && again->size_bytes == extent->size_bytes);
  static const tjhandle decoder = tjInitDecompress();
  int width = 0;
  int height = 0;
  int subsampling = 0;
  int colorspace = 0;
  if (tjDecompressHeader3(
          decoder, data, extent->size_bytes, &width, &height, &subsampling, &colorspace) == 0) {
    TM_CHECK(width == extent->width_px && height == extent->height_px);
  }
  return 0;
}
