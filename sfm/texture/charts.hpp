#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sfm/texture/face_views.hpp"
#include "sfm/texture/view_labeling.hpp"

namespace trigmesh {

/// A connected piece of the surface that shows one view, and its rectangle in an atlas page.
struct Chart {
  std::uint32_t view = kNoLabel;     ///< kNoLabel: a sheet of patches for faces that no view sees
  std::vector<std::uint32_t> faces;  ///< ascending
  int source_x = 0;  ///< first column and row of the rectangle in the view's (scaled) picture
  int source_y = 0;
  int width = 0;  ///< texels, without padding
  int height = 0;
  std::uint16_t page = 0;
  int page_x = 0;  ///< first texel in the page
  int page_y = 0;
};

using FaceNeighbors = std::vector<std::array<std::uint32_t, 3>>;

/// The connected components of equal label, in the order of their first face. Faces with kNoLabel
/// are in none.
[[nodiscard]] std::vector<Chart> connected_charts(std::span<const std::uint32_t> labels,
                                                  const FaceNeighbors& neighbors);

/// Gives components of at most `max_faces` faces to the neighbouring label with the longest common
/// border among those whose view sees all of their faces. One pass, in the order of first faces.
void absorb_small_charts(const FaceViews& faces,
                         const FaceNeighbors& neighbors,
                         std::size_t max_faces,
                         std::vector<std::uint32_t>& labels);

}  // namespace trigmesh
