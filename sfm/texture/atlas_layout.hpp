#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "firmware/base/result.hpp"
#include "sfm/dense/dense_view.hpp"
#include "sfm/surface/triangle_mesh.hpp"
#include "sfm/texture/charts.hpp"

namespace trigmesh {

struct AtlasOptions {
  /// Side of the square pages, texels, a power of two in [64, 16384]. When everything fits on one
  /// smaller page, that is taken.
  int page_size_px = 4096;
  /// Most pages, [1, 64]. When the charts need more, texels become larger until they fit.
  int max_pages = 4;
  /// Free texels around each chart, filled with its border colours, [1, 64]. Four keep two levels
  /// of mip maps clean.
  int padding_px = 4;
  /// Texels per picture pixel along each axis, (0, 1]: 1 keeps the resolution of the pictures.
  double texels_per_pixel = 1.0;

  [[nodiscard]] Result<> validate() const;
};

/// Where everything lies in the atlas.
struct AtlasLayout {
  int page_size_px = 0;
  int page_count = 0;
  double texels_per_pixel = 1.0;  ///< as reached, <= the option
  std::vector<Chart> charts;
  std::vector<std::uint32_t> face_chart;  ///< per face: position in `charts`
  /// Per face corner, in the page of its chart; texel centres are whole numbers.
  std::vector<std::array<Eigen::Vector2f, 3>> face_texels;
};

/// Gives each chart the rectangle of its projection in its view, gathers the faces without a label
/// in sheets of small patches, and packs all of them. kLimitExceeded when even a twentieth of the
/// density does not fit.
[[nodiscard]] Result<AtlasLayout> lay_out_atlas(const TriangleMesh& mesh,
                                                std::span<const DenseView> views,
                                                std::span<const std::uint32_t> labels,
                                                std::vector<Chart> charts,
                                                const AtlasOptions& options);

/// Size of a view's picture at the density of an atlas.
[[nodiscard]] Eigen::Vector2i scaled_size(const Camera& camera, double texels_per_pixel);

/// Faces that no view sees have patches of kPatchSide squared texels; the corners lie at texel
/// (1, 1), (2, 1) and (1, 2) of the patch.
inline constexpr int kPatchSide = 4;
inline constexpr std::size_t kPatchesPerRow = 16;

/// First texel of patch `index` in its sheet.
[[nodiscard]] inline Eigen::Vector2i patch_origin(std::size_t index) {
  return kPatchSide * Eigen::Vector2i(static_cast<int>(index % kPatchesPerRow),
                                      static_cast<int>(index / kPatchesPerRow));
}

}  // namespace trigmesh
