#include "firmware/pipeline/matchable_image.hpp"

#include <limits>
#include <utility>
#include <vector>

#include "firmware/base/check.hpp"

namespace trigmesh {

namespace {

/// Pixels as a lens without distortion would give them; a keypoint without a ray becomes
/// not-a-number, which no match survives.
std::vector<Eigen::Vector2d> undistort(const Camera& camera,
                                       const std::vector<Keypoint>& keypoints) {
  Camera ideal = camera;
  ideal.model = CameraModel::kPinhole;
  std::vector<Eigen::Vector2d> result;
  result.reserve(keypoints.size());
  for (const Keypoint& keypoint : keypoints) {
    const Eigen::Vector2d pixel(static_cast<double>(keypoint.x_px),
                                static_cast<double>(keypoint.y_px));
    const auto ray = normalize_pixel(camera, pixel);
    const auto straight = ray ? project(ideal, ray->homogeneous()) : std::nullopt;
    result.push_back(
        straight.value_or(Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN())));
  }
  return result;
}

}  // namespace

Result<MatchableImage> matchable_image(const ImageFeatures& image, const CameraGroup& group) {
  TM_ASSIGN_OR_RETURN(DescriptorIndex index, DescriptorIndex::build(image.features));
  MatchableImage result{std::move(index),
                        undistort(group.camera, image.features.keypoints),
                        image.width_px,
                        image.height_px,
                        std::nullopt};
  if (group.knowledge != IntrinsicsKnowledge::kUnknown) {
    result.calibration = group.camera.calibration_matrix();
  }
  return result;
}

}  // namespace trigmesh
