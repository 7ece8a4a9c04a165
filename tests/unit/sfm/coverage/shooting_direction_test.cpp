#include "sfm/coverage/shooting_direction.hpp"

#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "tests/unit/sfm/coverage/coverage_scenes.hpp"

namespace trigmesh {
namespace {

using test::direction;
using test::kRadPerDeg;
using test::view_from;

/// One piece of area 1 at `position`.
SurfaceGap gap_at(const Eigen::Vector3d& position, const Eigen::Vector3d& normal) {
  SurfaceGap gap;
  gap.pieces = {{GapKind::kHole, position, normal, 1.0}};
  gap.center = position;
  gap.normal = normal;
  gap.area = 1.0;
  gap.hole_area = 1.0;
  return gap;
}

std::optional<ShootingDirection> direction_of(const SurfaceGap& gap,
                                              const TriangleMesh& mesh,
                                              const std::vector<DenseView>& views) {
  SerialExecutor executor;
  return find_shooting_direction(gap, mesh, views, up_of_views(views), executor);
}

TEST(UpOfViews, IsWhereTheUpperEdgesPoint) {
  EXPECT_GT(up_of_views(test::orbit(0, 345)).z(), 0.999);
  EXPECT_GT(up_of_views(test::orbit(0, 45)).z(), 0.999) << "an arc, looking down";
  // All look the same way: the upper edge is all there is.
  const std::vector<DenseView> row{view_from({5, 0, 0}, {0, 0, 0}),
                                   view_from({5, 1, 0}, {0, 1, 0})};
  EXPECT_GT(up_of_views(row).z(), 0.999);
}

TEST(UpOfViews, FollowsTheWorldFrame) {
  std::vector<DenseView> views = test::orbit(0, 180);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(2.0, Eigen::Vector3d(1, 2, -1).normalized()));
  for (DenseView& view : views) {
    view.cam_from_world.rotation = view.cam_from_world.rotation * turn.conjugate();
  }
  EXPECT_GT(up_of_views(views).dot(turn * Eigen::Vector3d::UnitZ()), 0.999);
}

TEST(ShootingDirection, TurnsLeftAndRightAsOneStandingThereWould) {
  const std::vector<DenseView> views{view_from(6 * direction(0, 0)),
                                     view_from(6 * direction(10, 0))};
  const TriangleMesh mesh = test::make_box({});
  // Standing on +x and facing the box, +y is on the right hand.
  const auto right = direction_of(gap_at({0, 1, 0}, {0, 1, 0}), mesh, views);
  ASSERT_TRUE(right.has_value());
  EXPECT_EQ(right->view, 1U);
  EXPECT_LT(right->turn_left_rad, -60 * kRadPerDeg);
  const auto left = direction_of(gap_at({0, -1, 0}, {0, -1, 0}), mesh, views);
  ASSERT_TRUE(left.has_value());
  EXPECT_EQ(left->view, 0U);
  EXPECT_GT(left->turn_left_rad, 60 * kRadPerDeg);
}

TEST(ShootingDirection, RisesTowardsWhatLooksUp) {
  const std::vector<DenseView> views = test::orbit(0, 345);
  const auto above = direction_of(
      gap_at({0, 0, 1}, Eigen::Vector3d(0.3, 0, 1).normalized()), test::make_box({}), views);
  ASSERT_TRUE(above.has_value());
  EXPECT_GT(above->rise_rad, 10 * kRadPerDeg);
  EXPECT_NEAR(above->elevation_rad / kRadPerDeg, 73.3, 1.0);
  EXPECT_DOUBLE_EQ(above->visible_area, 1.0);
}

TEST(ShootingDirection, IsNotTheUnderside) {
  const auto below =
      direction_of(gap_at({0, 0, -1}, {0, 0, -1}), test::make_box({}), test::orbit(0, 345));
  EXPECT_FALSE(below.has_value());
}

TEST(ShootingDirection, IsNotTheInside) {
  EXPECT_FALSE(direction_of(gap_at({0, 0, 0}, {0, 1, 0}), test::make_box({}), test::orbit(0, 345)));
}

TEST(ShootingDirection, GoesAroundWhatStandsInFront) {
  // A wall close before the gap; beside it the gap can be seen.
  TriangleMesh mesh = test::make_box({});
  test::add_square({2.0F, 0, 0}, {0, 0.5F, 0}, {0, 0, 5}, 4, mesh);
  const auto beside = direction_of(gap_at({1, 0, 0}, {1, 0, 0}), mesh, test::orbit(0, 345));
  ASSERT_TRUE(beside.has_value());
  EXPECT_DOUBLE_EQ(beside->visible_area, 1.0);
}

}  // namespace
}  // namespace trigmesh
