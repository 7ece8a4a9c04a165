#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "firmware/base/result.hpp"
#include "sfm/calibration/marker_dictionary.hpp"
#include "sfm/calibration/quad_refinement.hpp"

namespace trigmesh {

/// A square marker found in an image.
struct MarkerDetection {
  int id = 0;
  /// Corners of the black square in the marker's own orientation: top left, top right, bottom
  /// right, bottom left. Pixels, first pixel centre = (0, 0).
  std::array<Eigen::Vector2d, 4> corners_px;
  int wrong_bits = 0;  ///< cells that had to be corrected
};

struct MarkerDetectorOptions {
  /// Shortest side of a marker, pixels, >= 8. Below about two pixels a cell the bits cannot be
  /// read.
  double min_side_px = 12.0;
  /// Smallest difference between the means of white and black cells, grey levels, (0, 255].
  double min_contrast = 25.0;

  /// Where an edge is seen depends on it; see linear_light.
  ToneCurve tone_curve = ToneCurve::kSrgb;

  [[nodiscard]] Result<> validate() const;
};

/// Finds markers of one dictionary and refines their corners to a fraction of a pixel by straight
/// lines through their edges. Each id at most once (the largest wins), sorted by id. Deterministic.
/// `grey`: CV_8UC1. kInvalidArgument: options, or an image of another type; kInternal: OpenCV
/// refused.
[[nodiscard]] Result<std::vector<MarkerDetection>> detect_markers(
    const cv::Mat& grey,
    const MarkerDictionary& dictionary,
    const MarkerDetectorOptions& options = {});

}  // namespace trigmesh
