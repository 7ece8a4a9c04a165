#include "sfm/surface/vertex_votes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "firmware/base/check.hpp"

namespace trigmesh {

namespace {

constexpr std::size_t kChunk = 8192;
// A view that sees a vertex from steeper than this (cosine) neither supports nor colours it.
constexpr float kMinCosine = 0.1F;
constexpr std::uint8_t kUnknownColor = 128;

/// Bilinear; nothing (weight 0) outside the picture and where the mask is 0.
Eigen::Vector4f sample(const ViewImage& image, float x, float y) {
  const auto left = static_cast<int>(std::floor(x));
  const auto top = static_cast<int>(std::floor(y));
  const int nearest_x = static_cast<int>(std::lround(x));
  const int nearest_y = static_cast<int>(std::lround(y));
  if (nearest_x < 0 || nearest_y < 0 || nearest_x >= image.rgb.cols ||
      nearest_y >= image.rgb.rows ||
      (!image.mask.empty() && image.mask.at<std::uint8_t>(nearest_y, nearest_x) == 0)) {
    return Eigen::Vector4f::Zero();
  }
  const float fx = x - static_cast<float>(left);
  const float fy = y - static_cast<float>(top);
  Eigen::Vector4f sum = Eigen::Vector4f::Zero();
  for (int k = 0; k < 4; ++k) {
    const int u = std::clamp(left + (k & 1), 0, image.rgb.cols - 1);
    const int v = std::clamp(top + (k >> 1), 0, image.rgb.rows - 1);
    const float weight = ((k & 1) != 0 ? fx : 1.0F - fx) * ((k >> 1) != 0 ? fy : 1.0F - fy);
    const cv::Vec3b& rgb = image.rgb.at<cv::Vec3b>(v, u);
    sum += weight * Eigen::Vector4f(rgb[0], rgb[1], rgb[2], 1.0F);
  }
  return sum;
}

}  // namespace

VertexVotes::VertexVotes(std::size_t vertex_count)
    : support_(vertex_count), color_sums_(vertex_count, Eigen::Vector4f::Zero()) {}

void VertexVotes::add_view(const DepthFrame& frame,
                           const ViewImage& image,
                           const TriangleMesh& mesh,
                           float tolerance,
                           Executor& executor) {
  TM_CHECK(mesh.positions.size() == support_.size() && mesh.normals.size() == support_.size());
  const float scale_x =
      static_cast<float>(image.rgb.cols) / static_cast<float>(std::max(frame.width_px, 1));
  const float scale_y =
      static_cast<float>(image.rgb.rows) / static_cast<float>(std::max(frame.height_px, 1));
  const auto vote = [&](std::size_t i) {
    const Eigen::Vector3f point = frame.to_camera(mesh.positions[i]);
    const PixelPlane* plane = frame.find_plane(point);
    if (plane == nullptr || std::abs(plane->normal.dot(point) - plane->offset) > tolerance ||
        std::abs(point.z() - plane->depth) > 4.0F * tolerance) {
      return;
    }
    const float cosine =
        -(frame.rotation_cam_from_world * mesh.normals[i]).dot(point) / point.norm();
    if (cosine < kMinCosine) {
      return;
    }
    if (support_[i] < std::numeric_limits<std::uint16_t>::max()) {
      ++support_[i];
    }
    if (!image.rgb.empty()) {
      const float u = frame.fx_px * point.x() / point.z() + frame.cx_px;
      const float v = frame.fy_px * point.y() / point.z() + frame.cy_px;
      color_sums_[i] += plane->weight * cosine *
                        sample(image, (u + 0.5F) * scale_x - 0.5F, (v + 0.5F) * scale_y - 0.5F);
    }
  };
  const std::size_t chunks = (support_.size() + kChunk - 1) / kChunk;
  executor.for_each_index(chunks, [&](std::size_t chunk) {
    const std::size_t end = std::min((chunk + 1) * kChunk, support_.size());
    for (std::size_t i = chunk * kChunk; i < end; ++i) {
      vote(i);
    }
  });
}

std::vector<std::array<std::uint8_t, 3>> VertexVotes::colors() const {
  std::vector<std::array<std::uint8_t, 3>> colors(color_sums_.size(),
                                                  {kUnknownColor, kUnknownColor, kUnknownColor});
  for (std::size_t i = 0; i < colors.size(); ++i) {
    const Eigen::Vector4f& sum = color_sums_[i];
    for (Eigen::Index c = 0; c < 3 && sum[3] > 0.0F; ++c) {
      colors[i][static_cast<std::size_t>(c)] =
          static_cast<std::uint8_t>(std::clamp(sum[c] / sum[3] + 0.5F, 0.0F, 255.0F));
    }
  }
  return colors;
}

}  // namespace trigmesh
