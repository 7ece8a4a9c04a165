#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/camera/pixel_format.hpp"
#include "drivers/camera/v4l2/kernel.hpp"
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

/// V4L2's code of a format; 0 for formats that it does not have (PNG).
[[nodiscard]] std::uint32_t fourcc_of(PixelFormat format);

/// Our name for V4L2's code; nothing for formats that we do not read.
[[nodiscard]] std::optional<PixelFormat> format_of_fourcc(std::uint32_t fourcc);

/// Whether `a` is to be preferred to `b`: first the size nearest to the wish (sum of the
/// differences of both sides), then the rate that falls short least (in whole hertz), then
/// kFormatOrder, then the rate that is nearest. A strict weak order.
[[nodiscard]] bool is_better(const CameraMode& a, const CameraMode& b, const CameraWish& wish);

/// The best mode. kFormatRefused: none, or none in the wished format; says what there is.
[[nodiscard]] DeviceResult<CameraMode> choose_mode(std::span<const CameraMode> modes,
                                                   const CameraWish& wish,
                                                   const std::string& camera);

/// Asks an open camera for its modes in formats that we read, each with the rate nearest to the
/// wish. Cameras that take any size within bounds are asked for the wished one. A camera that tells
/// no sizes at all is given the wish to try.
[[nodiscard]] std::vector<CameraMode> list_modes(Kernel& kernel, int fd, const CameraWish& wish);

}  // namespace trigmesh
