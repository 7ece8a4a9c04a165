#include "sfm/geometry/triangulation.hpp"

#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "tests/unit/sfm/geometry/synthetic.hpp"

namespace trigmesh {
namespace {

using synthetic::Random;

constexpr double kDegree = std::numbers::pi / 180.0;

std::vector<Sighting> see(const Camera& camera,
                          const std::vector<Rigid3>& poses,
                          const Eigen::Vector3d& point,
                          double noise_px,
                          Random& random) {
  std::vector<Sighting> sightings;
  for (const Rigid3& pose : poses) {
    const auto pixel = project(camera, pose * point);
    EXPECT_TRUE(pixel);
    sightings.push_back(*make_sighting(camera, pose, *pixel + random.gauss2(noise_px)));
  }
  return sightings;
}

class TriangulationByCamera : public testing::TestWithParam<Camera> {};

INSTANTIATE_TEST_SUITE_P(Cameras,
                         TriangulationByCamera,
                         testing::Values(synthetic::pinhole(),
                                         synthetic::brown_conrady(),
                                         synthetic::fisheye()),
                         [](const testing::TestParamInfo<Camera>& parameter) {
                           return std::string(to_string(parameter.param.model));
                         });

TEST_P(TriangulationByCamera, ExactPixelsGiveTheExactPoint) {
  Random random(1);
  for (const std::size_t views : {2U, 3U, 7U, 15U}) {
    const auto poses = synthetic::arc_of_cameras(views, 40.0 * kDegree);
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector3d point = random.in_box(1.0);
      const auto sightings = see(GetParam(), poses, point, 0.0, random);
      const Triangulation result = triangulate(sightings, {});
      ASSERT_EQ(result.outcome, TriangulationOutcome::kOk);
      EXPECT_NEAR((result.point_in_world - point).norm(), 0.0, 1e-9);
      EXPECT_NEAR(result.max_error_px, 0.0, 1e-7);
      EXPECT_NEAR(
          result.angle_rad,
          triangulation_angle(camera_center(poses.front()), camera_center(poses.back()), point),
          1e-9);
      const Eigen::Vector4d linear = *triangulate_linear(sightings);
      EXPECT_NEAR((linear.head<3>() / linear.w() - point).norm(), 0.0, 1e-7);
    }
  }
}

TEST_P(TriangulationByCamera, NoOtherNearPointHasASmallerError) {
  Random random(2);
  const auto poses = synthetic::arc_of_cameras(5, 30.0 * kDegree);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d point = random.in_box(1.0);
    const auto sightings = see(GetParam(), poses, point, 1.0, random);
    const Triangulation result = triangulate(sightings, {.max_error_px = 20.0});
    ASSERT_EQ(result.outcome, TriangulationOutcome::kOk);
    const auto cost = [&](const Eigen::Vector3d& at) {
      double sum = 0.0;
      for (std::size_t k = 0; k < poses.size(); ++k) {
        sum += (*project(GetParam(), poses[k] * at) - sightings[k].pixel).squaredNorm();
      }
      return sum;
    };
    for (int k = 0; k < 6; ++k) {
      const Eigen::Vector3d delta = (k < 3 ? 1e-4 : -1e-4) * Eigen::Vector3d::Unit(k % 3);
      EXPECT_LT(cost(result.point_in_world), cost(result.point_in_world + delta));
    }
  }
}

TEST(Triangulation, MoreViewsAndLessNoiseAreBetter) {
  const auto error = [](std::size_t views, double noise_px) {
    Random random(3);
    const Camera camera = synthetic::pinhole();
    const auto poses = synthetic::arc_of_cameras(views, 30.0 * kDegree);
    double sum = 0.0;
    for (int i = 0; i < 300; ++i) {
      const Eigen::Vector3d point = random.in_box(1.0);
      const auto sightings = see(camera, poses, point, noise_px, random);
      sum += (triangulate(sightings, {.max_error_px = 50.0}).point_in_world - point).squaredNorm();
    }
    return sum;
  };
  EXPECT_LT(error(3, 0.1), error(3, 0.5));
  EXPECT_LT(error(3, 0.5), error(3, 2.0));
  EXPECT_LT(error(12, 0.5), error(3, 0.5));
}

TEST(Triangulation, NearlyParallelRaysAreRefusedForTheirAngle) {
  Random random(4);
  const Camera camera = synthetic::pinhole();
  const auto poses = synthetic::arc_of_cameras(2, 1.0 * kDegree);
  const auto sightings = see(camera, poses, {0.1, 0.0, 0.0}, 0.0, random);
  const Triangulation result = triangulate(sightings, {.min_angle_rad = 1.5 * kDegree});
  EXPECT_EQ(result.outcome, TriangulationOutcome::kSmallAngle);
  EXPECT_NEAR(result.angle_rad, 1.0 * kDegree, 1e-3);
  EXPECT_EQ(triangulate(sightings, {.min_angle_rad = 0.5 * kDegree}).outcome,
            TriangulationOutcome::kOk);
}

