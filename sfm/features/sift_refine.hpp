#pragma once

#include <array>
#include <optional>

namespace trigmesh::sift {

/// Difference-of-Gaussian values around a sample: cube[layer][y][x], the sample itself at
/// [1][1][1].
using Cube = std::array<std::array<std::array<float, 3>, 3>, 3>;

/// The extremum of the quadratic through a cube, as an offset from its centre in samples.
struct QuadraticExtremum {
  float dx = 0.0F;
  float dy = 0.0F;
  float dlayer = 0.0F;
  float value = 0.0F;       ///< interpolated value at the extremum
  float edge_trace = 0.0F;  ///< trace of the spatial Hessian
  float edge_determinant = 0.0F;
};

/// Fits D(x) = D + g'x + x'Hx / 2 by central differences and solves x = -H^-1 g (Brown and Lowe,
/// "Invariant Features from Interest Point Groups", BMVC 2002, eq. 2-3). nullopt when H is
/// singular.
[[nodiscard]] std::optional<QuadraticExtremum> fit_quadratic(const Cube& cube);

/// A place within a layer, as an offset from the centre of the cube in samples.
struct PlanarOffset {
  float dx = 0.0F;
  float dy = 0.0F;
};

/// Sharpens the place of a fit: the quadratic of fit_quadratic takes the spatial curvature to be
/// the same at all scales, which pulls the place towards or away from the sample when the extremum
/// lies between two layers. Here the layer at `dlayer` is interpolated first, and the extremum of
/// the quadratic through its 3x3 values is returned; nullopt when that is singular.
[[nodiscard]] std::optional<PlanarOffset> fit_in_layer(const Cube& cube, float dlayer);

/// Lowe 2004, section 4.1: true when the ratio of principal curvatures is above `max_ratio` or they
/// differ in sign.
[[nodiscard]] bool is_edge(const QuadraticExtremum& fit, float max_ratio);

}  // namespace trigmesh::sift
