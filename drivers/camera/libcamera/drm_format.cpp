#include "drivers/camera/libcamera/drm_format.hpp"

#include <array>
#include <utility>

#include <libcamera/formats.h>

namespace trigmesh {
namespace {

namespace formats = libcamera::formats;

constexpr std::array<std::pair<PixelFormat, std::uint32_t>, 11> kCodes = {{
    {PixelFormat::kJpeg, formats::MJPEG.fourcc()},
    {PixelFormat::kYuyv, formats::YUYV.fourcc()},
    {PixelFormat::kUyvy, formats::UYVY.fourcc()},
    {PixelFormat::kNv12, formats::NV12.fourcc()},
    {PixelFormat::kGrey, formats::R8.fourcc()},
    {PixelFormat::kBayerRggb, formats::SRGGB8.fourcc()},
    {PixelFormat::kBayerGrbg, formats::SGRBG8.fourcc()},
    {PixelFormat::kBayerGbrg, formats::SGBRG8.fourcc()},
    {PixelFormat::kBayerBggr, formats::SBGGR8.fourcc()},
    {PixelFormat::kRgb24, formats::BGR888.fourcc()},
    {PixelFormat::kBgr24, formats::RGB888.fourcc()},
}};

}  // namespace

std::uint32_t drm_code_of(PixelFormat format) {
  for (const auto& [ours, theirs] : kCodes) {
    if (ours == format) {
      return theirs;
    }
  }
  return 0;
}

std::optional<PixelFormat> format_of_drm_code(std::uint32_t code) {
  for (const auto& [ours, theirs] : kCodes) {
    if (theirs == code) {
      return ours;
    }
  }
  return std::nullopt;
}

}  // namespace trigmesh
