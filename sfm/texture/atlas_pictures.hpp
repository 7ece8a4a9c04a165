#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "firmware/base/executor.hpp"
#include "firmware/base/result.hpp"
#include "sfm/dense/dense_view.hpp"
#include "sfm/surface/triangle_mesh.hpp"
#include "sfm/texture/atlas_layout.hpp"
#include "sfm/texture/view_gains.hpp"

namespace trigmesh {

/// Makes the pages (CV_8UC3) and copies each chart's rectangle from its picture, unchanged but for
/// the scale. Every picture is loaded once, one at a time in each thread. Errors are those of
/// `images`.
[[nodiscard]] Result<std::vector<cv::Mat>> copy_pictures(const AtlasLayout& layout,
                                                         std::span<const DenseView> views,
                                                         const ViewImageSource& images,
                                                         Executor& executor);

/// Per face corner, what is added to red, green and blue after the view's gain; grey levels.
using CornerOffsets = std::vector<std::array<Eigen::Vector3f, 3>>;

/// Turns copied pictures into textures, in place: multiplies by the view's gain, adds the offsets
/// interpolated over each face, and replaces whatever lies more than one texel outside of a chart's
/// faces, padding included, by the nearest texel inside.
void finish_charts(const AtlasLayout& layout,
                   const std::vector<ColorGain>& gains,
                   const CornerOffsets& offsets,
                   int padding_px,
                   std::vector<cv::Mat>& pages,
                   Executor& executor);

/// Colours for faces that no view sees: at vertices that they share with textured faces the
/// texture's colour goes on; from there the difference to the mesh's own vertex colours (grey where
/// it has none) spreads smoothly over the unseen vertices.
void paint_patches(const TriangleMesh& mesh,
                   const AtlasLayout& layout,
                   std::vector<cv::Mat>& pages);

/// Bilinear sample of an RGB picture at (x, y), texel centres at whole numbers, clamped to the
/// border.
[[nodiscard]] Eigen::Vector3f sample_bilinear(const cv::Mat& rgb, const Eigen::Vector2f& position);

}  // namespace trigmesh
