#include "sfm/coverage/face_coverage.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>

#include "sfm/coverage/mesh_visibility.hpp"

namespace trigmesh {
namespace {

constexpr double kMinViewCosine = 0.2;
constexpr int kLongestSidePx = 640;
// Views that are drawn before their looks are added up in order.
constexpr std::size_t kBatch = 8;

enum class Look : std::uint8_t { kOutside, kFramed, kSeen };

Look look_at(const FaceShape& face, const MeshVisibility& view) {
  if (!view.frames(face.middle)) {
    return Look::kOutside;
  }
  const Eigen::Vector3d to_camera = view.center_in_world() - face.middle;
  const bool faces_camera = face.normal.dot(to_camera) >= kMinViewCosine * to_camera.norm();
  return faces_camera && face.area > 0.0 && view.sees(face.middle) ? Look::kSeen : Look::kFramed;
}

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// Adds up the looks of views, one after the other.
class CoverageSum {
 public:
  explicit CoverageSum(const std::vector<FaceShape>& faces)
      : faces_(faces), coverage_(faces.size()), first_(faces.size()) {}

  void add(const std::vector<Look>& looks, const Eigen::Vector3d& camera) {
    for (std::size_t f = 0; f < looks.size(); ++f) {
      FaceCoverage& face = coverage_[f];
      face.framing_views += looks[f] == Look::kOutside ? 0U : 1U;
      if (looks[f] != Look::kSeen) {
        continue;
      }
      const Eigen::Vector3d ray = camera - faces_[f].middle;
      if (face.seeing_views == 0) {
        first_[f] = ray.cast<float>();
      }
      ++face.seeing_views;
      const auto parallax = static_cast<float>(angle_between(first_[f].cast<double>(), ray));
      face.parallax_rad = std::max(face.parallax_rad, parallax);
    }
  }

  [[nodiscard]] std::vector<FaceCoverage> take() { return std::move(coverage_); }

 private:
  const std::vector<FaceShape>& faces_;
  std::vector<FaceCoverage> coverage_;
  std::vector<Eigen::Vector3f> first_;
};

}  // namespace

FaceShape face_shape(const TriangleMesh& mesh, std::size_t face) {
  const auto& corners = mesh.faces[face];
  const Eigen::Vector3d a = mesh.positions[corners[0]].cast<double>();
  const Eigen::Vector3d b = mesh.positions[corners[1]].cast<double>();
  const Eigen::Vector3d c = mesh.positions[corners[2]].cast<double>();
  const Eigen::Vector3d doubled = (b - a).cross(c - a);
  const double length = doubled.norm();
  return {(a + b + c) / 3.0,
          length > 0.0 ? Eigen::Vector3d(doubled / length) : Eigen::Vector3d::Zero(),
          0.5 * length};
}

std::vector<FaceCoverage> measure_coverage(const TriangleMesh& mesh,
                                           std::span<const DenseView> views,
                                           Executor& executor) {
  std::vector<FaceShape> faces(mesh.faces.size());
  for (std::size_t f = 0; f < faces.size(); ++f) {
    faces[f] = face_shape(mesh, f);
  }
  CoverageSum sum(faces);
  std::array<std::vector<Look>, kBatch> looks;
  for (std::size_t first = 0; first < views.size(); first += kBatch) {
    const std::size_t count = std::min(kBatch, views.size() - first);
    executor.for_each_index(count, [&](std::size_t i) {
      const DenseView& view = views[first + i];
      const MeshVisibility visibility(mesh, view.camera, view.cam_from_world, kLongestSidePx);
      looks[i].resize(faces.size());
      std::transform(faces.begin(), faces.end(), looks[i].begin(), [&](const FaceShape& face) {
        return look_at(face, visibility);
      });
    });
    for (std::size_t i = 0; i < count; ++i) {
      sum.add(looks[i], camera_center(views[first + i].cam_from_world));
    }
  }
  return sum.take();
}

}  // namespace trigmesh
