#include "sfm/keyframes/view_change.hpp"

#include <numbers>
#include <random>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180.0;

/// Points before a camera, 2 to 6 m away.
std::vector<Vector3d> points_in_view() {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<Vector3d> points;
  for (int i = 0; i < 200; ++i) {
    const double depth = 2.0 + 4.0 * unit(random);
    points.emplace_back((unit(random) - 0.5) * depth, (unit(random) - 0.5) * depth, depth);
  }
  return points;
}

ViewChange change_after(const Matrix3d& rotation, const Vector3d& translation) {
  ViewChangeMeter meter;
  for (const Vector3d& point : points_in_view()) {
    meter.add(point.normalized(), (rotation * point + translation).normalized());
  }
  return meter.measure();
}

TEST(ViewChange, SeesNothingWhereNothingMoves) {
  const ViewChange change = change_after(Matrix3d::Identity(), Vector3d::Zero());
  EXPECT_NEAR(change.motion_deg, 0.0, 1e-6);
  EXPECT_NEAR(change.parallax_deg, 0.0, 1e-6);
}

TEST(ViewChange, TellsARotationFromAChangeOfPlace) {
  const Matrix3d rotation =
      AngleAxisd(5.0 * kDegree, Vector3d(0.2, 1.0, 0.1).normalized()).matrix();
  const ViewChange turned = change_after(rotation, Vector3d::Zero());
  EXPECT_GT(turned.motion_deg, 4.0);
  EXPECT_LT(turned.parallax_deg, 0.01);
  const ViewChange moved = change_after(rotation, {0.3, 0.0, 0.0});
  EXPECT_GT(moved.parallax_deg, 0.5);
}

TEST(ViewChange, BoundsTheParallaxFromBelow) {
  // 0.3 m sideways at 2 to 6 m: 3 to 8 degrees, of which a rotation takes the most.
  const ViewChange change = change_after(Matrix3d::Identity(), {0.3, 0.0, 0.0});
  EXPECT_GT(change.motion_deg, 3.0);
  EXPECT_LT(change.motion_deg, 8.0);
  EXPECT_LT(change.parallax_deg, change.motion_deg);
}

TEST(ViewChange, IsNotMovedByAFewWrongRays) {
  ViewChangeMeter meter;
  for (const Vector3d& point : points_in_view()) {
    const bool is_wrong = meter.ray_count() < 40;
    meter.add(point.normalized(),
              is_wrong ? Vector3d(0.5, 0.5, 1.0).normalized() : point.normalized());
  }
  EXPECT_LT(meter.measure().parallax_deg, 0.02);
}

TEST(ViewChange, SaysNothingOfTwoRays) {
  ViewChangeMeter meter;
  meter.add(Vector3d::UnitZ(), Vector3d::UnitX());
  meter.add(Vector3d::UnitZ(), Vector3d::UnitX());
  EXPECT_EQ(meter.measure().motion_deg, 0.0);
}

TEST(ViewChange, BeginsAnew) {
  ViewChangeMeter meter;
  for (int i = 0; i < 3; ++i) {
    meter.add(Vector3d::UnitZ(), Vector3d::UnitX());
  }
  EXPECT_NEAR(meter.measure().motion_deg, 90.0, 1e-9);
  meter.begin();
  EXPECT_EQ(meter.ray_count(), 0U);
}

}  // namespace
}  // namespace trigmesh
