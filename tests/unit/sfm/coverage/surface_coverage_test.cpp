#include "sfm/coverage/surface_coverage.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/unit/sfm/coverage/coverage_scenes.hpp"

namespace trigmesh {
namespace {

/// A sphere of radius 1 around the origin, as far as its points are within `reach_deg` of +x.
TriangleMesh make_cap(double reach_deg) {
  constexpr std::uint32_t kRings = 24;
  constexpr std::uint32_t kSectors = 36;
  TriangleMesh mesh;
  const auto at = [](std::uint32_t ring, std::uint32_t sector) {
    return ring * kSectors + sector % kSectors;
  };
  const double reach = reach_deg * test::kRadPerDeg;
  for (std::uint32_t ring = 0; ring <= kRings; ++ring) {
    for (std::uint32_t sector = 0; sector < kSectors; ++sector) {
      const double angle = reach * (ring + 0.01) / (kRings + 0.01);
      const double around = 2.0 * std::numbers::pi * sector / kSectors;
      mesh.positions.emplace_back(Eigen::Vector3d(std::cos(angle),
                                                  std::sin(angle) * std::cos(around),
                                                  std::sin(angle) * std::sin(around))
                                      .cast<float>());
    }
  }
  for (std::uint32_t ring = 0; ring < kRings; ++ring) {
    for (std::uint32_t sector = 0; sector < kSectors; ++sector) {
      mesh.faces.push_back({at(ring, sector), at(ring + 1, sector), at(ring + 1, sector + 1)});
      mesh.faces.push_back({at(ring, sector), at(ring + 1, sector + 1), at(ring, sector + 1)});
    }
  }
  return mesh;
}

TEST(SurfaceCoverage, IsCompleteForABallSeenFromAllSides) {
  std::vector<DenseView> views = test::orbit(0, 345);
  for (double azimuth = 0; azimuth < 360; azimuth += 30) {
    views.push_back(test::view_from(6 * test::direction(azimuth, -40)));
  }
  SerialExecutor executor;
  const SurfaceCoverage coverage = measure_surface_coverage(make_cap(180), views, executor);
  EXPECT_LT(coverage.gap_ratio, 0.02);
}

TEST(SurfaceCoverage, SendsToTheBackOfABallSeenFromOneSide) {
  // Half of it was made, by views around +x.
  const std::vector<DenseView> views = test::orbit(-30, 30);
  SerialExecutor executor;
  const SurfaceCoverage coverage = measure_surface_coverage(make_cap(95), views, executor);
  ASSERT_FALSE(coverage.gaps.empty());
  const ReachableGap& back = coverage.gaps.front();
  EXPECT_EQ(back.kind, GapKind::kHole);
  EXPECT_GT(std::abs(back.direction.turn_left_rad), 100 * test::kRadPerDeg);
  EXPECT_GT(back.area_ratio, 0.3) << "the opening is half as large as the half ball";
}

TEST(SurfaceCoverage, NamesTheMissingSideFromItsNeighbours) {
  const TriangleMesh mesh = test::make_box({{0, 1, 0}});
  std::vector<DenseView> views = test::orbit(150, 390);
  SerialExecutor executor;
  const SurfaceCoverage coverage = measure_surface_coverage(mesh, views, executor);
  ASSERT_FALSE(coverage.gaps.empty());
  const ReachableGap& side = coverage.gaps.front();
  EXPECT_EQ(side.kind, GapKind::kHole);
  EXPECT_NEAR((side.center_in_world - Eigen::Vector3d::UnitY()).norm(), 0.0, 0.1);
  EXPECT_NEAR(side.area_ratio, 4.0 / 20.0, 0.05);
  const std::string& name = views[side.direction.view].name;
  EXPECT_TRUE(name.starts_with("150_") || name.starts_with("390_")) << name;
  EXPECT_NEAR(std::abs(side.direction.turn_left_rad) / test::kRadPerDeg, 60.0, 10.0);
}

/// Runs indices backwards: results must not depend on the order.
class BackwardExecutor final : public Executor {
 public:
  void for_each_index(std::size_t count, const std::function<void(std::size_t)>& work) override {
    for (std::size_t i = count; i > 0; --i) {
      work(i - 1);
    }
  }
};

TEST(SurfaceCoverage, DoesNotDependOnTheExecutor) {
  const TriangleMesh mesh = test::make_box({{0, 1, 0}, {1, 0, 0}});
  const std::vector<DenseView> views = test::orbit(150, 390);
  SerialExecutor forward;
  BackwardExecutor backward;
  const SurfaceCoverage a = measure_surface_coverage(mesh, views, forward);
  const SurfaceCoverage b = measure_surface_coverage(mesh, views, backward);
  ASSERT_EQ(a.gaps.size(), b.gaps.size());
  EXPECT_EQ(a.gap_ratio, b.gap_ratio);
  for (std::size_t i = 0; i < a.gaps.size(); ++i) {
    EXPECT_EQ(a.gaps[i].center_in_world, b.gaps[i].center_in_world);
    EXPECT_EQ(a.gaps[i].direction.turn_left_rad, b.gaps[i].direction.turn_left_rad);
  }
}

TEST(SurfaceCoverage, OfNothingIsNothing) {
  SerialExecutor executor;
  EXPECT_TRUE(measure_surface_coverage({}, test::orbit(0, 345), executor).gaps.empty());
  EXPECT_TRUE(measure_surface_coverage(test::make_box({}), {}, executor).gaps.empty());
}

}  // namespace
}  // namespace trigmesh
