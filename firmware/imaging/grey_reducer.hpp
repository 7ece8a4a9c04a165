#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include <opencv2/core/mat.hpp>

#include "drivers/camera/pixel_format.hpp"
#include "firmware/base/result.hpp"

namespace trigmesh {

/// The brightness of frames at a reduced size of about kWidthPx pixels a row: enough to judge them,
/// and the noise of the sensor counts little. Uses the same memory for each frame: none is taken
/// from the heap by us once it has seen one. Thread-compatible.
class GreyReducer {
 public:
  static constexpr int kWidthPx = 320;

  GreyReducer();
  ~GreyReducer();
  GreyReducer(const GreyReducer&) = delete;
  GreyReducer& operator=(const GreyReducer&) = delete;
  GreyReducer(GreyReducer&&) = delete;
  GreyReducer& operator=(GreyReducer&&) = delete;

  /// JPEG is decoded at the reduced size (grey only), raw pixels are averaged in blocks.
  /// kCorruptData: bytes and layout do not fit, or no picture; kLimitExceeded: more pixels than a
  /// camera has.
  [[nodiscard]] Result<> reduce(const FrameLayout& layout, std::span<const std::uint8_t> bytes);

  /// The frame reduced last, CV_8UC1; the next reduce() writes over it.
  [[nodiscard]] const cv::Mat& grey() const { return grey_; }

 private:
  struct Decoder;

  [[nodiscard]] Result<> reduce_jpeg(std::span<const std::uint8_t> bytes);
  [[nodiscard]] Result<> reduce_png(std::span<const std::uint8_t> bytes);
  [[nodiscard]] Result<> reduce_raw(const FrameLayout& layout, std::span<const std::uint8_t> bytes);

  std::unique_ptr<Decoder> decoder_;
  cv::Mat grey_;
};

}  // namespace trigmesh
