#include "sfm/features/sift_refine.hpp"

#include <cmath>

namespace trigmesh::sift {

std::optional<QuadraticExtremum> fit_quadratic(const Cube& cube) {
  const auto at = [&](int layer, int y, int x) {
    return cube[static_cast<std::size_t>(1 + layer)][static_cast<std::size_t>(1 + y)]
               [static_cast<std::size_t>(1 + x)];
  };
  const float centre = at(0, 0, 0);
  const float gx = 0.5F * (at(0, 0, 1) - at(0, 0, -1));
  const float gy = 0.5F * (at(0, 1, 0) - at(0, -1, 0));
  const float gs = 0.5F * (at(1, 0, 0) - at(-1, 0, 0));
  const float xx = at(0, 0, 1) + at(0, 0, -1) - 2.0F * centre;
  const float yy = at(0, 1, 0) + at(0, -1, 0) - 2.0F * centre;
  const float ss = at(1, 0, 0) + at(-1, 0, 0) - 2.0F * centre;
  const float xy = 0.25F * (at(0, 1, 1) - at(0, 1, -1) - at(0, -1, 1) + at(0, -1, -1));
  const float xs = 0.25F * (at(1, 0, 1) - at(1, 0, -1) - at(-1, 0, 1) + at(-1, 0, -1));
  const float ys = 0.25F * (at(1, 1, 0) - at(1, -1, 0) - at(-1, 1, 0) + at(-1, -1, 0));

  // H^-1 = adj(H) / det(H) for the symmetric H over (x, y, s).
  const float a00 = yy * ss - ys * ys;
  const float a01 = xs * ys - xy * ss;
  const float a02 = xy * ys - xs * yy;
  const float a11 = xx * ss - xs * xs;
  const float a12 = xy * xs - xx * ys;
  const float a22 = xx * yy - xy * xy;
  const float determinant = xx * a00 + xy * a01 + xs * a02;
  if (determinant == 0.0F || !std::isfinite(1.0F / determinant)) {
    return std::nullopt;
  }
  const float scale = -1.0F / determinant;
  QuadraticExtremum fit;
  fit.dx = scale * (a00 * gx + a01 * gy + a02 * gs);
  fit.dy = scale * (a01 * gx + a11 * gy + a12 * gs);
  fit.dlayer = scale * (a02 * gx + a12 * gy + a22 * gs);
  fit.value = centre + 0.5F * (gx * fit.dx + gy * fit.dy + gs * fit.dlayer);
  fit.edge_trace = xx + yy;
  fit.edge_determinant = a22;
  return fit;
}

std::optional<PlanarOffset> fit_in_layer(const Cube& cube, float dlayer) {
  // Lagrange interpolation through the three layers.
  const std::array<float, 3> weight{
      0.5F * dlayer * (dlayer - 1.0F), 1.0F - dlayer * dlayer, 0.5F * dlayer * (dlayer + 1.0F)};
  std::array<std::array<float, 3>, 3> v{};
  for (std::size_t y = 0; y < 3; ++y) {
    for (std::size_t x = 0; x < 3; ++x) {
      v[y][x] = weight[0] * cube[0][y][x] + weight[1] * cube[1][y][x] + weight[2] * cube[2][y][x];
    }
  }
  const float gx = 0.5F * (v[1][2] - v[1][0]);
  const float gy = 0.5F * (v[2][1] - v[0][1]);
  const float xx = v[1][2] + v[1][0] - 2.0F * v[1][1];
  const float yy = v[2][1] + v[0][1] - 2.0F * v[1][1];
  const float xy = 0.25F * (v[2][2] - v[2][0] - v[0][2] + v[0][0]);
  const float determinant = xx * yy - xy * xy;
  if (determinant == 0.0F || !std::isfinite(1.0F / determinant)) {
    return std::nullopt;
  }
  return PlanarOffset{.dx = (xy * gy - yy * gx) / determinant,
                      .dy = (xy * gx - xx * gy) / determinant};
}

bool is_edge(const QuadraticExtremum& fit, float max_ratio) {
  const float limit = (max_ratio + 1.0F) * (max_ratio + 1.0F) / max_ratio;
  return fit.edge_determinant <= 0.0F ||
         fit.edge_trace * fit.edge_trace >= limit * fit.edge_determinant;
}

}  // namespace trigmesh::sift
