// Planes as inverse depth: the points X of a plane m . X = 1 have 1/z = m . K^-1 p, affine in the
// pixel p, so that slopes are (m_x / f_x, m_y / f_y) and the normal is -m / |m|.
#include "sfm/dense/plane_field.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/LU>
#include <opencv2/imgproc.hpp>

#include "firmware/base/check.hpp"

namespace trigmesh {

namespace {

struct Intrinsics {
  float fx;
  float fy;
  float cx;
  float cy;
};

Intrinsics intrinsics_of(const Camera& camera) {
  return {static_cast<float>(camera.fx_px),
          static_cast<float>(camera.fy_px),
          static_cast<float>(camera.cx_px),
          static_cast<float>(camera.cy_px)};
}

/// A sparse point in the picture: pixel and inverse depth.
using Seed = Eigen::Vector3f;

std::vector<Seed> project_seeds(const Camera& camera,
                                std::span<const Eigen::Vector3f> seeds_in_cam,
                                const InverseDepthRange& range) {
  const Intrinsics k = intrinsics_of(camera);
  std::vector<Seed> seeds;
  for (const Eigen::Vector3f& point : seeds_in_cam) {
    if (!(point.z() > 0.0F)) {
      continue;
    }
    const float q = 1.0F / point.z();
    const float x = k.fx * point.x() * q + k.cx;
    const float y = k.fy * point.y() * q + k.cy;
    if (x >= 0.0F && y >= 0.0F && x <= static_cast<float>(camera.width_px - 1) &&
        y <= static_cast<float>(camera.height_px - 1)) {
      seeds.emplace_back(x, y, std::clamp(q, range.min, range.max));
    }
  }
  return seeds;
}

/// Nearest seed of every pixel, as Voronoi cells grown from the seeds (cv::distanceTransform).
void fill_nearest(std::span<const Seed> seeds, PlaneField& field) {
  cv::Mat empty(field.height_px, field.width_px, CV_8UC1, cv::Scalar(1));
  for (const Seed& seed : seeds) {
    empty.at<std::uint8_t>(static_cast<int>(seed.y() + 0.5F), static_cast<int>(seed.x() + 0.5F)) =
        0;
  }
  cv::Mat distance;
  cv::Mat labels;
  cv::distanceTransform(
      empty, distance, labels, cv::DIST_L2, cv::DIST_MASK_5, cv::DIST_LABEL_PIXEL);
  std::vector<float> inverse_depth(seeds.size() + 1, 0.0F);
  for (const Seed& seed : seeds) {
    const int label =
        labels.at<int>(static_cast<int>(seed.y() + 0.5F), static_cast<int>(seed.x() + 0.5F));
    inverse_depth[static_cast<std::size_t>(label)] = seed.z();
  }
  for (int y = 0; y < field.height_px; ++y) {
    for (int x = 0; x < field.width_px; ++x) {
      field.planes[field.index(x, y)].inverse_depth =
          inverse_depth[static_cast<std::size_t>(labels.at<int>(y, x))];
    }
  }
}

/// Gives the pixels inside a triangle of seeds their common plane.
void fill_triangle(const std::array<Seed, 3>& corner,
                   const InverseDepthRange& range,
                   PlaneField& field) {
  Eigen::Matrix3d position;
  Eigen::Vector3d value;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    position.row(row) << static_cast<double>(corner[i].x()), static_cast<double>(corner[i].y()),
        1.0;
    value[row] = static_cast<double>(corner[i].z());
  }
  constexpr double kSmallestArea_px2 = 0.5;
  if (std::abs(position.determinant()) < kSmallestArea_px2) {
    return;
  }
  const Eigen::Matrix3d inverse = position.inverse();
  const Eigen::Vector3d plane = inverse * value;
  const auto low = corner[0].cwiseMin(corner[1]).cwiseMin(corner[2]);
  const auto high = corner[0].cwiseMax(corner[1]).cwiseMax(corner[2]);
  const auto first_x = static_cast<int>(std::ceil(low.x()));
  const auto first_y = static_cast<int>(std::ceil(low.y()));
  for (int y = first_y; y <= static_cast<int>(high.y()); ++y) {
    for (int x = first_x; x <= static_cast<int>(high.x()); ++x) {
      const Eigen::Vector3d at(x, y, 1.0);
      if ((inverse.transpose() * at).minCoeff() < -1e-9) {
        continue;
      }
      const auto q = static_cast<float>(plane.dot(at));
      field.planes[field.index(x, y)] = {std::clamp(q, range.min, range.max),
                                         static_cast<float>(plane.x()),
                                         static_cast<float>(plane.y())};
    }
  }
}

void fill_triangles(std::span<const Seed> seeds,
                    const InverseDepthRange& range,
                    PlaneField& field) {
  cv::Subdiv2D subdivision(cv::Rect(0, 0, field.width_px, field.height_px));
  std::vector<Seed> at_vertex(4, Seed::Zero());
  for (const Seed& seed : seeds) {
    const int vertex = subdivision.insert(cv::Point2f(seed.x(), seed.y()));
    if (static_cast<std::size_t>(vertex) >= at_vertex.size()) {
      at_vertex.resize(static_cast<std::size_t>(vertex) + 1, Seed::Zero());
    }
    at_vertex[static_cast<std::size_t>(vertex)] = seed;
  }
  std::vector<int> edges;
  subdivision.getLeadingEdgeList(edges);
  for (const int edge : edges) {
    std::array<Seed, 3> corner;
    int at = edge;
    bool inside = true;
    for (Seed& seed : corner) {
      const auto vertex = static_cast<std::size_t>(subdivision.edgeOrg(at));
      inside = inside && vertex >= 4 && vertex < at_vertex.size();
      seed = inside ? at_vertex[vertex] : Seed::Zero();
      at = subdivision.getEdge(at, cv::Subdiv2D::NEXT_AROUND_LEFT);
    }
    if (inside) {
      fill_triangle(corner, range, field);
    }
  }
}

}  // namespace

