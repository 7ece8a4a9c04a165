#include "drivers/camera/picture_in.hpp"

#include "drivers/camera/jpeg_extent.hpp"

namespace trigmesh {

DeviceResult<std::span<const std::uint8_t>> picture_in(std::span<const std::uint8_t> bytes,
                                                       const FrameLayout& layout) {
  if (bytes.empty()) {
    return device_fault(FaultKind::kShortFrame, "the camera delivered a frame without bytes");
  }
  if (!is_encoded(layout.format)) {
    const std::size_t needed = needed_bytes(layout);
    if (bytes.size() < needed) {
      return device_fault(FaultKind::kShortFrame,
                          "the camera delivered {} of the {} bytes of a frame",
                          bytes.size(),
                          needed);
    }
    return bytes;
  }
  const Result<JpegExtent> extent = find_jpeg_extent(bytes);
  if (!extent) {
    return device_fault(
        FaultKind::kCorruptFrame, "the camera delivered a {}", extent.error().message);
  }
  if (extent->width_px != layout.width_px || extent->height_px != layout.height_px) {
    return device_fault(FaultKind::kCorruptFrame,
                        "the camera delivered a JPEG of {} x {} pixels, agreed were {} x {}",
                        extent->width_px,
                        extent->height_px,
                        layout.width_px,
                        layout.height_px);
  }
  return bytes.first(extent->size_bytes);
}

}  // namespace trigmesh
