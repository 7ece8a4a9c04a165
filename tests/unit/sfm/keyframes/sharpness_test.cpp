#include "sfm/keyframes/sharpness.hpp"

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

TEST(VarianceOfLaplacian, IsThatOfTheFormula) {
  // One bright pixel in the middle of the 3 x 3 places where the Laplacian has all neighbours:
  // -40 there, 10 at four places, 0 at four: mean 0, squares 1600 and four times 100.
  cv::Mat grey = cv::Mat::zeros(5, 5, CV_8UC1);
  grey.at<std::uint8_t>(2, 2) = 10;
  EXPECT_DOUBLE_EQ(variance_of_laplacian(grey), 2000.0 / 9.0);
}

TEST(VarianceOfLaplacian, ReadsTheRowsOfAPart) {
  cv::Mat whole(5, 9, CV_8UC1, cv::Scalar(77));
  cv::Mat part = whole(cv::Rect(2, 0, 5, 5));
  part.setTo(0);
  part.at<std::uint8_t>(2, 2) = 10;
  EXPECT_DOUBLE_EQ(variance_of_laplacian(part), 2000.0 / 9.0);
}

TEST(VarianceOfLaplacian, IsZeroWithoutEdges) {
  EXPECT_EQ(variance_of_laplacian(cv::Mat(20, 20, CV_8UC1, cv::Scalar(90))), 0.0);
  EXPECT_EQ(variance_of_laplacian(cv::Mat(2, 20, CV_8UC1, cv::Scalar(90))), 0.0);
}

}  // namespace
}  // namespace trigmesh