PlaneField::PlaneField(int width, int height)
    : width_px(width),
      height_px(height),
      planes(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)),
      cost(planes.size(), kNoMatchCost),
      view_set(planes.size(), 0) {}

PlaneHypothesis plane_from_normal(const Camera& camera,
                                  const Eigen::Vector2f& pixel,
                                  float inverse_depth,
                                  const Eigen::Vector3f& normal_in_cam) {
  const Intrinsics k = intrinsics_of(camera);
  const Eigen::Vector3f ray((pixel.x() - k.cx) / k.fx, (pixel.y() - k.cy) / k.fy, 1.0F);
  const float along = normal_in_cam.dot(ray);
  constexpr float kGrazing = 1e-6F;
  if (std::abs(along) < kGrazing) {
    return {inverse_depth, 0.0F, 0.0F};
  }
  const float scale = inverse_depth / along;
  return {inverse_depth, scale * normal_in_cam.x() / k.fx, scale * normal_in_cam.y() / k.fy};
}

Eigen::Vector3f normal_of_plane(const Camera& camera,
                                const Eigen::Vector2f& pixel,
                                const PlaneHypothesis& plane) {
  const Intrinsics k = intrinsics_of(camera);
  const Eigen::Vector3f m(k.fx * plane.slope_x,
                          k.fy * plane.slope_y,
                          plane.inverse_depth - (pixel.x() - k.cx) * plane.slope_x -
                              (pixel.y() - k.cy) * plane.slope_y);
  return -m.normalized();
}

PlaneField field_from_depth_map(const DepthMap& map) {
  TM_CHECK(map.depth.type() == CV_32FC1 && map.normal.type() == CV_32FC3);
  PlaneField field(map.depth.cols, map.depth.rows);
  for (int y = 0; y < field.height_px; ++y) {
    for (int x = 0; x < field.width_px; ++x) {
      const float depth = map.depth.at<float>(y, x);
      if (depth > 0.0F) {
        const auto& n = map.normal.at<cv::Vec3f>(y, x);
        field.planes[field.index(x, y)] =
            plane_from_normal(map.camera,
                              Eigen::Vector2f(static_cast<float>(x), static_cast<float>(y)),
                              1.0F / depth,
                              Eigen::Vector3f(n[0], n[1], n[2]));
      }
    }
  }
  return field;
}

DepthMap depth_map_from_field(const PlaneField& field, const Camera& camera) {
  DepthMap map{.camera = camera,
               .depth = cv::Mat(field.height_px, field.width_px, CV_32FC1, cv::Scalar(0)),
               .normal = cv::Mat(field.height_px, field.width_px, CV_32FC3, cv::Scalar(0, 0, 0)),
               .confidence = cv::Mat(field.height_px, field.width_px, CV_8UC1, cv::Scalar(0))};
  for (int y = 0; y < field.height_px; ++y) {
    for (int x = 0; x < field.width_px; ++x) {
      const std::size_t i = field.index(x, y);
      const PlaneHypothesis& plane = field.planes[i];
      if (!(plane.inverse_depth > 0.0F)) {
        continue;
      }
      map.depth.at<float>(y, x) = 1.0F / plane.inverse_depth;
      const Eigen::Vector3f n = normal_of_plane(
          camera, Eigen::Vector2f(static_cast<float>(x), static_cast<float>(y)), plane);
      map.normal.at<cv::Vec3f>(y, x) = cv::Vec3f(n.x(), n.y(), n.z());
      const float match = std::clamp(1.0F - field.cost[i], 0.0F, 1.0F);
      map.confidence.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(1.0F + 254.0F * match);
    }
  }
  return map;
}

PlaneField resample_field(const PlaneField& field, int width_px, int height_px) {
  PlaneField out(width_px, height_px);
  const float scale_x = static_cast<float>(field.width_px) / static_cast<float>(width_px);
  const float scale_y = static_cast<float>(field.height_px) / static_cast<float>(height_px);
  for (int y = 0; y < height_px; ++y) {
    const float from_y = (static_cast<float>(y) + 0.5F) * scale_y - 0.5F;
    const int near_y = std::clamp(static_cast<int>(from_y + 0.5F), 0, field.height_px - 1);
    for (int x = 0; x < width_px; ++x) {
      const float from_x = (static_cast<float>(x) + 0.5F) * scale_x - 0.5F;
      const int near_x = std::clamp(static_cast<int>(from_x + 0.5F), 0, field.width_px - 1);
      const std::size_t from = field.index(near_x, near_y);
      const PlaneHypothesis& plane = field.planes[from];
      const std::size_t to = out.index(x, y);
      out.planes[to] = {plane.inverse_depth +
                            plane.slope_x * (from_x - static_cast<float>(near_x)) +
                            plane.slope_y * (from_y - static_cast<float>(near_y)),
                        plane.slope_x * scale_x,
                        plane.slope_y * scale_y};
      out.view_set[to] = field.view_set[from];
    }
  }
  return out;
}

PlaneField field_from_seeds(const Camera& camera,
                            std::span<const Eigen::Vector3f> seeds_in_cam,
                            const InverseDepthRange& range) {
  PlaneField field(camera.width_px, camera.height_px);
  const std::vector<Seed> seeds = project_seeds(camera, seeds_in_cam, range);
  if (!seeds.empty()) {
    fill_nearest(seeds, field);
    fill_triangles(seeds, range, field);
  }
  return field;
}

}  // namespace trigmesh
