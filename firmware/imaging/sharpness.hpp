#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "drivers/camera/pixel_format.hpp"
#include "firmware/base/result.hpp"

namespace trigmesh {

/// Says how sharp frames are, to compare frames of one scene: the variance of the Laplacian
/// (4 neighbours) of the brightness, at a reduced size of about kWidthPx pixels a row, so that the
/// noise of the sensor counts little. Uses the same memory for each frame: none is taken from the
/// heap by us once it has seen one. Thread-compatible.
class SharpnessMeter {
 public:
  static constexpr int kWidthPx = 320;

  SharpnessMeter();
  ~SharpnessMeter();
  SharpnessMeter(const SharpnessMeter&) = delete;
  SharpnessMeter& operator=(const SharpnessMeter&) = delete;
  SharpnessMeter(SharpnessMeter&&) = delete;
  SharpnessMeter& operator=(SharpnessMeter&&) = delete;

  /// 0: no edge at all, or fewer than 3 pixels on a side. JPEG is decoded at the reduced size
  /// (grey only). kCorruptData: bytes and layout do not fit, or no picture; kLimitExceeded: more
  /// pixels than a camera has.
  [[nodiscard]] Result<double> measure(const FrameLayout& layout,
                                       std::span<const std::uint8_t> bytes);

 private:
  struct Decoder;

  [[nodiscard]] Result<> reduce_jpeg(std::span<const std::uint8_t> bytes);
  [[nodiscard]] Result<> reduce_png(std::span<const std::uint8_t> bytes);
  [[nodiscard]] Result<> reduce_raw(const FrameLayout& layout, std::span<const std::uint8_t> bytes);

  std::unique_ptr<Decoder> decoder_;
  std::vector<std::uint8_t> grey_;  ///< rows of width_ pixels
  int width_ = 0;
  int height_ = 0;
};

}  // namespace trigmesh
