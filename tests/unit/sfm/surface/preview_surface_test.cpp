#include "sfm/surface/preview_surface.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

/// Three cameras above landmarks on the plane z = 0.
Scene plane_scene() {
  Scene scene;
  scene.cameras.push_back({.model = CameraModel::kPinhole,
                           .width_px = 320,
                           .height_px = 240,
                           .fx_px = 300.0,
                           .fy_px = 300.0,
                           .cx_px = 159.5,
                           .cy_px = 119.5});
  for (int y = -15; y <= 15; ++y) {
    for (int x = -15; x <= 15; ++x) {
      Landmark landmark;
      landmark.position_in_world = {0.05 * x + 0.01 * (y % 2), 0.05 * y, 0.0};
      landmark.color_rgb = {50, 100, 150};
      scene.landmarks.push_back(landmark);
    }
  }
  for (int v = -1; v <= 1; ++v) {
    View view;
    view.name = "view";
    const Eigen::Quaterniond down(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));
    view.cam_from_world = Rigid3{down, -(down * Eigen::Vector3d(0.2 * v, 0.0, 2.0))};
    for (std::size_t i = 0; i < scene.landmarks.size(); ++i) {
      view.landmarks.push_back(id_of<LandmarkId>(i));
    }
    scene.views.push_back(view);
  }
  return scene;
}

TEST(PreviewSurface, OfAPlaneIsFlatFacesTheCamerasAndHasItsColour) {
  SerialExecutor serial;
  const auto result = make_preview_surface(plane_scene(), serial);
  ASSERT_TRUE(result) << result.error().message;
  ASSERT_GT(result->mesh.faces.size(), 1000U);
  EXPECT_EQ(result->report.view_count, 3U);
  for (std::size_t v = 0; v < result->mesh.positions.size(); ++v) {
    EXPECT_NEAR(result->mesh.positions[v].z(), 0.0F, 0.005F);
    EXPECT_GT(result->mesh.normals[v].z(), 0.9F);
  }
}

TEST(PreviewSurface, NeedsLandmarks) {
  Scene scene = plane_scene();
  for (View& view : scene.views) {
    view.landmarks.clear();
  }
  SerialExecutor serial;
  const auto result = make_preview_surface(scene, serial);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::kInsufficientData);
}

}  // namespace
}  // namespace trigmesh
