#include "firmware/pipeline/depth_map_store.hpp"

#include <cstring>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "firmware/base/binary_stream.hpp"
#include "firmware/base/check.hpp"

namespace trigmesh {

namespace {

constexpr int kMaxSidePx = 65536;

template <typename T>
std::vector<T> pixels_of(const cv::Mat& image) {
  const cv::Mat whole = image.isContinuous() ? image : image.clone();
  std::vector<T> pixels(whole.total() * static_cast<std::size_t>(whole.channels()));
  if (!pixels.empty()) {
    std::memcpy(pixels.data(), whole.data, pixels.size() * sizeof(T));
  }
  return pixels;
}

/// An image from its pixels; empty when their number is not that of the size.
template <typename T>
cv::Mat image_from(const std::vector<T>& pixels, int width_px, int height_px, int type) {
  cv::Mat image(height_px, width_px, type);
  const std::size_t count = image.total() * static_cast<std::size_t>(image.channels());
  if (count == 0 || pixels.size() != count) {
    return {};
  }
  std::memcpy(image.data, pixels.data(), count * sizeof(T));
  return image;
}

}  // namespace

std::vector<std::uint8_t> encode_depth_map(const DepthMap& map) {
  BinaryWriter out;
  out.value(map.camera.width_px);
  out.value(map.camera.height_px);
  for (const double value :
       {map.camera.fx_px, map.camera.fy_px, map.camera.cx_px, map.camera.cy_px}) {
    out.value(value);
  }
  out.items(pixels_of<float>(map.depth));
  out.items(pixels_of<float>(map.normal));
  out.items(pixels_of<std::uint8_t>(map.confidence));
  return out.take();
}

Result<DepthMap> decode_depth_map(std::span<const std::uint8_t> bytes) {
  BinaryReader in(bytes);
  DepthMap map;
  map.camera.width_px = in.value<int>();
  map.camera.height_px = in.value<int>();
  map.camera.fx_px = in.value<double>();
  map.camera.fy_px = in.value<double>();
  map.camera.cx_px = in.value<double>();
  map.camera.cy_px = in.value<double>();
  const auto depth = in.items<float>();
  const auto normal = in.items<float>();
  const auto confidence = in.items<std::uint8_t>();
  const int width = map.camera.width_px;
  const int height = map.camera.height_px;
  if (!in.complete() || width < 0 || height < 0 || width > kMaxSidePx || height > kMaxSidePx) {
    return fail(ErrorCode::kCorruptData, "cannot read a stored depth map: the record is damaged");
  }
  if (depth.empty() && normal.empty() && confidence.empty()) {
    return map;
  }
  // Sizes are compared before memory is taken.
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (depth.size() != pixels || normal.size() != 3 * pixels || confidence.size() != pixels) {
    return fail(ErrorCode::kCorruptData,
                "cannot read a stored depth map: the record contradicts itself");
  }
  map.depth = image_from(depth, width, height, CV_32FC1);
  map.normal = image_from(normal, width, height, CV_32FC3);
  map.confidence = image_from(confidence, width, height, CV_8UC1);
  return map;
}

std::string DepthMapStore::name_of(std::size_t view) const {
  return fmt::format("{}-{:06}", round_, view);
}

Result<> DepthMapStore::save(std::size_t view, const DepthMap& map) const {
  return folder_->save(name_of(view), keys_[view], encode_depth_map(map));
}

bool DepthMapStore::has(std::size_t view) const {
  const auto bytes = folder_->load(name_of(view), keys_[view]);
  return bytes && decode_depth_map(*bytes);
}

Result<DepthMap> DepthMapStore::load(std::size_t view) const {
  TM_CHECK(view < keys_.size());
  const auto bytes = folder_->load(name_of(view), keys_[view]);
  if (!bytes) {
    return fail(ErrorCode::kCorruptData,
                "the depth map {} is gone from the work folder; run the command again",
                name_of(view));
  }
  return decode_depth_map(*bytes);
}

}  // namespace trigmesh
