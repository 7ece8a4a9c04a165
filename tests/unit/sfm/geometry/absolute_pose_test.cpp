#include "sfm/geometry/absolute_pose.hpp"

#include <algorithm>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "sfm/geometry/pose_refinement.hpp"
#include "tests/unit/sfm/geometry/synthetic.hpp"

namespace trigmesh {
namespace {

using synthetic::Random;

constexpr double kDegree = std::numbers::pi / 180.0;

struct Problem {
  Camera camera;
  Rigid3 truth;
  std::vector<Eigen::Vector2d> pixels;
  std::vector<Eigen::Vector3d> points;
};

struct ProblemOptions {
  std::size_t count = 200;
  double outlier_ratio = 0.0;
  double noise_px = 0.0;
  Camera camera = synthetic::pinhole();
};

/// The first matches are wrong, the rest right.
Problem make_problem(Random& random, const ProblemOptions& options) {
  Problem problem{options.camera, {random.rotation(), random.in_box(5.0)}, {}, {}};
  const auto wrong =
      static_cast<std::size_t>(options.outlier_ratio * static_cast<double>(options.count));
  while (problem.pixels.size() < options.count) {
    const Eigen::Vector2d any(random.uniform(0.0, options.camera.width_px),
                              random.uniform(0.0, options.camera.height_px));
    const auto uv = normalize_pixel(options.camera, any);
    if (!uv) {
      continue;
    }
    const Eigen::Vector3d point_in_cam = random.uniform(3.0, 9.0) * uv->homogeneous();
    problem.points.push_back(problem.truth.inverse() * point_in_cam);
    Eigen::Vector2d pixel = any + random.gauss2(options.noise_px);
    if (problem.pixels.size() < wrong) {
      pixel = {random.uniform(0.0, options.camera.width_px),
               random.uniform(0.0, options.camera.height_px)};
    }
    problem.pixels.push_back(pixel);
  }
  return problem;
}

double rotation_error_deg(const Rigid3& pose, const Rigid3& truth) {
  return synthetic::rotation_distance_rad(pose.rotation, truth.rotation) / kDegree;
}

double center_error(const Rigid3& pose, const Rigid3& truth) {
  return (camera_center(pose) - camera_center(truth)).norm();
}

class AbsolutePoseByCamera : public testing::TestWithParam<Camera> {};

INSTANTIATE_TEST_SUITE_P(Cameras,
                         AbsolutePoseByCamera,
                         testing::Values(synthetic::pinhole(),
                                         synthetic::brown_conrady(),
                                         synthetic::fisheye()),
                         [](const testing::TestParamInfo<Camera>& parameter) {
                           return std::string(to_string(parameter.param.model));
                         });

TEST_P(AbsolutePoseByCamera, ExactMatchesGiveTheExactPose) {
  Random random(1);
  for (int i = 0; i < 20; ++i) {
    const Problem p = make_problem(random, {.count = 30, .camera = GetParam()});
    const AbsolutePose pose = estimate_absolute_pose(p.camera, p.pixels, p.points, {});
    ASSERT_EQ(pose.outcome, AbsolutePoseOutcome::kOk);
    EXPECT_EQ(pose.inlier_count, 30U);
    EXPECT_NEAR(rotation_error_deg(pose.cam_from_world, p.truth), 0.0, 1e-7);
    EXPECT_NEAR(center_error(pose.cam_from_world, p.truth), 0.0, 1e-8);
    EXPECT_NEAR(pose.rmse_px, 0.0, 1e-6);
  }
}

TEST_P(AbsolutePoseByCamera, SixtyPercentWrongMatchesDoNotMatter) {
  Random random(2);
  for (int i = 0; i < 10; ++i) {
    const Problem p = make_problem(
        random, {.count = 500, .outlier_ratio = 0.6, .noise_px = 0.7, .camera = GetParam()});
    const AbsolutePose pose = estimate_absolute_pose(p.camera, p.pixels, p.points, {});
    ASSERT_EQ(pose.outcome, AbsolutePoseOutcome::kOk);
    EXPECT_NEAR(static_cast<double>(pose.inlier_count), 200.0, 5.0);
    EXPECT_LT(rotation_error_deg(pose.cam_from_world, p.truth), 0.08);
    EXPECT_LT(center_error(pose.cam_from_world, p.truth), 0.02);
    EXPECT_NEAR(pose.rmse_px, 0.7 * std::numbers::sqrt2, 0.15);
  }
}

TEST(AbsolutePose, NinetyPercentWrongMatchesOnlyTakeLonger) {
  Random random(3);
  for (int i = 0; i < 3; ++i) {
    const Problem p = make_problem(random, {.count = 1000, .outlier_ratio = 0.9, .noise_px = 0.7});
    const AbsolutePose pose = estimate_absolute_pose(p.camera, p.pixels, p.points, {});
    ASSERT_EQ(pose.outcome, AbsolutePoseOutcome::kOk);
    EXPECT_NEAR(static_cast<double>(pose.inlier_count), 100.0, 6.0);
    EXPECT_LT(rotation_error_deg(pose.cam_from_world, p.truth), 0.1);
  }
}

TEST(AbsolutePose, MarksExactlyTheRightMatches) {
  Random random(4);
  const Problem p = make_problem(random, {.count = 100, .outlier_ratio = 0.5});
  const AbsolutePose pose =
      estimate_absolute_pose(p.camera, p.pixels, p.points, {.max_error_px = 1.0});
  for (std::size_t i = 0; i < 100; ++i) {
    EXPECT_EQ(pose.inliers[i], i < 50 ? 0 : 1) << i;
  }
}

TEST(AbsolutePose, SameSeedGivesTheSameBits) {
  Random random(5);
  const Problem p = make_problem(random, {.count = 300, .outlier_ratio = 0.7, .noise_px = 1.0});
  const AbsolutePose first = estimate_absolute_pose(p.camera, p.pixels, p.points, {.seed = 9});
  const AbsolutePose second = estimate_absolute_pose(p.camera, p.pixels, p.points, {.seed = 9});
  EXPECT_EQ(first.cam_from_world.matrix(), second.cam_from_world.matrix());
  EXPECT_EQ(first.inliers, second.inliers);
  EXPECT_EQ(first.iterations, second.iterations);
}

TEST(AbsolutePose, ErrorGrowsWithNoise) {
  const auto error_at = [](double noise_px) {
    Random random(6);
    double sum = 0.0;
    for (int i = 0; i < 20; ++i) {
      const Problem p = make_problem(random, {.count = 100, .noise_px = noise_px});
      const AbsolutePose pose =
          estimate_absolute_pose(p.camera, p.pixels, p.points, {.max_error_px = 12.0});
      sum += rotation_error_deg(pose.cam_from_world, p.truth);
    }
    return sum;
  };
  EXPECT_LT(error_at(0.1), error_at(0.5));
  EXPECT_LT(error_at(0.5), error_at(2.0));
}

TEST(AbsolutePose, PlanarPointsAreEnough) {
  Random random(7);
  const Camera camera = synthetic::brown_conrady();
  const Rigid3 truth = synthetic::look_at({1.0, -2.0, -4.0}, Eigen::Vector3d::Zero());
  std::vector<Eigen::Vector2d> pixels;
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 60; ++i) {
    const double x = random.uniform(-1.0, 1.0);
    points.emplace_back(x, random.uniform(-1.0, 1.0), 0.0);
    pixels.push_back(*project(camera, truth * points.back()) + random.gauss2(0.3));
  }
  const AbsolutePose pose = estimate_absolute_pose(camera, pixels, points, {});
  ASSERT_EQ(pose.outcome, AbsolutePoseOutcome::kOk);
  EXPECT_LT(rotation_error_deg(pose.cam_from_world, truth), 0.1);
}

TEST(AbsolutePose, PointsOnALineAreDegenerate) {
  const Camera camera = synthetic::pinhole();
  const Rigid3 truth = synthetic::look_at({1.0, -2.0, -4.0}, Eigen::Vector3d::Zero());
  std::vector<Eigen::Vector2d> pixels;
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 40; ++i) {
    points.push_back(Eigen::Vector3d(0.5, 1.0, -0.25) * (0.05 * i - 1.0));
    pixels.push_back(*project(camera, truth * points.back()));
  }
  EXPECT_EQ(estimate_absolute_pose(camera, pixels, points, {.max_iterations = 200}).outcome,
            AbsolutePoseOutcome::kDegenerate);
}

