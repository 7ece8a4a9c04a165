#include "sfm/geometry/similarity.hpp"

#include <vector>

#include <gtest/gtest.h>

#include "tests/unit/sfm/geometry/synthetic.hpp"

namespace trigmesh {
namespace {

using synthetic::Random;

Sim3 random_similarity(Random& random) {
  const double scale = std::exp(random.uniform(-3.0, 3.0));
  const Eigen::Quaterniond rotation = random.rotation();
  return {scale, rotation, random.in_box(20.0)};
}

std::vector<Eigen::Vector3d> cloud(Random& random, std::size_t count) {
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < count; ++i) {
    points.push_back(random.in_box(3.0));
  }
  return points;
}

std::vector<Eigen::Vector3d> move_all(const Sim3& motion,
                                      const std::vector<Eigen::Vector3d>& points) {
  std::vector<Eigen::Vector3d> moved;
  for (const auto& point : points) {
    moved.push_back(motion * point);
  }
  return moved;
}

void expect_near(const Sim3& actual, const Sim3& expected, double tolerance) {
  EXPECT_NEAR(actual.scale / expected.scale, 1.0, tolerance);
  EXPECT_NEAR(synthetic::rotation_distance_rad(actual.rotation, expected.rotation), 0.0, tolerance);
  EXPECT_NEAR((actual.translation - expected.translation).norm(), 0.0, 100.0 * tolerance);
}

TEST(Sim3, ComposesAndInvertsLikeItsActionOnPoints) {
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    const Sim3 b_from_a = random_similarity(random);
    const Sim3 c_from_b = random_similarity(random);
    const Eigen::Vector3d point = random.in_box(2.0);
    EXPECT_NEAR(((c_from_b * b_from_a) * point - c_from_b * (b_from_a * point)).norm(), 0.0, 1e-10);
    EXPECT_NEAR((b_from_a.inverse() * (b_from_a * point) - point).norm(), 0.0, 1e-10);
  }
}

TEST(Sim3, TransformedPoseSeesTransformedPointsInTheSamePixel) {
  Random random(2);
  for (int i = 0; i < 50; ++i) {
    const Sim3 b_from_a = random_similarity(random);
    const Rigid3 cam_from_a{random.rotation(), random.in_box(2.0)};
    const Rigid3 cam_from_b = transform_pose(b_from_a, cam_from_a);
    const Eigen::Vector3d point = random.in_box(2.0);
    const Eigen::Vector3d expected = b_from_a.scale * (cam_from_a * point);
    EXPECT_NEAR((cam_from_b * (b_from_a * point) - expected).norm() / b_from_a.scale, 0.0, 1e-11);
    EXPECT_NEAR(
        (camera_center(cam_from_b) - b_from_a * camera_center(cam_from_a)).norm(), 0.0, 1e-9);
  }
}

TEST(AlignPoints, RecoversTheMotionFromExactPoints) {
  Random random(3);
  for (int i = 0; i < 100; ++i) {
    const Sim3 truth = random_similarity(random);
    const auto a = cloud(random, 3 + static_cast<std::size_t>(i) % 20);
    const Alignment fit = align_points(a, move_all(truth, a), ScaleMode::kEstimated);
    ASSERT_EQ(fit.outcome, AlignmentOutcome::kOk);
    expect_near(fit.b_from_a, truth, 1e-9);
    EXPECT_NEAR(fit.rmse / truth.scale, 0.0, 1e-11);
  }
}

TEST(AlignPoints, KeepsUnitScaleWhenTold) {
  Random random(4);
  Sim3 truth = random_similarity(random);
  truth.scale = 1.0;
  const auto a = cloud(random, 10);
  const auto b = move_all(truth, a);
  expect_near(align_points(a, b, ScaleMode::kFixedToOne).b_from_a, truth, 1e-10);
  truth.scale = 2.0;
  const Alignment forced = align_points(a, move_all(truth, a), ScaleMode::kFixedToOne);
  EXPECT_EQ(forced.b_from_a.scale, 1.0);
  EXPECT_GT(forced.rmse, 0.5);
}

TEST(AlignPoints, CoplanarPointsAreEnough) {
  Random random(5);
  const Sim3 truth = random_similarity(random);
  auto a = cloud(random, 6);
  for (auto& point : a) {
    point.z() = 0.0;
  }
  const Alignment fit = align_points(a, move_all(truth, a), ScaleMode::kEstimated);
  ASSERT_EQ(fit.outcome, AlignmentOutcome::kOk);
  expect_near(fit.b_from_a, truth, 1e-9);
}

