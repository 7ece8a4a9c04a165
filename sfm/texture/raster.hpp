#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include <Eigen/Core>

namespace trigmesh {

/// The part of the plane in which pixels are visited: 0 <= x < width, 0 <= y < height.
struct PixelBounds {
  int width = 0;
  int height = 0;
};

/// Calls `visit(x, y, barycentric)` for each pixel whose centre (whole numbers) lies in the
/// triangle, row by row; `barycentric` (Eigen::Vector3f) are the weights of the three corners.
/// Half-space test on corners rounded to 1/256 px (Pineda, "A Parallel Algorithm for Polygon
/// Rasterization", SIGGRAPH 1988), in whole numbers: triangles that share an edge never visit a
/// pixel twice and leave none out. Either orientation; corners must be within +-4e6 px.
template <typename Visit>
void rasterize_triangle(const std::array<Eigen::Vector2f, 3>& corners_px,
                        PixelBounds bounds,
                        Visit&& visit) {
  constexpr std::int64_t kOne = 256;
  std::array<std::int64_t, 3> x{};
  std::array<std::int64_t, 3> y{};
  for (std::size_t i = 0; i < 3; ++i) {
    x[i] = std::llround(static_cast<double>(corners_px[i].x()) * static_cast<double>(kOne));
    y[i] = std::llround(static_cast<double>(corners_px[i].y()) * static_cast<double>(kOne));
  }
  std::int64_t area = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0]);
  if (area == 0) {
    return;
  }
  const bool swapped = area < 0;
  if (swapped) {
    std::swap(x[1], x[2]);
    std::swap(y[1], y[2]);
    area = -area;
  }
  const auto ceil_pixel = [](std::int64_t v) { return static_cast<int>((v + kOne - 1) >> 8); };
  const auto floor_pixel = [](std::int64_t v) { return static_cast<int>(v >> 8); };
  const int x_begin = std::max(0, ceil_pixel(std::min({x[0], x[1], x[2]})));
  const int x_end = std::min(bounds.width - 1, floor_pixel(std::max({x[0], x[1], x[2]})));
  const int y_begin = std::max(0, ceil_pixel(std::min({y[0], y[1], y[2]})));
  const int y_end = std::min(bounds.height - 1, floor_pixel(std::max({y[0], y[1], y[2]})));
  // Edge i lies opposite to corner i. A centre exactly on an edge belongs to one side only.
  std::array<std::int64_t, 3> step_x{};
  std::array<std::int64_t, 3> step_y{};
  std::array<std::int64_t, 3> row{};
  std::array<std::int64_t, 3> least{};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t a = (i + 1) % 3;
    const std::size_t b = (i + 2) % 3;
    const std::int64_t dx = x[b] - x[a];
    const std::int64_t dy = y[b] - y[a];
    step_x[i] = -dy * kOne;
    step_y[i] = dx * kOne;
    row[i] = dx * (y_begin * kOne - y[a]) - dy * (x_begin * kOne - x[a]);
    least[i] = (dy > 0 || (dy == 0 && dx > 0)) ? 0 : 1;
  }
  const double scale = 1.0 / static_cast<double>(area);
  for (int py = y_begin; py <= y_end; ++py) {
    std::array<std::int64_t, 3> e = row;
    for (int px = x_begin; px <= x_end; ++px) {
      if (e[0] >= least[0] && e[1] >= least[1] && e[2] >= least[2]) {
        const auto b0 = static_cast<float>(static_cast<double>(e[0]) * scale);
        const auto b1 = static_cast<float>(static_cast<double>(e[1]) * scale);
        const auto b2 = static_cast<float>(static_cast<double>(e[2]) * scale);
        visit(px, py, swapped ? Eigen::Vector3f(b0, b2, b1) : Eigen::Vector3f(b0, b1, b2));
      }
      e[0] += step_x[0];
      e[1] += step_x[1];
      e[2] += step_x[2];
    }
    for (std::size_t i = 0; i < 3; ++i) {
      row[i] += step_y[i];
    }
  }
}

}  // namespace trigmesh
