#include "sfm/texture/textured_render.hpp"

#include <cstddef>
#include <cstdint>

#include "sfm/texture/atlas_pictures.hpp"
#include "sfm/texture/mesh_projection.hpp"

namespace trigmesh {

RenderedView render_textured(const TexturedMesh& textured,
                             const Camera& camera,
                             const Rigid3& cam_from_world) {
  const TriangleMesh& mesh = textured.mesh;
  const PixelBounds bounds{camera.width_px, camera.height_px};
  const ProjectedMesh projected = project_mesh(mesh, camera, cam_from_world);
  RenderedView view{cv::Mat(bounds.height, bounds.width, CV_8UC3, cv::Scalar(0, 0, 0)),
                    cv::Mat(bounds.height, bounds.width, CV_8UC1, cv::Scalar(0))};
  cv::Mat nearest(bounds.height, bounds.width, CV_32FC1, cv::Scalar(0));
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const ProjectedFace face = project_face(mesh, projected, f);
    if (!face.in_front) {
      continue;
    }
    const bool outside = doubled_area_px(face) < 0.0F;
    const cv::Mat& page = textured.pages[textured.face_page[f]];
    const auto& uv = textured.face_uv[f];
    rasterize_triangle(face.corners_px, bounds, [&](int x, int y, const Eigen::Vector3f& weights) {
      const float inverse_depth = weights.dot(face.inverse_depth);
      if (!(inverse_depth > nearest.at<float>(y, x))) {
        return;
      }
      nearest.at<float>(y, x) = inverse_depth;
      view.coverage.at<std::uint8_t>(y, x) = outside ? 255 : 0;
      const Eigen::Vector3f w = weights.cwiseProduct(face.inverse_depth) / inverse_depth;
      const Eigen::Vector2f at = w[0] * uv[0] + w[1] * uv[1] + w[2] * uv[2];
      const Eigen::Vector3f color =
          sample_bilinear(page, at * static_cast<float>(page.cols) - Eigen::Vector2f(0.5F, 0.5F));
      auto& pixel = view.rgb.at<cv::Vec3b>(y, x);
      for (int c = 0; c < 3; ++c) {
        pixel[c] = outside ? cv::saturate_cast<std::uint8_t>(color[c]) : std::uint8_t{0};
      }
    });
  }
  return view;
}

}  // namespace trigmesh
