#include "sfm/dense/view_selection.hpp"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sfm/dense/undistortion.hpp"
#include "tests/unit/sfm/dense/rendered_scene.hpp"

namespace trigmesh {
namespace {

/// Cameras at given x, 5 units in front of a wall of landmarks that all of them see.
Scene wall_scene(const std::vector<double>& camera_x, int landmarks) {
  Scene scene;
  scene.cameras.push_back(test::small_camera());
  for (const double x : camera_x) {
    View view;
    view.cam_from_world = test::look_at({x, 0.0, -5.0}, {0.0, 0.0, 0.0});
    scene.views.push_back(view);
  }
  for (int i = 0; i < landmarks; ++i) {
    Landmark landmark;
    landmark.position_in_world = {0.1 * (i % 10) - 0.5, 0.1 * (i / 10 % 10) - 0.5, 0.1 * (i % 3)};
    for (std::size_t v = 0; v < scene.views.size(); ++v) {
      View& view = scene.views[v];
      landmark.track.push_back({id_of<ViewId>(v), id_of<FeatureIndex>(view.landmarks.size())});
      view.landmarks.push_back(id_of<LandmarkId>(scene.landmarks.size()));
      view.keypoints_px.emplace_back(0.0F, 0.0F);
    }
    scene.landmarks.push_back(landmark);
  }
  return scene;
}

std::vector<StereoPlan> plans_of(const Scene& scene, const ViewSelectionOptions& options) {
  const std::vector<DenseView> views = dense_views(scene);
  const Result<std::vector<StereoPlan>> plans = plan_stereo(scene, views, options);
  EXPECT_TRUE(plans.has_value());
  return *plans;
}

TEST(ViewSelection, PrefersAGoodAngleToATinyOrAHugeOne) {
  // About 0.3, 15 and 60 degrees from the first.
  const auto plans = plans_of(wall_scene({0.0, 0.03, 1.35, 8.7}, 100), {});
  ASSERT_FALSE(plans[0].sources.empty());
  EXPECT_EQ(plans[0].sources[0], 2U);
}

TEST(ViewSelection, TakesSourcesOnBothSides) {
  ViewSelectionOptions options;
  options.max_sources = 2;
  const auto plans = plans_of(wall_scene({0.0, 1.3, 1.4, 1.5, -1.0}, 100), options);
  EXPECT_THAT(plans[0].sources, testing::Contains(4U));
  EXPECT_GE(plans[0].neighbors.size(), plans[0].sources.size());
}

TEST(ViewSelection, DepthRangeHoldsTheLandmarks) {
  const auto plans = plans_of(wall_scene({0.0, 1.0}, 100), {});
  EXPECT_LT(plans[0].min_depth, 5.0F);
  EXPECT_GT(plans[0].min_depth, 2.0F);
  EXPECT_GT(plans[0].max_depth, 5.2F);
  EXPECT_EQ(plans[0].seeds_in_cam.size(), 100U);
}

TEST(ViewSelection, WorksWithThreeLandmarks) {
  const auto plans = plans_of(wall_scene({0.0, 1.0, -1.0}, 3), {});
  EXPECT_EQ(plans[0].sources.size(), 2U);
  EXPECT_GT(plans[0].max_depth, plans[0].min_depth);
}

TEST(ViewSelection, ALonelyViewGetsNoSources) {
  Scene scene = wall_scene({0.0, 1.0}, 50);
  View away;
  away.cam_from_world = test::look_at({0.0, 0.0, -5.0}, {0.0, 0.0, -50.0});
  scene.views.push_back(away);
  EXPECT_TRUE(plans_of(scene, {})[2].sources.empty());
}

TEST(ViewSelection, RefusesTooManySources) {
  ViewSelectionOptions options;
  options.max_sources = 9;
  EXPECT_EQ(plan_stereo({}, {}, options).error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace trigmesh
