#include "sfm/scene/scene_transform.hpp"

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

TEST(SceneTransform, MovesPosesAndPointsTogether) {
  Scene scene;
  scene.cameras = {{.width_px = 640, .height_px = 480, .fx_px = 500, .fy_px = 500}};
  scene.views.resize(2);
  scene.views[0].cam_from_world =
      Rigid3{Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY())), {0.1, 0.2, 0.3}};
  scene.landmarks.resize(1);
  scene.landmarks[0].position_in_world = {0.4, -0.3, 5.0};
  const Sim3 b_from_a{
      2.5, Eigen::Quaterniond(Eigen::AngleAxisd(1.1, Eigen::Vector3d::UnitX())), {1.0, 2.0, 3.0}};
  const Scene moved = transform_scene(b_from_a, scene);

  EXPECT_FALSE(moved.views[1].cam_from_world);
  const auto in_cam = [](const Scene& s) {
    return Eigen::Vector3d(*s.views[0].cam_from_world * s.landmarks[0].position_in_world);
  };
  // What a camera sees is the same but for the unit.
  EXPECT_LT((in_cam(moved) - 2.5 * in_cam(scene)).norm(), 1e-12);
  EXPECT_LT((moved.landmarks[0].position_in_world - b_from_a * scene.landmarks[0].position_in_world)
                .norm(),
            1e-12);
}

}  // namespace
}  // namespace trigmesh
