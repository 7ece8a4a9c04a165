#include "sfm/dense/plane_field.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "tests/unit/sfm/dense/rendered_scene.hpp"

namespace trigmesh {
namespace {

TEST(PlaneField, NormalsSurviveTheWayThere) {
  const Camera camera = test::small_camera();
  const Eigen::Vector2f pixel(20.0F, 60.0F);
  const Eigen::Vector3f normal = Eigen::Vector3f(0.3F, -0.4F, -1.0F).normalized();
  const PlaneHypothesis plane = plane_from_normal(camera, pixel, 0.4F, normal);
  EXPECT_FLOAT_EQ(plane.inverse_depth, 0.4F);
  EXPECT_LT((normal_of_plane(camera, pixel, plane) - normal).norm(), 1e-5F);
}

TEST(PlaneField, InverseDepthIsAffineAlongAPlane) {
  const auto view = test::render({test::plane(Eigen::Vector3d(0.5, -0.3, -1.0).normalized(), -3.0)},
                                 test::small_camera(),
                                 Rigid3{});
  const PlaneField field = field_from_depth_map(view.truth);
  const PlaneHypothesis& here = field.planes[field.index(30, 30)];
  const float there = here.inverse_depth + 25.0F * here.slope_x - 12.0F * here.slope_y;
  EXPECT_NEAR(1.0F / there, view.truth.depth.at<float>(18, 55), 1e-3F);
}

TEST(PlaneField, ResamplingKeepsASlantedPlane) {
  const auto scene = {test::plane(Eigen::Vector3d(0.5, -0.3, -1.0).normalized(), -3.0)};
  const auto large = test::render(scene, test::small_camera(), Rigid3{});
  const PlaneField small = resample_field(field_from_depth_map(large.truth), 48, 36);
  const PlaneField back = resample_field(small, 96, 72);
  const DepthMap map = depth_map_from_field(back, test::small_camera());
  EXPECT_EQ(test::correct_share(map, large.truth, 1e-4, 1), 1.0);
}

TEST(PlaneField, SeedsOfAPlaneGiveThePlaneBetweenThem) {
  const auto view = test::render({test::plane(Eigen::Vector3d(0.5, -0.3, -1.0).normalized(), -3.0)},
                                 test::small_camera(),
                                 Rigid3{});
  const Camera& camera = view.image.camera;
  std::vector<Eigen::Vector3f> seeds;
  for (const int y : {5, 30, 66}) {
    for (const int x : {4, 50, 90}) {
      const float z = view.truth.depth.at<float>(y, x);
      seeds.emplace_back(static_cast<float>((x - camera.cx_px) / camera.fx_px) * z,
                         static_cast<float>((y - camera.cy_px) / camera.fy_px) * z,
                         z);
    }
  }
  const PlaneField field = field_from_seeds(camera, seeds, {0.05F, 2.0F});
  for (int y = 6; y < 66; y += 7) {
    for (int x = 5; x < 90; x += 9) {
      EXPECT_NEAR(1.0F / field.planes[field.index(x, y)].inverse_depth,
                  view.truth.depth.at<float>(y, x),
                  2e-3F);
    }
  }
  EXPECT_GT(field.planes[field.index(0, 0)].inverse_depth, 0.0F);  // outside: the nearest seed's
}

TEST(PlaneField, NoSeedsGiveNoPlanes) {
  const PlaneField field = field_from_seeds(test::small_camera(), {}, {0.05F, 2.0F});
  EXPECT_EQ(field.planes[100], PlaneHypothesis{});
}

}  // namespace
}  // namespace trigmesh
