// Consistency of depth maps, in the spirit of P. Merrell et al., "Real-time visibility-based fusion
// of depth maps", ICCV 2007 (support and free-space violations), with the round-trip error of
// J. Schoenberger et al., "Pixelwise view selection for unstructured multi-view stereo", ECCV 2016.
#include "sfm/dense/depth_filter.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "firmware/base/check.hpp"

namespace trigmesh {

namespace {

bool well_formed(const DepthMap& map) {
  return map.depth.type() == CV_32FC1 && map.normal.type() == CV_32FC3 &&
         map.confidence.type() == CV_8UC1 && map.normal.size() == map.depth.size() &&
         map.confidence.size() == map.depth.size() && map.camera.width_px == map.depth.cols &&
         map.camera.height_px == map.depth.rows;
}

void forget(DepthMap& map, int x, int y) {
  map.depth.at<float>(y, x) = 0.0F;
  map.normal.at<cv::Vec3f>(y, x) = cv::Vec3f(0.0F, 0.0F, 0.0F);
  map.confidence.at<std::uint8_t>(y, x) = 0;
}

/// Confidence of a match confirmed by `agreeing` views: each halves what is left of the doubt.
std::uint8_t final_confidence(std::uint8_t match, std::size_t agreeing) {
  const float doubt = std::pow(0.6F, static_cast<float>(agreeing));
  return static_cast<std::uint8_t>(
      std::clamp(static_cast<float>(match) * (1.0F - doubt), 1.0F, 255.0F));
}

struct FilterTask {
  const PosedDepthMap& view;
  const std::vector<MapComparison>& comparisons;
  const DepthFilterOptions& options;
  std::size_t needed = 0;
};

void judge_pixel(const FilterTask& task, int x, int y, DepthMap& out) {
  const float depth = task.view.map.depth.at<float>(y, x);
  const std::uint8_t match = task.view.map.confidence.at<std::uint8_t>(y, x);
  std::size_t agreeing = 0;
  std::size_t conflicting = 0;
  double sum = static_cast<double>(depth);
  if (depth > 0.0F && match >= task.options.min_confidence) {
    for (const MapComparison& comparison : task.comparisons) {
      const MapOpinion opinion = comparison.ask(x, y);
      agreeing += opinion.verdict == MapVerdict::kAgrees ? 1 : 0;
      conflicting += opinion.verdict == MapVerdict::kConflicts ? 1 : 0;
      sum += opinion.verdict == MapVerdict::kAgrees
                 ? static_cast<double>(opinion.depth_in_reference)
                 : 0.0;
    }
  }
  const float allowed = task.options.max_conflict_ratio * static_cast<float>(agreeing);
  if (agreeing < task.needed || static_cast<float>(conflicting) > allowed) {
    forget(out, x, y);
    return;
  }
  out.depth.at<float>(y, x) = static_cast<float>(sum / static_cast<double>(agreeing + 1));
  out.confidence.at<std::uint8_t>(y, x) = final_confidence(match, agreeing);
}

/// Drops connected pieces (4 neighbours, depth steps below twice the tolerance) that are small.
void drop_small_segments(const DepthFilterOptions& options, DepthMap& map) {
  const int width = map.depth.cols;
  const int height = map.depth.rows;
  const float max_step = 2.0F * options.agreement.max_depth_ratio;
  cv::Mat visited(height, width, CV_8UC1, cv::Scalar(0));
  std::vector<cv::Point> segment;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (visited.at<std::uint8_t>(y, x) != 0 || !(map.depth.at<float>(y, x) > 0.0F)) {
        continue;
      }
      segment.assign(1, cv::Point(x, y));
      visited.at<std::uint8_t>(y, x) = 1;
      for (std::size_t i = 0; i < segment.size(); ++i) {
        const cv::Point at = segment[i];
        const float depth = map.depth.at<float>(at);
        for (const cv::Point step :
             {cv::Point(1, 0), cv::Point(-1, 0), cv::Point(0, 1), cv::Point(0, -1)}) {
          const cv::Point next = at + step;
          if (next.x < 0 || next.y < 0 || next.x >= width || next.y >= height ||
              visited.at<std::uint8_t>(next) != 0) {
            continue;
          }
          const float other = map.depth.at<float>(next);
          if (other > 0.0F && std::abs(other - depth) <= max_step * depth) {
            visited.at<std::uint8_t>(next) = 1;
            segment.push_back(next);
          }
        }
      }
      if (std::ssize(segment) < options.min_segment_px) {
        for (const cv::Point& at : segment) {
          forget(map, at.x, at.y);
        }
      }
    }
  }
}

}  // namespace

Result<> DepthFilterOptions::validate() const {
  TM_RETURN_IF_ERROR(agreement.validate());
  if (min_agreeing_views < 1 || min_agreeing_views > 16) {
    return fail(ErrorCode::kInvalidArgument,
                "min_agreeing_views is {}, not in [1, 16]",
                min_agreeing_views);
  }
  if (min_confidence < 1 || min_confidence > 255) {
    return fail(
        ErrorCode::kInvalidArgument, "min_confidence is {}, not in [1, 255]", min_confidence);
  }
  if (!(max_conflict_ratio >= 0.0F && max_conflict_ratio <= 10.0F)) {
    return fail(ErrorCode::kInvalidArgument,
                "max_conflict_ratio is {}, not in [0, 10]",
                max_conflict_ratio);
  }
  if (min_segment_px < 0) {
    return fail(ErrorCode::kInvalidArgument, "min_segment_px is {}, not >= 0", min_segment_px);
  }
  return {};
}

Result<DepthMap> filter_depth_map(const PosedDepthMap& view,
                                  const cv::Mat& mask,
                                  std::span<const PosedDepthMap> neighbors,
                                  const DepthFilterOptions& options,
                                  Executor& executor) {
  TM_RETURN_IF_ERROR(options.validate());
  if (!well_formed(view.map) ||
      (!mask.empty() && (mask.type() != CV_8UC1 || mask.size() != view.map.depth.size()))) {
    return fail(ErrorCode::kInvalidArgument, "depth map, camera and mask differ in size or type");
  }
  std::vector<MapComparison> comparisons;
  for (const PosedDepthMap& neighbor : neighbors) {
    if (neighbor.map.depth.empty()) {
      continue;
    }
    if (!well_formed(neighbor.map)) {
      return fail(ErrorCode::kInvalidArgument,
                  "depth map and camera of a neighbour differ in size or type");
    }
    comparisons.emplace_back(view, neighbor, options.agreement);
  }
  DepthMap out{.camera = view.map.camera,
               .depth = view.map.depth.clone(),
               .normal = view.map.normal.clone(),
               .confidence = view.map.confidence.clone()};
  const FilterTask task{
      view,
      comparisons,
      options,
      std::max<std::size_t>(1, std::min(options.min_agreeing_views, comparisons.size()))};
  executor.for_each_index(static_cast<std::size_t>(out.depth.rows), [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < out.depth.cols; ++x) {
      if (!mask.empty() && mask.at<std::uint8_t>(y, x) == 0) {
        forget(out, x, y);
      } else {
        judge_pixel(task, x, y, out);
      }
    }
  });
  drop_small_segments(options, out);
  return out;
}

}  // namespace trigmesh
