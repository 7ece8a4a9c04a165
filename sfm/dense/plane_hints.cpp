#include "sfm/dense/plane_hints.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <Eigen/Core>

#include "sfm/dense/plane_field.hpp"

namespace trigmesh {

namespace {

constexpr std::size_t kLayers = 2;
/// Two surfaces of one pixel are the same within this difference of depth.
constexpr float kSameDepthRatio = 0.02F;

struct HintLayers {
  std::vector<std::vector<PlaneHypothesis>> planes;
  std::vector<std::vector<std::uint8_t>> confidence;

  void offer(std::size_t pixel, PlaneHypothesis plane, std::uint8_t trust) {
    for (std::size_t layer = 0; layer < kLayers; ++layer) {
      PlaneHypothesis& held = planes[layer][pixel];
      std::uint8_t& held_trust = confidence[layer][pixel];
      const bool same = std::abs(held.inverse_depth - plane.inverse_depth) <
                        kSameDepthRatio * plane.inverse_depth;
      if (trust > held_trust) {
        std::swap(held, plane);
        std::swap(held_trust, trust);
      }
      if (same) {
        return;
      }
    }
  }
};

void project_map(const StereoProblem& problem, std::size_t s, HintLayers& layers) {
  const DepthMap& map = problem.source_maps[s];
  const Camera& camera = problem.reference.camera;
  const Rigid3 motion =
      problem.reference.cam_from_world * problem.sources[s].cam_from_world.inverse();
  const Eigen::Matrix3f rotation = motion.rotation.toRotationMatrix().cast<float>();
  const Eigen::Vector3f translation = motion.translation.cast<float>();
  const Eigen::Matrix3f k = camera.calibration_matrix().cast<float>();
  const auto fx = static_cast<float>(map.camera.fx_px);
  const auto fy = static_cast<float>(map.camera.fy_px);
  const auto cx = static_cast<float>(map.camera.cx_px);
  const auto cy = static_cast<float>(map.camera.cy_px);
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      const float z = map.depth.at<float>(y, x);
      if (!(z > 0.0F)) {
        continue;
      }
      const Eigen::Vector3f there(
          (static_cast<float>(x) - cx) / fx * z, (static_cast<float>(y) - cy) / fy * z, z);
      const Eigen::Vector3f here = rotation * there + translation;
      if (!(here.z() > 0.0F)) {
        continue;
      }
      const Eigen::Vector3f image = k * here / here.z();
      const float column = std::round(image.x());
      const float row = std::round(image.y());
      if (!(column >= 0.0F && row >= 0.0F && column < static_cast<float>(camera.width_px) &&
            row < static_cast<float>(camera.height_px))) {
        continue;
      }
      const auto& n = map.normal.at<cv::Vec3f>(y, x);
      const Eigen::Vector3f normal = rotation * Eigen::Vector3f(n[0], n[1], n[2]);
      if (!(normal.dot(here) < 0.0F)) {
        continue;  // the back of a surface
      }
      PlaneHypothesis plane = plane_from_normal(camera, image.head<2>(), 1.0F / here.z(), normal);
      plane.inverse_depth +=
          plane.slope_x * (column - image.x()) + plane.slope_y * (row - image.y());
      const std::size_t pixel =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(camera.width_px) +
          static_cast<std::size_t>(column);
      layers.offer(pixel, plane, map.confidence.at<std::uint8_t>(y, x));
    }
  }
}

}  // namespace

std::vector<std::vector<PlaneHypothesis>> plane_hints(const StereoProblem& problem) {
  const std::size_t pixels = static_cast<std::size_t>(problem.reference.camera.width_px) *
                             static_cast<std::size_t>(problem.reference.camera.height_px);
  HintLayers layers;
  layers.planes.assign(kLayers, std::vector<PlaneHypothesis>(pixels));
  layers.confidence.assign(kLayers, std::vector<std::uint8_t>(pixels, 0));
  for (std::size_t s = 0; s < problem.source_maps.size(); ++s) {
    if (!problem.source_maps[s].depth.empty()) {
      project_map(problem, s, layers);
    }
  }
  return std::move(layers.planes);
}

}  // namespace trigmesh
