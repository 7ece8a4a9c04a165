#include "sfm/mapping/bundle_adjustment.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/matchers.hpp"
#include "tests/support/random.hpp"
#include "tests/unit/sfm/mapping/bundle_test_scenes.hpp"

namespace trigmesh {
namespace {

using bundle_test::least_squares;
using bundle_test::lens;
using bundle_test::make_truth;
using bundle_test::same_bits;
using test_support::compare_reconstruction;
using test_support::make_synthetic_scene;
using test_support::PathKind;
using test_support::perturbed;
using test_support::ReconstructionNear;
using test_support::SyntheticSceneOptions;
using ::testing::Not;

// ---------------------------------------------------------------------------------------------------------------------
// Convergence.

class BundleAdjustment : public ::testing::TestWithParam<CameraModel> {};

TEST_P(BundleAdjustment, FindsTheTruthWithoutNoise) {
  SyntheticSceneOptions options;
  options.camera = lens(GetParam());
  options.points = 200;
  const Scene truth = make_truth(options);
  Scene scene = perturbed(truth, {.rotation_rad = 5e-3, .translation = 0.03, .point = 0.03});
  const BundleReport report = adjust_bundle(scene, select_everything(scene), least_squares());
  EXPECT_EQ(report.outcome, BundleOutcome::kConverged);
  EXPECT_GT(report.initial_rmse_px, 2.0);
  EXPECT_LT(report.final_rmse_px, 1e-4);  // keypoints are float: 3e-5 px at 600 px
  EXPECT_THAT(scene, ReconstructionNear(truth, 1e-6, 1e-6));
}

INSTANTIATE_TEST_SUITE_P(AllLenses,
                         BundleAdjustment,
                         ::testing::Values(CameraModel::kPinhole,
                                           CameraModel::kRadial,
                                           CameraModel::kBrownConrady,
                                           CameraModel::kKannalaBrandt));

TEST(BundleAdjustment, ResidualsMeetTheNoiseLessTheFreedoms) {
  const Scene truth = make_truth({.noise_px = 0.5, .dropout_ratio = 0.4});
  Scene scene = perturbed(truth, {.rotation_rad = 2e-3, .translation = 0.01, .point = 0.01});
  const BundleReport report = adjust_bundle(scene, select_everything(scene), least_squares());
  // E[sum of squares] = sigma^2 (equations - unknowns), unknowns less the seven freedoms of the
  // gauge.
  const double equations = 2.0 * static_cast<double>(report.observations);
  const double unknowns =
      3.0 * static_cast<double>(report.landmarks) + 6.0 * static_cast<double>(truth.views.size());
  const double expected = 0.5 * std::sqrt(2.0 * (equations - unknowns + 7.0) / equations);
  EXPECT_NEAR(report.final_rmse_px, expected, 0.02 * expected);
  EXPECT_THAT(scene, ReconstructionNear(truth, 1e-3, 4e-3));
}

TEST(BundleAdjustment, ReportsTheLimitOfIterations) {
  Scene scene = perturbed(make_truth({.points = 100}), {.rotation_rad = 5e-3, .point = 0.05});
  BundleOptions options = least_squares();
  options.max_iterations = 1;
  const BundleReport report = adjust_bundle(scene, select_everything(scene), options);
  EXPECT_EQ(report.outcome, BundleOutcome::kMaxIterations);
  EXPECT_EQ(report.iterations, 1);
  EXPECT_LT(report.final_cost, report.initial_cost);
}

// ---------------------------------------------------------------------------------------------------------------------
// What is held and what is free.

TEST(BundleAdjustment, ConstantViewsIntrinsicsAndOtherLandmarksKeepTheirBits) {
  const Scene truth = make_truth({.points = 200, .noise_px = 0.5});
  const Scene start = perturbed(truth, {.rotation_rad = 1e-3, .translation = 0.01, .point = 0.01});
  BundleSelection selection;
  selection.variable_views = {ViewId{4}, ViewId{5}};
  selection.constant_views = {ViewId{2}, ViewId{3}, ViewId{7}};
  for (std::size_t i = 0; i < 100; ++i) {
    selection.landmarks.push_back(id_of<LandmarkId>(2 * i % truth.landmarks.size()));
  }
  Scene scene = start;
  const BundleReport report = adjust_bundle(scene, selection, {});
  EXPECT_EQ(report.variable_views, 2U);
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    EXPECT_EQ(same_bits(*scene.views[i].cam_from_world, *start.views[i].cam_from_world),
              i != 4 && i != 5)
        << i;
  }
  EXPECT_EQ(scene.cameras, start.cameras);
  EXPECT_EQ(scene.landmarks[1].position_in_world, start.landmarks[1].position_in_world);
  EXPECT_NE(scene.landmarks[2].position_in_world, start.landmarks[2].position_in_world);
}

TEST(BundleAdjustment, HeldLandmarksKeepTheirBitsAndPosesConverge) {
  const Scene truth = make_truth({.points = 200});
  Scene scene = perturbed(truth, {.rotation_rad = 0.01, .translation = 0.05});
  BundleSelection selection = select_everything(scene);
  selection.landmark_mode = LandmarkMode::kConstant;
  for (const std::size_t count : {1U, 10U}) {  // dense and sparse normal equations
    selection.variable_views.resize(count);
    (void)adjust_bundle(scene, selection, least_squares());
    for (std::size_t i = 0; i < count; ++i) {
      EXPECT_THAT(*scene.views[i].cam_from_world,
                  test_support::Rigid3Near(*truth.views[i].cam_from_world, 1e-6, 1e-6));
    }
    selection = select_everything(scene);
    selection.landmark_mode = LandmarkMode::kConstant;
  }
  EXPECT_EQ(scene.landmarks[5].position_in_world, truth.landmarks[5].position_in_world);
}

TEST(BundleAdjustment, OnlyPointsMoveWhenEveryViewIsHeld) {
  const Scene truth = make_truth({.points = 100});
  Scene scene = perturbed(truth, {.point = 0.05});
  BundleSelection selection = select_everything(scene);
  std::swap(selection.variable_views, selection.constant_views);
  const BundleReport report = adjust_bundle(scene, selection, least_squares());
  EXPECT_EQ(report.outcome, BundleOutcome::kConverged);
  for (std::size_t i = 0; i < truth.landmarks.size(); ++i) {
    const Eigen::Vector3d error =
        scene.landmarks[i].position_in_world - truth.landmarks[i].position_in_world;
    ASSERT_LT(error.norm(), 1e-5);
  }
}

TEST(BundleAdjustment, GaugeHoldsTheFirstPoseAndTheScale) {
  const Scene truth = make_truth({.points = 200, .noise_px = 0.5});
  const Scene start = perturbed(truth, {.rotation_rad = 1e-3, .translation = 0.01, .point = 0.01});
  Scene scene = start;
  for (int i = 0; i < 10; ++i) {
    (void)adjust_bundle(scene, select_everything(scene), {});
  }
  EXPECT_TRUE(same_bits(*scene.views[0].cam_from_world, *start.views[0].cam_from_world));
  EXPECT_NEAR(compare_reconstruction(scene, start).scale, 1.0, 2e-3);
}

TEST(BundleAdjustment, OneConstantViewStillHoldsTheScale) {
  const Scene start = perturbed(make_truth({.points = 200, .noise_px = 0.5}),
                                {.rotation_rad = 1e-3, .translation = 0.01, .point = 0.01});
  Scene scene = start;
  BundleSelection selection = select_everything(scene);
  selection.constant_views = {ViewId{3}};
  selection.variable_views.erase(selection.variable_views.begin() + 3);
  for (int i = 0; i < 10; ++i) {
    (void)adjust_bundle(scene, selection, {});
  }
  EXPECT_TRUE(same_bits(*scene.views[3].cam_from_world, *start.views[3].cam_from_world));
  EXPECT_NEAR(compare_reconstruction(scene, start).scale, 1.0, 2e-3);
}

TEST(BundleAdjustment, FreeFocalAndDistortionAreRecovered) {
  SyntheticSceneOptions scene_options;
  scene_options.camera = lens(CameraModel::kBrownConrady);
  scene_options.noise_px = 0.3;
  scene_options.extent = 3.4;  // fills the images: distortion shows at their borders
  scene_options.camera_groups = 2;
  scene_options.views = 16;
  const Scene truth = make_truth(scene_options);
  Scene scene = perturbed(truth, {.rotation_rad = 1e-3, .translation = 0.01, .point = 0.01});
  BundleOptions options = least_squares();
  for (Camera& camera : scene.cameras) {
    camera.fx_px *= 1.05;
    camera.fy_px *= 1.05;
    camera.distortion = {};
    IntrinsicsFreedom freedom;
    freedom.focal = true;
    freedom.distortion = 4;
    options.intrinsics.push_back(freedom);
  }
  (void)adjust_bundle(scene, select_everything(scene), options);
  for (std::size_t i = 0; i < 2; ++i) {
    const Camera& found = scene.cameras[i];
    const Camera& wanted = truth.cameras[i];
    EXPECT_NEAR(found.fx_px, wanted.fx_px, 1e-3 * wanted.fx_px);
    EXPECT_NEAR(found.fy_px / found.fx_px, wanted.fy_px / wanted.fx_px, 1e-12);
    EXPECT_NEAR(found.distortion[0], wanted.distortion[0], 0.01);
    EXPECT_EQ(found.cx_px, wanted.cx_px);
  }
}

TEST(BundleAdjustment, AllSevenIntrinsicsCanBeFree) {
  SyntheticSceneOptions scene_options;
  scene_options.camera = lens(CameraModel::kBrownConrady);
  scene_options.path = PathKind::kRandom;
  scene_options.views = 16;
  const Scene truth = make_truth(scene_options);
  Scene scene = truth;
  scene.cameras[0].fx_px *= 1.02;
  scene.cameras[0].fy_px *= 1.02;
  scene.cameras[0].cx_px += 5.0;
  scene.cameras[0].distortion[3] = 0.0;
  BundleOptions options = least_squares();
  options.intrinsics.resize(1);
  options.intrinsics[0].focal = true;
  options.intrinsics[0].principal_point = true;
  options.intrinsics[0].distortion = 4;
  (void)adjust_bundle(scene, select_everything(scene), options);
  EXPECT_NEAR(scene.cameras[0].fx_px, truth.cameras[0].fx_px, 0.01);
  EXPECT_NEAR(scene.cameras[0].cx_px, truth.cameras[0].cx_px, 0.05);
  EXPECT_NEAR(scene.cameras[0].distortion[3], truth.cameras[0].distortion[3], 1e-4);
}

TEST(BundleAdjustment, OnlyOneOfTwoCamerasIsSolved) {
  SyntheticSceneOptions scene_options;
  scene_options.camera_groups = 2;
  const Scene truth = make_truth(scene_options);
  Scene scene = truth;
  scene.cameras[1].fx_px *= 1.02;
  scene.cameras[1].fy_px *= 1.02;
  BundleOptions options = least_squares();
  options.intrinsics.resize(2);
  options.intrinsics[1].focal = true;
  (void)adjust_bundle(scene, select_everything(scene), options);
  EXPECT_EQ(scene.cameras[0], truth.cameras[0]);
  EXPECT_NEAR(scene.cameras[1].fx_px, truth.cameras[1].fx_px, 1e-2);
}

TEST(BundleAdjustment, PriorPullsTheFocalInProportionToItsSigma) {
  const Scene truth = make_truth({.points = 150, .noise_px = 1.0, .dropout_ratio = 0.5});
  const auto focal_with_prior = [&truth](double sigma_ratio) {
    Scene scene = truth;
    BundleOptions options = least_squares();
    options.intrinsics.resize(1);
    options.intrinsics[0].focal = true;
    options.intrinsics[0].focal_sigma_ratio = sigma_ratio;
    options.intrinsics[0].prior = truth.cameras[0];
    options.intrinsics[0].prior.fx_px = 770.0;  // 10 % off
    (void)adjust_bundle(scene, select_everything(scene), options);
    return scene.cameras[0].fx_px;
  };
  const double free = focal_with_prior(0.0);
  const double weak = focal_with_prior(0.03);
  const double strong = focal_with_prior(0.001);
  const double fixed = focal_with_prior(1e-7);
  EXPECT_LT(free, weak);
  EXPECT_LT(weak, strong);
  EXPECT_LT(strong, fixed);
  EXPECT_NEAR(fixed, 770.0, 0.01);
}

// ---------------------------------------------------------------------------------------------------------------------
// Outliers and weights.

/// Moves a share of all observed keypoints by 10 to 100 px.
Scene with_wrong_keypoints(Scene scene, double ratio) {
  test_support::Random random(3);
  for (View& view : scene.views) {
    for (Eigen::Vector2f& keypoint : view.keypoints_px) {
      if (random.uniform() < ratio) {
        const Eigen::Vector2d move = random.uniform(10.0, 100.0) *
                                     Eigen::Vector2d{random.normal(), random.normal()}.normalized();
        keypoint += move.cast<float>();
      }
    }
  }
  return scene;
}

TEST(BundleAdjustment, RobustLossResistsOutliers) {
  const Scene truth = make_truth({.noise_px = 0.5});
  const Scene start = with_wrong_keypoints(
      perturbed(truth, {.rotation_rad = 1e-3, .translation = 0.01, .point = 0.01}), 0.05);
  for (const RobustLoss loss : {RobustLoss::kHuber, RobustLoss::kSoftL1, RobustLoss::kCauchy}) {
    Scene scene = start;
    BundleOptions options;
    options.loss = loss;
    (void)adjust_bundle(scene, select_everything(scene), options);
    EXPECT_THAT(scene, ReconstructionNear(truth, 2e-3, 1e-2)) << static_cast<int>(loss);
  }
  Scene scene = start;
  (void)adjust_bundle(scene, select_everything(scene), least_squares());
  EXPECT_THAT(scene, Not(ReconstructionNear(truth, 2e-3, 1e-2)));
}

TEST(BundleAdjustment, SigmasTakeTheWeightFromBadKeypoints) {
  const Scene truth = make_truth({.noise_px = 0.2});
  Scene start = truth;
  test_support::Random random(11);
  std::vector<std::vector<float>> sigmas;
  for (View& view : start.views) {
    auto& sigma = sigmas.emplace_back(view.keypoints_px.size(), 0.2F);
    for (std::size_t i = 0; i < sigma.size(); i += 2) {
      sigma[i] = 5.0F;
      view.keypoints_px[i] +=
          Eigen::Vector2d{5.0 * random.normal(), 5.0 * random.normal()}.cast<float>();
    }
  }
  Scene plain = start;
  Scene weighted = start;
  (void)adjust_bundle(plain, select_everything(plain), least_squares());
  (void)adjust_bundle(weighted, select_everything(weighted), least_squares(), sigmas);
  EXPECT_LT(4.0 * compare_reconstruction(weighted, truth).rmse_position,
            compare_reconstruction(plain, truth).rmse_position);
}

TEST(BundleAdjustment, PointBehindACameraIsLeftOutAndCounted) {
  const Scene truth = make_truth({.points = 100});
  Scene scene = truth;
  Landmark& wild = scene.landmarks[0];
  wild.position_in_world = {0.0, 0.0, -50.0};  // behind every camera
  const BundleReport report = adjust_bundle(scene, select_everything(scene), least_squares());
  EXPECT_EQ(report.skipped_observations, wild.track.size());
  EXPECT_EQ(wild.position_in_world, Eigen::Vector3d(0.0, 0.0, -50.0));
  EXPECT_THAT(scene, ReconstructionNear(truth, 1e-5, 1e-5));
}

TEST(BundleAdjustment, SurvivesPointsThatPassTheCamerasDuringTheSolution) {
  const Scene truth = make_truth({.points = 100, .noise_px = 0.5});
  Scene scene = truth;
  for (std::size_t i = 0; i < 10; ++i) {  // just in front of one camera, far from the truth
    const Rigid3& pose = *scene.views[i].cam_from_world;
    scene.landmarks[i].position_in_world = pose.inverse() * Eigen::Vector3d(0.001, 0.001, 0.01);
  }
  const BundleReport report = adjust_bundle(scene, select_everything(scene), {});
  EXPECT_NE(report.outcome, BundleOutcome::kFailed);
  EXPECT_LE(report.final_cost, report.initial_cost);
  for (const View& view : scene.views) {
    EXPECT_TRUE(view.cam_from_world->translation.allFinite());
  }
}

// ---------------------------------------------------------------------------------------------------------------------
// Edges.

TEST(BundleAdjustment, NothingSelectedIsNothingToDo) {
  const Scene truth = make_truth({.points = 50});
  Scene scene = perturbed(truth, {.point = 0.1});
  const Scene before = scene;
  EXPECT_EQ(adjust_bundle(scene, {}, {}).outcome, BundleOutcome::kNothingToDo);
  BundleSelection no_landmarks;
  no_landmarks.variable_views = {ViewId{0}, ViewId{1}};
  EXPECT_EQ(adjust_bundle(scene, no_landmarks, {}).outcome, BundleOutcome::kNothingToDo);
  BundleSelection all_constant = select_everything(scene);
  std::swap(all_constant.variable_views, all_constant.constant_views);
  all_constant.landmark_mode = LandmarkMode::kConstant;
  EXPECT_EQ(adjust_bundle(scene, all_constant, {}).outcome, BundleOutcome::kNothingToDo);
  Scene empty;
  EXPECT_EQ(adjust_bundle(empty, select_everything(empty), {}).outcome,
            BundleOutcome::kNothingToDo);
  EXPECT_EQ(scene.landmarks[0].position_in_world, before.landmarks[0].position_in_world);
}

TEST(BundleAdjustment, ViewWithoutObservationsKeepsItsPose) {
  Scene scene = make_truth({.points = 100, .noise_px = 0.5});
  View lonely = scene.views[0];
  lonely.keypoints_px.clear();
  lonely.landmarks.clear();
  scene.views.push_back(lonely);
  const Rigid3 before = *lonely.cam_from_world;
  const BundleReport report = adjust_bundle(scene, select_everything(scene), {});
  EXPECT_EQ(report.variable_views, scene.views.size() - 2);  // less the lonely and the gauge
  EXPECT_TRUE(same_bits(*scene.views.back().cam_from_world, before));
}

TEST(BundleSelection, AroundTakesTheLandmarksAndTheirOtherViewsAsConstant) {
  const Scene scene = make_synthetic_scene({.path = PathKind::kOrbit, .views = 20}).truth;
  const std::vector<ViewId> variable = {ViewId{5}, ViewId{6}};
  const BundleSelection all = select_around(scene, variable);
  EXPECT_EQ(all.variable_views, variable);
  EXPECT_THAT(all.constant_views, ::testing::Contains(ViewId{4}));
  EXPECT_THAT(all.constant_views,
              Not(::testing::Contains(ViewId{15})));  // the other side of the box
  EXPECT_TRUE(std::is_sorted(all.landmarks.begin(), all.landmarks.end()));
  const BundleSelection few = select_around(scene, variable, 1'000'000);
  EXPECT_EQ(few.constant_views.size(), 1U);
}

TEST(BundleOptions, RefusesValuesOutOfRange) {
  EXPECT_TRUE(BundleOptions{}.validate().has_value());
  BundleOptions options;
  options.loss_scale_px = 0.0;
  EXPECT_FALSE(options.validate().has_value());
  options = {};
  options.max_iterations = 0;
  EXPECT_FALSE(options.validate().has_value());
  options = {};
  options.function_tolerance = std::nan("");
  EXPECT_FALSE(options.validate().has_value());
  options = {};
  options.intrinsics.resize(1);
  options.intrinsics[0].distortion = 5;
  EXPECT_FALSE(options.validate().has_value());
  options.intrinsics[0].distortion = 0;
  options.intrinsics[0].focal_sigma_ratio = 0.1;  // around a prior that was not given
  const auto result = options.validate();
  ASSERT_FALSE(result.has_value());
  EXPECT_THAT(result.error().message, ::testing::HasSubstr("prior.fx_px"));
}

}  // namespace
}  // namespace trigmesh
