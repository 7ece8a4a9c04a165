#include "sfm/keyframes/image_pyramid.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/textured_image.hpp"

namespace trigmesh {
namespace {

using test_support::textured_image;

std::vector<int> widths(const ImagePyramid& pyramid) {
  std::vector<int> result;
  for (const cv::Mat& image : pyramid) {
    result.push_back(image.cols);
  }
  return result;
}

TEST(ImagePyramid, HalvesByTheMeanOfFourPixels) {
  ImagePyramid pyramid = {cv::Mat::zeros(32, 33, CV_8UC1)};
  pyramid[0].at<std::uint8_t>(2, 4) = 200;
  build_halves(2, pyramid);
  ASSERT_EQ(pyramid[1].size(), cv::Size(16, 16));
  EXPECT_EQ(pyramid[1].at<std::uint8_t>(1, 2), 50);
  EXPECT_EQ(cv::countNonZero(pyramid[1]), 1);
}

TEST(ImagePyramid, StopsAtSmallImages) {
  ImagePyramid pyramid = {textured_image(320, 240, 7)};
  build_halves(6, pyramid);
  EXPECT_THAT(widths(pyramid), ::testing::ElementsAre(320, 160, 80, 40));
  pyramid.front() = cv::Mat::zeros(10, 10, CV_8UC1);
  build_halves(3, pyramid);
  EXPECT_THAT(widths(pyramid), ::testing::ElementsAre(10));
}

TEST(PyramidPool, ReducesLargeImagesAndCopiesSmallOnes) {
  PyramidPool pool;
  const cv::Mat large = textured_image(320, 240, 7);
  EXPECT_THAT(widths(*pool.make(large, 160, 2)), ::testing::ElementsAre(160, 80));
  const auto copy = pool.make(large, 320, 1);
  EXPECT_NE(copy->front().data, large.data);
  EXPECT_EQ(cv::norm(copy->front(), large, cv::NORM_INF), 0.0);
}

TEST(PyramidPool, UsesMemoryAgainThatNobodyHolds) {
  PyramidPool pool;
  const cv::Mat dark = cv::Mat::zeros(240, 320, CV_8UC1);
  const cv::Mat bright(240, 320, CV_8UC1, cv::Scalar(255));
  auto first = pool.make(dark, 320, 3);
  const std::uint8_t* memory = first->front().data;
  const auto second = pool.make(bright, 320, 3);
  EXPECT_EQ(first->front().at<std::uint8_t>(0, 0), 0) << "it is held";
  first.reset();
  const auto third = pool.make(bright, 320, 3);
  EXPECT_EQ(third->front().data, memory);
  EXPECT_EQ(third->back().at<std::uint8_t>(0, 0), 255);
}

}  // namespace
}  // namespace trigmesh
