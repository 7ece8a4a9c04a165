#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <opencv2/core/mat.hpp>

#include "sfm/dense/dense_view.hpp"
#include "sfm/surface/triangle_mesh.hpp"

namespace trigmesh {

/// A smooth colour for each point of space: the truth that textures must show.
inline Eigen::Vector3d paint(const Eigen::Vector3d& p) {
  return {120.0 + 60.0 * std::sin(5.0 * p.x()),
          120.0 + 60.0 * std::sin(4.0 * p.y() + 1.0),
          120.0 + 60.0 * std::cos(3.0 * (p.x() + p.y() + p.z()))};
}

inline Camera small_camera() {
  return {.model = CameraModel::kPinhole,
          .width_px = 120,
          .height_px = 90,
          .fx_px = 100.0,
          .fy_px = 100.0,
          .cx_px = 59.5,
          .cy_px = 44.5,
          .distortion = {}};
}

/// A camera at `eye` that looks at `target`; image x is horizontal.
inline Rigid3 looking_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
  const Eigen::Vector3d z = (target - eye).normalized();
  const Eigen::Vector3d hint =
      std::abs(z.y()) < 0.9 ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX();
  const Eigen::Vector3d x = hint.cross(z).normalized();
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  return {Eigen::Quaterniond(rotation), -(rotation * eye)};
}

/// A square in the plane z = `height`, seen from above (+z), of cells x cells pairs of triangles.
inline TriangleMesh square_mesh(double half_side, int cells, double height) {
  TriangleMesh mesh;
  const auto index = [cells](int x, int y) {
    return static_cast<std::uint32_t>(y * (cells + 1) + x);
  };
  for (int y = 0; y <= cells; ++y) {
    for (int x = 0; x <= cells; ++x) {
      mesh.positions.push_back(Eigen::Vector3d(half_side * (2.0 * x / cells - 1.0),
                                               half_side * (2.0 * y / cells - 1.0),
                                               height)
                                   .cast<float>());
    }
  }
  for (int y = 0; y < cells; ++y) {
    for (int x = 0; x < cells; ++x) {
      mesh.faces.push_back({index(x, y), index(x + 1, y), index(x + 1, y + 1)});
      mesh.faces.push_back({index(x, y), index(x + 1, y + 1), index(x, y + 1)});
    }
  }
  return mesh;
}

inline void append(TriangleMesh& mesh, const TriangleMesh& other) {
  const auto shift = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
  for (const auto& face : other.faces) {
    mesh.faces.push_back({face[0] + shift, face[1] + shift, face[2] + shift});
  }
}

/// Colour at a pixel of a view: where the ray is, the caller knows.
using RayColor =
    std::function<Eigen::Vector3d(const Eigen::Vector3d& eye, const Eigen::Vector3d& ray)>;

inline cv::Mat ray_picture(const DenseView& view, const RayColor& color) {
  const Camera& camera = view.camera;
  cv::Mat rgb(camera.height_px, camera.width_px, CV_8UC3);
  const Rigid3 world_from_cam = view.cam_from_world.inverse();
  for (int y = 0; y < rgb.rows; ++y) {
    for (int x = 0; x < rgb.cols; ++x) {
      const Eigen::Vector3d in_cam(
          (x - camera.cx_px) / camera.fx_px, (y - camera.cy_px) / camera.fy_px, 1.0);
      const Eigen::Vector3d c =
          color(world_from_cam.translation, world_from_cam.rotation * in_cam.normalized());
      rgb.at<cv::Vec3b>(y, x) = {cv::saturate_cast<std::uint8_t>(c[0]),
                                 cv::saturate_cast<std::uint8_t>(c[1]),
                                 cv::saturate_cast<std::uint8_t>(c[2])};
    }
  }
  return rgb;
}

/// Paint on the plane z = 0, grey 30 beside and above it.
inline Eigen::Vector3d ground_color(const Eigen::Vector3d& eye, const Eigen::Vector3d& ray) {
  return ray.z() < 0.0 ? paint(eye - ray * (eye.z() / ray.z()))
                       : Eigen::Vector3d(Eigen::Vector3d::Constant(30.0));
}

class MemoryImages final : public ViewImageSource {
 public:
  std::vector<ViewImage> pictures;

  [[nodiscard]] Result<ViewImage> load(std::size_t view) const override { return pictures[view]; }
};

struct PaintedScene {
  std::vector<DenseView> views;
  MemoryImages images;

  void add_view(const Eigen::Vector3d& eye, const RayColor& color) {
    views.push_back({.name = "view" + std::to_string(views.size()),
                     .camera = small_camera(),
                     .cam_from_world = looking_at(eye, Eigen::Vector3d::Zero()),
                     .source = {}});
    images.pictures.push_back({ray_picture(views.back(), color), {}});
  }
};

/// Fills `scene` with `count` views on a circle above the painted ground.
inline void add_ring(PaintedScene& scene, int count) {
  for (int i = 0; i < count; ++i) {
    const double angle = 2.0 * 3.14159265358979 * i / count;
    scene.add_view({0.8 * std::cos(angle), 0.8 * std::sin(angle), 2.0}, ground_color);
  }
}

}  // namespace trigmesh
