#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "drivers/camera/pixel_format.hpp"
#include "drivers/device/device_fault.hpp"

namespace trigmesh {

/// What a camera is wanted to deliver.
struct CameraWish {
  int width_px = 1280;
  int height_px = 720;
  /// Frames a second, > 0.
  double rate_hz = 30.0;
  /// Only this format; otherwise the best of kFormatOrder.
  std::optional<PixelFormat> format;
};

/// One way in which a camera can run.
struct CameraMode {
  PixelFormat format = PixelFormat::kJpeg;
  int width_px = 0;
  int height_px = 0;
  /// Between two frames, at the wished rate or the nearest the mode has; 0: not told.
  std::chrono::nanoseconds frame_interval{0};

  bool operator==(const CameraMode&) const = default;
};

/// Formats from the one we like most. JPEG first: its bytes are stored untouched and a USB cable
/// carries them at full rate; then colour without loss in the order of its chroma; one byte Bayer
/// after it, because the camera's own colour processing is lost; grey last, for it has no colour.
inline constexpr PixelFormat kFormatOrder[] = {
    PixelFormat::kJpeg,
    PixelFormat::kYuyv,
    PixelFormat::kUyvy,
    PixelFormat::kRgb24,
    PixelFormat::kBgr24,
    PixelFormat::kNv12,
    PixelFormat::kBayerRggb,
    PixelFormat::kBayerGrbg,
    PixelFormat::kBayerGbrg,
    PixelFormat::kBayerBggr,
    PixelFormat::kGrey,
};

/// Whether `a` is to be preferred to `b`: first the size nearest to the wish (sum of the
/// differences of both sides), then the rate that falls short least (in whole hertz), then
/// kFormatOrder, then the rate that is nearest. A strict weak order.
[[nodiscard]] bool is_better(const CameraMode& a, const CameraMode& b, const CameraWish& wish);

/// The best mode. kFormatRefused: none, or none in the wished format; says what there is.
[[nodiscard]] DeviceResult<CameraMode> choose_mode(std::span<const CameraMode> modes,
                                                   const CameraWish& wish,
                                                   const std::string& camera);

/// What a side of a picture may be where a camera takes any within bounds: the size nearest to
/// `wanted` from below among `minimum`, `minimum` + `step`, ... `maximum`.
[[nodiscard]] int nearest_step(int wanted,
                               std::uint32_t minimum,
                               std::uint32_t maximum,
                               std::uint32_t step);

/// Between two frames at the wished rate.
[[nodiscard]] std::chrono::nanoseconds wished_interval(const CameraWish& wish);

}  // namespace trigmesh
