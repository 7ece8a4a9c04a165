#pragma once

#include "sfm/dense/dense_view.hpp"
#include "sfm/dense/depth_map.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// A coarse depth map and picture of a view from the landmarks it sees.
struct SparseDepth {
  DepthMap map;
  ViewImage image;  ///< colours of the landmarks, of the size of the map
};

/// Interpolates the landmarks that a registered view sees over their Delaunay triangulation in the
/// image (Delaunay 1934; cv::Subdiv2D). Triangles with long edges or with a jump in depth, and
/// those seen too steeply, are left out. `width_px` is the width of the map. Empty mats when the
/// view has no pose or sees fewer than three landmarks.
[[nodiscard]] SparseDepth interpolate_landmarks(const Scene& scene, ViewId view, int width_px);

}  // namespace trigmesh
