#include "firmware/imaging/frame_image.hpp"

#include <utility>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

constexpr int kSmallestBayerSide = 3;

bool is_bayer(PixelFormat format) {
  return format == PixelFormat::kBayerRggb || format == PixelFormat::kBayerGrbg ||
         format == PixelFormat::kBayerGbrg || format == PixelFormat::kBayerBggr;
}

Result<> check_layout(const FrameLayout& layout,
                      std::span<const std::uint8_t> bytes,
                      const DecodeOptions& options) {
  if (options.max_pixels <= 0) {
    return fail(ErrorCode::kInvalidArgument,
                "max_pixels is {}, must be greater than 0",
                options.max_pixels);
  }
  if (layout.width_px <= 0 || layout.height_px <= 0 ||
      layout.stride_bytes < row_bytes(layout.format, layout.width_px)) {
    return fail(ErrorCode::kCorruptData,
                "a frame of {} cannot have {} x {} pixels in rows of {} bytes",
                to_string(layout.format),
                layout.width_px,
                layout.height_px,
                layout.stride_bytes);
  }
  if (std::int64_t{layout.width_px} * layout.height_px > options.max_pixels) {
    return fail(ErrorCode::kLimitExceeded,
                "frame of {} x {} pixels is larger than the limit of {} pixels",
                layout.width_px,
                layout.height_px,
                options.max_pixels);
  }
  if (bytes.size() < needed_bytes(layout)) {
    return fail(ErrorCode::kCorruptData,
                "frame has {} bytes, its {} x {} pixels of {} need {}",
                bytes.size(),
                layout.width_px,
                layout.height_px,
                to_string(layout.format),
                needed_bytes(layout));
  }
  if (is_bayer(layout.format) &&
      (layout.width_px < kSmallestBayerSide || layout.height_px < kSmallestBayerSide)) {
    return fail(ErrorCode::kUnsupported,
                "Bayer frame of {} x {} pixels: no colours can be made of it",
                layout.width_px,
                layout.height_px);
  }
  return {};
}

/// The bytes as a matrix, without copying; it is read only.
cv::Mat matrix_over(
    std::span<const std::uint8_t> bytes, int rows, int cols, int type, std::size_t stride) {
  return cv::Mat(rows, cols, type, const_cast<std::uint8_t*>(bytes.data()), stride);
}

/// Converted in whole pairs of pixels, as the bytes come; what is too much is cut off.
cv::Mat rgb_of_packed(const FrameLayout& layout, std::span<const std::uint8_t> bytes, int code) {
  const int width = (layout.width_px + 1) / 2 * 2;
  cv::Mat rgb;
  cv::cvtColor(
      matrix_over(bytes, layout.height_px, width, CV_8UC2, layout.stride_bytes), rgb, code);
  return rgb;
}

/// With an odd height, the missing row of brightness is taken from the chroma that follows it, and
/// cut off.
cv::Mat rgb_of_nv12(const FrameLayout& layout, std::span<const std::uint8_t> bytes) {
  const int width = (layout.width_px + 1) / 2 * 2;
  const int chroma_rows = (layout.height_px + 1) / 2;
  const std::size_t chroma_begin = static_cast<std::size_t>(layout.height_px) * layout.stride_bytes;
  const cv::Mat luma = matrix_over(bytes, 2 * chroma_rows, width, CV_8UC1, layout.stride_bytes);
  const cv::Mat chroma = matrix_over(
      bytes.subspan(chroma_begin), chroma_rows, width / 2, CV_8UC2, layout.stride_bytes);
  cv::Mat rgb;
  cv::cvtColorTwoPlane(luma, chroma, rgb, cv::COLOR_YUV2RGB_NV12);
  return rgb;
}

cv::Mat rgb_of_bytes(const FrameLayout& layout, std::span<const std::uint8_t> bytes, int code) {
  const bool has_three =
      layout.format == PixelFormat::kRgb24 || layout.format == PixelFormat::kBgr24;
  const cv::Mat pixels = matrix_over(
      bytes, layout.height_px, layout.width_px, has_three ? CV_8UC3 : CV_8UC1, layout.stride_bytes);
  if (layout.format == PixelFormat::kRgb24) {
    return pixels.clone();
  }
  cv::Mat rgb;
  cv::cvtColor(pixels, rgb, code);
  return rgb;
}

