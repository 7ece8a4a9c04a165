#include "drivers/camera/pixel_format.hpp"

namespace trigmesh {

std::string_view to_string(PixelFormat format) {
  switch (format) {
    case PixelFormat::kJpeg:
      return "JPEG";
    case PixelFormat::kPng:
      return "PNG";
    case PixelFormat::kYuyv:
      return "YUYV";
    case PixelFormat::kUyvy:
      return "UYVY";
    case PixelFormat::kNv12:
      return "NV12";
    case PixelFormat::kGrey:
      return "GREY";
    case PixelFormat::kBayerRggb:
      return "RGGB";
    case PixelFormat::kBayerGrbg:
      return "GRBG";
    case PixelFormat::kBayerGbrg:
      return "GBRG";
    case PixelFormat::kBayerBggr:
      return "BGGR";
    case PixelFormat::kRgb24:
      return "RGB24";
    case PixelFormat::kBgr24:
      return "BGR24";
  }
  return "unknown";
}

std::size_t row_bytes(PixelFormat format, int width_px) {
  const auto width = static_cast<std::size_t>(width_px);
  switch (format) {
    case PixelFormat::kJpeg:
    case PixelFormat::kPng:
      return 0;
    case PixelFormat::kYuyv:
    case PixelFormat::kUyvy:
      return (width + 1) / 2 * 4;
    case PixelFormat::kNv12:
      return (width + 1) / 2 * 2;  // the row of chroma, which is the longer one
    case PixelFormat::kGrey:
    case PixelFormat::kBayerRggb:
    case PixelFormat::kBayerGrbg:
    case PixelFormat::kBayerGbrg:
    case PixelFormat::kBayerBggr:
      return width;
    case PixelFormat::kRgb24:
    case PixelFormat::kBgr24:
      return width * 3;
  }
  return 0;
}

std::size_t needed_bytes(const FrameLayout& layout) {
  if (is_encoded(layout.format) || layout.height_px <= 0 || layout.width_px <= 0) {
    return 0;
  }
  const auto height = static_cast<std::size_t>(layout.height_px);
  const std::size_t rows = layout.format == PixelFormat::kNv12 ? height + (height + 1) / 2 : height;
  return (rows - 1) * layout.stride_bytes + row_bytes(layout.format, layout.width_px);
}

}  // namespace trigmesh
