#include "tests/unit/sfm/dense/rendered_scene.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <Eigen/Geometry>

namespace trigmesh::test {

namespace {

double lattice(std::int64_t x, std::int64_t y, std::int64_t z) {
  auto h = static_cast<std::uint64_t>(x * 73856093 ^ y * 19349663 ^ z * 83492791);
  h = (h ^ (h >> 31U)) * 0x9E3779B97F4A7C15ULL;
  h = (h ^ (h >> 29U)) * 0xBF58476D1CE4E5B9ULL;
  return static_cast<double>((h >> 40U) & 0xFFFFU) / 65535.0;
}

/// Trilinear noise on a unit lattice, [0, 1].
double noise(const Eigen::Vector3d& p) {
  const Eigen::Vector3d base = p.array().floor();
  const Eigen::Vector3d f = p - base;
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const int dx = corner & 1;
    const int dy = (corner >> 1) & 1;
    const int dz = (corner >> 2) & 1;
    const double weight = (dx == 1 ? f.x() : 1.0 - f.x()) * (dy == 1 ? f.y() : 1.0 - f.y()) *
                          (dz == 1 ? f.z() : 1.0 - f.z());
    sum += weight * lattice(static_cast<std::int64_t>(base.x()) + dx,
                            static_cast<std::int64_t>(base.y()) + dy,
                            static_cast<std::int64_t>(base.z()) + dz);
  }
  return sum;
}

double texture(const Eigen::Vector3d& p) {
  return 40.0 + 100.0 * noise(p * 6.0) + 75.0 * noise(p * 14.0 + Eigen::Vector3d(7.3, 1.7, 4.1));
}

std::optional<Hit> first_hit(const std::vector<Surface>& surfaces,
                             const Eigen::Vector3d& origin,
                             const Eigen::Vector3d& direction) {
  std::optional<Hit> first;
  for (const Surface& surface : surfaces) {
    const std::optional<Hit> hit = surface(origin, direction);
    if (hit && (!first || hit->distance < first->distance)) {
      first = hit;
    }
  }
  return first;
}

}  // namespace

Surface plane(const Eigen::Vector3d& normal,
              double offset,
              const Eigen::Vector3d& center,
              double radius) {
  return
      [=](const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) -> std::optional<Hit> {
        const double t = (offset - normal.dot(origin)) / normal.dot(direction);
        if (!(t > 0.0) || (origin + t * direction - center).norm() > radius) {
          return std::nullopt;
        }
        return Hit{t, normal.dot(direction) < 0.0 ? normal.normalized() : -normal.normalized()};
      };
}

Surface sphere(const Eigen::Vector3d& center, double radius) {
  return
      [=](const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) -> std::optional<Hit> {
        const Eigen::Vector3d offset = origin - center;
        const double a = direction.squaredNorm();
        const double b = offset.dot(direction);
        const double root = b * b - a * (offset.squaredNorm() - radius * radius);
        if (root < 0.0 || -b - std::sqrt(root) <= 0.0) {
          return std::nullopt;
        }
        const double t = (-b - std::sqrt(root)) / a;
        return Hit{t, (offset + t * direction).normalized()};
      };
}

Camera small_camera() {
  return {.model = CameraModel::kPinhole,
          .width_px = 96,
          .height_px = 72,
          .fx_px = 100.0,
          .fy_px = 101.0,
          .cx_px = 47.0,
          .cy_px = 36.5,
          .distortion = {}};
}

Rigid3 look_at(const Eigen::Vector3d& center, const Eigen::Vector3d& target) {
  const Eigen::Vector3d z = (target - center).normalized();
  const Eigen::Vector3d x = Eigen::Vector3d::UnitY().cross(z).normalized();
  Eigen::Matrix3d rows;
  rows << x.transpose(), z.cross(x).transpose(), z.transpose();
  Rigid3 pose;
  pose.rotation = Eigen::Quaterniond(rows);
  pose.translation = -(rows * center);
  return pose;
}

RenderedView render(const std::vector<Surface>& surfaces,
                    const Camera& camera,
                    const Rigid3& cam_from_world) {
  RenderedView view;
  view.image = {.grey = cv::Mat(camera.height_px, camera.width_px, CV_8UC1, cv::Scalar(0)),
                .mask = {},
                .camera = camera,
                .cam_from_world = cam_from_world};
  view.truth = {.camera = camera,
                .depth = cv::Mat(camera.height_px, camera.width_px, CV_32FC1, cv::Scalar(0)),
                .normal = cv::Mat(camera.height_px, camera.width_px, CV_32FC3, cv::Scalar(0, 0, 0)),
                .confidence = cv::Mat(camera.height_px, camera.width_px, CV_8UC1, cv::Scalar(0))};
  const Rigid3 world_from_cam = cam_from_world.inverse();
  const auto cast = [&](double x, double y) {
    const Eigen::Vector3d ray(
        (x - camera.cx_px) / camera.fx_px, (y - camera.cy_px) / camera.fy_px, 1.0);
    return Eigen::Vector3d(world_from_cam.rotation * ray);
  };
  for (int y = 0; y < camera.height_px; ++y) {
    for (int x = 0; x < camera.width_px; ++x) {
      if (const auto hit = first_hit(surfaces, world_from_cam.translation, cast(x, y))) {
        const Eigen::Vector3d n = cam_from_world.rotation * hit->normal_in_world;
        view.truth.depth.at<float>(y, x) = static_cast<float>(hit->distance);
        view.truth.normal.at<cv::Vec3f>(y, x) = cv::Vec3f(
            static_cast<float>(n.x()), static_cast<float>(n.y()), static_cast<float>(n.z()));
        view.truth.confidence.at<std::uint8_t>(y, x) = 255;
      }
      double grey = 0.0;
      for (const double dy : {-0.25, 0.25}) {
        for (const double dx : {-0.25, 0.25}) {
          const Eigen::Vector3d direction = cast(x + dx, y + dy);
          const auto hit = first_hit(surfaces, world_from_cam.translation, direction);
          grey += hit ? texture(world_from_cam.translation + hit->distance * direction) : 0.0;
        }
      }
      view.image.grey.at<std::uint8_t>(y, x) =
          static_cast<std::uint8_t>(std::clamp(grey / 4.0, 0.0, 255.0));
    }
  }
  return view;
}

double correct_share(const DepthMap& map, const DepthMap& truth, double ratio, int border_px) {
  int correct = 0;
  int all = 0;
  for (int y = border_px; y < truth.depth.rows - border_px; ++y) {
    for (int x = border_px; x < truth.depth.cols - border_px; ++x) {
      const double expected = static_cast<double>(truth.depth.at<float>(y, x));
      if (expected > 0.0) {
        const double error = std::abs(static_cast<double>(map.depth.at<float>(y, x)) - expected);
        correct += error <= ratio * expected ? 1 : 0;
        ++all;
      }
    }
  }
  return all > 0 ? static_cast<double>(correct) / all : 0.0;
}

}  // namespace trigmesh::test
