#include "sfm/mapping/bundle_solvers.hpp"

#include <cstddef>
#include <functional>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sfm/mapping/bundle_adjustment.hpp"
#include "tests/support/matchers.hpp"
#include "tests/unit/sfm/mapping/bundle_test_scenes.hpp"

namespace trigmesh {
namespace {

using bundle_test::least_squares;
using bundle_test::lens;
using bundle_test::make_truth;
using bundle_test::same_bits;
using test_support::perturbed;
using test_support::ReconstructionNear;
using test_support::SyntheticSceneOptions;

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

}  // namespace
}  // namespace trigmesh
