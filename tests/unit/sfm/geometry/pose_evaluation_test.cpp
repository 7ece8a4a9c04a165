#include "sfm/geometry/pose_evaluation.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sfm/geometry/similarity.hpp"

namespace trigmesh {
namespace {

using ::testing::HasSubstr;

Rigid3 pose_at(const Eigen::Vector3d& center, double turn_rad) {
  const Eigen::Quaterniond rotation(
      Eigen::AngleAxisd(turn_rad, Eigen::Vector3d(1.0, 2.0, -1.0).normalized()));
  return {rotation, -(rotation * center)};
}

/// Five cameras, not on one line.
std::vector<NamedPose> some_poses() {
  std::vector<NamedPose> poses;
  for (int i = 0; i < 5; ++i) {
    const double a = 0.4 * i;
    poses.push_back({"folder/img" + std::to_string(i) + ".jpg",
                     pose_at({3.0 * std::cos(a), 3.0 * std::sin(a), 0.2 * i * i}, a)});
  }
  return poses;
}

std::vector<NamedPose> moved(std::vector<NamedPose> poses, double scale) {
  const Sim3 b_from_a{scale, Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5), {4.0, -2.0, 9.0}};
  for (NamedPose& pose : poses) {
    pose.cam_from_world = transform_pose(b_from_a, pose.cam_from_world);
  }
  return poses;
}

TEST(PoseEvaluation, IsPerfectForAModelThatDiffersByASimilarity) {
  const auto score =
      evaluate_poses(some_poses(), moved(some_poses(), 7.5), ScaleAlignment::kFitted);
  ASSERT_TRUE(score.has_value()) << score.error().message;
  EXPECT_EQ(score->registered, 5U);
  EXPECT_EQ(score->truth_count, 5U);
  EXPECT_LT(score->position_max, 1e-12);
  EXPECT_LT(score->rotation_median_deg, 1e-10);
  EXPECT_NEAR(score->auc_1_deg, 1.0, 1e-9);
}

TEST(PoseEvaluation, CountsAWrongScaleOnlyWhenTheModelClaimsToBeMetric) {
  const auto same =
      evaluate_poses(some_poses(), moved(some_poses(), 1.0), ScaleAlignment::kMeasured);
  ASSERT_TRUE(same.has_value());
  EXPECT_LT(same->position_max, 1e-12);
  const auto twice =
      evaluate_poses(some_poses(), moved(some_poses(), 2.0), ScaleAlignment::kMeasured);
  ASSERT_TRUE(twice.has_value());
  EXPECT_GT(twice->position_rmse, 0.5);
}

TEST(PoseEvaluation, PairsNamesWithoutFolderAndExtension) {
  std::vector<NamedPose> estimate = some_poses();
  for (NamedPose& pose : estimate) {
    pose.name = "other/place/" + pose.name.substr(7, 4) + ".png";
  }
  const auto score = evaluate_poses(some_poses(), estimate, ScaleAlignment::kFitted);
  ASSERT_TRUE(score.has_value()) << score.error().message;
  EXPECT_EQ(score->registered, 5U);
}

TEST(PoseEvaluation, PairsFullNamesWhenStemsRepeat) {
  std::vector<NamedPose> truth = some_poses();
  truth[0].name = "left/img.jpg";
  truth[1].name = "right/img.jpg";
  const auto score = evaluate_poses(truth, truth, ScaleAlignment::kFitted);
  ASSERT_TRUE(score.has_value()) << score.error().message;
  EXPECT_EQ(score->registered, 5U);
  truth[1].name = "left/img.jpg";
  EXPECT_EQ(evaluate_poses(truth, truth, ScaleAlignment::kFitted).error().code,
            ErrorCode::kInvalidArgument);
}

TEST(PoseEvaluation, CountsPairsWithAnUnregisteredImageAsWrong) {
  std::vector<NamedPose> estimate = some_poses();
  estimate.pop_back();
  const auto score = evaluate_poses(some_poses(), estimate, ScaleAlignment::kFitted);
  ASSERT_TRUE(score.has_value());
  EXPECT_EQ(score->registered, 4U);
  EXPECT_NEAR(score->auc_5_deg, 0.6, 1e-9);  // 6 of 10 pairs
}

TEST(PoseEvaluation, MeasuresATurnedCamera) {
  std::vector<NamedPose> estimate = some_poses();
  for (NamedPose& pose : estimate) {  // every camera rolls by 2 degrees about its own axis
    const Eigen::Quaterniond roll(
        Eigen::AngleAxisd(2.0 * std::numbers::pi / 180.0, Eigen::Vector3d::UnitZ()));
    pose.cam_from_world = Rigid3{roll, Eigen::Vector3d::Zero()} * pose.cam_from_world;
  }
  const auto score = evaluate_poses(some_poses(), estimate, ScaleAlignment::kFitted);
  ASSERT_TRUE(score.has_value());
  EXPECT_NEAR(score->rotation_median_deg, 2.0, 1e-9);
  EXPECT_LT(score->position_max, 1e-12);
  EXPECT_LT(score->auc_1_deg, score->auc_5_deg);
}

TEST(PoseEvaluation, NeedsThreeCommonImagesThatAreNotOnALine) {
  std::vector<NamedPose> estimate = some_poses();
  estimate.resize(2);
  const auto few = evaluate_poses(some_poses(), estimate, ScaleAlignment::kFitted);
  ASSERT_FALSE(few.has_value());
  EXPECT_EQ(few.error().code, ErrorCode::kInsufficientData);
  EXPECT_THAT(few.error().message, HasSubstr("only 2 of the 5"));

  std::vector<NamedPose> line = some_poses();
  for (std::size_t i = 0; i < line.size(); ++i) {
    line[i].cam_from_world = pose_at({static_cast<double>(i), 0.0, 0.0}, 0.1);
  }
  EXPECT_EQ(evaluate_poses(line, line, ScaleAlignment::kFitted).error().code,
            ErrorCode::kInsufficientData);
  EXPECT_FALSE(evaluate_poses({}, {}, ScaleAlignment::kFitted).has_value());
}

TEST(RecallArea, IsTheAreaUnderThePiecewiseLinearCurve) {
  EXPECT_DOUBLE_EQ(recall_area({0.0, 0.0}, 1.0), 1.0);
  EXPECT_DOUBLE_EQ(recall_area({1.0, 2.0}, 1.0), 0.0);
  EXPECT_DOUBLE_EQ(recall_area({}, 1.0), 0.0);
  // One of two errors below the limit: a triangle of 0.5 x 0.5 / 2, then 0.5 high to the limit.
  EXPECT_DOUBLE_EQ(recall_area({0.5, std::numeric_limits<double>::infinity()}, 1.0), 0.375);
  EXPECT_DOUBLE_EQ(recall_area({1.0, 0.5, 9.0, 0.25}, 2.0),
                   (0.125 * 0.25 + 0.375 * 0.25 + 0.625 * 0.5 + 0.75 * 1.0) / 2.0);
}

}  // namespace
}  // namespace trigmesh
