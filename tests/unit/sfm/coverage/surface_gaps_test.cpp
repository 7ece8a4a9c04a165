#include "sfm/coverage/surface_gaps.hpp"

#include <vector>

#include <gtest/gtest.h>

#include "tests/unit/sfm/coverage/coverage_scenes.hpp"

namespace trigmesh {
namespace {

SurfaceGaps gaps_of(const TriangleMesh& mesh, const std::vector<DenseView>& views) {
  SerialExecutor executor;
  return find_gaps(mesh, views, measure_coverage(mesh, views, executor));
}

TEST(SurfaceGaps, FindsTheMissingSideOfABox) {
  const Eigen::Vector3f side(0, 1, 0);
  const SurfaceGaps found = gaps_of(test::make_box({side, {0, 0, -1}}), test::orbit(0, 345));
  ASSERT_FALSE(found.gaps.empty());
  // The border around both missing sides is one: it looks between them.
  const SurfaceGap& hole = found.gaps.front();
  EXPECT_NEAR(hole.hole_area, hole.area, 1e-6);
  EXPECT_GT(hole.normal.y(), 0.6);
  EXPECT_GT(hole.area, 4.0);
  EXPECT_NEAR(found.subject_area, 16.0, 0.1);
}

TEST(SurfaceGaps, FindsWeakFaces) {
  // Nobody stood on the side of +x; the side is there all the same.
  const SurfaceGaps found = gaps_of(test::make_box({}), test::orbit(90, 270));
  ASSERT_FALSE(found.gaps.empty());
  const SurfaceGap* weak = nullptr;
  for (const SurfaceGap& gap : found.gaps) {
    weak = gap.normal.x() > 0.95 ? &gap : weak;
  }
  ASSERT_NE(weak, nullptr);
  EXPECT_EQ(weak->hole_area, 0.0);
  EXPECT_NEAR(weak->area, 4.0, 0.1);
  EXPECT_NEAR((weak->center - Eigen::Vector3d::UnitX()).norm(), 0.0, 0.05);
}

TEST(SurfaceGaps, FindsNothingWrongWithWhatAllHaveSeen) {
  for (const SurfaceGap& gap : gaps_of(test::make_box({}), test::orbit(0, 345)).gaps) {
    EXPECT_LT(gap.normal.z(), -0.9) << "only the side on which it stands";
  }
}

TEST(SurfaceGaps, TakesTheBorderOfAReliefForItsEnd) {
  TriangleMesh wall;
  test::add_square({0, 0, 0}, {0, 1, 0}, {0, 0, 1}, 8, wall);
  EXPECT_TRUE(gaps_of(wall, test::orbit(-45, 45)).gaps.empty());
  // A window of one square in it is a hole.
  wall.faces.erase(wall.faces.begin() + 56, wall.faces.begin() + 58);
  const SurfaceGaps found = gaps_of(wall, test::orbit(-45, 45));
  ASSERT_EQ(found.gaps.size(), 1U);
  EXPECT_NEAR(found.gaps[0].area, 1.0 / 16.0, 1e-6);
  EXPECT_GT(found.gaps[0].normal.x(), 0.99);
}

TEST(SurfaceGaps, TakesTheBorderAtTheEndOfThePicturesForItsEnd) {
  // A corner of two walls, no relief, which runs on to where few pictures reach.
  TriangleMesh corner;
  test::add_square({0, 5, 0}, {0, 5, 0}, {0, 0, 5}, 24, corner);
  test::add_square({5, 0, 0}, {0, 0, 5}, {5, 0, 0}, 24, corner);
  corner = test::welded(corner);
  std::vector<DenseView> views;
  for (const double azimuth_deg : {30.0, 40.0, 50.0, 60.0}) {
    views.push_back(test::view_from(6 * test::direction(azimuth_deg, 0)));
  }
  const SurfaceGaps found = gaps_of(corner, views);
  for (const SurfaceGap& gap : found.gaps) {
    EXPECT_EQ(gap.hole_area, 0.0);
  }
}

TEST(SurfaceGaps, DoesNotMindWhatIsAroundTheSubject) {
  TriangleMesh mesh = test::make_box({});
  // A large ground far outside of most pictures, and so seen by few.
  test::add_square({30, 0, -1}, {5, 0, 0}, {0, 5, 0}, 8, mesh);
  const SurfaceGaps found = gaps_of(mesh, test::orbit(0, 345));
  EXPECT_LT(found.subject_area, 24.1);
  for (const SurfaceGap& gap : found.gaps) {
    EXPECT_LT(gap.center.norm(), 2.0);
  }
}

TEST(SurfaceGaps, NeedsViewsFromDifferentPlaces) {
  const Eigen::Vector3d place = 6 * test::direction(0, 0);
  std::vector<DenseView> views;
  for (int i = 0; i < 5; ++i) {
    views.push_back(test::view_from(place + 0.02 * i * Eigen::Vector3d::UnitY()));
  }
  TriangleMesh wall;
  test::add_square({0, 0, 0}, {0, 1, 0}, {0, 0, 1}, 8, wall);
  const SurfaceGaps found = gaps_of(wall, views);
  ASSERT_EQ(found.gaps.size(), 1U);
  EXPECT_NEAR(found.gaps[0].area, 4.0, 1e-4) << "five views, but hardly any parallax";
}

}  // namespace
}  // namespace trigmesh
