#include "sfm/mapping/bundle_adjustment.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <vector>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sfm/mapping/bundle_problem.hpp"
#include "sfm/mapping/reprojection_cost.hpp"
#include "tests/support/matchers.hpp"
#include "tests/support/random.hpp"
#include "tests/support/synthetic_scene.hpp"

namespace trigmesh {
namespace {

using test_support::CloudKind;
using test_support::compare_reconstruction;
using test_support::make_synthetic_scene;
using test_support::PathKind;
using test_support::perturbed;
using test_support::ReconstructionNear;
using test_support::SyntheticSceneOptions;
using ::testing::Not;

// The same bits, not only equal values.
bool same_bits(const Rigid3& a, const Rigid3& b) {
  return std::memcmp(a.rotation.coeffs().data(), b.rotation.coeffs().data(), 4 * sizeof(double)) ==
             0 &&
         std::memcmp(a.translation.data(), b.translation.data(), 3 * sizeof(double)) == 0;
}

Scene make_truth(SyntheticSceneOptions options = {}) {
  options.cloud = CloudKind::kVolume;
  return make_synthetic_scene(options).truth;
}

/// Keypoints exactly where the points project, within float.
BundleOptions least_squares() {
  BundleOptions options;
  options.loss = RobustLoss::kNone;
  options.function_tolerance = 1e-14;
  options.parameter_tolerance = 1e-14;
  return options;
}

Camera lens(CameraModel model) {
  Camera camera = SyntheticSceneOptions{}.camera;
  camera.model = model;
  switch (model) {
    case CameraModel::kPinhole:
      break;
    case CameraModel::kRadial:
      camera.distortion = {-0.12, 0.03, 0.0, 0.0};
      break;
    case CameraModel::kBrownConrady:
      camera.distortion = {-0.12, 0.03, 0.002, -0.001};
      break;
    case CameraModel::kKannalaBrandt:
      camera.distortion = {0.03, -0.01, 0.004, -0.001};
      break;
  }
  return camera;
}

// ---------------------------------------------------------------------------------------------------------------------
// The residual against numeric derivatives, away from the base pose and for every lens.

class Reprojection : public ::testing::TestWithParam<CameraModel> {
 protected:
  Reprojection() {
    pose_.base.rotation = Eigen::AngleAxisd(0.7, Eigen::Vector3d(0.2, -0.5, 0.8).normalized());
    pose_.base.translation = {0.3, -0.2, 4.0};
    pose_.parameters = {0.11, -0.23, 0.31, 0.05, -0.07, 0.3};
    pose_.update();
    point_ = {0.5, 0.4, -0.3};
    observation_.pixel = {400.0F, 300.0F};
    observation_.inverse_sigma = 0.5F;
  }

  static IntrinsicsState everything_free() {
    IntrinsicsFreedom freedom;
    freedom.focal = true;
    freedom.principal_point = true;
    freedom.distortion = 4;
    return {lens(GetParam()), freedom};
  }

  [[nodiscard]] Eigen::Vector2d residual() const {
    return evaluate_reprojection(pose_, intrinsics_, point_, observation_, {});
  }

  /// Central difference of the residual by one number that `update` makes effective.
  template <typename Update>
  Eigen::Vector2d slope(double& value, double step, const Update& update) {
    const double at = value;
    value = at + step;
    update();
    const Eigen::Vector2d high = residual();
    value = at - step;
    update();
    const Eigen::Vector2d low = residual();
    value = at;
    update();
    return (high - low) / (2.0 * step);
  }

