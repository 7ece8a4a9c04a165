#pragma once

#include <vector>

#include "sfm/texture/charts.hpp"

namespace trigmesh {

/// Joins charts whose rectangles lie in the same picture so close together that one rectangle,
/// padding included, takes no more texels than both: they show the same pixels, and small ones
/// often lie within the rectangle of a large one. In: rectangles (source_x, source_y, width,
/// height) are set. Out: ordered by their first face.
[[nodiscard]] std::vector<Chart> merge_close_charts(std::vector<Chart> charts, int padding_px);

}  // namespace trigmesh
