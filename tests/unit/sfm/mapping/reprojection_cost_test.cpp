#include "sfm/mapping/reprojection_cost.hpp"

#include <cstddef>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "tests/support/matchers.hpp"
#include "tests/unit/sfm/mapping/bundle_test_scenes.hpp"

namespace trigmesh {
namespace {

using bundle_test::lens;

/// The residual against numeric derivatives, away from the base pose.
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

}  // namespace
}  // namespace trigmesh
