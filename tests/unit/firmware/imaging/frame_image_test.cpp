#include "firmware/imaging/frame_image.hpp"

#include <array>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using ::testing::HasSubstr;

struct Colour {
  int red = 0;
  int green = 0;
  int blue = 0;
};

constexpr std::array<Colour, 7> kColours = {{{255, 255, 255},
                                             {0, 0, 0},
                                             {255, 0, 0},
                                             {0, 255, 0},
                                             {0, 0, 255},
                                             {200, 120, 40},
                                             {90, 90, 90}}};

/// ITU-R BT.601, video range, from its definition.
struct Yuv {
  std::uint8_t y = 0;
  std::uint8_t cb = 0;
  std::uint8_t cr = 0;
};

Yuv yuv_of(const Colour& colour) {
  const double r = colour.red / 255.0;
  const double g = colour.green / 255.0;
  const double b = colour.blue / 255.0;
  const double luma = 0.299 * r + 0.587 * g + 0.114 * b;
  const auto byte = [](double value) { return static_cast<std::uint8_t>(std::lround(value)); };
  return {byte(16.0 + 219.0 * luma),
          byte(128.0 + 224.0 * (b - luma) / (2.0 - 2.0 * 0.114)),
          byte(128.0 + 224.0 * (r - luma) / (2.0 - 2.0 * 0.299))};
}

/// Padding that no pixel may show.
constexpr std::uint8_t kPadding = 0xA5;

std::vector<std::uint8_t> frame_of(const FrameLayout& layout, const Colour& colour) {
  std::vector<std::uint8_t> bytes(needed_bytes(layout) + 3, kPadding);
  const Yuv yuv = yuv_of(colour);
  const auto at = [&](int row, std::size_t i) -> std::uint8_t& {
    return bytes[static_cast<std::size_t>(row) * layout.stride_bytes + i];
  };
  const std::size_t used = row_bytes(layout.format, layout.width_px);
  const auto width = static_cast<std::size_t>(layout.width_px);
  const auto red = static_cast<std::uint8_t>(colour.red);
  const auto green = static_cast<std::uint8_t>(colour.green);
  const auto blue = static_cast<std::uint8_t>(colour.blue);
  const auto bayer = [&](int row, std::size_t i) {
    const std::array<std::array<std::uint8_t, 4>, 4> patterns = {{{red, green, green, blue},
                                                                  {green, red, blue, green},
                                                                  {green, blue, red, green},
                                                                  {blue, green, green, red}}};
    const auto which =
        static_cast<std::size_t>(layout.format) - static_cast<std::size_t>(PixelFormat::kBayerRggb);
    return patterns[which][static_cast<std::size_t>(row % 2) * 2 + i % 2];
  };
  for (int row = 0; row < layout.height_px; ++row) {
    for (std::size_t i = 0; i < used; ++i) {
      switch (layout.format) {
        case PixelFormat::kYuyv:
          at(row, i) = std::array{yuv.y, yuv.cb, yuv.y, yuv.cr}[i % 4];
          break;
        case PixelFormat::kUyvy:
          at(row, i) = std::array{yuv.cb, yuv.y, yuv.cr, yuv.y}[i % 4];
          break;
        case PixelFormat::kNv12:
          if (i < width) {
            at(row, i) = yuv.y;
          }
          at(layout.height_px + row / 2, i) = i % 2 == 0 ? yuv.cb : yuv.cr;
          break;
        case PixelFormat::kRgb24:
          at(row, i) = std::array{red, green, blue}[i % 3];
          break;
        case PixelFormat::kBgr24:
          at(row, i) = std::array{blue, green, red}[i % 3];
          break;
        default:
          at(row, i) = bayer(row, i);
          break;
      }
    }
  }
  return bytes;
}

void expect_colour(const cv::Mat& rgb,
                   const Colour& colour,
                   int tolerance,
                   const std::string& what) {
  for (int y = 0; y < rgb.rows; ++y) {
    for (int x = 0; x < rgb.cols; ++x) {
      const std::uint8_t* pixel = rgb.ptr<std::uint8_t>(y) + 3 * x;
      const int worst = std::max({std::abs(pixel[0] - colour.red),
                                  std::abs(pixel[1] - colour.green),
                                  std::abs(pixel[2] - colour.blue)});
      ASSERT_LE(worst, tolerance) << what << " at " << x << ", " << y << ": " << int{pixel[0]}
                                  << ' ' << int{pixel[1]} << ' ' << int{pixel[2]};
    }
  }
}

