#pragma once

#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "drivers/camera/frame.hpp"
#include "drivers/camera/slot_pool.hpp"
#include "tests/support/textured_image.hpp"

namespace trigmesh::test_support {

/// Grey frames of 320x240 pixels out of a wide picture: a camera that looks at a wall. One frame at
/// a time.
class PanningCamera {
 public:
  /// The picture is `longest_px` wider than a frame.
  explicit PanningCamera(int longest_px)
      : wall_(textured_image(kWidth + longest_px, kHeight, /*seed=*/3)),
        pool_(std::make_shared<SlotPool>(1, nullptr)) {}

  /// What it sees from `x_px` on, which is at most `longest_px`.
  [[nodiscard]] Frame at(int x_px) {
    const std::size_t slot = *pool_->take();
    const cv::Mat view = wall_(cv::Rect(x_px, 0, kWidth, kHeight)).clone();
    pool_->bytes(slot).assign(view.datastart, view.dataend);
    FrameInfo info;
    info.layout.format = PixelFormat::kGrey;
    info.layout.width_px = kWidth;
    info.layout.height_px = kHeight;
    info.layout.stride_bytes = kWidth;
    return {info, pool_->bytes(slot), pool_, slot};
  }

 private:
  static constexpr int kWidth = 320;
  static constexpr int kHeight = 240;

  cv::Mat wall_;
  std::shared_ptr<SlotPool> pool_;
};

}  // namespace trigmesh::test_support
