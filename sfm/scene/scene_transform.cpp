#include "sfm/scene/scene_transform.hpp"

namespace trigmesh {

Scene transform_scene(const Sim3& b_from_a, Scene scene_in_a) {
  for (View& view : scene_in_a.views) {
    if (view.cam_from_world) {
      view.cam_from_world = transform_pose(b_from_a, *view.cam_from_world);
    }
  }
  for (Landmark& landmark : scene_in_a.landmarks) {
    landmark.position_in_world = b_from_a * landmark.position_in_world;
  }
  return scene_in_a;
}

}  // namespace trigmesh
