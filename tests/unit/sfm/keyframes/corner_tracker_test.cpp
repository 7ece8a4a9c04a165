#include "sfm/keyframes/corner_tracker.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "tests/support/textured_image.hpp"

namespace trigmesh {
namespace {

using Eigen::Vector2f;

using test_support::textured_image;

cv::Mat shifted(const cv::Mat& image, double x, double y) {
  const cv::Mat motion = (cv::Mat_<double>(2, 3) << 1, 0, x, 0, 1, y);
  cv::Mat moved;
  cv::warpAffine(image, moved, motion, image.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
  return moved;
}

class CornerTracker : public ::testing::Test {
 protected:
  /// Largest error over the corners that were followed, but for those whose patch reaches over the
  /// border of the first image, behind which the second one is made up.
  double largest_error(const cv::Mat& second, const Vector2f& shift) {
    const ImagePyramid from = pyramid_of(first_);
    const ImagePyramid to = pyramid_of(second);
    double largest = 0.0;
    followed_ = 0;
    for (const Vector2f& corner : corners_) {
      if (const auto tracked = track_corner(from, to, corner, options_)) {
        ++followed_;
        const Vector2f from_centre = (corner - Vector2f(160.0F, 120.0F)).cwiseAbs();
        if (from_centre.x() > 140.0F || from_centre.y() > 100.0F) {
          continue;
        }
        const Vector2f error = *tracked - corner - shift;
        largest = std::max(largest, static_cast<double>(error.norm()));
      }
    }
    return largest;
  }

  [[nodiscard]] ImagePyramid pyramid_of(const cv::Mat& grey) const {
    ImagePyramid pyramid = {grey};
    build_halves(options_.levels, pyramid);
    return pyramid;
  }

  const CornerTrackerOptions options_{};
  const cv::Mat first_ = textured_image(320, 240, 7);
  const std::vector<Vector2f> corners_ = find_corners(first_, options_);
  std::size_t followed_ = 0;
};

TEST_F(CornerTracker, FindsCornersApartFromEachOther) {
  ASSERT_GE(corners_.size(), 100U);
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_GE((corners_[i] - corners_[j]).norm(), 9.99F);
    }
  }
}

TEST_F(CornerTracker, FindsNothingInADarkImage) {
  EXPECT_THAT(find_corners(cv::Mat::zeros(100, 100, CV_8UC1), options_), ::testing::IsEmpty());
}

TEST_F(CornerTracker, StaysWhereNothingMoves) {
  EXPECT_LT(largest_error(first_, {0.0F, 0.0F}), 1e-3);
  EXPECT_GE(followed_, corners_.size() * 9 / 10);
}

TEST_F(CornerTracker, FollowsAFractionOfAPixel) {
  EXPECT_LT(largest_error(shifted(first_, 0.4, -0.7), {0.4F, -0.7F}), 0.1);
  EXPECT_GE(followed_, corners_.size() * 9 / 10);
}

TEST_F(CornerTracker, FollowsALongWayThroughThePyramid) {
  EXPECT_LT(largest_error(shifted(first_, 9.3, 5.6), {9.3F, 5.6F}), 0.2);
  EXPECT_GE(followed_, corners_.size() / 2);
}

TEST_F(CornerTracker, FollowsWhereTheLightChanges) {
  cv::Mat brighter;
  shifted(first_, 1.0, 0.0).convertTo(brighter, CV_8UC1, 0.8, 40.0);
  EXPECT_LT(largest_error(brighter, {1.0F, 0.0F}), 0.2);
  EXPECT_GE(followed_, corners_.size() * 8 / 10);
}

TEST_F(CornerTracker, FollowsNothingIntoAnotherPicture) {
  (void)largest_error(textured_image(320, 240, 8), {0.0F, 0.0F});
  EXPECT_LE(followed_, corners_.size() / 20);
}

TEST_F(CornerTracker, LosesWhatLeavesTheImage) {
  const ImagePyramid pyramid = pyramid_of(first_);
  for (const Vector2f& corner :
       {Vector2f(2.0F, 100.0F), Vector2f(-5.0F, 10.0F), Vector2f(400.0F, 300.0F)}) {
    EXPECT_FALSE(track_corner(pyramid, pyramid, corner, options_).has_value());
  }
}

TEST(CornerTrackerOptions, NamesWhatIsWrong) {
  CornerTrackerOptions options;
  EXPECT_TRUE(options.validate().has_value());
  options.patch_radius_px = 16;
  const Result<> result = options.validate();
  ASSERT_FALSE(result.has_value());
  EXPECT_THAT(result.error().message, ::testing::HasSubstr("patch_radius_px is 16"));
}

}  // namespace
}  // namespace trigmesh
