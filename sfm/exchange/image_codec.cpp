#include "sfm/exchange/image_codec.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>

#include <png.h>
#include <turbojpeg.h>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

constexpr std::array<std::uint8_t, 3> kJpegStart = {0xFF, 0xD8, 0xFF};
constexpr std::array<std::uint8_t, 8> kPngStart = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
constexpr int kMaxJpegSide = 65500;

template <std::size_t N>
bool starts_with(std::span<const std::uint8_t> bytes, const std::array<std::uint8_t, N>& start) {
  return bytes.size() >= N && std::equal(start.begin(), start.end(), bytes.begin());
}

Result<> check_size(const ImageInfo& info, const DecodeOptions& options) {
  const std::int64_t pixels = std::int64_t{info.width_px} * info.height_px;
  if (pixels > options.max_pixels) {
    return fail(ErrorCode::kLimitExceeded,
                "{} picture of {} x {} pixels is larger than the limit of {} pixels",
                to_string(info.format),
                info.width_px,
                info.height_px,
                options.max_pixels);
  }
  return {};
}

/// BT.601 luma with 16 bit weights, rounded: the conversion that JPEG prescribes, so PNG and JPEG
/// grey mean the same.
cv::Mat grey_from_rgb(const cv::Mat& rgb) {
  cv::Mat grey(rgb.rows, rgb.cols, CV_8UC1);
  for (int y = 0; y < rgb.rows; ++y) {
    const std::uint8_t* in = rgb.ptr<std::uint8_t>(y);
    std::uint8_t* out = grey.ptr<std::uint8_t>(y);
    for (int x = 0; x < rgb.cols; ++x, in += 3) {
      out[x] = static_cast<std::uint8_t>(
          (19595U * in[0] + 38470U * in[1] + 7471U * in[2] + 32768U) >> 16U);
    }
  }
  return grey;
}

// ---- JPEG
// ----------------------------------------------------------------------------------------------------------

struct JpegHandleCloser {
  void operator()(void* handle) const { (void)tjDestroy(handle); }
};

using JpegHandle = std::unique_ptr<void, JpegHandleCloser>;

struct JpegBytesFreer {
  void operator()(unsigned char* bytes) const { tjFree(bytes); }
};

struct JpegHeader {
  ImageInfo info;
  int subsampling = 0;
  int colorspace = 0;
};

unsigned long size_of(std::span<const std::uint8_t> bytes) {
  return static_cast<unsigned long>(bytes.size());
}

/// Warnings that leave the pixels whole; libjpeg keeps the first warning of a picture, which is the
/// one that tells.
bool is_harmless(std::string_view warning) {
  return warning.find("extraneous bytes before marker") != std::string_view::npos ||
         warning.find("Adobe") != std::string_view::npos ||
         warning.find("JFIF") != std::string_view::npos;
}

/// turbojpeg calls a truncated file a mere warning and fills the rest with grey: for us that is
/// damage.
Result<> check_jpeg(int status, tjhandle handle) {
  if (status == 0) {
    return {};
  }
  const std::string reason = tjGetErrorStr2(handle);
  if (tjGetErrorCode(handle) == TJERR_WARNING && is_harmless(reason)) {
    return {};
  }
  return fail(ErrorCode::kCorruptData, "damaged JPEG: {}", reason);
}

Result<JpegHeader> read_jpeg_header(tjhandle handle, std::span<const std::uint8_t> bytes) {
  JpegHeader header;
  header.info.format = ImageFormat::kJpeg;
  TM_RETURN_IF_ERROR(check_jpeg(tjDecompressHeader3(handle,
                                                    bytes.data(),
                                                    size_of(bytes),
                                                    &header.info.width_px,
                                                    &header.info.height_px,
                                                    &header.subsampling,
                                                    &header.colorspace),
                                handle));
  if (header.info.width_px <= 0 || header.info.height_px <= 0) {
    return fail(ErrorCode::kCorruptData, "damaged JPEG: the header gives no size");
  }
  return header;
}

