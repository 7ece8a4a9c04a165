#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "sfm/calibration/quad_refinement.hpp"

namespace trigmesh {

/// A marker as it was read: its dark square and its bits, row by row as seen from the first corner,
/// the first is the highest, 1 = white.
struct ReadMarker {
  Quad quad;
  std::uint64_t pattern = 0;
  int bits = 4;  ///< on a side
};

/// How far edges seem to lie on their dark side, pixels; negative: on their light side. White paper
/// that is overexposed, a tone curve that is not the one supposed, and ink that runs move all edges
/// of a marker alike; edges inside of it, which look to both sides, tell by how much. Nothing when
/// there are too few clear edges, as in markers with cells of less than 4 px. `light`: CV_32FC1,
/// 0..255, see linear_light.
[[nodiscard]] std::optional<double> edge_shift_px(const cv::Mat& light,
                                                  const std::vector<ReadMarker>& markers);

/// The dark square with its sides moved outwards. `by_px` is small against the sides.
[[nodiscard]] Quad moved_outwards(const Quad& quad, double by_px);

}  // namespace trigmesh
