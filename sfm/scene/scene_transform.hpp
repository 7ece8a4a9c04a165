#pragma once

#include "sfm/geometry/similarity.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// The same scene in world b: poses and points are moved, pixels and what belongs together stay.
[[nodiscard]] Scene transform_scene(const Sim3& b_from_a, Scene scene_in_a);

}  // namespace trigmesh
