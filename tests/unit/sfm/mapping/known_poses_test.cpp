#include "sfm/mapping/known_poses.hpp"

#include <gtest/gtest.h>

#include "tests/unit/sfm/mapping/mapping_test_scenes.hpp"

namespace trigmesh {
namespace {

using test_support::SyntheticScene;

std::vector<PosedImage> posed_images(const SyntheticScene& scene) {
  std::vector<PosedImage> images;
  for (const View& view : scene.truth.views) {
    PosedImage image{{view.name, view.camera, {}}, view.cam_from_world};
    for (const Eigen::Vector2f& pixel : view.keypoints_px) {
      image.image.keypoints.push_back({.x_px = pixel.x(), .y_px = pixel.y()});
    }
    images.push_back(std::move(image));
  }
  return images;
}

std::vector<PairRecord> pairs_of(const SyntheticScene& scene) {
  return mapping_test::make_store(scene).pairs;
}

TEST(TriangulateKnownPoses, FindsThePointsAndLeavesTheCameras) {
  const SyntheticScene scene =
      test_support::make_synthetic_scene({.points = 300, .views = 6, .noise_px = 0.3});
  SerialExecutor executor;
  const auto result = triangulate_known_poses(
      scene.truth.cameras, posed_images(scene), pairs_of(scene), {}, executor);
  ASSERT_TRUE(result) << result.error().message;
  ASSERT_TRUE(result->validate()) << result->validate().error().message;
  EXPECT_EQ(result->registered_count(), scene.truth.views.size());
  EXPECT_GT(result->landmarks.size(), scene.truth.landmarks.size() * 9 / 10);
  for (std::size_t i = 0; i < scene.truth.views.size(); ++i) {
    EXPECT_EQ(result->views[i].cam_from_world->translation,
              scene.truth.views[i].cam_from_world->translation);
  }
  for (const Landmark& landmark : result->landmarks) {
    EXPECT_LT(landmark.error_px, 2.0);
  }
}

TEST(TriangulateKnownPoses, ImagesWithoutPoseTakeNoPart) {
  const SyntheticScene scene = test_support::make_synthetic_scene({.points = 200, .views = 5});
  std::vector<PosedImage> images = posed_images(scene);
  images[2].cam_from_world.reset();
  SerialExecutor executor;
  const auto result =
      triangulate_known_poses(scene.truth.cameras, images, pairs_of(scene), {}, executor);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->registered_count(), 4U);
  for (const Landmark& landmark : result->landmarks) {
    for (const Observation& observation : landmark.track) {
      EXPECT_NE(observation.view, ViewId{2});
    }
  }
}

TEST(TriangulateKnownPoses, RefusesWhatPointsNowhere) {
  const SyntheticScene scene = test_support::make_synthetic_scene({.points = 50, .views = 3});
  SerialExecutor executor;
  std::vector<PosedImage> images = posed_images(scene);
  images[1].image.camera = CameraId{9};
  EXPECT_EQ(triangulate_known_poses(scene.truth.cameras, images, {}, {}, executor).error().code,
            ErrorCode::kInvalidArgument);
  images = posed_images(scene);
  const std::vector<PairRecord> beyond{{{ViewId{1}, ViewId{7}}, {}}};
  EXPECT_EQ(triangulate_known_poses(scene.truth.cameras, images, beyond, {}, executor).error().code,
            ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace trigmesh
