#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "firmware/base/executor.hpp"
#include "firmware/base/result.hpp"
#include "sfm/moving/contradicting_features.hpp"
#include "sfm/moving/hidden_background.hpp"
#include "sfm/moving/moving_view.hpp"

namespace trigmesh {

/// How regions are drawn around the evidence.
struct RegionOptions {
  /// Views that must contradict a keypoint before it counts, >= 1.
  std::size_t min_contradicting_views = 1;
  /// Smallest region, part of the picture, (0, 1).
  double min_area_ratio = 0.002;
  /// Such keypoints that a region must hold, >= 1, unless `min_hidden_ratio` of the picture in it
  /// hides the background, (0, 1).
  std::size_t min_keypoints = 12;
  double min_hidden_ratio = 0.002;
  /// Part of a region that must be evidence of one kind or the other, [0, 1].
  double min_evidence_ratio = 0.04;

  /// Names the field, its value and the violated rule.
  [[nodiscard]] Result<> validate() const;
};

struct MovingOptions {
  ContradictionOptions features;
  HiddenBackgroundOptions background;
  RegionOptions regions;

  [[nodiscard]] Result<> validate() const;
};

/// The regions of each view that show something which moved while the views were taken: CV_8UC1 of
/// the view's size, 255 = it moved; an empty Mat where there is nothing of the kind. A thing that
/// has texture is found by the matches of its keypoints between the views; one without, or that
/// shows once, by the surfaces behind it. Something that stood still in all views, or whose motion
/// was that of the scene, is not found; nor are shadows. Deterministic for any executor. Memory:
/// about as much as `views`, 450 bytes a keypoint, and 400 bytes a pixel of one view for each
/// thread. kInvalidArgument: options, pictures that differ in size or type from their view.
[[nodiscard]] Result<std::vector<cv::Mat>> find_moving_regions(std::span<const MovingView> views,
                                                               const MovingOptions& options,
                                                               Executor& executor);

}  // namespace trigmesh
