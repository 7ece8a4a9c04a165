#include "sfm/features/sift_refine.hpp"

#include <gtest/gtest.h>

namespace trigmesh::sift {
namespace {

/// a + quadratic form around (x, y, s) with all cross terms.
Cube quadratic_cube(float x, float y, float s) {
  Cube cube{};
  for (int k = -1; k <= 1; ++k) {
    for (int j = -1; j <= 1; ++j) {
      for (int i = -1; i <= 1; ++i) {
        const float dx = static_cast<float>(i) - x;
        const float dy = static_cast<float>(j) - y;
        const float ds = static_cast<float>(k) - s;
        cube[static_cast<std::size_t>(k + 1)][static_cast<std::size_t>(j + 1)]
            [static_cast<std::size_t>(i + 1)] =
                9.0F - 3.0F * dx * dx - 2.0F * dy * dy - 1.5F * ds * ds + 0.7F * dx * dy -
                0.4F * dx * ds + 0.3F * dy * ds;
      }
    }
  }
  return cube;
}

TEST(FitQuadratic, FindsTheTopOfAQuadraticExactly) {
  const auto fit = fit_quadratic(quadratic_cube(0.31F, -0.42F, 0.17F));
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->dx, 0.31F, 1e-5);
  EXPECT_NEAR(fit->dy, -0.42F, 1e-5);
  EXPECT_NEAR(fit->dlayer, 0.17F, 1e-5);
  EXPECT_NEAR(fit->value, 9.0F, 1e-5);
  EXPECT_NEAR(fit->edge_trace, -10.0F, 1e-4);
  EXPECT_NEAR(fit->edge_determinant, 6.0F * 4.0F - 0.49F, 1e-4);
}

TEST(FitQuadratic, FlatCubeHasNoExtremum) {
  EXPECT_FALSE(fit_quadratic(Cube{}));
}

TEST(FitQuadratic, RidgeThatDoesNotBendAlongOneAxisHasNoExtremum) {
  Cube cube{};
  for (auto& layer : cube) {
    layer[1] = {5.0F, 5.0F, 5.0F};
  }
  EXPECT_FALSE(fit_quadratic(cube));
}

TEST(FitInLayer, FindsTheTopBetweenLayersWhoseCurvaturesDiffer) {
  // A peak at (0.4, -0.3, 0.45) that is much narrower in the finer layer.
  Cube cube{};
  for (int k = -1; k <= 1; ++k) {
    for (int j = -1; j <= 1; ++j) {
      for (int i = -1; i <= 1; ++i) {
        const float dx = static_cast<float>(i) - 0.4F;
        const float dy = static_cast<float>(j) + 0.3F;
        const float ds = static_cast<float>(k) - 0.45F;
        const float curvature = 2.0F - 0.8F * static_cast<float>(k);
        cube[static_cast<std::size_t>(k + 1)][static_cast<std::size_t>(j + 1)]
            [static_cast<std::size_t>(i + 1)] = 9.0F - ds * ds - curvature * (dx * dx + dy * dy);
      }
    }
  }
  const auto place = fit_in_layer(cube, 0.45F);
  ASSERT_TRUE(place);
  EXPECT_NEAR(place->dx, 0.4F, 1e-5);
  EXPECT_NEAR(place->dy, -0.3F, 1e-5);
}

TEST(FitInLayer, FlatLayerHasNoExtremum) {
  EXPECT_FALSE(fit_in_layer(Cube{}, 0.2F));
}

TEST(IsEdge, DecidesByTheRatioOfCurvatures) {
  const auto with_curvatures = [](float a, float b) {
    QuadraticExtremum fit;
    fit.edge_trace = a + b;
    fit.edge_determinant = a * b;
    return fit;
  };
  EXPECT_FALSE(is_edge(with_curvatures(-1.0F, -1.0F), 10.0F));
  EXPECT_FALSE(is_edge(with_curvatures(-9.9F, -1.0F), 10.0F));
  EXPECT_TRUE(is_edge(with_curvatures(-10.1F, -1.0F), 10.0F));
  EXPECT_TRUE(is_edge(with_curvatures(1.0F, -1.0F), 10.0F));  // saddle
}

}  // namespace
}  // namespace trigmesh::sift