TEST(ImageOfFrame, ShowsKnownColoursInEveryFormatSizeAndStride) {
  for (const PixelFormat format : {PixelFormat::kYuyv,
                                   PixelFormat::kUyvy,
                                   PixelFormat::kNv12,
                                   PixelFormat::kBayerRggb,
                                   PixelFormat::kBayerGrbg,
                                   PixelFormat::kBayerGbrg,
                                   PixelFormat::kBayerBggr,
                                   PixelFormat::kRgb24,
                                   PixelFormat::kBgr24}) {
    for (const auto& [width, height] : {std::pair(8, 6), std::pair(7, 5), std::pair(34, 3)}) {
      for (const std::size_t padding : {0U, 1U, 13U}) {
        const std::size_t stride = row_bytes(format, width) + padding;
        const FrameLayout layout{format, width, height, stride};
        for (const Colour& colour : kColours) {
          const auto image = image_of_frame(layout, frame_of(layout, colour));
          ASSERT_TRUE(image) << image.error().message;
          ASSERT_EQ(image->rgb.size(), cv::Size(width, height));
          ASSERT_EQ(image->grey.size(), cv::Size(width, height));
          expect_colour(image->rgb, colour, 3, std::string(to_string(format)));
        }
      }
    }
  }
}

TEST(ImageOfFrame, KeepsGreyAsItIs) {
  const FrameLayout layout{PixelFormat::kGrey, 3, 2, 5};
  const std::vector<std::uint8_t> bytes = {1, 2, 3, 9, 9, 4, 5, 6};
  const auto image = image_of_frame(layout, bytes);
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->grey.at<std::uint8_t>(1, 2), 6);
  EXPECT_EQ(image->rgb.at<cv::Vec3b>(0, 1), cv::Vec3b(2, 2, 2));
  const auto grey_alone = image_of_frame(layout, bytes, {.channels = ImageChannels::kGrey});
  EXPECT_TRUE(grey_alone->rgb.empty());
}

TEST(ImageOfFrame, MakesOnlyWhatIsAskedFor) {
  const FrameLayout layout{PixelFormat::kYuyv, 4, 4, 8};
  const auto bytes = frame_of(layout, {90, 90, 90});
  EXPECT_TRUE(image_of_frame(layout, bytes, {.channels = ImageChannels::kRgb})->grey.empty());
  EXPECT_TRUE(image_of_frame(layout, bytes, {.channels = ImageChannels::kGrey})->rgb.empty());
}

TEST(ImageOfFrame, DoesNotReadBeyondTheBytes) {
  const FrameLayout layout{PixelFormat::kNv12, 7, 5, 16};
  const std::vector<std::uint8_t> bytes(needed_bytes(layout), 128);
  EXPECT_TRUE(image_of_frame(layout, bytes));
  const auto cut = image_of_frame(layout, std::span(bytes).first(bytes.size() - 1));
  ASSERT_FALSE(cut);
  EXPECT_EQ(cut.error().code, ErrorCode::kCorruptData);
  EXPECT_THAT(cut.error().message, HasSubstr("need 120"));
}

TEST(ImageOfFrame, RefusesImpossibleLayouts) {
  const std::vector<std::uint8_t> bytes(1000);
  const auto code = [&](const FrameLayout& layout, const DecodeOptions& options = {}) {
    const auto image = image_of_frame(layout, bytes, options);
    return image ? ErrorCode::kInternal : image.error().code;
  };
  EXPECT_EQ(code({PixelFormat::kGrey, 8, 4, 7}), ErrorCode::kCorruptData);
  EXPECT_EQ(code({PixelFormat::kGrey, 0, 4, 8}), ErrorCode::kCorruptData);
  EXPECT_EQ(code({PixelFormat::kGrey, 8, -1, 8}), ErrorCode::kCorruptData);
  EXPECT_EQ(code({PixelFormat::kBayerRggb, 2, 2, 2}), ErrorCode::kUnsupported);
  EXPECT_EQ(code({PixelFormat::kGrey, 8, 4, 8}, {.channels = {}, .max_pixels = 31}),
            ErrorCode::kLimitExceeded);
  EXPECT_EQ(code({PixelFormat::kJpeg, 8, 4, 0}), ErrorCode::kCorruptData);
}

TEST(JpegOfFrame, KeepsJpegUntouchedAndEncodesTheRest) {
  const FrameLayout raw{PixelFormat::kUyvy, 16, 16, 40};
  const auto jpeg = jpeg_of_frame(raw, frame_of(raw, {200, 120, 40}), 95);
  ASSERT_TRUE(jpeg) << jpeg.error().message;
  const FrameLayout encoded{PixelFormat::kJpeg, 16, 16, 0};
  EXPECT_EQ(*jpeg_of_frame(encoded, *jpeg, 10), *jpeg);
  const auto image = image_of_frame(encoded, *jpeg);
  ASSERT_TRUE(image) << image.error().message;
  expect_colour(image->rgb, {200, 120, 40}, 5, "JPEG");
  const FrameLayout grey{PixelFormat::kGrey, 16, 16, 16};
  EXPECT_TRUE(jpeg_of_frame(grey, std::vector<std::uint8_t>(256, 77), 90));
}

}  // namespace
}  // namespace trigmesh
