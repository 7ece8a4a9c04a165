#include "sfm/exchange/image_codec.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include <png.h>
#include <turbojpeg.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// A smooth picture with a different gradient in each channel, so that swapped channels or rows are
/// noticed.
cv::Mat gradient_rgb(int width, int height) {
  cv::Mat image(height, width, CV_8UC3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.at<cv::Vec3b>(y, x) =
          cv::Vec3b(static_cast<std::uint8_t>(x * 255 / std::max(width - 1, 1)),
                    static_cast<std::uint8_t>(y * 255 / std::max(height - 1, 1)),
                    static_cast<std::uint8_t>(64 + (x + y) / 4 % 192));
    }
  }
  return image;
}

cv::Mat gradient_grey(int width, int height) {
  cv::Mat image(height, width, CV_8UC1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>((x * 3 + y * 5) % 256);
    }
  }
  return image;
}

/// Largest difference over all channels; 256 when the shapes differ.
int largest_difference(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.type() != b.type()) {
    return 256;
  }
  int largest = 0;
  for (int y = 0; y < a.rows; ++y) {
    const std::uint8_t* p = a.ptr<std::uint8_t>(y);
    const std::uint8_t* q = b.ptr<std::uint8_t>(y);
    for (int i = 0; i < a.cols * a.channels(); ++i) {
      largest = std::max(largest, std::abs(int{p[i]} - int{q[i]}));
    }
  }
  return largest;
}

int luma(int r, int g, int b) {
  return static_cast<int>(std::lround(0.299 * r + 0.587 * g + 0.114 * b));
}

/// Encodes with any pixel format and flags of turbojpeg, for the kinds that the product does not
/// write.
Bytes jpeg_with(const cv::Mat& image, TJPF format, TJSAMP subsampling, int flags) {
  tjhandle handle = tjInitCompress();
  unsigned char* out = nullptr;
  unsigned long size = 0;
  const int status = tjCompress2(handle,
                                 image.data,
                                 image.cols,
                                 static_cast<int>(image.step[0]),
                                 image.rows,
                                 format,
                                 &out,
                                 &size,
                                 subsampling,
                                 95,
                                 flags);
  EXPECT_EQ(status, 0) << tjGetErrorStr2(handle);
  Bytes bytes(out, out + size);
  tjFree(out);
  (void)tjDestroy(handle);
  return bytes;
}

/// Writes a PNG of any libpng format from raw rows (16 bit formats in native order).
Bytes png_with(
    png_uint_32 format, int width, int height, const void* pixels, const void* colormap = nullptr) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(width);
  header.height = static_cast<png_uint_32>(height);
  header.format = format;
  header.colormap_entries = colormap == nullptr ? 0U : 4U;
  png_alloc_size_t size = 1U << 16U;
  Bytes bytes(size);
  EXPECT_NE(png_image_write_to_memory(&header, bytes.data(), &size, 0, pixels, 0, colormap), 0)
      << header.message;
  bytes.resize(size);
  return bytes;
}

TEST(PngCodec, RoundTripsWithoutLoss) {
  const cv::Mat rgb = gradient_rgb(37, 21);
  const auto bytes = encode_png(rgb);
  ASSERT_TRUE(bytes) << bytes.error().message;
  const auto image = decode_image(*bytes);
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(largest_difference(image->rgb, rgb), 0);
  const auto& pixel = rgb.at<cv::Vec3b>(20, 30);
  EXPECT_NEAR(image->grey.at<std::uint8_t>(20, 30), luma(pixel[0], pixel[1], pixel[2]), 1);
}

TEST(PngCodec, RoundTripsGreyAndTurnsItIntoRgb) {
  const cv::Mat grey = gradient_grey(19, 33);
  const auto bytes = encode_png(grey);
  ASSERT_TRUE(bytes) << bytes.error().message;
  const auto image = decode_image(*bytes, {.channels = ImageChannels::kGrey});
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(largest_difference(image->grey, grey), 0);
  EXPECT_TRUE(image->rgb.empty());
  const auto colour = decode_image(*bytes, {.channels = ImageChannels::kRgb});
  ASSERT_TRUE(colour) << colour.error().message;
  const std::uint8_t value = grey.at<std::uint8_t>(7, 5);
  EXPECT_EQ(colour->rgb.at<cv::Vec3b>(7, 5), cv::Vec3b(value, value, value));
  EXPECT_TRUE(colour->grey.empty());
}

TEST(PngCodec, EncodesPictureWithRowPadding) {
  const cv::Mat whole = gradient_rgb(40, 30);
  const cv::Mat part = whole(cv::Rect(3, 4, 20, 10));
  const auto bytes = encode_png(part);
  ASSERT_TRUE(bytes) << bytes.error().message;
  const auto image = decode_image(*bytes, {.channels = ImageChannels::kRgb});
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(largest_difference(image->rgb, part.clone()), 0);
}

