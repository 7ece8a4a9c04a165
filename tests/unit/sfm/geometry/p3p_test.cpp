#include "sfm/geometry/p3p.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "tests/unit/sfm/geometry/synthetic.hpp"

namespace trigmesh {
namespace {

using synthetic::Random;
using Points = std::array<Eigen::Vector3d, 3>;

Points rays_to(const Rigid3& cam_from_world, const Points& points) {
  Points rays;
  std::transform(points.begin(), points.end(), rays.begin(), [&](const Eigen::Vector3d& point) {
    return (cam_from_world * point).normalized();
  });
  return rays;
}

double distance(const Rigid3& a, const Rigid3& b) {
  return synthetic::rotation_distance_rad(a.rotation, b.rotation) +
         (a.translation - b.translation).norm();
}

double nearest(const P3pSolutions& solutions, const Rigid3& truth) {
  double best = 1e9;
  for (std::size_t k = 0; k < solutions.count; ++k) {
    best = std::min(best, distance(solutions.cam_from_world.at(k), truth));
  }
  return best;
}

void expect_all_solve(const P3pSolutions& solutions, const Points& rays, const Points& points) {
  for (std::size_t k = 0; k < solutions.count; ++k) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector3d seen = solutions.cam_from_world.at(k) * points.at(i);
      EXPECT_NEAR((seen.normalized() - rays.at(i)).norm(), 0.0, 1e-6);
    }
  }
}

TEST(P3p, TruePoseIsAlwaysAmongTheSolutions) {
  Random random(1);
  std::vector<double> errors;
  std::size_t solutions_sum = 0;
  for (int i = 0; i < 5000; ++i) {
    const Rigid3 truth{random.rotation(), Eigen::Vector3d(0.0, 0.0, 4.0) + random.in_box(1.0)};
    const Points points{random.in_box(1.5), random.in_box(1.5), random.in_box(1.5)};
    if (std::any_of(
            points.begin(), points.end(), [&](const auto& x) { return (truth * x).z() < 0.3; })) {
      continue;
    }
    const Points rays = rays_to(truth, points);
    const P3pSolutions solutions = solve_p3p(rays, points);
    ASSERT_GE(solutions.count, 1U) << i;
    expect_all_solve(solutions, rays, points);
    errors.push_back(nearest(solutions, truth));
    solutions_sum += solutions.count;
  }
  ASSERT_GT(errors.size(), 4500U);
  EXPECT_LT(synthetic::median(errors), 1e-13);
  // Double roots halve the digits; more than that is a wrong branch.
  EXPECT_LT(*std::max_element(errors.begin(), errors.end()), 1e-4);
  EXPECT_LT(solutions_sum, 3 * errors.size());
}

TEST(P3p, SymmetricViewOfAnEquilateralTriangle) {
  // Both conics are degenerate at once here; four solutions exist.
  const Points points{Eigen::Vector3d(1.0, 0.0, 0.0),
                      Eigen::Vector3d(-0.5, std::sqrt(0.75), 0.0),
                      Eigen::Vector3d(-0.5, -std::sqrt(0.75), 0.0)};
  for (const double height : {1.0, 2.0, 5.0}) {
    const Rigid3 truth{Eigen::Quaterniond::Identity(), {0.0, 0.0, height}};
    const Points rays = rays_to(truth, points);
    const P3pSolutions solutions = solve_p3p(rays, points);
    EXPECT_LT(nearest(solutions, truth), 1e-6) << height;
    expect_all_solve(solutions, rays, points);
  }
}

TEST(P3p, IsoscelesTriangleSeenFromItsPlaneOfSymmetry) {
  Random random(2);
  for (int i = 0; i < 200; ++i) {
    const Points points{Eigen::Vector3d(0.0, random.uniform(-1.0, 1.0), random.uniform(0.5, 1.0)),
                        Eigen::Vector3d(-1.0, 0.0, 0.0),
                        Eigen::Vector3d(1.0, 0.0, 0.0)};
    const Eigen::Vector3d center(0.0, random.uniform(-1.0, 1.0), -4.0);
    const Rigid3 truth = synthetic::look_at(center, Eigen::Vector3d::Zero());
    for (const auto& order :
         {std::array{0U, 1U, 2U}, std::array{1U, 0U, 2U}, std::array{1U, 2U, 0U}}) {
      const Points permuted{points.at(order[0]), points.at(order[1]), points.at(order[2])};
      const Points rays = rays_to(truth, permuted);
      EXPECT_LT(nearest(solve_p3p(rays, permuted), truth), 1e-5) << i;
    }
  }
}

TEST(P3p, CollinearAndCoincidentPointsHaveNoSolution) {
  const Rigid3 pose{Eigen::Quaterniond::Identity(), {0.0, 0.0, 3.0}};
  const Points line{Eigen::Vector3d(-1.0, 0.0, 0.0),
                    Eigen::Vector3d(0.0, 0.1, 0.0),
                    Eigen::Vector3d(1.0, 0.2, 0.0)};
  EXPECT_EQ(solve_p3p(rays_to(pose, line), line).count, 0U);
  const Points twice{Eigen::Vector3d(-1.0, 0.0, 0.0),
                     Eigen::Vector3d(-1.0, 0.0, 0.0),
                     Eigen::Vector3d(1.0, 0.2, 0.0)};
  EXPECT_EQ(solve_p3p(rays_to(pose, twice), twice).count, 0U);
}

TEST(P3p, SameRayForAllPointsHasNoSolution) {
  const Points points{Eigen::Vector3d(-1.0, 0.0, 0.0),
                      Eigen::Vector3d(0.0, 1.0, 0.0),
                      Eigen::Vector3d(1.0, 0.0, 0.5)};
  const Points rays{Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitZ()};
  EXPECT_EQ(solve_p3p(rays, points).count, 0U);
}

TEST(P3p, ScaleOfTheWorldScalesTheTranslation) {
  Random random(3);
  for (const double scale : {1e-4, 1.0, 1e5}) {
    const Rigid3 truth{random.rotation(), scale * Eigen::Vector3d(0.2, 0.1, 5.0)};
    const Points points{
        scale * random.in_box(1.0), scale * random.in_box(1.0), scale * random.in_box(1.0)};
    const P3pSolutions solutions = solve_p3p(rays_to(truth, points), points);
    double best = 1e9;
    for (std::size_t k = 0; k < solutions.count; ++k) {
      best = std::min(
          best, (solutions.cam_from_world.at(k).translation - truth.translation).norm() / scale);
    }
    EXPECT_LT(best, 1e-9);
  }
}

}  // namespace
}  // namespace trigmesh