  PoseState pose_;
  IntrinsicsState intrinsics_ = everything_free();
  Eigen::Vector3d point_;
  BundleObservation observation_;
};

TEST_P(Reprojection, PoseDerivativesAgreeWithDifferences) {
  PoseJacobian analytic;
  ReprojectionJacobians wanted;
  wanted.pose = analytic.data();
  (void)evaluate_reprojection(pose_, intrinsics_, point_, observation_, wanted);
  for (std::size_t i = 0; i < PoseState::kSize; ++i) {
    const auto numeric = slope(pose_.parameters[i], 1e-6, [this] { pose_.update(); });
    EXPECT_LT((analytic.col(static_cast<Eigen::Index>(i)) - numeric).norm(), 1e-5) << i;
  }
}

TEST_P(Reprojection, PointDerivativesAgreeWithDifferences) {
  PointJacobian analytic;
  ReprojectionJacobians wanted;
  wanted.point = analytic.data();
  (void)evaluate_reprojection(pose_, intrinsics_, point_, observation_, wanted);
  for (Eigen::Index i = 0; i < 3; ++i) {
    const auto numeric = slope(point_[i], 1e-6, [] {});
    EXPECT_LT((analytic.col(i) - numeric).norm(), 1e-5) << i;
  }
}

TEST_P(Reprojection, IntrinsicsDerivativesAgreeWithDifferences) {
  const int size = intrinsics_.block_size();
  Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::RowMajor> analytic(2, size);
  ReprojectionJacobians wanted;
  wanted.intrinsics = analytic.data();
  (void)evaluate_reprojection(pose_, intrinsics_, point_, observation_, wanted);
  for (int i = 0; i < size; ++i) {
    const auto numeric = slope(intrinsics_.parameters[static_cast<std::size_t>(i)],
                               i == 0 ? 1e-3 : 1e-6,
                               [this] { intrinsics_.update(); });
    EXPECT_LT((analytic.col(i) - numeric).norm(), 1e-4) << i;
  }
}

TEST_P(Reprojection, FrozenCoordinateHasNoDerivative) {
  pose_.frozen_translation = 1;
  PoseJacobian analytic;
  ReprojectionJacobians wanted;
  wanted.pose = analytic.data();
  (void)evaluate_reprojection(pose_, intrinsics_, point_, observation_, wanted);
  EXPECT_EQ(analytic.col(4).norm(), 0.0);
  EXPECT_GT(analytic.col(3).norm(), 0.0);
}

INSTANTIATE_TEST_SUITE_P(AllLenses,
                         Reprojection,
                         ::testing::Values(CameraModel::kPinhole,
                                           CameraModel::kRadial,
                                           CameraModel::kBrownConrady,
                                           CameraModel::kKannalaBrandt));

TEST(Reprojection, BehindTheCameraIsLargeAndFlat) {
  const PoseState pose;
  const IntrinsicsState intrinsics(lens(CameraModel::kPinhole), {});
  BundleObservation observation;
  observation.inverse_sigma = 0.5F;
  PointJacobian by_point = PointJacobian::Ones();
  ReprojectionJacobians wanted;
  wanted.point = by_point.data();
  const Eigen::Vector2d residual =
      evaluate_reprojection(pose, intrinsics, {0.1, 0.1, -2.0}, observation, wanted);
  EXPECT_EQ(residual, Eigen::Vector2d::Constant(0.5 * kUnprojectablePx));
  EXPECT_EQ(by_point, PointJacobian::Zero());
}

TEST(PoseState, ParametersTurnAndShiftInTheCameraFrame) {
  PoseState pose;
  pose.base = {Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitY())), {1, 2, 3}};
  pose.update();
  EXPECT_THAT(pose.cam_from_world(), test_support::Rigid3Near(pose.base, 1e-12, 1e-12));
  pose.parameters = {0.0, 0.0, 1e-3, 0.0, 0.5, 0.0};
  pose.update();
  const Rigid3 step{Eigen::Quaterniond(Eigen::AngleAxisd(1e-3, Eigen::Vector3d::UnitZ())),
                    {0.0, 0.5, 0.0}};
  EXPECT_THAT(pose.cam_from_world(), test_support::Rigid3Near(step * pose.base, 1e-9, 1e-9));
  EXPECT_TRUE(pose.rotation.isApprox(pose.cam_from_world().rotation.toRotationMatrix(), 1e-12));
  EXPECT_TRUE(pose.translation.isApprox(pose.cam_from_world().translation, 1e-12));
}

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

/// Two cameras under a prior, weights, one held view and wrong keypoints: everything that a solver
/// has to heed.
struct HardCase {
  Scene scene;
  BundleSelection selection;
  BundleOptions options = least_squares();
  std::vector<std::vector<float>> sigmas;
};

HardCase make_hard_case(RobustLoss loss) {
  SyntheticSceneOptions scene_options;
  scene_options.points = 150;
  scene_options.noise_px = 0.5;
  scene_options.camera_groups = 2;
  scene_options.camera = lens(CameraModel::kBrownConrady);
  const Scene truth = make_truth(scene_options);
  HardCase out;
  out.scene = perturbed(truth, {.rotation_rad = 2e-3, .translation = 0.01, .point = 0.01});
  out.selection = select_everything(out.scene);
  out.selection.variable_views.erase(out.selection.variable_views.begin() + 2);
  out.selection.constant_views = {ViewId{2}};
  out.options.loss = loss;
  out.options.loss_scale_px = 2.0;
  out.options.max_iterations = 200;
  out.options.intrinsics.resize(2);
  out.options.intrinsics[0].focal = true;
  out.options.intrinsics[0].focal_sigma_ratio = 0.01;
  out.options.intrinsics[0].prior = out.scene.cameras[0];
  out.options.intrinsics[1].focal = true;
  out.options.intrinsics[1].principal_point = true;
  out.options.intrinsics[1].principal_point_sigma_px = 5.0;
  out.options.intrinsics[1].distortion = 4;
  out.options.intrinsics[1].distortion_sigma = 0.1;
  out.options.intrinsics[1].prior = out.scene.cameras[1];
  for (const View& view : out.scene.views) {
    auto& sigma = out.sigmas.emplace_back(view.keypoints_px.size(), 0.5F);
    for (std::size_t i = 0; i < sigma.size(); i += 3) {
      sigma[i] = 1.5F;
    }
  }
  return out;
}

