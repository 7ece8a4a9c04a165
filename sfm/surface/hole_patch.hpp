#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace trigmesh {

/// A triangulated patch; the first `border_count` points are the border it was made for.
struct HolePatch {
  std::vector<Eigen::Vector3f> points;
  std::size_t border_count = 0;
  std::vector<std::array<std::uint32_t, 3>> faces;
  /// For each point beyond the border the three earlier points whose mean it was when it came.
  std::vector<std::array<std::uint32_t, 3>> parents;
};

/// Border of at least three points -> triangles of least total area between them, with normals that
/// follow the order of the border (counter-clockwise seen from their tip). O(n^3).
[[nodiscard]] HolePatch minimal_area_patch(const std::vector<Eigen::Vector3f>& border);

/// Splits triangles much larger than `edge_length` at their centre and flips inner edges to the
/// better diagonal until all are small.
void refine(float edge_length, HolePatch& patch);

/// Moves the inner points to where the surface bends least: `anchors` holds, per border point, the
/// mean of the neighbours it has outside of the patch, or itself.
void fair(const std::vector<Eigen::Vector3f>& anchors, HolePatch& patch);

}  // namespace trigmesh
