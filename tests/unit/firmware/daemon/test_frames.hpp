#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "drivers/camera/frame.hpp"
#include "drivers/camera/slot_pool.hpp"
#include "firmware/daemon/frame_times.hpp"

namespace trigmesh::test_support {

/// A grey frame of 64 x 48 pixels with lines; `contrast` makes its edges stronger.
inline std::vector<std::uint8_t> grey_lines(std::uint8_t contrast) {
  std::vector<std::uint8_t> bytes(64 * 48, 100);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<std::uint8_t>(100 + (i % 8 < 4 ? contrast : 0));
  }
  return bytes;
}

/// Frames as a camera gives them: grey, in a pool that counts them.
class TestFrames {
 public:
  TestFrames() : pool_(std::make_shared<SlotPool>(1, nullptr)) {}

  [[nodiscard]] Frame make(std::uint8_t contrast) {
    const std::size_t slot = *pool_->take();
    pool_->bytes(slot) = grey_lines(contrast);
    FrameInfo info;
    info.layout.format = PixelFormat::kGrey;
    info.layout.width_px = 64;
    info.layout.height_px = 48;
    info.layout.stride_bytes = 64;
    return {info, pool_->bytes(slot), pool_, slot};
  }

 private:
  std::shared_ptr<SlotPool> pool_;
};

/// Exposed for an instant.
inline FrameTimes at(std::chrono::nanoseconds time) {
  return {time, time, time};
}

}  // namespace trigmesh::test_support
