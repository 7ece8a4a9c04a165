#include "sfm/dense/depth_filter.hpp"

#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "tests/unit/sfm/dense/rendered_scene.hpp"

namespace trigmesh {
namespace {

/// True maps of a wall with a ball in front of it from four sides.
std::vector<PosedDepthMap> true_maps() {
  std::vector<PosedDepthMap> maps;
  for (const double x : {0.0, 0.5, -0.5, 0.25}) {
    const Rigid3 pose = test::look_at({x, 0.1 * x, -3.0}, {0.0, 0.0, 0.0});
    maps.push_back(
        {test::render({test::plane({0.0, 0.0, -1.0}, -0.8), test::sphere({0.0, 0.0, 0.0}, 0.5)},
                      test::small_camera(),
                      pose)
             .truth,
         pose});
  }
  return maps;
}

DepthMap filtered(const std::vector<PosedDepthMap>& maps, const cv::Mat& mask = {}) {
  SerialExecutor executor;
  const Result<DepthMap> out =
      filter_depth_map(maps[0], mask, std::span(maps).subspan(1), {}, executor);
  EXPECT_TRUE(out.has_value());
  return *out;
}

void set_depth(DepthMap& map, const cv::Rect& area, float depth) {
  map.depth(area).setTo(cv::Scalar(static_cast<double>(depth)));
  map.normal(area).setTo(cv::Scalar(0.0, 0.0, -1.0));
}

TEST(DepthFilter, KeepsWhatAllViewsAgreeOn) {
  const auto maps = true_maps();
  const DepthMap out = filtered(maps);
  EXPECT_GT(test::correct_share(out, maps[0].map, 0.005, 8), 0.85);
  EXPECT_GT(out.confidence.at<std::uint8_t>(36, 48), 150);
}

TEST(DepthFilter, DropsWhatNoOtherViewHas) {
  auto maps = true_maps();
  const cv::Rect moved(30, 25, 12, 12);
  set_depth(maps[0].map, moved, 1.8F);
  const DepthMap out = filtered(maps);
  EXPECT_EQ(cv::countNonZero(out.depth(moved)), 0);
  EXPECT_EQ(out.confidence.at<std::uint8_t>(30, 35), 0);
}

TEST(DepthFilter, DropsWhatOthersLookThrough) {
  auto maps = true_maps();
  // A plate that two views place in the air, where a third one and a fourth see the wall behind it.
  DepthFilterOptions options;
  options.min_agreeing_views = 1;
  options.max_conflict_ratio = 0.5F;
  const auto plate = test::plane({0.0, 0.0, -1.0}, 1.0, {0.0, 0.0, -1.0}, 0.3);
  maps[0].map = test::render({plate}, test::small_camera(), maps[0].cam_from_world).truth;
  maps[1].map = test::render({plate}, test::small_camera(), maps[1].cam_from_world).truth;
  SerialExecutor executor;
  const Result<DepthMap> out =
      filter_depth_map(maps[0], {}, std::span(maps).subspan(1), options, executor);
  ASSERT_TRUE(out.has_value());
  EXPECT_EQ(out->depth.at<float>(36, 47), 0.0F);
  options.max_conflict_ratio = 10.0F;
  const Result<DepthMap> lenient =
      filter_depth_map(maps[0], {}, std::span(maps).subspan(1), options, executor);
  EXPECT_GT(lenient->depth.at<float>(36, 47), 0.0F);
}

TEST(DepthFilter, MasksAndWeakMatchesGo) {
  auto maps = true_maps();
  cv::Mat mask(72, 96, CV_8UC1, cv::Scalar(255));
  mask.at<std::uint8_t>(36, 48) = 0;
  maps[0].map.confidence.at<std::uint8_t>(36, 60) = 20;
  const DepthMap out = filtered(maps, mask);
  EXPECT_EQ(out.depth.at<float>(36, 48), 0.0F);
  EXPECT_EQ(out.depth.at<float>(36, 60), 0.0F);
  EXPECT_GT(out.depth.at<float>(36, 50), 0.0F);
}

TEST(DepthFilter, DropsSpecks) {
  auto maps = true_maps();
  for (PosedDepthMap& posed : maps) {
    const cv::Mat whole = posed.map.depth.clone();
    posed.map.depth.setTo(cv::Scalar(0.0));
    const cv::Rect speck(46, 35, 3, 3);
    whole(speck).copyTo(posed.map.depth(speck));
  }
  EXPECT_EQ(cv::countNonZero(filtered(maps).depth), 0);
}

TEST(DepthFilter, AveragesDepths) {
  auto maps = true_maps();
  maps[0].map.depth *= 1.004;
  const DepthMap out = filtered(maps);
  const DepthMap truth = true_maps()[0].map;
  EXPECT_LT(out.depth.at<float>(10, 10), 1.003F * truth.depth.at<float>(10, 10));
}

TEST(DepthFilter, RefusesBadOptions) {
  const auto maps = true_maps();
  DepthFilterOptions options;
  options.agreement.max_depth_ratio = 0.0F;
  SerialExecutor executor;
  EXPECT_EQ(filter_depth_map(maps[0], {}, {}, options, executor).error().code,
            ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace trigmesh
