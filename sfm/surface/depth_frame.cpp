#include "sfm/surface/depth_frame.hpp"

#include <algorithm>
#include <cmath>

#include "firmware/base/check.hpp"

namespace trigmesh {

namespace {

// A step in depth of more than this many footprints between neighbours is a silhouette, where
// matching windows smear the nearer surface over the farther one.
constexpr float kJumpFootprints = 8.0F;
constexpr float kSilhouetteWeight = 0.3F;
// Steeper views than this (cosine) say nothing reliable.
constexpr float kMinCosine = 0.05F;
constexpr float kMaxScaleWeight = 4.0F;

Result<> check_map(const DepthMap& map) {
  TM_RETURN_IF_ERROR(map.camera.validate());
  const cv::Size size(map.camera.width_px, map.camera.height_px);
  if (map.camera.model != CameraModel::kPinhole) {
    return fail(ErrorCode::kInvalidArgument, "cannot use a depth map: its camera has distortion");
  }
  if (map.depth.size() != size || map.normal.size() != size || map.confidence.size() != size ||
      map.depth.type() != CV_32FC1 || map.normal.type() != CV_32FC3 ||
      map.confidence.type() != CV_8UC1) {
    return fail(ErrorCode::kInvalidArgument,
                "cannot use a depth map: depth, normal and confidence must be {}x{} float, 3 float "
                "and byte",
                size.width,
                size.height);
  }
  return {};
}

/// Nearest and farthest known depth of the 3x3 pixels around.
struct DepthRange {
  float nearest;
  float farthest;
};

DepthRange range_around(const cv::Mat& depth, int x, int y) {
  const float center = depth.at<float>(y, x);
  DepthRange range{center, center};
  for (int v = std::max(y - 1, 0); v <= std::min(y + 1, depth.rows - 1); ++v) {
    const float* row = depth.ptr<float>(v);
    for (int u = std::max(x - 1, 0); u <= std::min(x + 1, depth.cols - 1); ++u) {
      if (row[u] > 0.0F) {
        range.nearest = std::min(range.nearest, row[u]);
        range.farthest = std::max(range.farthest, row[u]);
      }
    }
  }
  return range;
}

PixelPlane make_plane(const DepthMap& map, int x, int y, const DepthFrameOptions& options) {
  const auto fx = static_cast<float>(map.camera.fx_px);
  const auto fy = static_cast<float>(map.camera.fy_px);
  const float depth = map.depth.at<float>(y, x);
  const float footprint = depth / std::max(fx, fy);
  const cv::Vec3f& n = map.normal.at<cv::Vec3f>(y, x);
  const Eigen::Vector3f normal(n[0], n[1], n[2]);
  const Eigen::Vector3f ray((static_cast<float>(x) - static_cast<float>(map.camera.cx_px)) / fx,
                            (static_cast<float>(y) - static_cast<float>(map.camera.cy_px)) / fy,
                            1.0F);
  const float cosine = -normal.dot(ray) / ray.norm();
  const bool usable = depth > 0.0F && std::isfinite(depth) && cosine >= kMinCosine &&
                      footprint <= options.max_footprint_voxels * options.voxel_size;
  if (!usable) {
    return {};
  }
  const DepthRange range = range_around(map.depth, x, y);
  const bool silhouette =
      range.farthest - range.nearest > kJumpFootprints * footprint / std::max(cosine, 0.25F);
  const float scale = options.voxel_size / footprint;
  PixelPlane plane;
  plane.normal = normal;
  plane.offset = normal.dot(ray) * depth;
  plane.depth = depth;
  plane.weight = static_cast<float>(map.confidence.at<std::uint8_t>(y, x)) / 255.0F * cosine *
                 std::min(scale * scale, kMaxScaleWeight) * (silhouette ? kSilhouetteWeight : 1.0F);
  plane.free_depth = range.nearest;
  return plane;
}

}  // namespace

const PixelPlane* DepthFrame::find_plane(const Eigen::Vector3f& point_in_cam) const {
  if (planes.empty() || !(point_in_cam.z() > 0.0F)) {
    return nullptr;
  }
  const float u = fx_px * point_in_cam.x() / point_in_cam.z() + cx_px + 0.5F;
  const float v = fy_px * point_in_cam.y() / point_in_cam.z() + cy_px + 0.5F;
  if (!(u >= 0.0F && v >= 0.0F && u < static_cast<float>(width_px) &&
        v < static_cast<float>(height_px))) {
    return nullptr;
  }
  const auto pixel =
      static_cast<std::size_t>(static_cast<int>(v)) * static_cast<std::size_t>(width_px) +
      static_cast<std::size_t>(static_cast<int>(u));
  const PixelPlane& plane = planes[pixel];
  return plane.depth > 0.0F ? &plane : nullptr;
}

Result<DepthFrame> make_depth_frame(const DepthMap& map,
                                    const Rigid3& cam_from_world,
                                    const DepthFrameOptions& options) {
  DepthFrame frame;
  if (map.depth.empty()) {
    return frame;
  }
  TM_RETURN_IF_ERROR(check_map(map));
  frame.rotation_cam_from_world = cam_from_world.rotation.toRotationMatrix().cast<float>();
  frame.translation_cam_from_world = cam_from_world.translation.cast<float>();
  frame.fx_px = static_cast<float>(map.camera.fx_px);
  frame.fy_px = static_cast<float>(map.camera.fy_px);
  frame.cx_px = static_cast<float>(map.camera.cx_px);
  frame.cy_px = static_cast<float>(map.camera.cy_px);
  frame.width_px = map.camera.width_px;
  frame.height_px = map.camera.height_px;
  frame.planes.reserve(static_cast<std::size_t>(frame.width_px) *
                       static_cast<std::size_t>(frame.height_px));
  for (int y = 0; y < frame.height_px; ++y) {
    for (int x = 0; x < frame.width_px; ++x) {
      frame.planes.push_back(make_plane(map, x, y, options));
    }
  }
  return frame;
}

}  // namespace trigmesh
