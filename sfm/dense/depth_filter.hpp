#pragma once

#include <cstddef>
#include <span>

#include <opencv2/core/mat.hpp>

#include "firmware/base/executor.hpp"
#include "firmware/base/result.hpp"
#include "sfm/dense/depth_map.hpp"
#include "sfm/dense/map_agreement.hpp"

namespace trigmesh {

/// What a pixel needs to stay in a depth map.
struct DepthFilterOptions {
  AgreementOptions agreement;
  /// Other views that must agree, [1, 16]. Fewer are asked for where fewer neighbours are given.
  std::size_t min_agreeing_views = 2;
  /// Photometric confidence below which a pixel is dropped unseen, [1, 255].
  int min_confidence = 100;
  /// Views that look through the point for each that agrees, at most, [0, 10].
  float max_conflict_ratio = 1.0F;
  /// Pieces of surface smaller than this are dropped, pixels, >= 0.
  int min_segment_px = 20;

  /// Names the field, its value and the violated rule.
  [[nodiscard]] Result<> validate() const;
};

/// The pixels of a map that its neighbours confirm and its mask (CV_8UC1 of the size of the map, or
/// empty) leaves in, with the mean depth of those that agree and the final confidence: 255 is a
/// perfect match confirmed by many. What disagrees with all other views, as something that moved
/// does, is gone. Neighbours with empty maps are passed over; they are unfiltered maps of the last
/// round. kInvalidArgument: options, sizes.
[[nodiscard]] Result<DepthMap> filter_depth_map(const PosedDepthMap& view,
                                                const cv::Mat& mask,
                                                std::span<const PosedDepthMap> neighbors,
                                                const DepthFilterOptions& options,
                                                Executor& executor);

}  // namespace trigmesh
