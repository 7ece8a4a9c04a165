#pragma once

// Inside of guided matching: which points lie near a line, in the best instruction set of the
// machine (Highway).

#include <cstddef>
#include <cstdint>
#include <vector>

namespace trigmesh::internal {

/// Points sorted into strips across one axis, and by cells of the other coordinate within a strip:
/// the points of a strip near a line are one run in memory.
struct PointStrips {
  int along = 0;  ///< axis in which the strips follow each other: 0 for x, 1 for y
  float strip_begin_px = 0.0F;
  float cell_begin_px = 0.0F;
  float strip_px = 1.0F;
  float cell_px = 1.0F;
  int strips = 0;
  int cells = 0;  ///< in each strip
  std::vector<std::uint32_t>
      starts;  ///< first point of each cell, strip after strip; strips * cells + 1
  /// Of the sorted points; longer than the number of points by kStripPadding, so that whole vectors
  /// can be read.
  std::vector<float> x_px;
  std::vector<float> y_px;
  std::vector<std::uint32_t> members;  ///< where each stood before sorting
};

/// Largest number of lanes of a vector of floats.
inline constexpr std::size_t kStripPadding = 64;

/// A point (x, y) is near when e^2 <= limit and e^2 <= limit |(back_x . (x, y, 1), back_y . (x, y,
/// 1))|^2, with e = line . (x, y, 1). The line has a normal of unit length and is nearer to the
/// axis `along` of the strips.
struct LineGate {
  float line[3];
  float back_x[3];
  float back_y[3];
  float limit = 0.0F;
};

/// Writes the members near the line to `found` and returns how many; `found` must hold all points
/// and kStripPadding more. The same on every instruction set.
[[nodiscard]] std::size_t find_near_line(const PointStrips& strips,
                                         const LineGate& gate,
                                         std::uint32_t* found);

}  // namespace trigmesh::internal
