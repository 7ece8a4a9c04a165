#include "sfm/surface/sparse_depth.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <opencv2/imgproc.hpp>

#include "firmware/base/check.hpp"

namespace trigmesh {

namespace {

// Of the width of the map: longer edges span what no landmark says.
constexpr float kMaxEdgeRatio = 0.15F;
// Largest depth over smallest in a triangle.
constexpr double kMaxDepthRatio = 1.15;
constexpr double kMinCosine = 0.15;
constexpr std::uint8_t kConfidence = 128;

/// A landmark in the coarse picture.
struct ImagePoint {
  cv::Point2f pixel;
  Eigen::Vector3d in_cam = Eigen::Vector3d::Zero();
  Eigen::Vector3f rgb = Eigen::Vector3f::Zero();
};

Camera coarse_pinhole(const Camera& camera, int width_px) {
  const double scale = static_cast<double>(width_px) / camera.width_px;
  Camera coarse;
  coarse.model = CameraModel::kPinhole;
  coarse.width_px = width_px;
  coarse.height_px = std::max(1, static_cast<int>(std::lround(camera.height_px * scale)));
  coarse.fx_px = camera.fx_px * scale;
  coarse.fy_px = camera.fy_px * scale;
  coarse.cx_px = (camera.cx_px + 0.5) * scale - 0.5;
  coarse.cy_px = (camera.cy_px + 0.5) * scale - 0.5;
  return coarse;
}

std::vector<ImagePoint> visible_points(const Scene& scene, const View& view, const Camera& camera) {
  std::vector<ImagePoint> points;
  for (const LandmarkId id : view.landmarks) {
    if (id == kNoLandmark) {
      continue;
    }
    const Landmark& landmark = scene.landmarks[index(id)];
    const Eigen::Vector3d in_cam = *view.cam_from_world * landmark.position_in_world;
    const auto pixel = project(camera, in_cam);
    if (!pixel || pixel->x() < 0.0 || pixel->y() < 0.0 || pixel->x() > camera.width_px - 1 ||
        pixel->y() > camera.height_px - 1) {
      continue;
    }
    const auto& c = landmark.color_rgb;
    points.push_back({cv::Point2f(static_cast<float>(pixel->x()), static_cast<float>(pixel->y())),
                      in_cam,
                      Eigen::Vector3f(c[0], c[1], c[2])});
  }
  return points;
}

/// Corners as positions in the list of points, of triangles between points only.
std::vector<std::array<std::size_t, 3>> triangulate(const std::vector<ImagePoint>& points,
                                                    const Camera& camera) {
  cv::Subdiv2D subdivision(cv::Rect(0, 0, camera.width_px, camera.height_px));
  std::vector<std::size_t> point_of_vertex;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto vertex = static_cast<std::size_t>(subdivision.insert(points[i].pixel));
    if (vertex >= point_of_vertex.size()) {
      point_of_vertex.resize(vertex + 1, points.size());
    }
    point_of_vertex[vertex] = i;  // of two in one place the later one stays
  }
  std::vector<int> first_edges;
  subdivision.getLeadingEdgeList(first_edges);
  std::vector<std::array<std::size_t, 3>> triangles;
  for (int edge : first_edges) {
    std::array<std::size_t, 3> corners{};
    bool inner = true;
    for (std::size_t& corner : corners) {
      const auto vertex = static_cast<std::size_t>(subdivision.edgeOrg(edge));
      corner = vertex < point_of_vertex.size() ? point_of_vertex[vertex] : points.size();
      inner = inner && corner < points.size();
      edge = subdivision.getEdge(edge, cv::Subdiv2D::NEXT_AROUND_LEFT);
    }
    if (inner) {
      triangles.push_back(corners);
    }
  }
  return triangles;
}

/// Fills the pixels of one triangle.
void draw(const std::array<const ImagePoint*, 3>& corners, SparseDepth& sparse) {
  const Camera& camera = sparse.map.camera;
  const auto& [a, b, c] = corners;
  const float longest = static_cast<float>(std::max({cv::norm(a->pixel - b->pixel),
                                                     cv::norm(b->pixel - c->pixel),
                                                     cv::norm(c->pixel - a->pixel)}));
  const auto depths = std::minmax({a->in_cam.z(), b->in_cam.z(), c->in_cam.z()});
  Eigen::Vector3d normal = (b->in_cam - a->in_cam).cross(c->in_cam - a->in_cam).normalized();
  normal *= normal.dot(a->in_cam) > 0.0 ? -1.0 : 1.0;
  if (longest > kMaxEdgeRatio * static_cast<float>(camera.width_px) ||
      depths.second > kMaxDepthRatio * depths.first ||
      !(-normal.dot(a->in_cam.normalized()) >= kMinCosine)) {
    return;
  }
  Eigen::Matrix3f basis;
  basis << a->pixel.x, b->pixel.x, c->pixel.x, a->pixel.y, b->pixel.y, c->pixel.y, 1.0F, 1.0F, 1.0F;
  const Eigen::Matrix3f weights_of_pixel = basis.inverse();
  const double offset = normal.dot(a->in_cam);
  const auto low = [](float p, float q, float r) {
    return static_cast<int>(std::ceil(std::min({p, q, r})));
  };
  const auto high = [](float p, float q, float r) {
    return static_cast<int>(std::floor(std::max({p, q, r})));
  };
  for (int y = low(a->pixel.y, b->pixel.y, c->pixel.y);
       y <= high(a->pixel.y, b->pixel.y, c->pixel.y);
       ++y) {
    for (int x = low(a->pixel.x, b->pixel.x, c->pixel.x);
         x <= high(a->pixel.x, b->pixel.x, c->pixel.x);
         ++x) {
      const Eigen::Vector3f weights =
          weights_of_pixel * Eigen::Vector3f(static_cast<float>(x), static_cast<float>(y), 1.0F);
      if (!(weights.minCoeff() >= 0.0F)) {
        continue;
      }
      const Eigen::Vector3d ray(
          (x - camera.cx_px) / camera.fx_px, (y - camera.cy_px) / camera.fy_px, 1.0);
      const Eigen::Vector3f rgb = weights[0] * a->rgb + weights[1] * b->rgb + weights[2] * c->rgb;
      sparse.map.depth.at<float>(y, x) = static_cast<float>(offset / normal.dot(ray));
      const Eigen::Vector3f n = normal.cast<float>();
      sparse.map.normal.at<cv::Vec3f>(y, x) = cv::Vec3f(n.x(), n.y(), n.z());
      sparse.map.confidence.at<std::uint8_t>(y, x) = kConfidence;
      sparse.image.rgb.at<cv::Vec3b>(y, x) = cv::Vec3b(static_cast<std::uint8_t>(rgb[0]),
                                                       static_cast<std::uint8_t>(rgb[1]),
                                                       static_cast<std::uint8_t>(rgb[2]));
    }
  }
}

}  // namespace

SparseDepth interpolate_landmarks(const Scene& scene, ViewId view_id, int width_px) {
  TM_CHECK(width_px > 0);
  const View& view = scene.views[index(view_id)];
  SparseDepth sparse;
  if (!view.cam_from_world) {
    return sparse;
  }
  sparse.map.camera = coarse_pinhole(scene.cameras[index(view.camera)], width_px);
  const std::vector<ImagePoint> points = visible_points(scene, view, sparse.map.camera);
  if (points.size() < 3) {
    return sparse;
  }
  const cv::Size size(sparse.map.camera.width_px, sparse.map.camera.height_px);
  sparse.map.depth = cv::Mat(size, CV_32FC1, cv::Scalar::all(0.0));
  sparse.map.normal = cv::Mat(size, CV_32FC3, cv::Scalar::all(0.0));
  sparse.map.confidence = cv::Mat(size, CV_8UC1, cv::Scalar::all(0.0));
  sparse.image.rgb = cv::Mat(size, CV_8UC3, cv::Scalar::all(0.0));
  for (const auto& triangle : triangulate(points, sparse.map.camera)) {
    draw({&points[triangle[0]], &points[triangle[1]], &points[triangle[2]]}, sparse);
  }
  return sparse;
}

}  // namespace trigmesh
