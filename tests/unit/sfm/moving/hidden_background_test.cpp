#include "sfm/moving/hidden_background.hpp"

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "tests/unit/sfm/moving/moving_scene.hpp"

namespace trigmesh {
namespace {

TEST(HiddenBackground, IsBehindSomethingThatShowsOnce) {
  const test::MovingScene scene = test::make_moving_scene({.plate = test::PlateKind::kPlainOnce});
  const cv::Mat hidden = find_hidden_background(scene.views, 2, {});
  EXPECT_GT(test::recall(hidden, scene.truth[2]), 0.9);
  EXPECT_GT(test::precision(hidden, scene.truth[2]), 0.99);
  EXPECT_EQ(cv::countNonZero(find_hidden_background(scene.views, 1, {})), 0);
}

TEST(HiddenBackground, IsNotBehindWhatStandsStillWithoutDepth) {
  const test::MovingScene scene =
      test::make_moving_scene({.plate = test::PlateKind::kPlainStanding});
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const cv::Mat hidden = find_hidden_background(scene.views, i, {});
    EXPECT_LT(test::recall(hidden, scene.truth[i]), 0.05) << "view " << i;
  }
}

TEST(HiddenBackground, IsFoundAtAnotherExposure) {
  const test::MovingScene scene =
      test::make_moving_scene({.plate = test::PlateKind::kPlainOnce, .exposure = 0.6});
  const cv::Mat hidden = find_hidden_background(scene.views, 2, {});
  EXPECT_GT(test::recall(hidden, scene.truth[2]), 0.9);
  EXPECT_GT(test::precision(hidden, scene.truth[2]), 0.99);
}

TEST(HiddenBackground, IsNotSeenInChangedExposureAlone) {
  test::MovingScene scene =
      test::make_moving_scene({.plate = test::PlateKind::kNone, .exposure = 0.5});
  // Depth is missing in a field that shows the wall like everything else.
  scene.views[2].depth(cv::Rect(100, 80, 100, 80)).setTo(0.0);
  EXPECT_EQ(cv::countNonZero(find_hidden_background(scene.views, 2, {})), 0);
}

TEST(HiddenBackground, NeedsWitnesses) {
  test::MovingScene scene = test::make_moving_scene({.plate = test::PlateKind::kPlainOnce});
  scene.views[2].neighbors = {1};
  EXPECT_EQ(cv::countNonZero(find_hidden_background(scene.views, 2, {})), 0);
}

TEST(HiddenBackground, IsNotSoughtWhereTheMaskLeavesOut) {
  test::MovingScene scene = test::make_moving_scene({.plate = test::PlateKind::kPlainOnce});
  scene.views[2].mask = scene.truth[2] == 0;
  EXPECT_EQ(cv::countNonZero(find_hidden_background(scene.views, 2, {})), 0);
}

TEST(HiddenBackgroundOptions, NameTheFieldThatIsWrong) {
  HiddenBackgroundOptions options;
  EXPECT_TRUE(options.validate().has_value());
  options.min_witnesses = 1;
  EXPECT_THAT(options.validate().error().message, testing::HasSubstr("min_witnesses"));
  options = {};
  options.max_depth_ratio = 0.0F;
  EXPECT_THAT(options.validate().error().message, testing::HasSubstr("max_depth_ratio"));
  options = {};
  options.min_color_difference = -1.0F;
  EXPECT_THAT(options.validate().error().message, testing::HasSubstr("min_color_difference"));
  options = {};
  options.samples = 0;
  EXPECT_THAT(options.validate().error().message, testing::HasSubstr("samples"));
}

}  // namespace
}  // namespace trigmesh
