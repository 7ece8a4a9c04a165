#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware/base/check.hpp"
#include "sfm/exchange/exif.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

/// A focal length that is told is one that a lens can have.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto camera = trigmesh::read_exif_camera(std::span(data, size), 4000, 3000);
  if (camera && camera->focal_px) {
    TM_CHECK(std::isfinite(*camera->focal_px) && *camera->focal_px > 0.0);
  }
  return 0;
}