TEST(AlignPoints, MirroredPointsGiveARotationNotAReflection) {
  Random random(6);
  const auto a = cloud(random, 12);
  auto b = a;
  for (auto& point : b) {
    point.x() = -point.x();
  }
  const Alignment fit = align_points(a, b, ScaleMode::kEstimated);
  ASSERT_EQ(fit.outcome, AlignmentOutcome::kOk);
  EXPECT_NEAR(fit.b_from_a.rotation.toRotationMatrix().determinant(), 1.0, 1e-12);
  EXPECT_GT(fit.rmse, 0.1);
}

TEST(AlignPoints, LineAndSinglePlaceAreDegenerate) {
  std::vector<Eigen::Vector3d> line;
  for (int i = 0; i < 8; ++i) {
    line.emplace_back(1.0 + i, 2.0 - 2.0 * i, 0.5 * i);
  }
  EXPECT_EQ(align_points(line, line, ScaleMode::kEstimated).outcome, AlignmentOutcome::kDegenerate);
  const std::vector<Eigen::Vector3d> place(5, Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(align_points(place, place, ScaleMode::kEstimated).outcome,
            AlignmentOutcome::kDegenerate);
}

TEST(AlignPoints, TwoPairsAreTooFew) {
  const std::vector<Eigen::Vector3d> two{{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}};
  EXPECT_EQ(align_points(two, two, ScaleMode::kEstimated).outcome, AlignmentOutcome::kTooFewPoints);
  EXPECT_EQ(align_points({}, {}, ScaleMode::kEstimated).outcome, AlignmentOutcome::kTooFewPoints);
}

TEST(AlignPoints, ErrorGrowsWithNoise) {
  const auto error_at = [](double sigma) {
    Random random(7);
    const Sim3 truth = random_similarity(random);
    const auto a = cloud(random, 50);
    auto b = move_all(truth, a);
    for (auto& point : b) {
      const double x = random.gauss();
      const double y = random.gauss();
      point += sigma * truth.scale * Eigen::Vector3d(x, y, random.gauss());
    }
    const Alignment fit = align_points(a, b, ScaleMode::kEstimated);
    return synthetic::rotation_distance_rad(fit.b_from_a.rotation, truth.rotation);
  };
  EXPECT_LT(error_at(0.0), 1e-9);
  EXPECT_LT(error_at(0.001), error_at(0.01));
  EXPECT_LT(error_at(0.01), error_at(0.1));
  EXPECT_LT(error_at(0.01), 0.005);
}

TEST(AlignPointsRobust, IgnoresWrongPairs) {
  Random random(8);
  for (int trial = 0; trial < 20; ++trial) {
    const Sim3 truth = random_similarity(random);
    const auto a = cloud(random, 60);
    auto b = move_all(truth, a);
    for (std::size_t i = 0; i < 36; ++i) {
      b[i] = truth * random.in_box(3.0);
    }
    const Alignment fit = align_points_robust(a, b, {.max_error = 0.01 * truth.scale});
    ASSERT_EQ(fit.outcome, AlignmentOutcome::kOk);
    expect_near(fit.b_from_a, truth, 1e-9);
    EXPECT_EQ(fit.inlier_count, 24U);
    EXPECT_EQ(fit.inliers[0], 0);
    EXPECT_EQ(fit.inliers[59], 1);
  }
}

TEST(AlignPointsRobust, SaysWhenNothingAgrees) {
  Random random(9);
  const auto a = cloud(random, 40);
  const auto b = cloud(random, 40);
  const Alignment fit = align_points_robust(a, b, {.max_error = 0.001, .min_inliers = 6});
  EXPECT_EQ(fit.outcome, AlignmentOutcome::kTooFewInliers);
  const std::vector<Eigen::Vector3d> place(5, Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(align_points_robust(place, place, {.max_error = 0.1}).outcome,
            AlignmentOutcome::kDegenerate);
  EXPECT_EQ(align_points_robust({}, {}, {.max_error = 0.1}).outcome,
            AlignmentOutcome::kTooFewPoints);
}

}  // namespace
}  // namespace trigmesh
