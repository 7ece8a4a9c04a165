#include "sfm/geometry/relative_pose.hpp"

#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "sfm/geometry/epipolar.hpp"
#include "sfm/geometry/homography.hpp"
#include "tests/unit/sfm/geometry/two_view.hpp"

namespace trigmesh {
namespace {

using synthetic::make_two_view;
using synthetic::Random;
using synthetic::Structure;
using synthetic::TwoViewMatches;

constexpr double kDegree = std::numbers::pi / 180.0;

RelativePose estimate(const TwoViewMatches& m, const RelativePoseOptions& options = {}) {
  return estimate_relative_pose(m.camera, m.camera, m.first_px, m.second_px, options);
}

double rotation_error_deg(const RelativePose& pose, const TwoViewMatches& m) {
  return synthetic::rotation_distance_rad(pose.second_from_first.rotation,
                                          m.second_from_first.rotation) /
         kDegree;
}

double direction_error_deg(const RelativePose& pose, const TwoViewMatches& m) {
  return synthetic::direction_distance_rad(pose.second_from_first.translation,
                                           m.second_from_first.translation) /
         kDegree;
}

/// What the noise leaves at best: the true pose refined on the true matches alone, which are the
/// last ones.
RelativePose noise_floor(const TwoViewMatches& m, std::size_t first_right) {
  const Eigen::Matrix3d k = m.camera.calibration_matrix();
  std::vector<Eigen::Vector2d> first;
  std::vector<Eigen::Vector2d> second;
  for (std::size_t i = first_right; i < m.first.size(); ++i) {
    first.emplace_back((k * m.first[i].homogeneous()).hnormalized());
    second.emplace_back((k * m.second[i].homogeneous()).hnormalized());
  }
  return {.second_from_first =
              refine_relative_pose(m.second_from_first, {k, k}, first, second, {}, {})};
}

class RelativePoseByCamera : public testing::TestWithParam<Camera> {};

INSTANTIATE_TEST_SUITE_P(Cameras,
                         RelativePoseByCamera,
                         testing::Values(synthetic::pinhole(), synthetic::brown_conrady()),
                         [](const testing::TestParamInfo<Camera>& parameter) {
                           return std::string(to_string(parameter.param.model));
                         });

TEST_P(RelativePoseByCamera, ExactMatchesGiveTheExactPose) {
  Random random(1);
  for (int i = 0; i < 10; ++i) {
    const TwoViewMatches m = make_two_view(random, {.count = 50, .camera = GetParam()});
    const RelativePose pose = estimate(m);
    ASSERT_EQ(pose.outcome, RelativePoseOutcome::kOk);
    EXPECT_EQ(pose.inlier_count, 50U);
    EXPECT_LT(rotation_error_deg(pose, m), 1e-6);
    EXPECT_LT(direction_error_deg(pose, m), 1e-5);
    EXPECT_NEAR(pose.second_from_first.translation.norm(), 1.0, 1e-12);
    EXPECT_GT(pose.median_angle_rad, 3.0 * kDegree);
  }
}

TEST_P(RelativePoseByCamera, HalfTheMatchesMayBeWrong) {
  Random random(2);
  for (int i = 0; i < 5; ++i) {
    const TwoViewMatches m = make_two_view(
        random, {.count = 400, .outlier_ratio = 0.5, .noise_px = 0.5, .camera = GetParam()});
    const RelativePose pose = estimate(m);
    ASSERT_EQ(pose.outcome, RelativePoseOutcome::kOk);
    const RelativePose best = noise_floor(m, 200);
    EXPECT_LT(rotation_error_deg(pose, m), 0.05 + 1.5 * rotation_error_deg(best, m));
    EXPECT_LT(direction_error_deg(pose, m), 0.3 + 1.5 * direction_error_deg(best, m));
    std::size_t right = 0;
    for (std::size_t k = 200; k < 400; ++k) {
      right += pose.inliers[k];
    }
    EXPECT_GE(right, 192U);
    EXPECT_LE(pose.inlier_count - right, 12U);  // wrong matches that lie on their epipolar line
    EXPECT_NEAR(pose.rmse_px, 0.5, 0.15);
  }
}

TEST(RelativePose, SeventyPercentWrongMatchesOnlyTakeLonger) {
  Random random(3);
  const TwoViewMatches m =
      make_two_view(random, {.count = 600, .outlier_ratio = 0.7, .noise_px = 0.5});
  const RelativePose pose = estimate(m);
  ASSERT_EQ(pose.outcome, RelativePoseOutcome::kOk);
  EXPECT_LT(rotation_error_deg(pose, m), 0.2);
  EXPECT_GT(pose.inlier_count, 170U);
}

TEST(RelativePose, PlaneGivesTheTrueMotionOrItsTwin) {
  // Two motions explain a plane exactly (Hartley & Zisserman, section 13.1); no solver can do
  // better than one of them.
  Random random(4);
  int right = 0;
  for (int i = 0; i < 10; ++i) {
    const TwoViewMatches m =
        make_two_view(random, {.count = 200, .noise_px = 0.2, .structure = Structure::kPlane});
    const RelativePose pose = estimate(m);
    ASSERT_EQ(pose.outcome, RelativePoseOutcome::kOk);
    EXPECT_GT(pose.inlier_count, 195U);
    EXPECT_NEAR(pose.rmse_px, 0.2, 0.05);
    right += rotation_error_deg(pose, m) < 0.5 ? 1 : 0;
  }
  EXPECT_GE(right, 3);
}

TEST(OtherMotionOfPlane, ExplainsTheSameHomographyAndLeadsBack) {
  Random random(14);
  for (int i = 0; i < 20; ++i) {
    const TwoViewMatches m = make_two_view(random, {.count = 30, .structure = Structure::kPlane});
    const Eigen::Matrix3d plane = estimate_homography(m.first, m.second).second_from_first;
    const auto twin = other_motion_of_plane(plane, m.second_from_first);
    ASSERT_TRUE(twin);
    EXPECT_GT(synthetic::rotation_distance_rad(twin->rotation, m.second_from_first.rotation),
              0.01 * kDegree);
    const Eigen::Matrix3d essential = essential_from_pose(*twin);
    for (std::size_t k = 0; k < m.first.size(); ++k) {
      EXPECT_LT(sampson_error_squared(essential, m.first[k], m.second[k]), 1e-18);
    }
    const auto back = other_motion_of_plane(plane, *twin);
    ASSERT_TRUE(back);
    EXPECT_LT(synthetic::rotation_distance_rad(back->rotation, m.second_from_first.rotation), 1e-7);
  }
  EXPECT_FALSE(other_motion_of_plane(Eigen::Matrix3d::Zero(), Rigid3{}));
  EXPECT_FALSE(other_motion_of_plane(Eigen::Matrix3d::Identity(), Rigid3{}));
}

TEST(RelativePose, PureRotationIsNamedAndItsRotationFound) {
  Random random(5);
  for (int i = 0; i < 10; ++i) {
    const TwoViewMatches m =
        make_two_view(random, {.count = 300, .noise_px = i < 5 ? 0.0 : 0.5, .baseline = 0.0});
    const RelativePose pose = estimate(m);
    ASSERT_EQ(pose.outcome, RelativePoseOutcome::kNoParallax);
    EXPECT_LT(rotation_error_deg(pose, m), 0.05);
    EXPECT_EQ(pose.second_from_first.translation.norm(), 0.0);
    EXPECT_GT(pose.rotation_inlier_count, 250U);
  }
}

TEST(RelativePose, PointsAtInfinityAreNoParallaxToo) {
  Random random(6);
  const TwoViewMatches m =
      make_two_view(random, {.count = 100, .noise_px = 0.3, .structure = Structure::kInfinity});
  EXPECT_EQ(estimate(m).outcome, RelativePoseOutcome::kNoParallax);
}

TEST(RelativePose, SamePictureTwiceIsNoParallax) {
  Random random(7);
  TwoViewMatches m = make_two_view(random, {.count = 100});
  m.second_px = m.first_px;
  const RelativePose pose = estimate(m);
  EXPECT_EQ(pose.outcome, RelativePoseOutcome::kNoParallax);
  EXPECT_LT(rotation_angle(pose.second_from_first.rotation), 1e-9);
}

TEST(RelativePose, RandomMatchesHaveNoPose) {
  Random random(8);
  const TwoViewMatches m = make_two_view(random, {.count = 200, .outlier_ratio = 1.0});
  const RelativePose pose = estimate(m, {.max_iterations = 200});
  EXPECT_EQ(pose.outcome, RelativePoseOutcome::kTooFewInliers);
}

TEST(RelativePose, MinimalCounts) {
  Random random(9);
  TwoViewMatches m = make_two_view(random, {.count = 6});
  EXPECT_EQ(estimate(m).outcome, RelativePoseOutcome::kTooFewInliers);
  const RelativePose six = estimate(m, {.min_inliers = 6});
  EXPECT_EQ(six.inlier_count, 6U);
  m.first_px.pop_back();
  m.second_px.pop_back();
  EXPECT_EQ(estimate(m).outcome, RelativePoseOutcome::kTooFewPoints);
  EXPECT_EQ(estimate_relative_pose(m.camera, m.camera, {}, {}, {}).outcome,
            RelativePoseOutcome::kTooFewPoints);
}

TEST(RelativePose, SameSeedGivesTheSameBits) {
  Random random(10);
  const TwoViewMatches m =
      make_two_view(random, {.count = 200, .outlier_ratio = 0.4, .noise_px = 0.5});
  const RelativePose first = estimate(m);
  const RelativePose second = estimate(m);
  EXPECT_EQ(first.second_from_first.matrix(), second.second_from_first.matrix());
  EXPECT_EQ(first.inliers, second.inliers);
}

TEST(RelativePose, SwappingTheImagesInvertsThePose) {
  Random random(11);
  const TwoViewMatches m = make_two_view(random, {.count = 80});
  const RelativePose there = estimate(m);
  const RelativePose back = estimate_relative_pose(m.camera, m.camera, m.second_px, m.first_px, {});
  const Rigid3 inverse = there.second_from_first.inverse();
  EXPECT_LT(synthetic::rotation_distance_rad(back.second_from_first.rotation, inverse.rotation),
            1e-7);
  EXPECT_LT(
      synthetic::direction_distance_rad(back.second_from_first.translation, inverse.translation),
      1e-6);
}

TEST(RelativePoseFromFundamental, EqualsSamplingWhenTheFundamentalMatrixIsRight) {
  Random random(12);
  const TwoViewMatches m =
      make_two_view(random, {.count = 300, .outlier_ratio = 0.3, .noise_px = 0.5});
  const Eigen::Matrix3d k = m.camera.calibration_matrix();
  const std::span first(m.first_px);
  const std::span second(m.second_px);
  const Eigen::Matrix3d f = estimate_fundamental(first.subspan(90), second.subspan(90)).fundamental;
  const RelativePose pose =
      relative_pose_from_fundamental(f, m.camera, m.camera, first, second, {});
  ASSERT_EQ(pose.outcome, RelativePoseOutcome::kOk);
  EXPECT_LT(rotation_error_deg(pose, m), 0.15);
  EXPECT_EQ(relative_pose_from_fundamental(
                fundamental_from_essential(essential_from_pose(m.second_from_first), k, k),
                m.camera,
                m.camera,
                first.first(3),
                second.first(3),
                {})
                .outcome,
            RelativePoseOutcome::kTooFewPoints);
}

TEST(RelativePoseFromFundamental, ZeroMatrixIsRefused) {
  Random random(13);
  const TwoViewMatches m = make_two_view(random, {.count = 50});
  const RelativePose pose = relative_pose_from_fundamental(
      Eigen::Matrix3d::Zero(), m.camera, m.camera, m.first_px, m.second_px, {});
  EXPECT_NE(pose.outcome, RelativePoseOutcome::kOk);
}

TEST(RelativePoseOptions, ValidateNamesTheField) {
  EXPECT_TRUE(RelativePoseOptions{}.validate());
  EXPECT_NE(
      RelativePoseOptions{.max_error_px = 0.0}.validate().error().message.find("max_error_px is 0"),
      std::string::npos);
  EXPECT_FALSE(RelativePoseOptions{.min_inliers = 5}.validate());
  EXPECT_FALSE(RelativePoseOptions{.confidence = 0.0}.validate());
  EXPECT_FALSE(RelativePoseOptions{.max_iterations = 0}.validate());
}

}  // namespace
}  // namespace trigmesh