TEST(PngCodec, ReducesPaletteToRgb) {
  const std::array<std::uint8_t, 4> indices = {0, 1, 2, 3};
  const std::array<std::uint8_t, 12> palette = {255, 0, 0, 0, 255, 0, 0, 0, 255, 9, 8, 7};
  const Bytes bytes = png_with(PNG_FORMAT_RGB_COLORMAP, 4, 1, indices.data(), palette.data());
  const auto image = decode_image(bytes, {.channels = ImageChannels::kRgb});
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->rgb.at<cv::Vec3b>(0, 1), cv::Vec3b(0, 255, 0));
  EXPECT_EQ(image->rgb.at<cv::Vec3b>(0, 3), cv::Vec3b(9, 8, 7));
}

TEST(PngCodec, LaysTransparentPixelsOverBlack) {
  const std::array<std::uint8_t, 8> pixels = {200, 100, 50, 255, 200, 100, 50, 0};
  const Bytes bytes = png_with(PNG_FORMAT_RGBA, 2, 1, pixels.data());
  const auto image = decode_image(bytes, {.channels = ImageChannels::kRgb});
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->rgb.at<cv::Vec3b>(0, 0), cv::Vec3b(200, 100, 50));
  EXPECT_EQ(image->rgb.at<cv::Vec3b>(0, 1), cv::Vec3b(0, 0, 0));
}

TEST(PngCodec, ReadsSixteenBits) {
  const std::array<std::uint16_t, 3> pixels = {0, 32768, 65535};
  const Bytes bytes = png_with(PNG_FORMAT_LINEAR_Y, 3, 1, pixels.data());
  const auto image = decode_image(bytes, {.channels = ImageChannels::kGrey});
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->grey.at<std::uint8_t>(0, 0), 0);
  EXPECT_NEAR(image->grey.at<std::uint8_t>(0, 1),
              187,
              2);  // half of the light on the sRGB curve (188), or its power 2.2 (186)
  EXPECT_EQ(image->grey.at<std::uint8_t>(0, 2), 255);
}

TEST(PngCodec, RefusesTruncatedAndDamagedFiles) {
  const Bytes whole = encode_png(gradient_rgb(64, 64)).value();
  for (const std::size_t size : {std::size_t{8}, std::size_t{20}, whole.size() / 2}) {
    const auto image = decode_image(std::span(whole).first(size));
    ASSERT_FALSE(image) << size;
    EXPECT_EQ(image.error().code, ErrorCode::kCorruptData);
  }
  Bytes damaged = whole;
  damaged[whole.size() / 2] ^= 0xFFU;
  EXPECT_EQ(decode_image(damaged).error().code, ErrorCode::kCorruptData);
}

TEST(JpegCodec, StaysCloseToTheOriginalInEveryMode) {
  const cv::Mat rgb = gradient_rgb(131, 77);
  const auto bytes = encode_jpeg(rgb, 95);
  ASSERT_TRUE(bytes) << bytes.error().message;
  const auto both = decode_image(*bytes);
  const auto grey = decode_image(*bytes, {.channels = ImageChannels::kGrey});
  const auto colour = decode_image(*bytes, {.channels = ImageChannels::kRgb});
  ASSERT_TRUE(both && grey && colour);
  EXPECT_LE(largest_difference(both->rgb.rowRange(8, 60).colRange(8, 48),
                               rgb.rowRange(8, 60).colRange(8, 48)),
            30);
  EXPECT_LE(largest_difference(both->rgb, colour->rgb), 40);  // chroma is interpolated differently
  EXPECT_EQ(largest_difference(both->grey, grey->grey), 0);   // the luma plane is one and the same
  EXPECT_TRUE(both->grey.isContinuous());
  const auto& pixel = rgb.at<cv::Vec3b>(40, 20);
  EXPECT_NEAR(both->grey.at<std::uint8_t>(40, 20), luma(pixel[0], pixel[1], pixel[2]), 6);
}

TEST(JpegCodec, DecodesGreyFilesInEveryMode) {
  cv::Mat grey(40, 50, CV_8UC1, cv::Scalar(90));
  const Bytes bytes = encode_jpeg(grey, 90).value();
  for (const ImageChannels channels :
       {ImageChannels::kGrey, ImageChannels::kRgb, ImageChannels::kGreyAndRgb}) {
    const auto image = decode_image(bytes, {.channels = channels});
    ASSERT_TRUE(image) << image.error().message;
    if (channels != ImageChannels::kRgb) {
      EXPECT_NEAR(image->grey.at<std::uint8_t>(20, 20), 90, 1);
    }
    if (channels != ImageChannels::kGrey) {
      EXPECT_NEAR(image->rgb.at<cv::Vec3b>(20, 20)[2], 90, 1);
    }
  }
}