TEST(AbsolutePose, OnePointManyTimesIsDegenerate) {
  const Camera camera = synthetic::pinhole();
  const std::vector<Eigen::Vector3d> points(20, Eigen::Vector3d(0.0, 0.1, 4.0));
  const std::vector<Eigen::Vector2d> pixels(20, *project(camera, points.front()));
  EXPECT_EQ(estimate_absolute_pose(camera, pixels, points, {.max_iterations = 200}).outcome,
            AbsolutePoseOutcome::kDegenerate);
}

TEST(AbsolutePose, DuplicatedMatchesAreHarmless) {
  Random random(8);
  Problem p = make_problem(random, {.count = 20, .noise_px = 0.2});
  for (int copies = 0; copies < 3; ++copies) {
    p.pixels.insert(p.pixels.end(), p.pixels.begin(), p.pixels.begin() + 20);
    p.points.insert(p.points.end(), p.points.begin(), p.points.begin() + 20);
  }
  const AbsolutePose pose = estimate_absolute_pose(p.camera, p.pixels, p.points, {});
  ASSERT_EQ(pose.outcome, AbsolutePoseOutcome::kOk);
  EXPECT_LT(rotation_error_deg(pose.cam_from_world, p.truth), 0.2);
}

TEST(AbsolutePose, RandomMatchesHaveNoPose) {
  Random random(9);
  const Problem p = make_problem(random, {.count = 200, .outlier_ratio = 1.0});
  const AbsolutePose pose =
      estimate_absolute_pose(p.camera, p.pixels, p.points, {.max_iterations = 2000});
  EXPECT_EQ(pose.outcome, AbsolutePoseOutcome::kTooFewInliers);
  EXPECT_LT(pose.inlier_count, 12U);
}

