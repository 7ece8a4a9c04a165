#include "sfm/features/integral_image.hpp"

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

cv::Mat noise(int width, int height) {
  std::mt19937 generator(7);
  cv::Mat image(height, width, CV_8UC1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(generator() % 256);
    }
  }
  return image;
}

/// Pixels as little squares: the exact integral over a real rectangle, given in pixel coordinates.
double brute_force_integral(const cv::Mat& image, double x0, double y0, double x1, double y1) {
  double sum = 0.0;
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const double width = std::min(x1, x + 0.5) - std::max(x0, x - 0.5);
      const double height = std::min(y1, y + 0.5) - std::max(y0, y - 0.5);
      sum += std::max(0.0, width) * std::max(0.0, height) * image.at<std::uint8_t>(y, x);
    }
  }
  return sum;
}

TEST(IntegralImage, BoxSumsEqualDirectSums) {
  const cv::Mat image = noise(37, 23);
  const IntegralImage integral(image);
  for (const auto& [x0, y0, x1, y1] : std::vector<std::array<int, 4>>{
           {0, 0, 37, 23}, {0, 0, 1, 1}, {36, 22, 37, 23}, {5, 3, 30, 4}, {7, 7, 7, 12}}) {
    const double expected = brute_force_integral(image, x0 - 0.5, y0 - 0.5, x1 - 0.5, y1 - 0.5);
    EXPECT_DOUBLE_EQ(integral.box_sum(x0, y0, x1, y1), expected);
  }
}

TEST(IntegralImage, SumsStayExactWhenTheTableWrapsAround) {
  // 4200 x 4200 white pixels sum to 4.5e9, more than 32 bits hold.
  const IntegralImage integral(cv::Mat(4200, 4200, CV_8UC1, cv::Scalar(255)));
  EXPECT_EQ(integral.box_sum(4100, 4100, 4200, 4200), 100 * 100 * 255);
}

TEST(IntegralImage, SquareMeanIntegratesFractionsOfPixels) {
  const cv::Mat image = noise(40, 30);
  const IntegralImage integral(image);
  for (const double x : {9.0, 12.3, 20.75}) {
    for (const double side : {0.7, 2.0, 5.45}) {
      const double y = 11.6;
      const double expected =
          brute_force_integral(image, x - side / 2, y - side / 2, x + side / 2, y + side / 2) /
          (side * side);
      EXPECT_NEAR(integral.square_mean(
                      static_cast<float>(x), static_cast<float>(y), static_cast<float>(side)),
                  expected,
                  2e-3);
    }
  }
}

TEST(IntegralImage, SquareBeyondTheBorderIsMovedInside) {
  const cv::Mat image = noise(40, 30);
  const IntegralImage integral(image);
  EXPECT_FLOAT_EQ(integral.square_mean(-50.0F, 10.0F, 4.0F),
                  integral.square_mean(1.5F, 10.0F, 4.0F));
  EXPECT_FLOAT_EQ(integral.square_mean(20.0F, 99.0F, 4.0F),
                  integral.square_mean(20.0F, 27.5F, 4.0F));
}

TEST(IntegralImage, SquareLargerThanTheImageIsCutToIt) {
  const IntegralImage integral(cv::Mat(16, 16, CV_8UC1, cv::Scalar(77)));
  EXPECT_FLOAT_EQ(integral.square_mean(3.0F, 3.0F, 100.0F), 77.0F);
}

TEST(IntegralImage, SecondDifferencesOfTheGridAreCellSums) {
  const cv::Mat image = noise(60, 50);
  const IntegralImage integral(image);
  constexpr int kCount = 8;
  std::array<float, kCount * kCount> sums{};
  constexpr float kLeft = 10.3F;
  constexpr float kTop = 4.8F;
  constexpr float kSpacing = 3.7F;
  ASSERT_TRUE(integral.grid_sums(kLeft, kTop, kSpacing, kCount, sums));
  for (int i = 0; i + 1 < kCount; ++i) {
    for (int j = 0; j + 1 < kCount; ++j) {
      const auto at = [&](int r, int c) { return sums[static_cast<std::size_t>(r * kCount + c)]; };
      const float cell = at(i + 1, j + 1) - at(i + 1, j) - at(i, j + 1) + at(i, j);
      const double x = static_cast<double>(kLeft) + j * static_cast<double>(kSpacing);
      const double y = static_cast<double>(kTop) + i * static_cast<double>(kSpacing);
      const double spacing = static_cast<double>(kSpacing);
      EXPECT_NEAR(static_cast<double>(cell),
                  brute_force_integral(image, x, y, x + spacing, y + spacing),
                  0.1);
    }
  }
}

TEST(IntegralImage, GridThatLeavesTheImageIsRefused) {
  const IntegralImage integral(noise(60, 50));
  std::array<float, 16> sums{};
  EXPECT_FALSE(integral.grid_sums(-0.6F, 5.0F, 2.0F, 4, sums));
  EXPECT_FALSE(integral.grid_sums(5.0F, 44.0F, 2.0F, 4, sums));
  EXPECT_TRUE(integral.grid_sums(-0.5F, -0.5F, 2.0F, 4, sums));
}

}  // namespace
}  // namespace trigmesh
