#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "sfm/camera/camera.hpp"
#include "sfm/geometry/rigid3.hpp"
#include "sfm/surface/triangle_mesh.hpp"
#include "sfm/texture/raster.hpp"

namespace trigmesh {

/// A mesh as one pinhole view sees it.
struct ProjectedMesh {
  /// Per vertex: x_px, y_px, depth along the optical axis; depth 0 when it cannot be seen: behind
  /// the camera, or so far outside that it has no sensible pixel.
  std::vector<Eigen::Vector3f> vertices;
};

[[nodiscard]] ProjectedMesh project_mesh(const TriangleMesh& mesh,
                                         const Camera& camera,
                                         const Rigid3& cam_from_world);

/// The corners of a face, in pixels; valid only if `in_front`.
struct ProjectedFace {
  std::array<Eigen::Vector2f, 3> corners_px;
  Eigen::Vector3f inverse_depth = Eigen::Vector3f::Zero();
  bool in_front = false;  ///< all corners can be seen by a camera without edges
};

[[nodiscard]] inline ProjectedFace project_face(const TriangleMesh& mesh,
                                                const ProjectedMesh& projected,
                                                std::size_t face) {
  ProjectedFace result;
  result.in_front = true;
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector3f& vertex = projected.vertices[mesh.faces[face][i]];
    result.corners_px[i] = vertex.head<2>();
    result.in_front = result.in_front && vertex.z() > 0.0F;
    result.inverse_depth[static_cast<Eigen::Index>(i)] =
        vertex.z() > 0.0F ? 1.0F / vertex.z() : 0.0F;
  }
  return result;
}

/// Twice the signed area of the projection; negative when the outside (counter-clockwise side) of
/// the face looks at the camera, because y points down.
[[nodiscard]] inline float doubled_area_px(const ProjectedFace& face) {
  const Eigen::Vector2f a = face.corners_px[1] - face.corners_px[0];
  const Eigen::Vector2f b = face.corners_px[2] - face.corners_px[0];
  return a.x() * b.y() - a.y() * b.x();
}

/// z-buffer: CV_32FC1 of the camera's size, 1/depth of the nearest face of either orientation at
/// each pixel centre; 0 = nothing. Faces with a corner behind the camera are left out.
[[nodiscard]] cv::Mat render_inverse_depth(const TriangleMesh& mesh,
                                           const ProjectedMesh& projected,
                                           PixelBounds bounds);

}  // namespace trigmesh
