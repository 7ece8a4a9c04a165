#include "firmware/imaging/sharpness.hpp"

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "sfm/exchange/image_codec.hpp"

namespace trigmesh {
namespace {

/// Random squares, blurred by `sigma_px`; 0: not at all.
cv::Mat picture(int width, int height, double sigma_px) {
  cv::RNG random(7);
  cv::Mat grey(height, width, CV_8UC1, cv::Scalar(128));
  for (int i = 0; i < 300; ++i) {
    const cv::Rect square(random.uniform(0, width), random.uniform(0, height), 40, 40);
    cv::rectangle(grey, square, cv::Scalar(random.uniform(0, 255)), cv::FILLED);
  }
  if (sigma_px > 0.0) {
    cv::GaussianBlur(grey, grey, cv::Size(), sigma_px);
  }
  return grey;
}

FrameLayout layout_of(PixelFormat format, int width, int height, std::size_t stride) {
  FrameLayout layout;
  layout.format = format;
  layout.width_px = width;
  layout.height_px = height;
  layout.stride_bytes = stride;
  return layout;
}

double sharpness(const FrameLayout& layout, std::span<const std::uint8_t> bytes) {
  SharpnessMeter meter;
  const Result<double> measured = meter.measure(layout, bytes);
  EXPECT_TRUE(measured) << measured.error().message;
  return measured.value_or(-1.0);
}

double grey_sharpness(const cv::Mat& grey) {
  return sharpness(layout_of(PixelFormat::kGrey, grey.cols, grey.rows, grey.step[0]),
                   {grey.data, grey.total()});
}

TEST(SharpnessMeter, FallsWithBlurInRawFrames) {
  const double sharp = grey_sharpness(picture(640, 480, 0.0));
  const double soft = grey_sharpness(picture(640, 480, 2.0));
  const double blurred = grey_sharpness(picture(640, 480, 5.0));
  EXPECT_GT(sharp, 1.5 * soft);
  EXPECT_GT(soft, 1.5 * blurred);
}

TEST(SharpnessMeter, FallsWithBlurInJpeg) {
  std::vector<double> measured;
  for (const double sigma_px : {0.0, 3.0, 9.0}) {
    const auto jpeg = encode_jpeg(picture(1280, 720, sigma_px));
    ASSERT_TRUE(jpeg);
    measured.push_back(sharpness(layout_of(PixelFormat::kJpeg, 0, 0, 0), *jpeg));
  }
  EXPECT_GT(measured[0], 1.5 * measured[1]);
  EXPECT_GT(measured[1], 1.5 * measured[2]);
}

TEST(SharpnessMeter, ReadsTheBrightnessOfPackedFrames) {
  const cv::Mat grey = picture(640, 480, 0.0);
  const double expected = grey_sharpness(grey);
  for (const bool is_brightness_first : {true, false}) {
    std::vector<std::uint8_t> packed(2 * grey.total(), 90);  // chroma says nothing
    for (std::size_t i = 0; i < grey.total(); ++i) {
      packed[2 * i + (is_brightness_first ? 0 : 1)] = grey.data[i];
    }
    const PixelFormat format = is_brightness_first ? PixelFormat::kYuyv : PixelFormat::kUyvy;
    EXPECT_EQ(sharpness(layout_of(format, 640, 480, 1280), packed), expected);
  }
}

TEST(SharpnessMeter, ABayerPatternIsNoEdge) {
  std::vector<std::uint8_t> cells(640 * 480);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    cells[i] = (i % 2 == 0) == (i / 640 % 2 == 0) ? 200 : 20;
  }
  EXPECT_EQ(sharpness(layout_of(PixelFormat::kBayerRggb, 640, 480, 640), cells), 0.0);
}

TEST(SharpnessMeter, RefusesFramesThatAreNone) {
  SharpnessMeter meter;
  const std::vector<std::uint8_t> few(10);
  const auto raw = meter.measure(layout_of(PixelFormat::kGrey, 64, 64, 64), few);
  ASSERT_FALSE(raw);
  EXPECT_EQ(raw.error().code, ErrorCode::kCorruptData);
  const auto jpeg = meter.measure(layout_of(PixelFormat::kJpeg, 0, 0, 0), few);
  ASSERT_FALSE(jpeg);
  EXPECT_EQ(jpeg.error().code, ErrorCode::kCorruptData);
}

TEST(SharpnessMeter, AFrameOfTwoRowsHasNone) {
  const std::vector<std::uint8_t> rows(20, 3);
  EXPECT_EQ(sharpness(layout_of(PixelFormat::kGrey, 10, 2, 10), rows), 0.0);
}

}  // namespace
}  // namespace trigmesh
