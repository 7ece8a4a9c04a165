#pragma once

#include <cstddef>
#include <span>

#include <opencv2/core/mat.hpp>

#include "firmware/base/result.hpp"
#include "sfm/moving/moving_view.hpp"

namespace trigmesh {

/// When a pixel is taken to show something in front of the scene that no other view shows there.
struct HiddenBackgroundOptions {
  /// Neighbours that must show the same surface behind the pixel, and that must look through each
  /// place in front of it, >= 2.
  std::size_t min_witnesses = 2;
  /// Depths within this part of each other are one surface, (0, 0.5].
  float max_depth_ratio = 0.02F;
  /// Smallest difference of a colour channel from the background's, after exposure, [0, 255].
  float min_color_difference = 30.0F;
  /// The difference must also be this often the spread of the witnesses' colours, >= 0: gloss
  /// differs from view to view by itself.
  float min_spread_ratio = 3.0F;
  /// Places in front of the surface that are asked, evenly in inverse depth, >= 1.
  int samples = 48;

  /// Names the field, its value and the violated rule.
  [[nodiscard]] Result<> validate() const;
};

/// The pixels of view `view` (CV_8UC1, 255 = so, of the view's size) where its neighbours agree on
/// a surface, the pixel shows another colour, and everything in front of that surface is seen to be
/// empty by other views: whatever hides the surface was not there for them. What stands still but
/// has no depth (plain, glossy, thin) is not among them: no view looks through it.
[[nodiscard]] cv::Mat find_hidden_background(std::span<const MovingView> views,
                                             std::size_t view,
                                             const HiddenBackgroundOptions& options);

}  // namespace trigmesh
