#include "sfm/dense/fusion.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "tests/unit/sfm/dense/rendered_scene.hpp"

namespace trigmesh {
namespace {

/// Maps and pictures in memory.
class MemoryMaps final : public DepthMapSource {
 public:
  std::vector<DepthMap> maps;

  [[nodiscard]] Result<DepthMap> load(std::size_t view) const override { return maps[view]; }
};

class MemoryImages final : public ViewImageSource {
 public:
  std::vector<ViewImage> images;

  [[nodiscard]] Result<ViewImage> load(std::size_t view) const override { return images[view]; }
};

/// Three views of a ball; their pictures are one colour each.
struct BallViews {
  std::vector<DenseView> views;
  std::vector<std::vector<std::size_t>> neighbors{{1, 2}, {0, 2}, {0, 1}};
  MemoryMaps maps;
  MemoryImages images;

  BallViews() {
    for (const double x : {0.0, 0.3, -0.3}) {
      const Rigid3 pose = test::look_at({x, 0.0, -3.0}, {0.0, 0.0, 0.0});
      views.push_back({.name = "", .camera = test::small_camera(), .cam_from_world = pose});
      maps.maps.push_back(
          test::render({test::sphere({0.0, 0.0, 0.0}, 0.8)}, test::small_camera(), pose).truth);
      images.images.push_back(
          {.rgb = cv::Mat(72, 96, CV_8UC3, cv::Scalar(30, 60, 90)), .mask = {}});
    }
  }

  [[nodiscard]] FusionInput input() const { return {views, neighbors, &maps, &images}; }
};

TEST(Fusion, PointsLieOnTheBallAndLookOutwards) {
  const BallViews ball;
  SerialExecutor executor;
  const Result<DenseCloud> cloud = fuse_depth_maps(ball.input(), {}, executor);
  ASSERT_TRUE(cloud.has_value());
  ASSERT_GT(cloud->size(), 1000U);
  for (const DensePoint& point : *cloud) {
    EXPECT_NEAR(point.position_in_world.norm(), 0.8F, 0.01F);
    EXPECT_GT(point.normal_in_world.dot(point.position_in_world.normalized()), 0.95F);
    EXPECT_EQ(point.color_rgb, (std::array<std::uint8_t, 3>{30, 60, 90}));
    EXPECT_GE(point.view_count, 2);
    EXPECT_GT(point.confidence, 0.9F);
  }
}

TEST(Fusion, TakesEverySurfaceElementOnce) {
  const BallViews ball;
  SerialExecutor executor;
  const Result<DenseCloud> cloud = fuse_depth_maps(ball.input(), {}, executor);
  ASSERT_TRUE(cloud.has_value());
  const auto pixels = static_cast<std::size_t>(cv::countNonZero(ball.maps.maps[0].depth));
  EXPECT_LT(cloud->size(), pixels * 3 / 2);
}

TEST(Fusion, ASingleViewProvesNothing) {
  BallViews ball;
  ball.maps.maps[1] = {};
  ball.maps.maps[2] = {};
  SerialExecutor executor;
  const Result<DenseCloud> cloud = fuse_depth_maps(ball.input(), {}, executor);
  ASSERT_TRUE(cloud.has_value());
  EXPECT_TRUE(cloud->empty());
}

TEST(Fusion, KeepsItsLimit) {
  const BallViews ball;
  SerialExecutor executor;
  FusionOptions options;
  options.max_points = 10;
  EXPECT_EQ(fuse_depth_maps(ball.input(), options, executor).error().code,
            ErrorCode::kLimitExceeded);
}

}  // namespace
}  // namespace trigmesh
