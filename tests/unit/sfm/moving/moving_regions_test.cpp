#include "sfm/moving/moving_regions.hpp"

#include <thread>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "tests/unit/sfm/moving/moving_scene.hpp"

namespace trigmesh {
namespace {

/// Calls from two threads, the second half first.
class TwoThreads final : public Executor {
 public:
  void for_each_index(std::size_t count, const std::function<void(std::size_t)>& work) override {
    std::thread other([&] {
      for (std::size_t i = count / 2; i < count; ++i) {
        work(i);
      }
    });
    for (std::size_t i = count / 2; i > 0; --i) {
      work(i - 1);
    }
    other.join();
  }
};

std::vector<cv::Mat> find_in(const test::MovingScene& scene) {
  SerialExecutor executor;
  auto masks = find_moving_regions(scene.views, {}, executor);
  EXPECT_TRUE(masks.has_value());
  return masks ? *masks : std::vector<cv::Mat>(scene.views.size());
}

bool all_empty(const std::vector<cv::Mat>& masks) {
  return std::all_of(masks.begin(), masks.end(), [](const cv::Mat& mask) { return mask.empty(); });
}

TEST(MovingRegions, CoverABoardThatMoved) {
  const test::MovingScene scene = test::make_moving_scene({});
  const std::vector<cv::Mat> masks = find_in(scene);
  for (std::size_t i = 0; i < masks.size(); ++i) {
    EXPECT_GT(test::recall(masks[i], scene.truth[i]), 0.97) << "view " << i;
    EXPECT_GT(test::precision(masks[i], scene.truth[i]), 0.93) << "view " << i;
  }
}

TEST(MovingRegions, CoverABoardInFrontOfNothingThatHasDepth) {
  test::MovingScene scene = test::make_moving_scene({});
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    // Plain sky in place of the wall.
    scene.views[i].rgb.setTo(cv::Scalar(230, 235, 240), scene.truth[i] == 0);
    scene.views[i].depth.setTo(0.0);
  }
  const std::vector<cv::Mat> masks = find_in(scene);
  for (std::size_t i = 0; i < masks.size(); ++i) {
    EXPECT_GT(test::recall(masks[i], scene.truth[i]), 0.97) << "view " << i;
    EXPECT_GT(test::precision(masks[i], scene.truth[i]), 0.9) << "view " << i;
  }
}

TEST(MovingRegions, CoverAPlainBoardThatShowsOnce) {
  const test::MovingScene scene = test::make_moving_scene({.plate = test::PlateKind::kPlainOnce});
  std::vector<cv::Mat> masks = find_in(scene);
  EXPECT_GT(test::recall(masks[2], scene.truth[2]), 0.97);
  EXPECT_GT(test::precision(masks[2], scene.truth[2]), 0.93);
  masks[2] = cv::Mat();
  EXPECT_TRUE(all_empty(masks));
}

TEST(MovingRegions, AreEmptyWhenAllStandsStill) {
  EXPECT_TRUE(all_empty(find_in(test::make_moving_scene({.plate = test::PlateKind::kNone}))));
  EXPECT_TRUE(
      all_empty(find_in(test::make_moving_scene({.plate = test::PlateKind::kPlainStanding}))));
}

TEST(MovingRegions, SwallowSpecksOfDepthButNotSurfaces) {
  test::MovingScene scene = test::make_moving_scene({});
  const cv::Rect board = cv::boundingRect(scene.truth[1]);
  const cv::Rect speck(board.x, board.y + 30, 4, 4);  // at the border: no hole
  const cv::Rect surface(board.x + 20, board.y + 20, 30, 30);
  scene.views[1].depth(speck).setTo(3.2);
  scene.views[1].depth(surface).setTo(3.2);
  const cv::Mat mask = find_in(scene)[1];
  ASSERT_FALSE(mask.empty());
  EXPECT_EQ(cv::countNonZero(mask(speck)), speck.area());
  EXPECT_LT(cv::countNonZero(mask(surface)), surface.area() / 4);
}

TEST(MovingRegions, StayOutOfGivenMasks) {
  test::MovingScene scene = test::make_moving_scene({});
  scene.views[0].mask = scene.truth[0] == 0;
  EXPECT_TRUE(find_in(scene)[0].empty());
}

TEST(MovingRegions, DoNotDependOnThreads) {
  const test::MovingScene scene = test::make_moving_scene({});
  TwoThreads executor;
  const auto masks = find_moving_regions(scene.views, {}, executor);
  ASSERT_TRUE(masks.has_value());
  const std::vector<cv::Mat> expected = find_in(scene);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(cv::countNonZero((*masks)[i] != expected[i]), 0) << "view " << i;
  }
}

TEST(MovingRegions, RefuseViewsThatDoNotFit) {
  SerialExecutor executor;
  test::MovingScene scene = test::make_moving_scene({.views = 2});
  scene.views[1].depth = cv::Mat(10, 10, CV_32FC1, cv::Scalar(0));
  EXPECT_EQ(find_moving_regions(scene.views, {}, executor).error().code,
            ErrorCode::kInvalidArgument);
  scene = test::make_moving_scene({.views = 2});
  scene.views[0].neighbors = {2};
  EXPECT_EQ(find_moving_regions(scene.views, {}, executor).error().code,
            ErrorCode::kInvalidArgument);
}

TEST(MovingRegions, OfNoViewAreNone) {
  SerialExecutor executor;
  const auto masks = find_moving_regions({}, {}, executor);
  ASSERT_TRUE(masks.has_value());
  EXPECT_TRUE(masks->empty());
}

TEST(RegionOptions, NameTheFieldThatIsWrong) {
  RegionOptions options;
  EXPECT_TRUE(options.validate().has_value());
  options.min_area_ratio = 0.0;
  EXPECT_THAT(options.validate().error().message, testing::HasSubstr("min_area_ratio"));
  options = {};
  options.min_keypoints = 0;
  EXPECT_THAT(options.validate().error().message, testing::HasSubstr("min_keypoints"));
  options = {};
  options.min_evidence_ratio = 2.0;
  EXPECT_THAT(options.validate().error().message, testing::HasSubstr("min_evidence_ratio"));
}

}  // namespace
}  // namespace trigmesh