Result<cv::Mat> decode_jpeg_as(tjhandle handle,
                               std::span<const std::uint8_t> bytes,
                               const ImageInfo& info,
                               TJPF pixel_format) {
  cv::Mat image(info.height_px, info.width_px, pixel_format == TJPF_GRAY ? CV_8UC1 : CV_8UC3);
  TM_RETURN_IF_ERROR(check_jpeg(tjDecompress2(handle,
                                              bytes.data(),
                                              size_of(bytes),
                                              image.data,
                                              info.width_px,
                                              static_cast<int>(image.step[0]),
                                              info.height_px,
                                              pixel_format,
                                              TJFLAG_ACCURATEDCT | TJFLAG_LIMITSCANS),
                                handle));
  return image;
}

/// Entropy decoding, the larger part of the work, is done once: the luma plane is the grey picture,
/// and colour is made from the planes.
Result<DecodedImage> decode_jpeg_planes(tjhandle handle,
                                        std::span<const std::uint8_t> bytes,
                                        const JpegHeader& header) {
  const int width = header.info.width_px;
  const int height = header.info.height_px;
  std::array<cv::Mat, 3> planes;
  std::array<unsigned char*, 3> pointers{};
  std::array<int, 3> strides{};
  for (int i = 0; i < 3; ++i) {
    const auto at = static_cast<std::size_t>(i);
    planes[at].create(tjPlaneHeight(i, height, header.subsampling),
                      tjPlaneWidth(i, width, header.subsampling),
                      CV_8UC1);
    pointers[at] = planes[at].data;
    strides[at] = static_cast<int>(planes[at].step[0]);
  }
  TM_RETURN_IF_ERROR(check_jpeg(tjDecompressToYUVPlanes(handle,
                                                        bytes.data(),
                                                        size_of(bytes),
                                                        pointers.data(),
                                                        width,
                                                        strides.data(),
                                                        height,
                                                        TJFLAG_ACCURATEDCT | TJFLAG_LIMITSCANS),
                                handle));
  DecodedImage image;
  image.rgb.create(height, width, CV_8UC3);
  std::array<const unsigned char*, 3> sources = {pointers[0], pointers[1], pointers[2]};
  TM_RETURN_IF_ERROR(check_jpeg(tjDecodeYUVPlanes(handle,
                                                  sources.data(),
                                                  strides.data(),
                                                  header.subsampling,
                                                  image.rgb.data,
                                                  width,
                                                  static_cast<int>(image.rgb.step[0]),
                                                  height,
                                                  TJPF_RGB,
                                                  0),
                                handle));
  // Planes are padded to whole chroma samples: cut the padding off and give its memory back.
  image.grey = planes[0].cols == width && planes[0].rows == height
                   ? planes[0]
                   : planes[0](cv::Rect(0, 0, width, height)).clone();
  return image;
}

Result<JpegHandle> open_jpeg() {
  JpegHandle handle(tjInitDecompress());
  if (handle == nullptr) {
    return fail(ErrorCode::kInternal, "cannot start the JPEG decoder: {}", tjGetErrorStr());
  }
  return handle;
}

