#include "sfm/texture/mesh_projection.hpp"

#include <cmath>
#include <cstdint>

#include "firmware/base/check.hpp"

namespace trigmesh {

ProjectedMesh project_mesh(const TriangleMesh& mesh,
                           const Camera& camera,
                           const Rigid3& cam_from_world) {
  TM_CHECK(camera.model == CameraModel::kPinhole);
  constexpr double kFarthestPixel = 1e6;  // what the rasteriser can hold, with room
  const Eigen::Matrix<double, 3, 4> projection =
      camera.calibration_matrix() * cam_from_world.matrix();
  ProjectedMesh result;
  result.vertices.resize(mesh.positions.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const Eigen::Vector3d p = projection * mesh.positions[i].cast<double>().homogeneous();
    const double x_px = p.x() / p.z();
    const double y_px = p.y() / p.z();
    const bool seen =
        p.z() > 0.0 && std::abs(x_px) < kFarthestPixel && std::abs(y_px) < kFarthestPixel;
    result.vertices[i] = seen ? Eigen::Vector3d(x_px, y_px, p.z()).cast<float>()
                              : Eigen::Vector3f(Eigen::Vector3f::Zero());
  }
  return result;
}

cv::Mat render_inverse_depth(const TriangleMesh& mesh,
                             const ProjectedMesh& projected,
                             PixelBounds bounds) {
  cv::Mat inverse_depth(bounds.height, bounds.width, CV_32FC1, cv::Scalar(0));
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const ProjectedFace face = project_face(mesh, projected, f);
    if (!face.in_front) {
      continue;
    }
    rasterize_triangle(face.corners_px, bounds, [&](int x, int y, const Eigen::Vector3f& weights) {
      float& nearest = inverse_depth.at<float>(y, x);
      nearest = std::max(nearest, weights.dot(face.inverse_depth));
    });
  }
  return inverse_depth;
}

}  // namespace trigmesh