class SolverAgreement : public ::testing::TestWithParam<RobustLoss> {};

TEST_P(SolverAgreement, OwnSolverFindsTheMinimumOfCeresDenseAndSparse) {
  const HardCase start = make_hard_case(GetParam());
  const auto solve = [&start](BundleSolver solver, int dense_views, Scene& scene) {
    BundleOptions options = start.options;
    options.solver = solver;
    options.dense_views = dense_views;
    return adjust_bundle(scene, start.selection, options, start.sigmas);
  };
  Scene own = start.scene;
  Scene dense = start.scene;
  Scene sparse = start.scene;
  const BundleReport own_report = solve(BundleSolver::kSchur, 100, own);
  const BundleReport dense_report = solve(BundleSolver::kCeres, 100, dense);
  const BundleReport sparse_report = solve(BundleSolver::kCeres, 0, sparse);
  EXPECT_NEAR(own_report.initial_cost, dense_report.initial_cost, 1e-9 * own_report.initial_cost);
  EXPECT_NEAR(own_report.final_cost, dense_report.final_cost, 1e-7 * own_report.final_cost);
  EXPECT_NEAR(sparse_report.final_cost, dense_report.final_cost, 1e-7 * own_report.final_cost);
  EXPECT_THAT(own, ReconstructionNear(dense, 1e-5, 1e-5));
  EXPECT_THAT(sparse, ReconstructionNear(dense, 1e-5, 1e-5));
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(own.cameras[i].fx_px, dense.cameras[i].fx_px, 1e-2);
    EXPECT_NEAR(own.cameras[i].cy_px, dense.cameras[i].cy_px, 1e-2);
  }
}

INSTANTIATE_TEST_SUITE_P(AllLosses,
                         SolverAgreement,
                         ::testing::Values(RobustLoss::kNone,
                                           RobustLoss::kHuber,
                                           RobustLoss::kSoftL1,
                                           RobustLoss::kCauchy));

/// The worst that an executor may do to the order of the pieces.
class BackwardExecutor final : public Executor {
 public:
  void for_each_index(std::size_t count, const std::function<void(std::size_t)>& work) override {
    for (std::size_t i = count; i > 0; --i) {
      work(i - 1);
    }
  }
};

TEST(BundleAdjustment, EveryExecutorGivesTheSameBits) {
  const Scene start = perturbed(make_truth({.points = 1200, .views = 12, .noise_px = 0.5}),
                                {.rotation_rad = 2e-3, .translation = 0.01, .point = 0.01});
  Scene forward = start;
  Scene backward = start;
  const BundleReport report = adjust_bundle(forward, select_everything(start), {});
  ASSERT_GT(report.observations, 8192U);  // several pieces
  BackwardExecutor executor;
  (void)adjust_bundle(backward, select_everything(start), {}, {}, executor);
  for (std::size_t i = 0; i < start.views.size(); ++i) {
    EXPECT_TRUE(same_bits(*forward.views[i].cam_from_world, *backward.views[i].cam_from_world));
  }
  for (std::size_t i = 0; i < start.landmarks.size(); ++i) {
    EXPECT_EQ(forward.landmarks[i].position_in_world, backward.landmarks[i].position_in_world);
  }
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
                                     Eigen::Vector2d(random.normal(), random.normal()).normalized();
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
          Eigen::Vector2d(5.0 * random.normal(), 5.0 * random.normal()).cast<float>();
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

TEST(BundleAdjustment, TwoRunsGiveTheSameBits) {
  const Scene start = perturbed(make_truth({.noise_px = 0.5, .dropout_ratio = 0.3}),
                                {.rotation_rad = 2e-3, .translation = 0.02, .point = 0.02});
  BundleOptions options;
  options.intrinsics.resize(1);
  options.intrinsics[0].focal = true;
  for (const int dense_views : {100, 0}) {
    options.dense_views = dense_views;
    Scene first = start;
    (void)adjust_bundle(first, select_everything(start), options);
    const std::vector<double> shift_the_heap(12345, 1.0);
    Scene second = start;
    (void)adjust_bundle(second, select_everything(start), options);
    EXPECT_EQ(first.cameras, second.cameras);
    for (std::size_t i = 0; i < start.views.size(); ++i) {
      EXPECT_TRUE(same_bits(*first.views[i].cam_from_world, *second.views[i].cam_from_world));
    }
    for (std::size_t i = 0; i < start.landmarks.size(); ++i) {
      EXPECT_EQ(first.landmarks[i].position_in_world, second.landmarks[i].position_in_world);
    }
  }
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
