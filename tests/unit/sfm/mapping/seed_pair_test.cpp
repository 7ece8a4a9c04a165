#include "sfm/mapping/seed_pair.hpp"

#include <vector>

#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/matchers.hpp"
#include "tests/unit/sfm/mapping/mapping_test_scenes.hpp"

namespace trigmesh {
namespace {

using test_support::CloudKind;
using test_support::make_synthetic_scene;
using test_support::PathKind;
using test_support::Rigid3Near;
using test_support::SyntheticScene;

std::optional<SeedPair> choose(const ImageStore& store,
                               const SyntheticScene& scene,
                               const MapperOptions& options = {}) {
  SerialExecutor executor;
  return choose_seed_pair(store, scene.truth.cameras, options, executor);
}

/// Pose of the second view in the first with a translation of length one.
Rigid3 true_motion(const SyntheticScene& scene, ImagePair pair) {
  Rigid3 motion = *scene.truth.views[index(pair.second)].cam_from_world *
                  scene.truth.views[index(pair.first)].cam_from_world->inverse();
  motion.translation.normalize();
  return motion;
}

double baseline(const SyntheticScene& scene, ImagePair pair) {
  return (camera_center(*scene.truth.views[index(pair.second)].cam_from_world) -
          camera_center(*scene.truth.views[index(pair.first)].cam_from_world))
      .norm();
}

TEST(SeedPair, FindsTheTrueMotion) {
  const auto scene = make_synthetic_scene({.cloud = CloudKind::kVolume, .points = 200, .views = 2});
  const auto seed = choose(mapping_test::make_store(scene), scene);
  ASSERT_TRUE(seed.has_value());
  EXPECT_THAT(seed->second_from_first, Rigid3Near(true_motion(scene, seed->pair), 1e-4, 1e-4));
  EXPECT_NEAR(seed->second_from_first.translation.norm(), 1.0, 1e-9);
  EXPECT_GE(seed->landmarks, 150U);
  EXPECT_GT(seed->median_angle_rad, 0.3);
}

TEST(SeedPair, TakesTheLargestOfModerateBaselines) {
  const auto scene = make_synthetic_scene(
      {.cloud = CloudKind::kVolume, .points = 200, .views = 3, .arc_deg = 10.0});
  const auto seed = choose(mapping_test::make_store(scene), scene);
  ASSERT_TRUE(seed.has_value());
  for (const auto& other : scene.pairs) {
    EXPECT_GE(baseline(scene, seed->pair), baseline(scene, other.pair));
  }
}

TEST(SeedPair, WorksOnAPlaneWhenIntrinsicsAreKnown) {
  const auto scene = make_synthetic_scene({.cloud = CloudKind::kPlane, .points = 200, .views = 3});
  const auto seed = choose(mapping_test::make_store(scene), scene);
  ASSERT_TRUE(seed.has_value());
  EXPECT_THAT(seed->second_from_first, Rigid3Near(true_motion(scene, seed->pair), 1e-3, 1e-3));
}

TEST(SeedPair, RefusesPairsWithoutParallax) {
  const auto scene = make_synthetic_scene(
      {.cloud = CloudKind::kVolume, .points = 200, .views = 3, .arc_deg = 6.0});
  MapperOptions options;
  options.min_triangulation_angle_deg = 30.0;
  EXPECT_FALSE(choose(mapping_test::make_store(scene), scene, options).has_value());
}

TEST(SeedPair, RefusesATurnOnTheSpotEvenWhenItIsTakenForGeneralMotion) {
  auto scene = make_synthetic_scene({.cloud = CloudKind::kVolume,
                                     .points = 200,
                                     .path = PathKind::kPureRotation,
                                     .views = 3,
                                     .noise_px = 0.5});
  EXPECT_FALSE(choose(mapping_test::make_store(scene), scene).has_value());
  // With x' ~ H x for all points, [e]x H is a fundamental matrix for every e.
  const Eigen::Matrix3d k = scene.truth.cameras[0].calibration_matrix();
  for (auto& [pair, geometry] : scene.pairs) {
    const Eigen::Matrix3d turn = true_motion(scene, pair).rotation.toRotationMatrix();
    const Eigen::Matrix3d homography = k * turn * k.inverse();
    Eigen::Matrix3d cross;
    cross << 0.0, 0.0, 0.1, 0.0, 0.0, -1.0, -0.1, 1.0, 0.0;  // of (1, 0.1, 0), at infinity
    geometry.fundamental = cross * homography;
    geometry.kind = TwoViewKind::kGeneral;
  }
  EXPECT_FALSE(choose(mapping_test::make_store(scene), scene).has_value());
}

TEST(SeedPair, NeedsEnoughLandmarks) {
  const auto scene = make_synthetic_scene({.cloud = CloudKind::kVolume, .points = 40, .views = 3});
  MapperOptions options;
  options.min_seed_landmarks = 50;
  EXPECT_FALSE(choose(mapping_test::make_store(scene), scene, options).has_value());
  options.min_seed_landmarks = 20;
  EXPECT_TRUE(choose(mapping_test::make_store(scene), scene, options).has_value());
}

TEST(SeedPair, LeavesRegisteredImagesAlone) {
  const auto scene = make_synthetic_scene({.cloud = CloudKind::kVolume, .points = 200, .views = 4});
  ImageStore store = mapping_test::make_store(scene);
  const auto first = choose(store, scene);
  ASSERT_TRUE(first.has_value());
  store.images[index(first->pair.first)].registered = true;
  const auto second = choose(store, scene);
  ASSERT_TRUE(second.has_value());
  EXPECT_NE(second->pair.first, first->pair.first);
  EXPECT_NE(second->pair.second, first->pair.first);
  for (ImageRecord& image : store.images) {
    image.registered = true;
  }
  EXPECT_FALSE(choose(store, scene).has_value());
}

}  // namespace
}  // namespace trigmesh
