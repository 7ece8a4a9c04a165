#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "sfm/texture/face_views.hpp"

namespace trigmesh {

/// Factors by which a view's red, green and blue are multiplied so that all views agree.
using ColorGain = std::array<float, 3>;

/// Exposure and white balance of the views, levelled: one factor a view and channel, from the mean
/// colours of the faces that several views see, by robust least squares on logarithms (so that the
/// trivial solution "all black" does not exist). Gains lie in [0.4, 2.5] and are around 1 in the
/// geometric mean; views that share no face with others keep 1. O(views^3 + views^2 * faces), at
/// most 30,000 faces are looked at.
[[nodiscard]] std::vector<ColorGain> estimate_view_gains(const FaceViews& faces,
                                                         std::size_t view_count);

/// Mean colour of the face in this view, grey levels, levelled.
[[nodiscard]] inline std::array<float, 3> leveled_color(const FaceView& view,
                                                        const std::vector<ColorGain>& gains) {
  std::array<float, 3> color{};
  for (std::size_t c = 0; c < 3; ++c) {
    color[c] = static_cast<float>(view.color[c]) / kColorUnits * gains[view.view][c];
  }
  return color;
}

}  // namespace trigmesh