TEST(AbsolutePose, ThreeMatchesAreTooFewAndFourAreTheLeast) {
  Random random(10);
  const Problem p = make_problem(random, {.count = 4});
  const std::span pixels(p.pixels);
  const std::span points(p.points);
  EXPECT_EQ(estimate_absolute_pose(p.camera, {}, {}, {}).outcome,
            AbsolutePoseOutcome::kTooFewPoints);
  EXPECT_EQ(estimate_absolute_pose(p.camera, pixels.first(3), points.first(3), {}).outcome,
            AbsolutePoseOutcome::kTooFewPoints);
  EXPECT_EQ(estimate_absolute_pose(p.camera, pixels, points, {}).outcome,
            AbsolutePoseOutcome::kTooFewInliers);
  const AbsolutePose pose = estimate_absolute_pose(p.camera, pixels, points, {.min_inliers = 4});
  ASSERT_EQ(pose.outcome, AbsolutePoseOutcome::kOk);
  EXPECT_LT(rotation_error_deg(pose.cam_from_world, p.truth), 1e-6);
}

TEST(AbsolutePose, WorldFarFromItsOriginKeepsThePrecision) {
  Random random(11);
  Problem p = make_problem(random, {.count = 100});
  const Eigen::Vector3d far(4.0e5, -2.0e5, 1.0e3);
  for (auto& point : p.points) {
    point += far;
  }
  p.truth = p.truth * Rigid3{Eigen::Quaterniond::Identity(), -far};
  const AbsolutePose pose = estimate_absolute_pose(p.camera, p.pixels, p.points, {});
  ASSERT_EQ(pose.outcome, AbsolutePoseOutcome::kOk);
  EXPECT_LT(center_error(pose.cam_from_world, p.truth), 1e-4);
}

