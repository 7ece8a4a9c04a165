#include "sfm/geometry/homography.hpp"

#include <cmath>
#include <vector>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "tests/unit/sfm/geometry/two_view.hpp"

namespace trigmesh {
namespace {

using synthetic::make_two_view;
using synthetic::Random;
using synthetic::Structure;
using synthetic::TwoViewMatches;

TEST(EstimateHomography, ExactPlaneMatchesAreTransferredExactly) {
  Random random(1);
  for (int i = 0; i < 30; ++i) {
    const TwoViewMatches m =
        make_two_view(random, {.count = i % 2 == 0 ? 4U : 50U, .structure = Structure::kPlane});
    const HomographyEstimate fit = estimate_homography(m.first_px, m.second_px);
    ASSERT_EQ(fit.outcome, HomographyOutcome::kOk);
    EXPECT_GT(fit.second_from_first.determinant(), 0.0);
    for (std::size_t k = 0; k < m.first_px.size(); ++k) {
      EXPECT_LT(
          symmetric_transfer_error_squared(fit.second_from_first, m.first_px[k], m.second_px[k]),
          1e-10);
    }
  }
}

TEST(EstimateHomography, MaskLeavesMatchesOut) {
  Random random(2);
  TwoViewMatches m = make_two_view(random, {.count = 30, .structure = Structure::kPlane});
  std::vector<std::uint8_t> mask(30, 1);
  for (std::size_t i = 0; i < 10; ++i) {
    m.second_px[i] += Eigen::Vector2d(50.0, -20.0);
    mask[i] = 0;
  }
  const HomographyEstimate fit = estimate_homography(m.first_px, m.second_px, mask);
  EXPECT_LT(transfer_error_squared(fit.second_from_first, m.first_px[20], m.second_px[20]), 1e-12);
  EXPECT_NEAR(
      transfer_error_squared(fit.second_from_first, m.first_px[0], m.second_px[0]), 2900.0, 1e-4);
}

TEST(EstimateHomography, LineAndEqualPointsAreDegenerate) {
  std::vector<Eigen::Vector2d> line;
  std::vector<Eigen::Vector2d> other;
  for (int i = 0; i < 10; ++i) {
    line.emplace_back(10.0 * i, 5.0 * i + 3.0);
    other.emplace_back(8.0 * i + 2.0, 30.0 - 3.0 * i);
  }
  EXPECT_EQ(estimate_homography(line, other).outcome, HomographyOutcome::kDegenerate);
  const std::vector<Eigen::Vector2d> same(6, Eigen::Vector2d(1.0, 2.0));
  EXPECT_EQ(estimate_homography(same, same).outcome, HomographyOutcome::kDegenerate);
}

TEST(EstimateHomography, ThreeOfFourOnALineAreDegenerate) {
  const std::vector<Eigen::Vector2d> first{{0.0, 0.0}, {1.0, 1.0}, {2.0, 2.0}, {5.0, 1.0}};
  const std::vector<Eigen::Vector2d> second{{0.0, 0.0}, {4.0, 1.0}, {2.0, 7.0}, {5.0, 1.0}};
  EXPECT_EQ(estimate_homography(first, second).outcome, HomographyOutcome::kDegenerate);
}

TEST(EstimateHomography, ThreeMatchesAreTooFew) {
  const std::vector<Eigen::Vector2d> three{{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}};
  EXPECT_EQ(estimate_homography(three, three).outcome, HomographyOutcome::kTooFewPoints);
  EXPECT_EQ(estimate_homography({}, {}).outcome, HomographyOutcome::kTooFewPoints);
}

TEST(TransferError, PointSentToInfinityIsInfinitelyWrong) {
  Eigen::Matrix3d h = Eigen::Matrix3d::Identity();
  h.row(2) << 1.0, 0.0, -4.0;
  EXPECT_TRUE(std::isinf(transfer_error_squared(h, {4.0, 1.0}, {0.0, 0.0})));
}

TEST(RotationFromHomography, PureRotationHasNoDeviation) {
  Random random(3);
  const Eigen::Matrix3d k1 = synthetic::pinhole().calibration_matrix();
  const Eigen::Matrix3d k2 = synthetic::fisheye().calibration_matrix();
  for (int i = 0; i < 50; ++i) {
    const Eigen::Quaterniond truth = random.rotation();
    const Eigen::Matrix3d h =
        (i % 2 == 0 ? 1.0 : -7.0) * k2 * truth.toRotationMatrix() * k1.inverse();
    const auto rotation = rotation_from_homography(h, k1, k2);
    ASSERT_TRUE(rotation);
    EXPECT_LT(rotation->deviation, 1e-10);
    EXPECT_LT(synthetic::rotation_distance_rad(rotation->second_from_first, truth), 1e-7);
  }
}

TEST(RotationFromHomography, PlaneSeenFromTwoPlacesDeviatesByItsParallax) {
  Random random(4);
  for (const double baseline : {0.2, 1.0}) {
    const TwoViewMatches m =
        make_two_view(random, {.structure = Structure::kPlane, .baseline = baseline});
    const Eigen::Matrix3d k = m.camera.calibration_matrix();
    const auto rotation = rotation_from_homography(
        estimate_homography(m.first_px, m.second_px).second_from_first, k, k);
    ASSERT_TRUE(rotation);
    EXPECT_GT(rotation->deviation, 0.05 * baseline);
    EXPECT_LT(rotation->deviation, 1.0 * baseline);
  }
}

TEST(RotationFromHomography, SingularMatrixIsRefused) {
  const Eigen::Matrix3d k = synthetic::pinhole().calibration_matrix();
  EXPECT_FALSE(rotation_from_homography(Eigen::Matrix3d::Zero(), k, k));
  EXPECT_FALSE(rotation_from_homography(Eigen::Matrix3d::Ones(), k, k));
}

}  // namespace
}  // namespace trigmesh
