#include "sfm/moving/contradicting_features.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/unit/sfm/moving/moving_scene.hpp"

namespace trigmesh {
namespace {

struct Counts {
  std::size_t on_board = 0;
  std::size_t contradicting_on_board = 0;
  std::size_t on_wall = 0;
  std::size_t contradicting_on_wall = 0;
};

Counts count(const test::MovingScene& scene,
             const std::vector<std::vector<FeatureEvidence>>& evidence) {
  Counts counts;
  for (std::size_t i = 0; i < evidence.size(); ++i) {
    for (const FeatureEvidence& feature : evidence[i]) {
      const int x = std::clamp(static_cast<int>(std::lround(feature.keypoint.x_px)), 0, 319);
      const int y = std::clamp(static_cast<int>(std::lround(feature.keypoint.y_px)), 0, 239);
      const bool contradicts = feature.contradicting > 2 * feature.agreeing;
      if (scene.truth[i].at<std::uint8_t>(y, x) != 0) {
        ++counts.on_board;
        counts.contradicting_on_board += contradicts ? 1 : 0;
      } else {
        ++counts.on_wall;
        counts.contradicting_on_wall += contradicts ? 1 : 0;
      }
    }
  }
  return counts;
}

Counts find_in(const test::MovingScene& scene) {
  SerialExecutor executor;
  const auto evidence = find_contradicting_features(scene.views, {}, executor);
  EXPECT_TRUE(evidence.has_value());
  return evidence ? count(scene, *evidence) : Counts{};
}

TEST(ContradictingFeatures, AreOnTheBoardThatMoved) {
  const Counts counts = find_in(test::make_moving_scene({}));
  ASSERT_GT(counts.on_board, 200U);
  EXPECT_GT(counts.contradicting_on_board, counts.on_board / 2);
  EXPECT_LT(counts.contradicting_on_wall, counts.on_wall / 200);
}

TEST(ContradictingFeatures, AreNowhereWhenAllStandsStill) {
  const Counts counts = find_in(test::make_moving_scene({.plate = test::PlateKind::kNone}));
  ASSERT_GT(counts.on_wall, 1000U);
  EXPECT_EQ(counts.contradicting_on_wall, 0U);
}

TEST(ContradictingFeatures, AreNotOnConfirmedSurfaces) {
  test::MovingScene scene = test::make_moving_scene({});
  for (MovingView& view : scene.views) {
    view.depth.setTo(4.0);
  }
  EXPECT_EQ(find_in(scene).contradicting_on_board, 0U);
}

TEST(ContradictingFeatures, AreNotWhereTheMaskLeavesOut) {
  test::MovingScene scene = test::make_moving_scene({});
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    scene.views[i].mask = scene.truth[i] == 0;
  }
  EXPECT_EQ(find_in(scene).contradicting_on_board, 0U);
}

TEST(ContradictingFeatures, ViewsTooSmallForKeypointsHaveNone) {
  std::vector<MovingView> views(2);
  for (MovingView& view : views) {
    view.camera = {.model = CameraModel::kPinhole,
                   .width_px = 8,
                   .height_px = 8,
                   .fx_px = 8.0,
                   .fy_px = 8.0,
                   .cx_px = 3.5,
                   .cy_px = 3.5,
                   .distortion = {}};
    view.rgb = cv::Mat(8, 8, CV_8UC3, cv::Scalar(10, 20, 30));
  }
  SerialExecutor executor;
  const auto evidence = find_contradicting_features(views, {}, executor);
  ASSERT_TRUE(evidence.has_value());
  EXPECT_TRUE((*evidence)[0].empty());
}

TEST(ContradictionOptions, NameTheFieldThatIsWrong) {
  ContradictionOptions options;
  EXPECT_TRUE(options.validate().has_value());
  options.max_partners = 0;
  EXPECT_THAT(options.validate().error().message, testing::HasSubstr("max_partners"));
  options = {};
  options.max_agreement_px = 5.0;
  EXPECT_THAT(options.validate().error().message, testing::HasSubstr("max_agreement_px"));
  options = {};
  options.min_common_motion = 7;
  EXPECT_THAT(options.validate().error().message, testing::HasSubstr("min_common_motion"));
  options = {};
  options.max_keypoints = 1;
  EXPECT_FALSE(options.validate().has_value());
}

}  // namespace
}  // namespace trigmesh
