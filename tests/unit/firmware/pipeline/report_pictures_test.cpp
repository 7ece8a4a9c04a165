#include "firmware/pipeline/report_pictures.hpp"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sfm/exchange/image_codec.hpp"

namespace trigmesh {
namespace {

double luma(const std::array<std::uint8_t, 3>& rgb) {
  return 0.299 * rgb[0] + 0.587 * rgb[1] + 0.114 * rgb[2];
}

/// A ramp of depths from 1 at the left to 2 at the right; unknown in the upper quarter.
DepthMap ramp(int width, int height) {
  DepthMap map;
  map.depth.create(height, width, CV_32FC1);
  map.confidence.create(height, width, CV_8UC1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const bool is_known = y >= height / 4;
      map.depth.at<float>(y, x) =
          is_known ? 1.0F + static_cast<float>(x) / static_cast<float>(width) : 0.0F;
      map.confidence.at<std::uint8_t>(y, x) = is_known ? 255 : 0;
    }
  }
  return map;
}

cv::Mat decode(const std::vector<std::uint8_t>& jpeg) {
  const auto image = decode_image(jpeg, {.channels = ImageChannels::kRgb});
  EXPECT_TRUE(image.has_value());
  return image->rgb;
}

TEST(DepthColor, GrowsEvenlyInLightness) {
  double previous = luma(depth_color(0.0));
  const double whole = luma(depth_color(1.0)) - previous;
  EXPECT_GT(whole, 150.0);
  for (int step = 1; step <= 20; ++step) {
    const double next = luma(depth_color(step / 20.0));
    EXPECT_NEAR(next - previous, whole / 20.0, 0.25 * whole / 20.0) << step;
    previous = next;
  }
}

TEST(DepthColor, TakesLevelsOutOfRangeForTheNearest) {
  EXPECT_EQ(depth_color(-1.0), depth_color(0.0));
  EXPECT_EQ(depth_color(2.0), depth_color(1.0));
}

TEST(DepthPicture, IsSmallAndKeepsTheShape) {
  const cv::Mat photograph(300, 400, CV_8UC3, cv::Scalar(10, 20, 30));
  const auto picture = make_depth_picture("a.jpg", photograph, ramp(200, 150));
  ASSERT_TRUE(picture.has_value()) << picture.error().message;
  EXPECT_EQ(decode(picture->image_jpeg).size(), cv::Size(256, 192));
  EXPECT_EQ(decode(picture->depth_jpeg).size(), cv::Size(200, 150)) << "never enlarged";
  EXPECT_EQ(picture->image_name, "a.jpg");
}

TEST(DepthPicture, PaintsNearLightFarDarkAndUnknownGrey) {
  const cv::Mat photograph(150, 200, CV_8UC3, cv::Scalar(10, 20, 30));
  const auto picture = make_depth_picture("a.jpg", photograph, ramp(200, 150));
  ASSERT_TRUE(picture.has_value());
  EXPECT_NEAR(picture->near_depth, 1.02, 0.01);
  EXPECT_NEAR(picture->far_depth, 1.98, 0.01);
  EXPECT_NEAR(picture->filled_ratio, 0.75, 0.01);
  const cv::Mat depth = decode(picture->depth_jpeg);
  const auto luma_at = [&](int x, int y) {
    const cv::Vec3b rgb = depth.at<cv::Vec3b>(y, x);
    return luma({rgb[0], rgb[1], rgb[2]});
  };
  EXPECT_GT(luma_at(4, 100), 200.0);
  EXPECT_LT(luma_at(195, 100), 60.0);
  EXPECT_NEAR(luma_at(100, 10), 96.0, 4.0);
}

TEST(DepthPicture, ShowsAMapWithoutAnyDepth) {
  DepthMap map = ramp(40, 30);
  map.depth.setTo(0.0);
  map.depth.at<float>(3, 3) = std::numeric_limits<float>::quiet_NaN();
  map.depth.at<float>(4, 4) = std::numeric_limits<float>::infinity();
  const auto picture =
      make_depth_picture("a.jpg", cv::Mat(30, 40, CV_8UC3, cv::Scalar(1, 1, 1)), map);
  ASSERT_TRUE(picture.has_value());
  EXPECT_EQ(picture->filled_ratio, 0.0);
  EXPECT_EQ(picture->near_depth, 0.0);
}

TEST(DepthPicture, RefusesPicturesThatDoNotFit) {
  const cv::Mat photograph(30, 40, CV_8UC3, cv::Scalar(1, 1, 1));
  DepthMap without_confidence = ramp(40, 30);
  without_confidence.confidence.release();
  EXPECT_FALSE(make_depth_picture("a.jpg", photograph, without_confidence).has_value());
  EXPECT_FALSE(make_depth_picture("a.jpg", cv::Mat(), ramp(40, 30)).has_value());
  EXPECT_FALSE(make_depth_picture("a.jpg", photograph, DepthMap{}).has_value());
}

}  // namespace
}  // namespace trigmesh
