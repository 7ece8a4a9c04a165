#include "sfm/dense/stereo_level.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>
#include <opencv2/imgproc.hpp>

#include "sfm/dense/plane_field.hpp"
#include "sfm/dense/undistortion.hpp"

namespace trigmesh {

namespace {

cv::Mat shrink(const cv::Mat& image, const Camera& camera, int interpolation) {
  if (image.empty() || (image.cols == camera.width_px && image.rows == camera.height_px)) {
    return image;
  }
  cv::Mat out;
  cv::resize(image, out, cv::Size(camera.width_px, camera.height_px), 0.0, 0.0, interpolation);
  return out;
}

Camera halved(const Camera& camera, int halvings) {
  const int divisor = 1 << halvings;
  return scaled_pinhole(camera,
                        std::max(1, (camera.width_px + divisor / 2) / divisor),
                        std::max(1, (camera.height_px + divisor / 2) / divisor));
}

cv::Mat pack_quads(const cv::Mat& grey) {
  cv::Mat quads(grey.rows, grey.cols, CV_32SC1);
  for (int y = 0; y < grey.rows; ++y) {
    const auto* top = grey.ptr<std::uint8_t>(y);
    const auto* bottom = grey.ptr<std::uint8_t>(std::min(y + 1, grey.rows - 1));
    auto* out = quads.ptr<std::int32_t>(y);
    for (int x = 0; x < grey.cols; ++x) {
      const int right = std::min(x + 1, grey.cols - 1);
      const std::uint32_t quad = std::uint32_t{top[x]} | std::uint32_t{top[right]} << 8U |
                                 std::uint32_t{bottom[x]} << 16U |
                                 std::uint32_t{bottom[right]} << 24U;
      out[x] = static_cast<std::int32_t>(quad);
    }
  }
  return quads;
}

/// The map's inverse depth at the size of its picture.
cv::Mat invert_depth(const DepthMap& map, const Camera& camera) {
  PlaneField field = field_from_depth_map(map);
  if (field.width_px != camera.width_px || field.height_px != camera.height_px) {
    field = resample_field(field, camera.width_px, camera.height_px);
  }
  cv::Mat out(camera.height_px, camera.width_px, CV_32FC1);
  std::transform(
      field.planes.begin(), field.planes.end(), out.ptr<float>(), [](const PlaneHypothesis& plane) {
        return plane.inverse_depth;
      });
  return out;
}

/// Inverse depth between four pixels: bilinear on one surface, of the nearest pixel at an edge.
float sample_inverse_depth(const cv::Mat& map, float x, float y) {
  const int x0 = std::min(static_cast<int>(x), map.cols - 2);
  const int y0 = std::min(static_cast<int>(y), map.rows - 2);
  const auto* top = map.ptr<float>(y0) + x0;
  const auto* bottom = map.ptr<float>(y0 + 1) + x0;
  const float fx = x - static_cast<float>(x0);
  const float fy = y - static_cast<float>(y0);
  const float low = std::min({top[0], top[1], bottom[0], bottom[1]});
  const float high = std::max({top[0], top[1], bottom[0], bottom[1]});
  constexpr float kOneSurfaceRatio = 0.97F;
  if (low < kOneSurfaceRatio * high) {
    return (fy < 0.5F ? top : bottom)[fx < 0.5F ? 0 : 1];
  }
  const float upper = top[0] + fx * (top[1] - top[0]);
  const float lower = bottom[0] + fx * (bottom[1] - bottom[0]);
  return upper + fy * (lower - upper);
}

StereoSource make_source(const StereoImage& reference,
                         const Camera& reference_camera,
                         const StereoImage& image,
                         int halvings) {
  const Camera camera = halved(image.camera, halvings);
  const Rigid3 source_from_reference = image.cam_from_world * reference.cam_from_world.inverse();
  const Eigen::Matrix3d rotation = source_from_reference.rotation.toRotationMatrix();
  const Eigen::Matrix3d k_source = camera.calibration_matrix();
  const Eigen::Matrix3d k_reference = reference_camera.calibration_matrix();
  StereoSource source;
  source.quads = pack_quads(shrink(image.grey, camera, cv::INTER_AREA));
  source.rotation = (k_source * rotation * k_reference.inverse()).cast<float>();
  source.epipole = (k_source * source_from_reference.translation).cast<float>();
  source.back_rotation = (k_reference * rotation.transpose() * k_source.inverse()).cast<float>();
  source.back_epipole = (k_reference * source_from_reference.inverse().translation).cast<float>();
  return source;
}

}  // namespace

SourceProjection StereoLevel::project(std::size_t s, float x, float y) const {
  const StereoSource& source = sources[s];
  SourceProjection out;
  out.quads = reinterpret_cast<const std::uint32_t*>(source.quads.data);
  out.stride = source.quads.cols;
  out.max_x_px = static_cast<float>(source.quads.cols - 1);
  out.max_y_px = static_cast<float>(source.quads.rows - 1);
  for (std::size_t k = 0; k < 3; ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    out.column_x[k] = source.rotation(row, 0);
    out.column_y[k] = source.rotation(row, 1);
    out.base[k] =
        source.rotation(row, 0) * x + source.rotation(row, 1) * y + source.rotation(row, 2);
    out.epipole[k] = source.epipole[row];
  }
  return out;
}

StereoLevel make_stereo_level(const StereoProblem& problem, int halvings) {
  StereoLevel level;
  level.camera = halved(problem.reference.camera, halvings);
  level.grey = shrink(problem.reference.grey, level.camera, cv::INTER_AREA);
  level.mask = shrink(problem.reference.mask, level.camera, cv::INTER_NEAREST);
  for (std::size_t s = 0; s < problem.sources.size(); ++s) {
    level.sources.push_back(
        make_source(problem.reference, level.camera, problem.sources[s], halvings));
    if (halvings == 0 && s < problem.source_maps.size() && !problem.source_maps[s].depth.empty()) {
      level.sources.back().inverse_depth =
          invert_depth(problem.source_maps[s], problem.sources[s].camera);
    }
  }
  return level;
}

std::optional<float> round_trip_error_px(const StereoSource& source, float x, float y, float q) {
  const Eigen::Vector3f there = source.rotation * Eigen::Vector3f(x, y, 1.0F) + source.epipole * q;
  const cv::Mat& map = source.inverse_depth;
  const float max_x = static_cast<float>(map.cols - 1);
  const float max_y = static_cast<float>(map.rows - 1);
  if (!(there.z() > 0.0F)) {
    return std::nullopt;
  }
  const float u = there.x() / there.z();
  const float v = there.y() / there.z();
  if (!(u >= 0.0F && v >= 0.0F && u <= max_x && v <= max_y)) {
    return std::nullopt;
  }
  const float there_q = sample_inverse_depth(map, u, v);
  if (!(there_q > 0.0F)) {
    return std::nullopt;
  }
  const Eigen::Vector3f back =
      source.back_rotation * Eigen::Vector3f(u, v, 1.0F) + source.back_epipole * there_q;
  if (!(back.z() > 0.0F)) {
    return std::nullopt;
  }
  const float dx = back.x() / back.z() - x;
  const float dy = back.y() / back.z() - y;
  return std::sqrt(dx * dx + dy * dy);
}

}  // namespace trigmesh