Result<DecodedImage> decode_jpeg(std::span<const std::uint8_t> bytes,
                                 const DecodeOptions& options) {
  TM_ASSIGN_OR_RETURN(const JpegHandle handle, open_jpeg());
  TM_ASSIGN_OR_RETURN(const JpegHeader header, read_jpeg_header(handle.get(), bytes));
  TM_RETURN_IF_ERROR(check_size(header.info, options));
  if (header.colorspace == TJCS_CMYK || header.colorspace == TJCS_YCCK) {
    return fail(ErrorCode::kUnsupported, "JPEG in CMYK (print) colours; save it in RGB");
  }
  DecodedImage image;
  switch (options.channels) {
    case ImageChannels::kGrey: {
      if (header.colorspace != TJCS_RGB) {
        TM_ASSIGN_OR_RETURN(image.grey,
                            decode_jpeg_as(handle.get(), bytes, header.info, TJPF_GRAY));
        return image;
      }
      TM_ASSIGN_OR_RETURN(const cv::Mat rgb,
                          decode_jpeg_as(handle.get(), bytes, header.info, TJPF_RGB));
      image.grey = grey_from_rgb(rgb);
      return image;
    }
    case ImageChannels::kRgb: {
      TM_ASSIGN_OR_RETURN(image.rgb, decode_jpeg_as(handle.get(), bytes, header.info, TJPF_RGB));
      return image;
    }
    case ImageChannels::kGreyAndRgb:
      break;
  }
  if (header.colorspace == TJCS_YCbCr && header.subsampling >= 0 &&
      header.subsampling != TJSAMP_GRAY) {
    return decode_jpeg_planes(handle.get(), bytes, header);
  }
  TM_ASSIGN_OR_RETURN(image.rgb, decode_jpeg_as(handle.get(), bytes, header.info, TJPF_RGB));
  image.grey = grey_from_rgb(image.rgb);
  return image;
}

// ---- PNG
// -----------------------------------------------------------------------------------------------------------

/// libpng's simplified reader; frees its state on every path.
class PngReader {
 public:
  PngReader() { image_.version = PNG_IMAGE_VERSION; }

  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;
  PngReader(PngReader&&) = delete;
  PngReader& operator=(PngReader&&) = delete;

  ~PngReader() { png_image_free(&image_); }

  [[nodiscard]] Result<ImageInfo> open(std::span<const std::uint8_t> bytes) {
    if (png_image_begin_read_from_memory(&image_, bytes.data(), bytes.size()) == 0) {
      return fail(
          ErrorCode::kCorruptData, "damaged PNG: {}", static_cast<const char*>(image_.message));
    }
    // 16 bit pictures of cameras carry the sRGB curve, like their 8 bit ones, unless a gAMA chunk
    // says otherwise.
    image_.flags |= PNG_IMAGE_FLAG_16BIT_sRGB;
    return ImageInfo{
        ImageFormat::kPng, static_cast<int>(image_.width), static_cast<int>(image_.height)};
  }

  [[nodiscard]] bool is_colour() const { return (image_.format & PNG_FORMAT_FLAG_COLOR) != 0U; }

  [[nodiscard]] Result<cv::Mat> read(const ImageInfo& info, png_uint_32 format) {
    cv::Mat pixels(info.height_px, info.width_px, format == PNG_FORMAT_GRAY ? CV_8UC1 : CV_8UC3);
    image_.format = format;
    const png_color black = {0, 0, 0};
    if (png_image_finish_read(
            &image_, &black, pixels.data, static_cast<png_int_32>(pixels.step[0]), nullptr) == 0) {
      return fail(
          ErrorCode::kCorruptData, "damaged PNG: {}", static_cast<const char*>(image_.message));
    }
    return pixels;
  }

 private:
  png_image image_{};
};

Result<DecodedImage> decode_png(std::span<const std::uint8_t> bytes, const DecodeOptions& options) {
  PngReader reader;
  TM_ASSIGN_OR_RETURN(const ImageInfo info, reader.open(bytes));
  TM_RETURN_IF_ERROR(check_size(info, options));
  DecodedImage image;
  if (options.channels == ImageChannels::kGrey && !reader.is_colour()) {
    TM_ASSIGN_OR_RETURN(image.grey, reader.read(info, PNG_FORMAT_GRAY));
    return image;
  }
  TM_ASSIGN_OR_RETURN(image.rgb, reader.read(info, PNG_FORMAT_RGB));
  if (options.channels != ImageChannels::kRgb) {
    image.grey = grey_from_rgb(image.rgb);
  }
  if (options.channels == ImageChannels::kGrey) {
    image.rgb.release();
  }
  return image;
}

Result<> check_encodable(const cv::Mat& image) {
  if (image.empty() || image.dims != 2 || (image.type() != CV_8UC1 && image.type() != CV_8UC3)) {
    return fail(ErrorCode::kInvalidArgument, "only pictures of 8 bit grey or RGB can be encoded");
  }
  return {};
}

}  // namespace

