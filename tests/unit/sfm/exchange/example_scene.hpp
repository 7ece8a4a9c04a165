#pragma once

#include <cstddef>

#include <gmock/gmock.h>

#include "sfm/scene/scene.hpp"
#include "tests/support/synthetic_scene.hpp"

namespace trigmesh::test_support {

/// A small scene with colours, reprojection errors, two lenses of the given model and free
/// keypoints.
inline Scene example_scene(CameraModel model, std::size_t views = 6, std::size_t points = 120) {
  SyntheticSceneOptions options;
  options.views = views;
  options.points = points;
  options.noise_px = 0.5;
  options.clutter_ratio = 0.2;
  options.camera_groups = 2;
  options.camera.model = model;
  options.camera.fy_px = options.camera.fx_px;
  switch (model) {
    case CameraModel::kPinhole:
      break;
    case CameraModel::kRadial:
      options.camera.distortion = {-0.11, 0.023, 0.0, 0.0};
      break;
    case CameraModel::kBrownConrady:
      options.camera.distortion = {-0.11, 0.023, 0.0011, -0.0007};
      break;
    case CameraModel::kKannalaBrandt:
      options.camera.distortion = {0.02, -0.003, 0.0004, -0.0001};
      break;
  }
  Scene scene = make_synthetic_scene(options).truth;
  for (std::size_t i = 0; i < scene.landmarks.size(); ++i) {
    const auto level = static_cast<std::uint8_t>(i % 256);
    scene.landmarks[i].color_rgb = {level, 200, static_cast<std::uint8_t>(255 - level)};
    scene.landmarks[i].error_px = 0.1 + 0.001 * static_cast<double>(i);
  }
  return scene;
}

/// All but the cameras equal in every bit; cameras up to the rounding of the half pixel.
inline void expect_same_scene(const Scene& actual, const Scene& expected) {
  ASSERT_EQ(actual.cameras.size(), expected.cameras.size());
  for (std::size_t i = 0; i < expected.cameras.size(); ++i) {
    EXPECT_EQ(actual.cameras[i].model, expected.cameras[i].model);
    EXPECT_EQ(actual.cameras[i].width_px, expected.cameras[i].width_px);
    EXPECT_LT((actual.cameras[i].intrinsics() - expected.cameras[i].intrinsics()).norm(), 1e-11);
  }
  ASSERT_EQ(actual.views.size(), expected.views.size());
  for (std::size_t i = 0; i < expected.views.size(); ++i) {
    const View& a = actual.views[i];
    const View& e = expected.views[i];
    EXPECT_EQ(a.name, e.name);
    EXPECT_EQ(a.camera, e.camera);
    ASSERT_TRUE(a.cam_from_world && e.cam_from_world);
    EXPECT_EQ(a.cam_from_world->rotation.coeffs(), e.cam_from_world->rotation.coeffs());
    EXPECT_EQ(a.cam_from_world->translation, e.cam_from_world->translation);
    EXPECT_EQ(a.keypoints_px, e.keypoints_px);
    EXPECT_EQ(a.landmarks, e.landmarks);
  }
  ASSERT_EQ(actual.landmarks.size(), expected.landmarks.size());
  for (std::size_t i = 0; i < expected.landmarks.size(); ++i) {
    const Landmark& a = actual.landmarks[i];
    const Landmark& e = expected.landmarks[i];
    EXPECT_EQ(a.position_in_world, e.position_in_world);
    EXPECT_EQ(a.color_rgb, e.color_rgb);
    EXPECT_EQ(a.error_px, e.error_px);
    EXPECT_EQ(a.track, e.track);
  }
}

}  // namespace trigmesh::test_support