TEST(Triangulation, PointAtInfinityIsASmallAngleAndFiniteInTheLinearForm) {
  const Camera camera = synthetic::pinhole();
  const Eigen::Vector3d direction = Eigen::Vector3d(0.1, -0.05, 1.0).normalized();
  std::vector<Sighting> sightings;
  for (const double x : {0.0, 1.0, 2.0}) {
    const Rigid3 pose{Eigen::Quaterniond::Identity(), {-x, 0.0, 0.0}};
    sightings.push_back(*make_sighting(camera, pose, *project(camera, direction)));
  }
  EXPECT_EQ(triangulate(sightings, {}).outcome, TriangulationOutcome::kSmallAngle);
  const Eigen::Vector4d linear = *triangulate_linear(sightings);
  EXPECT_NEAR(linear.w(), 0.0, 1e-9);
  EXPECT_NEAR(linear.head<3>().normalized().cross(direction).norm(), 0.0, 1e-9);
}

TEST(Triangulation, PointBehindIsRefused) {
  // Rays that diverge in front meet behind the cameras.
  const Camera camera = synthetic::pinhole();
  const Rigid3 left{Eigen::Quaterniond::Identity(), {0.5, 0.0, 0.0}};
  const Rigid3 right{Eigen::Quaterniond::Identity(), {-0.5, 0.0, 0.0}};
  const std::vector<Sighting> sightings{
      *make_sighting(camera, left, *project(camera, {-0.2, 0.0, 1.0})),
      *make_sighting(camera, right, *project(camera, {0.2, 0.0, 1.0}))};
  EXPECT_EQ(triangulate(sightings, {}).outcome, TriangulationOutcome::kBehindCamera);
  EXPECT_EQ(triangulate_robust(sightings, {}).best.outcome, TriangulationOutcome::kBehindCamera);
}

TEST(Triangulation, SkewRaysAreALargeError) {
  Random random(5);
  const Camera camera = synthetic::pinhole();
  const auto poses = synthetic::arc_of_cameras(2, 20.0 * kDegree);
  auto sightings = see(camera, poses, Eigen::Vector3d::Zero(), 0.0, random);
  sightings[1] = *make_sighting(camera, poses[1], sightings[1].pixel + Eigen::Vector2d(0.0, 60.0));
  const Triangulation result = triangulate(sightings, {.max_error_px = 4.0});
  EXPECT_EQ(result.outcome, TriangulationOutcome::kLargeError);
  EXPECT_NEAR(result.max_error_px, 30.0, 2.0);
}

TEST(Triangulation, OneViewOrOnePlaceIsDegenerate) {
  Random random(6);
  const Camera camera = synthetic::pinhole();
  const auto poses = synthetic::arc_of_cameras(2, 20.0 * kDegree);
  const auto sightings = see(camera, poses, Eigen::Vector3d::Zero(), 0.0, random);
  EXPECT_EQ(triangulate({}, {}).outcome, TriangulationOutcome::kDegenerate);
  EXPECT_EQ(triangulate(std::span(sightings).first(1), {}).outcome,
            TriangulationOutcome::kDegenerate);
  const std::vector<Sighting> twice{sightings[0], sightings[0], sightings[0]};
  EXPECT_EQ(triangulate(twice, {}).outcome, TriangulationOutcome::kDegenerate);
  EXPECT_EQ(triangulate_robust(twice, {}).inlier_count, 0U);
  EXPECT_FALSE(triangulate_linear(std::span(sightings).first(1)));
}

TEST(Triangulation, WorksFarFromTheOriginOfTheWorld) {
  Random random(7);
  const Camera camera = synthetic::pinhole();
  const Eigen::Vector3d far(4.0e5, -3.0e5, 2.0e3);
  auto poses = synthetic::arc_of_cameras(4, 30.0 * kDegree);
  for (Rigid3& pose : poses) {
    pose = pose * Rigid3{Eigen::Quaterniond::Identity(), -far};
  }
  const Eigen::Vector3d point = far + Eigen::Vector3d(0.3, 0.2, -0.4);
  const auto sightings = see(camera, poses, point, 0.0, random);
  const Triangulation result = triangulate(sightings, {});
  ASSERT_EQ(result.outcome, TriangulationOutcome::kOk);
  EXPECT_NEAR((result.point_in_world - point).norm(), 0.0, 1e-6);
}