TEST(JpegCodec, DecodesProgressiveAndAllSubsamplings) {
  const cv::Mat rgb(33, 47, CV_8UC3, cv::Scalar(200, 60, 20));
  for (const TJSAMP subsampling : {TJSAMP_444, TJSAMP_422, TJSAMP_420, TJSAMP_440, TJSAMP_411}) {
    for (const int flags : {0, TJFLAG_PROGRESSIVE}) {
      const Bytes bytes = jpeg_with(rgb, TJPF_RGB, subsampling, flags);
      const auto image = decode_image(bytes);
      ASSERT_TRUE(image) << image.error().message;
      EXPECT_LE(largest_difference(image->rgb, rgb), 4) << subsampling;
      EXPECT_NEAR(image->grey.at<std::uint8_t>(32, 46), luma(200, 60, 20), 2);
    }
  }
}

TEST(JpegCodec, RefusesTruncatedFileThatViewersShowHalfGrey) {
  const Bytes whole = encode_jpeg(gradient_rgb(200, 200), 90).value();
  for (const ImageChannels channels :
       {ImageChannels::kGrey, ImageChannels::kRgb, ImageChannels::kGreyAndRgb}) {
    const auto image =
        decode_image(std::span(whole).first(whole.size() / 2), {.channels = channels});
    ASSERT_FALSE(image);
    EXPECT_EQ(image.error().code, ErrorCode::kCorruptData);
  }
}

TEST(JpegCodec, RefusesCmyk) {
  const cv::Mat cmyk(16, 16, CV_8UC4, cv::Scalar(1, 2, 3, 4));
  const auto image = decode_image(jpeg_with(cmyk, TJPF_CMYK, TJSAMP_444, 0));
  ASSERT_FALSE(image);
  EXPECT_EQ(image.error().code, ErrorCode::kUnsupported);
}

TEST(ImageCodec, HandlesASinglePixel) {
  const cv::Mat one(1, 1, CV_8UC3, cv::Scalar(10, 20, 30));
  for (const Bytes& bytes : {encode_png(one).value(), encode_jpeg(one, 100).value()}) {
    const auto image = decode_image(bytes);
    ASSERT_TRUE(image) << image.error().message;
    EXPECT_EQ(image->grey.size(), cv::Size(1, 1));
    EXPECT_LE(largest_difference(image->rgb, one), 3);
  }
}

TEST(ImageCodec, ProbesWithoutDecoding) {
  const cv::Mat rgb = gradient_rgb(123, 45);
  const Bytes png = encode_png(rgb).value();
  const Bytes jpeg = encode_jpeg(rgb).value();
  const auto from_png = probe_image(std::span(png).first(100));
  ASSERT_TRUE(from_png) << from_png.error().message;
  EXPECT_EQ(from_png->format, ImageFormat::kPng);
  EXPECT_EQ(from_png->width_px, 123);
  const auto from_jpeg = probe_image(jpeg);
  ASSERT_TRUE(from_jpeg) << from_jpeg.error().message;
  EXPECT_EQ(from_jpeg->format, ImageFormat::kJpeg);
  EXPECT_EQ(from_jpeg->height_px, 45);
}

TEST(ImageCodec, RefusesOtherBytes) {
  for (const std::string text : {"", "\xFF", "GIF89a............", "\x89PNG"}) {
    const Bytes bytes(text.begin(), text.end());
    EXPECT_EQ(decode_image(bytes).error().code, ErrorCode::kCorruptData);
    EXPECT_EQ(probe_image(bytes).error().code, ErrorCode::kCorruptData);
  }
}

TEST(ImageCodec, KeepsThePixelLimitBeforeTakingMemory) {
  const cv::Mat rgb = gradient_rgb(20, 10);
  for (const Bytes& bytes : {encode_png(rgb).value(), encode_jpeg(rgb).value()}) {
    EXPECT_TRUE(decode_image(bytes, {.max_pixels = 200}));
    const auto image = decode_image(bytes, {.max_pixels = 199});
    ASSERT_FALSE(image);
    EXPECT_EQ(image.error().code, ErrorCode::kLimitExceeded);
  }
  EXPECT_EQ(decode_image({}, {.max_pixels = 0}).error().code, ErrorCode::kInvalidArgument);
}

TEST(ImageCodec, RefusesToEncodeOtherTypes) {
  EXPECT_EQ(encode_png(cv::Mat()).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(encode_jpeg(cv::Mat(4, 4, CV_32FC1)).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(encode_jpeg(cv::Mat(4, 4, CV_8UC1), 0).error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace trigmesh