TEST(RefineAbsolutePose, ComesBackFromANearbyStart) {
  Random random(12);
  for (int i = 0; i < 20; ++i) {
    const Problem p = make_problem(random, {.count = 200, .outlier_ratio = 0.3, .noise_px = 0.5});
    const Rigid3 nudge{
        Eigen::Quaterniond(Eigen::AngleAxisd(0.2 * kDegree, Eigen::Vector3d::UnitY())),
        {0.01, -0.01, 0.01}};
    const AbsolutePose pose =
        refine_absolute_pose(p.camera, p.pixels, p.points, nudge * p.truth, {});
    ASSERT_EQ(pose.outcome, AbsolutePoseOutcome::kOk);
    EXPECT_LT(rotation_error_deg(pose.cam_from_world, p.truth), 0.1);
    EXPECT_NEAR(static_cast<double>(pose.inlier_count), 140.0, 4.0);
  }
}

TEST(RefineAbsolutePose, SaysWhenTheStartExplainsNothing) {
  Random random(13);
  const Problem p = make_problem(random, {.count = 100});
  const Rigid3 turned{Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitY())),
                      Eigen::Vector3d::Zero()};
  EXPECT_EQ(refine_absolute_pose(p.camera, p.pixels, p.points, turned * p.truth, {}).outcome,
            AbsolutePoseOutcome::kTooFewInliers);
  EXPECT_EQ(refine_absolute_pose(p.camera, {}, {}, p.truth, {}).outcome,
            AbsolutePoseOutcome::kTooFewPoints);
}

TEST(FocalPose, FindsTheFocalLengthThroughoutTheRange) {
  Random random(14);
  for (const double focal_ratio : {0.55, 0.8, 1.2, 2.0, 2.8}) {
    Camera camera = synthetic::pinhole();
    camera.fx_px = camera.fy_px = focal_ratio * camera.width_px;
    const Problem p = make_problem(
        random, {.count = 300, .outlier_ratio = 0.5, .noise_px = 0.5, .camera = camera});
    Camera unknown = camera;
    unknown.fx_px = unknown.fy_px = 1.0;
    const FocalPose found = estimate_focal_pose(unknown, p.pixels, p.points, {}, {});
    ASSERT_EQ(found.pose.outcome, AbsolutePoseOutcome::kOk) << focal_ratio;
    EXPECT_NEAR(found.camera.fx_px / camera.fx_px, 1.0, 0.01) << focal_ratio;
    EXPECT_LT(rotation_error_deg(found.pose.cam_from_world, p.truth), 0.2);
    EXPECT_NEAR(static_cast<double>(found.pose.inlier_count), 150.0, 5.0);
    EXPECT_LT(found.focal_relative_sigma, 0.01);
    EXPECT_GT(found.focal_relative_sigma, 1e-5);
  }
}

TEST(FocalPose, KeepsDistortionAndAspect) {
  Random random(15);
  const Camera camera = synthetic::brown_conrady();
  const Problem p = make_problem(random, {.count = 200, .camera = camera});
  Camera guess = camera;
  guess.fx_px *= 1.7;
  guess.fy_px *= 1.7;
  const FocalPose found = estimate_focal_pose(guess, p.pixels, p.points, {}, {});
  ASSERT_EQ(found.pose.outcome, AbsolutePoseOutcome::kOk);
  EXPECT_NEAR(found.camera.fx_px, camera.fx_px, 0.01);
  EXPECT_NEAR(found.camera.fy_px, camera.fy_px, 0.01);
  EXPECT_EQ(found.camera.distortion, camera.distortion);
}