TEST(TriangulationAngle, IsTheAngleAtThePoint) {
  EXPECT_NEAR(triangulation_angle({1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, Eigen::Vector3d::Zero()),
              std::numbers::pi / 2.0,
              1e-15);
  EXPECT_NEAR(triangulation_angle({1e-9, 0.0, 0.0}, {0.0, 0.0, 0.0}, {0.0, 0.0, 1.0}), 1e-9, 1e-18);
  EXPECT_EQ(triangulation_angle({0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 0.0, 0.0}), 0.0);
}

TEST(MakeSighting, RefusesAPixelWithoutARay) {
  Camera camera = synthetic::pinhole();
  camera.model = CameraModel::kRadial;
  camera.distortion = {-1.0, 0.0, 0.0, 0.0};
  EXPECT_FALSE(make_sighting(camera, {}, {camera.cx_px + camera.fx_px, camera.cy_px}));
}

TEST(TriangulateRobust, AgreesWithPlainVersionWithoutOutliers) {
  Random random(8);
  const Camera camera = synthetic::brown_conrady();
  const auto poses = synthetic::arc_of_cameras(6, 30.0 * kDegree);
  const auto sightings = see(camera, poses, {0.2, 0.1, 0.3}, 0.5, random);
  const RobustTriangulation robust = triangulate_robust(sightings, {});
  EXPECT_EQ(robust.best.point_in_world, triangulate(sightings, {}).point_in_world);
  EXPECT_EQ(robust.inlier_count, 6U);
}

TEST(TriangulateRobust, LeavesWrongViewsOut) {
  Random random(9);
  const Camera camera = synthetic::brown_conrady();
  for (int trial = 0; trial < 200; ++trial) {
    const std::size_t views = 4 + static_cast<std::size_t>(trial) % 17;
    const auto poses = synthetic::arc_of_cameras(views, 40.0 * kDegree);
    const Eigen::Vector3d point = random.in_box(1.0);
    auto sightings = see(camera, poses, point, 0.3, random);
    const std::size_t wrong = views / 3;
    for (std::size_t k = 0; k < wrong; ++k) {
      const std::size_t at = 3 * k + 1;
      const double angle = random.uniform(0.0, 2.0 * std::numbers::pi);
      const Eigen::Vector2d shift =
          random.uniform(40.0, 300.0) * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      sightings[at] = *make_sighting(camera, poses[at], sightings[at].pixel + shift);
    }
    const RobustTriangulation result = triangulate_robust(sightings, {});
    ASSERT_EQ(result.best.outcome, TriangulationOutcome::kOk) << trial;
    EXPECT_EQ(result.inlier_count, views - wrong) << trial;
    EXPECT_NEAR((result.best.point_in_world - point).norm(), 0.0, 0.02) << trial;
    for (std::size_t k = 0; k < wrong; ++k) {
      EXPECT_EQ(result.inliers[3 * k + 1], 0);
    }
  }
}

TEST(TriangulateRobust, AsksForTheNumberOfViewsItIsTold) {
  Random random(10);
  const Camera camera = synthetic::pinhole();
  const auto poses = synthetic::arc_of_cameras(4, 30.0 * kDegree);
  auto sightings = see(camera, poses, Eigen::Vector3d::Zero(), 0.0, random);
  sightings[3] = *make_sighting(camera, poses[3], sightings[3].pixel + Eigen::Vector2d(0.0, 90.0));
  EXPECT_EQ(triangulate_robust(sightings, {.min_inliers = 3}).inlier_count, 3U);
  const RobustTriangulation refused = triangulate_robust(sightings, {.min_inliers = 4});
  EXPECT_EQ(refused.best.outcome, TriangulationOutcome::kLargeError);
  EXPECT_EQ(refused.inlier_count, 0U);
  EXPECT_EQ(triangulate_robust(std::span(sightings).first(2), {.min_inliers = 3}).best.outcome,
            TriangulationOutcome::kLargeError);
}

TEST(TriangulationOptions, ValidateNamesTheField) {
  EXPECT_TRUE(TriangulationOptions{}.validate());
  EXPECT_NE(TriangulationOptions{.min_angle_rad = -1.0}.validate().error().message.find(
                "min_angle_rad is -1"),
            std::string::npos);
  EXPECT_FALSE(TriangulationOptions{.max_error_px = 0.0}.validate());
  EXPECT_FALSE(TriangulationOptions{.max_refinement_steps = -1}.validate());
  EXPECT_FALSE(TriangulationOptions{.min_inliers = 1}.validate());
}

}  // namespace
}  // namespace trigmesh