/// OpenCV names a pattern by the second pixel of its second row and the one behind it: its "BG" is
/// what everybody else calls RGGB.
cv::Mat rgb_of_raw(const FrameLayout& layout, std::span<const std::uint8_t> bytes) {
  switch (layout.format) {
    case PixelFormat::kYuyv:
      return rgb_of_packed(layout, bytes, cv::COLOR_YUV2RGB_YUYV);
    case PixelFormat::kUyvy:
      return rgb_of_packed(layout, bytes, cv::COLOR_YUV2RGB_UYVY);
    case PixelFormat::kNv12:
      return rgb_of_nv12(layout, bytes);
    case PixelFormat::kGrey:
      return rgb_of_bytes(layout, bytes, cv::COLOR_GRAY2RGB);
    case PixelFormat::kBayerRggb:
      return rgb_of_bytes(layout, bytes, cv::COLOR_BayerBG2RGB);
    case PixelFormat::kBayerGrbg:
      return rgb_of_bytes(layout, bytes, cv::COLOR_BayerGB2RGB);
    case PixelFormat::kBayerGbrg:
      return rgb_of_bytes(layout, bytes, cv::COLOR_BayerGR2RGB);
    case PixelFormat::kBayerBggr:
      return rgb_of_bytes(layout, bytes, cv::COLOR_BayerRG2RGB);
    case PixelFormat::kRgb24:
    case PixelFormat::kBgr24:
      return rgb_of_bytes(layout, bytes, cv::COLOR_BGR2RGB);
    case PixelFormat::kJpeg:
    case PixelFormat::kPng:
      break;
  }
  return {};
}

DecodedImage convert(const FrameLayout& layout,
                     std::span<const std::uint8_t> bytes,
                     ImageChannels channels) {
  DecodedImage image;
  const cv::Rect visible(0, 0, layout.width_px, layout.height_px);
  if (layout.format == PixelFormat::kGrey && channels != ImageChannels::kRgb) {
    image.grey =
        matrix_over(bytes, layout.height_px, layout.width_px, CV_8UC1, layout.stride_bytes).clone();
    if (channels == ImageChannels::kGrey) {
      return image;
    }
  }
  const cv::Mat rgb = rgb_of_raw(layout, bytes);
  image.rgb = rgb.size() == visible.size() ? rgb : rgb(visible).clone();
  if (channels != ImageChannels::kRgb && image.grey.empty()) {
    cv::cvtColor(image.rgb, image.grey, cv::COLOR_RGB2GRAY);
  }
  if (channels == ImageChannels::kGrey) {
    image.rgb.release();
  }
  return image;
}

}  // namespace

Result<DecodedImage> image_of_frame(const FrameLayout& layout,
                                    std::span<const std::uint8_t> bytes,
                                    const DecodeOptions& options) {
  if (is_encoded(layout.format)) {
    return decode_image(bytes, options);
  }
  TM_RETURN_IF_ERROR(check_layout(layout, bytes, options));
  try {
    return convert(layout, bytes, options.channels);
  } catch (const cv::Exception& exception) {
    return fail(ErrorCode::kInternal,
                "cannot convert a frame of {}: {}",
                to_string(layout.format),
                exception.what());
  }
}

Result<std::vector<std::uint8_t>> jpeg_of_frame(const FrameLayout& layout,
                                                std::span<const std::uint8_t> bytes,
                                                int quality) {
  if (layout.format == PixelFormat::kJpeg) {
    return std::vector<std::uint8_t>(bytes.begin(), bytes.end());
  }
  if (layout.format == PixelFormat::kGrey) {
    TM_ASSIGN_OR_RETURN(const DecodedImage image,
                        image_of_frame(layout, bytes, {.channels = ImageChannels::kGrey}));
    return encode_jpeg(image.grey, quality);
  }
  TM_ASSIGN_OR_RETURN(const DecodedImage image,
                      image_of_frame(layout, bytes, {.channels = ImageChannels::kRgb}));
  return encode_jpeg(image.rgb, quality);
}

}  // namespace trigmesh
