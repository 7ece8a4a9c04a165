#include "sfm/coverage/face_coverage.hpp"

#include <vector>

#include <gtest/gtest.h>

#include "tests/unit/sfm/coverage/coverage_scenes.hpp"

namespace trigmesh {
namespace {

using test::direction;
using test::view_from;

/// A square that looks along +x, and one that hides its right half from views in front.
TriangleMesh half_hidden_square() {
  TriangleMesh mesh;
  test::add_square({0, 0, 0}, {0, 1, 0}, {0, 0, 1}, 2, mesh);
  test::add_square({0.5, -0.5, 0}, {0, 0.5, 0}, {0, 0, 1}, 1, mesh);
  return mesh;
}

TEST(FaceCoverage, CountsViewsThatSeeAndParallax) {
  TriangleMesh mesh;
  test::add_square({0, 0, 0}, {0, 0.1F, 0}, {0, 0, 0.1F}, 1, mesh);
  const std::vector<DenseView> views{view_from(5 * direction(0, 0)),
                                     view_from(5 * direction(20, 0)),
                                     view_from(5 * direction(-10, 0)),
                                     view_from(5 * direction(85, 0)),   // at a grazing angle
                                     view_from(5 * direction(180, 0)),  // from behind
                                     view_from(5 * direction(0, 0), {5, 5, 0})};  // looks away
  SerialExecutor executor;
  for (const FaceCoverage& face : measure_coverage(mesh, views, executor)) {
    EXPECT_EQ(face.framing_views, 5U);
    EXPECT_EQ(face.seeing_views, 3U);
    EXPECT_NEAR(static_cast<double>(face.parallax_rad) / test::kRadPerDeg, 20.0, 0.5);
  }
}

TEST(FaceCoverage, KnowsWhatIsHidden) {
  const TriangleMesh mesh = half_hidden_square();
  SerialExecutor executor;
  const auto coverage =
      measure_coverage(mesh, std::vector{view_from(20 * direction(0, 0))}, executor);
  for (std::size_t f = 0; f < 8; ++f) {
    const bool hidden = face_shape(mesh, f).middle.y() < 0.0;
    EXPECT_EQ(coverage[f].seeing_views, hidden ? 0U : 1U) << f;
    EXPECT_EQ(coverage[f].framing_views, 1U) << f;
  }
  EXPECT_EQ(coverage[8].seeing_views, 1U) << "the square in front";
}

TEST(FaceCoverage, HasShapes) {
  const TriangleMesh mesh = half_hidden_square();
  const FaceShape shape = face_shape(mesh, 0);
  EXPECT_NEAR(shape.area, 0.5, 1e-6);
  EXPECT_NEAR((shape.normal - Eigen::Vector3d::UnitX()).norm(), 0.0, 1e-6);
}

}  // namespace
}  // namespace trigmesh
