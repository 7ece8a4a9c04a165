#include "firmware/imaging/grey_reducer.hpp"

#include <algorithm>
#include <cstddef>

#include <turbojpeg.h>

#include "firmware/base/check.hpp"
#include "sfm/exchange/image_codec.hpp"

namespace trigmesh {
namespace {

constexpr std::int64_t kMaxPixels = 200'000'000;

/// Where the brightness lies in a row: bytes from the first to the second pixel, and before the
/// first. Bayer patterns and colours are taken for brightness as they are: green is most of it.
struct BrightnessBytes {
  std::size_t first = 0;
  std::size_t step = 1;
};

BrightnessBytes brightness_of(PixelFormat format) {
  switch (format) {
    case PixelFormat::kYuyv:
      return {0, 2};
    case PixelFormat::kUyvy:
      return {1, 2};
    case PixelFormat::kRgb24:
    case PixelFormat::kBgr24:
      return {1, 3};
    default:
      return {0, 1};
  }
}

bool is_bayer(PixelFormat format) {
  return format == PixelFormat::kBayerRggb || format == PixelFormat::kBayerGrbg ||
         format == PixelFormat::kBayerGbrg || format == PixelFormat::kBayerBggr;
}

/// The mean of `side` x `side` pixels that begin at `bytes`.
std::uint8_t mean_of_block(const std::uint8_t* bytes,
                           std::size_t stride,
                           std::size_t step,
                           std::size_t side) {
  std::size_t sum = 0;
  for (std::size_t row = 0; row < side; ++row) {
    const std::uint8_t* pixel = bytes + row * stride;
    for (std::size_t column = 0; column < side; ++column, pixel += step) {
      sum += *pixel;
    }
  }
  return static_cast<std::uint8_t>(sum / (side * side));
}

}  // namespace

struct GreyReducer::Decoder {
  Decoder() : handle(tjInitDecompress()) {}

  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;
  Decoder(Decoder&&) = delete;
  Decoder& operator=(Decoder&&) = delete;

  ~Decoder() {
    if (handle != nullptr) {
      (void)tjDestroy(handle);
    }
  }

  tjhandle handle;
};

GreyReducer::GreyReducer() : decoder_(std::make_unique<Decoder>()) {}

GreyReducer::~GreyReducer() = default;

Result<> GreyReducer::reduce(const FrameLayout& layout, std::span<const std::uint8_t> bytes) {
  if (layout.format == PixelFormat::kJpeg) {
    return reduce_jpeg(bytes);
  }
  if (layout.format == PixelFormat::kPng) {
    return reduce_png(bytes);
  }
  return reduce_raw(layout, bytes);
}

Result<> GreyReducer::reduce_jpeg(std::span<const std::uint8_t> bytes) {
  int width = 0;
  int height = 0;
  int subsampling = 0;
  int colours = 0;
  tjhandle handle = decoder_->handle;
  const auto size = static_cast<unsigned long>(bytes.size());
  if (handle == nullptr ||
      tjDecompressHeader3(handle, bytes.data(), size, &width, &height, &subsampling, &colours) !=
          0) {
    return fail(ErrorCode::kCorruptData, "cannot look at a frame: {}", tjGetErrorStr2(handle));
  }
  if (std::int64_t{width} * height > kMaxPixels) {
    return fail(ErrorCode::kLimitExceeded,
                "cannot look at a frame of {} x {} pixels: more than {}",
                width,
                height,
                kMaxPixels);
  }
  int divisor = 1;
  while (divisor < 8 && width / (2 * divisor) >= kWidthPx) {
    divisor *= 2;
  }
  grey_.create((height + divisor - 1) / divisor, (width + divisor - 1) / divisor, CV_8UC1);
  if (tjDecompress2(handle,
                    bytes.data(),
                    size,
                    grey_.data,
                    grey_.cols,
                    /*pitch=*/grey_.cols,
                    grey_.rows,
                    TJPF_GRAY,
                    TJFLAG_FASTDCT) != 0 &&
      tjGetErrorCode(handle) != TJERR_WARNING) {
    return fail(ErrorCode::kCorruptData, "cannot look at a frame: {}", tjGetErrorStr2(handle));
  }
  return {};
}

Result<> GreyReducer::reduce_png(std::span<const std::uint8_t> bytes) {
  TM_ASSIGN_OR_RETURN(
      const DecodedImage image,
      decode_image(bytes, {.channels = ImageChannels::kGrey, .max_pixels = kMaxPixels}));
  FrameLayout layout;
  layout.format = PixelFormat::kGrey;
  layout.width_px = image.grey.cols;
  layout.height_px = image.grey.rows;
  layout.stride_bytes = image.grey.step[0];
  return reduce_raw(layout, {image.grey.data, image.grey.total()});
}

Result<> GreyReducer::reduce_raw(const FrameLayout& layout, std::span<const std::uint8_t> bytes) {
  if (layout.width_px <= 0 || layout.height_px <= 0 || bytes.size() < needed_bytes(layout) ||
      layout.stride_bytes < row_bytes(layout.format, layout.width_px)) {
    return fail(ErrorCode::kCorruptData,
                "cannot look at a frame of {} with {} x {} pixels: it has {} bytes",
                to_string(layout.format),
                layout.width_px,
                layout.height_px,
                bytes.size());
  }
  // A Bayer pattern is averaged over whole cells, or it would count as edges.
  const int smallest_side = is_bayer(layout.format) ? 2 : 1;
  const int side = std::max(layout.width_px / kWidthPx, smallest_side);
  grey_.create(layout.height_px / side, layout.width_px / side, CV_8UC1);
  const auto [first, step] = brightness_of(layout.format);
  const auto block = static_cast<std::size_t>(side);
  const std::uint8_t* row = bytes.data() + first;
  for (int y = 0; y < grey_.rows; ++y, row += block * layout.stride_bytes) {
    const std::uint8_t* cell = row;
    for (int x = 0; x < grey_.cols; ++x, cell += block * step) {
      grey_.at<std::uint8_t>(y, x) = mean_of_block(cell, layout.stride_bytes, step, block);
    }
  }
  return {};
}

}  // namespace trigmesh