TEST(FocalPose, PlaneSeenStraightOnSaysThatTheFocalLengthIsOpen) {
  Random random(16);
  const Camera camera = synthetic::pinhole();
  std::vector<Eigen::Vector2d> pixels;
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 100; ++i) {
    const double x = random.uniform(-1.0, 1.0);
    points.emplace_back(x, random.uniform(-1.0, 1.0), 4.0);
    pixels.push_back(*project(camera, points.back()) + random.gauss2(0.5));
  }
  const FocalPose found = estimate_focal_pose(camera, pixels, points, {}, {});
  if (found.pose.outcome == AbsolutePoseOutcome::kOk) {
    EXPECT_GT(found.focal_relative_sigma, 0.02);
  } else {
    EXPECT_EQ(found.pose.outcome, AbsolutePoseOutcome::kDegenerate);
  }
}

TEST(FocalPose, SaysWhenThereIsNothingToFind) {
  Random random(17);
  const Problem p = make_problem(random, {.count = 60, .outlier_ratio = 1.0});
  EXPECT_EQ(
      estimate_focal_pose(p.camera, p.pixels, p.points, {.max_iterations = 100}, {}).pose.outcome,
      AbsolutePoseOutcome::kTooFewInliers);
  EXPECT_EQ(estimate_focal_pose(p.camera, {}, {}, {}, {}).pose.outcome,
            AbsolutePoseOutcome::kTooFewPoints);
}

TEST(RefinePose, StepsAgreeWithNumericMinimum) {
  // At the minimum no small motion lowers the sum of squares.
  Random random(18);
  const Problem p = make_problem(random, {.count = 40, .noise_px = 1.0});
  const std::vector<std::uint8_t> all(p.pixels.size(), 1);
  constexpr double kNearlyQuadratic = 1e4;
  const PoseRefinement refined = refine_pose({p.camera, p.truth},
                                             p.pixels,
                                             p.points,
                                             all,
                                             kNearlyQuadratic,
                                             PoseUnknowns::kPoseAndFocal,
                                             30);
  ASSERT_TRUE(refined.usable);
  EXPECT_TRUE(refined.determined);
  const auto cost = [&](const Camera& camera, const Rigid3& pose) {
    double sum = 0.0;
    for (std::size_t i = 0; i < p.pixels.size(); ++i) {
      sum += (*project(camera, pose * p.points[i]) - p.pixels[i]).squaredNorm();
    }
    return sum;
  };
  const double least = cost(refined.result.camera, refined.result.cam_from_world);
  for (int k = 0; k < 3; ++k) {
    for (const double step : {-1e-4, 1e-4}) {
      const Eigen::Vector3d axis = Eigen::Vector3d::Unit(k);
      const Rigid3 turn{Eigen::Quaterniond(Eigen::AngleAxisd(step, axis)), Eigen::Vector3d::Zero()};
      const Rigid3 shift{Eigen::Quaterniond::Identity(), step * axis};
      EXPECT_GT(cost(refined.result.camera, turn * refined.result.cam_from_world), least);
      EXPECT_GT(cost(refined.result.camera, shift * refined.result.cam_from_world), least);
      Camera zoomed = refined.result.camera;
      zoomed.fx_px *= 1.0 + step;
      zoomed.fy_px *= 1.0 + step;
      EXPECT_GT(cost(zoomed, refined.result.cam_from_world), least);
    }
  }
}

TEST(AbsolutePoseOptions, ValidateNamesTheField) {
  EXPECT_TRUE(AbsolutePoseOptions{}.validate());
  EXPECT_NE(AbsolutePoseOptions{.max_error_px = -2.0}.validate().error().message.find(
                "max_error_px is -2"),
            std::string::npos);
  EXPECT_FALSE(AbsolutePoseOptions{.min_inliers = 3}.validate());
  EXPECT_FALSE(AbsolutePoseOptions{.confidence = 1.0}.validate());
  EXPECT_FALSE(AbsolutePoseOptions{.max_iterations = 0}.validate());
  EXPECT_TRUE(FocalSearchOptions{}.validate());
  EXPECT_FALSE((FocalSearchOptions{.min_focal_ratio = 2.0, .max_focal_ratio = 1.0}.validate()));
  EXPECT_FALSE(FocalSearchOptions{.candidates = 1}.validate());
}

}  // namespace
}  // namespace trigmesh