std::string_view to_string(ImageFormat format) {
  return format == ImageFormat::kJpeg ? "JPEG" : "PNG";
}

Result<ImageInfo> probe_image(std::span<const std::uint8_t> bytes) {
  if (starts_with(bytes, kPngStart)) {
    PngReader reader;
    return reader.open(bytes);
  }
  if (starts_with(bytes, kJpegStart)) {
    TM_ASSIGN_OR_RETURN(const JpegHandle handle, open_jpeg());
    TM_ASSIGN_OR_RETURN(const JpegHeader header, read_jpeg_header(handle.get(), bytes));
    return header.info;
  }
  return fail(ErrorCode::kCorruptData, "neither a JPEG nor a PNG picture");
}

Result<DecodedImage> decode_image(std::span<const std::uint8_t> bytes,
                                  const DecodeOptions& options) {
  if (options.max_pixels <= 0) {
    return fail(ErrorCode::kInvalidArgument,
                "max_pixels is {}, must be greater than 0",
                options.max_pixels);
  }
  if (starts_with(bytes, kPngStart)) {
    return decode_png(bytes, options);
  }
  if (starts_with(bytes, kJpegStart)) {
    return decode_jpeg(bytes, options);
  }
  return fail(ErrorCode::kCorruptData, "neither a JPEG nor a PNG picture");
}

Result<std::vector<std::uint8_t>> encode_png(const cv::Mat& image) {
  TM_RETURN_IF_ERROR(check_encodable(image));
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.cols);
  header.height = static_cast<png_uint_32>(image.rows);
  header.format = image.type() == CV_8UC1 ? PNG_FORMAT_GRAY : PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(header);
  std::vector<std::uint8_t> bytes(size);
  const cv::Mat packed = image.isContinuous() ? image : image.clone();
  if (png_image_write_to_memory(&header, bytes.data(), &size, 0, packed.data, 0, nullptr) == 0) {
    return fail(
        ErrorCode::kInternal, "cannot encode PNG: {}", static_cast<const char*>(header.message));
  }
  bytes.resize(size);
  return bytes;
}

Result<std::vector<std::uint8_t>> encode_jpeg(const cv::Mat& image, int quality) {
  TM_RETURN_IF_ERROR(check_encodable(image));
  if (quality < 1 || quality > 100 || image.cols > kMaxJpegSide || image.rows > kMaxJpegSide) {
    return fail(
        ErrorCode::kInvalidArgument,
        "JPEG of {} x {} pixels at quality {}: sides are at most {}, quality is in [1, 100]",
        image.cols,
        image.rows,
        quality,
        kMaxJpegSide);
  }
  const JpegHandle handle(tjInitCompress());
  if (handle == nullptr) {
    return fail(ErrorCode::kInternal, "cannot start the JPEG encoder: {}", tjGetErrorStr());
  }
  const bool is_grey = image.type() == CV_8UC1;
  const int subsampling = is_grey ? TJSAMP_GRAY : TJSAMP_420;
  // The encoder's own buffer grows with the file; the worst case would take more than the pixels.
  unsigned long size = 0;
  unsigned char* out = nullptr;
  const int failed = tjCompress2(handle.get(),
                                 image.data,
                                 image.cols,
                                 static_cast<int>(image.step[0]),
                                 image.rows,
                                 is_grey ? TJPF_GRAY : TJPF_RGB,
                                 &out,
                                 &size,
                                 subsampling,
                                 quality,
                                 TJFLAG_ACCURATEDCT);
  const std::unique_ptr<unsigned char, JpegBytesFreer> owner(out);
  if (failed != 0) {
    return fail(ErrorCode::kInternal, "cannot encode JPEG: {}", tjGetErrorStr2(handle.get()));
  }
  return std::vector<std::uint8_t>(out, out + size);
}

}  // namespace trigmesh
