#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace trigmesh {

/// Corners of a cell: bit 0, 1, 2 of the number = offset along x, y, z.
inline constexpr std::size_t kCellCorners = 8;
inline constexpr std::size_t kCellEdges = 12;

/// An edge of a cell from corner `from` to corner `from | 1 << axis`.
struct CellEdge {
  int from = 0;
  int axis = 0;
};

/// Edge 4 a + k runs along axis a from the k-th corner whose bit a is clear.
[[nodiscard]] CellEdge cell_edge(std::size_t edge);

/// Three cell edges on which the corners of a triangle lie, counter-clockwise seen from outside.
using CellTriangle = std::array<std::uint8_t, 3>;

/// The triangles that separate the inside corners of a cell from the outside ones; `inside` has bit
/// c set when corner c is inside.
///
/// Marching cubes (Lorensen and Cline, SIGGRAPH 1987) with a table that is derived, not typed: on
/// each face of the cell every run of inside corners is cut off by one segment, so that what
/// happens on a face depends on its own four corners alone and cells that share it agree; the
/// segments close to loops; loops are cut to triangles with no diagonal on a face of the cell. The
/// surface is therefore closed and edges belong to two triangles wherever all cells are known.
[[nodiscard]] const std::vector<CellTriangle>& cell_triangles(std::uint8_t inside);

}  // namespace trigmesh
