#include "sfm/matching/two_view_verification.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sfm/matching/two_view_models.hpp"
#include "tests/unit/sfm/matching/synthetic_pair.hpp"

namespace trigmesh {
namespace {

using test_support::make_pair;
using test_support::Random;
using test_support::SyntheticPair;
using test_support::SyntheticPairOptions;

Rigid3 turned(double angle_rad, const Eigen::Vector3d& axis) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, axis.normalized())),
          Eigen::Vector3d::Zero()};
}

std::size_t count_true(const TwoViewGeometry& geometry, const SyntheticPair& pair) {
  return static_cast<std::size_t>(
      std::count_if(geometry.inliers.begin(), geometry.inliers.end(), [&](const auto& match) {
        return index(match.first) < pair.true_count;
      }));
}

/// Largest distance, over the image, of the noise-free points from the epipolar geometry that was
/// found.
double worst_error_px(const Eigen::Matrix3d& fundamental, SyntheticPairOptions options) {
  options.noise_px = 0.0;
  options.outlier_count = 0;
  const SyntheticPair truth = make_pair(options);
  double worst = 0.0;
  for (std::size_t i = 0; i < truth.true_count; ++i) {
    worst =
        std::max(worst, internal::sampson_squared(fundamental, truth.first[i], truth.second[i]));
  }
  return std::sqrt(worst);
}

TEST(VerifyPair, FindsGeneralMotionAmongOutliers) {
  const SyntheticPairOptions options{.true_count = 300, .outlier_count = 200};
  const SyntheticPair pair = make_pair(options);
  const TwoViewGeometry geometry = pair.verify();
  EXPECT_EQ(geometry.kind, TwoViewKind::kGeneral);
  EXPECT_EQ(geometry.candidates, 500U);
  EXPECT_GE(count_true(geometry, pair), 295U);
  EXPECT_LE(geometry.inliers.size(), 300U + 10U);
  EXPECT_TRUE(std::is_sorted(geometry.inliers.begin(), geometry.inliers.end()));
  EXPECT_LT(geometry.homography_inliers, 150U);
  EXPECT_LT(worst_error_px(geometry.fundamental, options), 0.5);
  EXPECT_NEAR(geometry.fundamental.determinant(), 0.0, 1e-15);
}

TEST(VerifyPair, IsExactWithoutNoise) {
  const SyntheticPairOptions options{.noise_px = 0.0};
  const SyntheticPair pair = make_pair(options);
  const TwoViewGeometry geometry = pair.verify();
  EXPECT_EQ(geometry.inliers.size(), 300U);
  EXPECT_LT(worst_error_px(geometry.fundamental, options), 1e-4);
}

TEST(VerifyPair, UsesAllMatchesNotOnlyTheSampled) {
  const SyntheticPair pair = make_pair({.true_count = 3000, .outlier_count = 500});
  const TwoViewGeometry geometry = pair.verify();
  EXPECT_EQ(geometry.kind, TwoViewKind::kGeneral);
  EXPECT_GE(count_true(geometry, pair), 2950U);
}

TEST(VerifyPair, CallsOnePlanePlanar) {
  const SyntheticPair pair = make_pair({.outlier_count = 60, .depth_variation = 0.0});
  for (const TwoViewGeometry& geometry : {pair.verify(), pair.verify_uncalibrated()}) {
    EXPECT_EQ(geometry.kind, TwoViewKind::kPlanar);
    EXPECT_GE(geometry.homography_inliers, 280U);
    EXPECT_GE(count_true(geometry, pair), 280U);
    EXPECT_GT(geometry.homography.norm(), 0.5);
  }
}

TEST(VerifyPair, SeesPureRotationWithAndWithoutCalibration) {
  const SyntheticPair pair =
      make_pair({.outlier_count = 60, .second_from_first = turned(0.3, {0.3, 1.0, 0.2})});
  for (const TwoViewGeometry& geometry : {pair.verify(), pair.verify_uncalibrated()}) {
    EXPECT_EQ(geometry.kind, TwoViewKind::kPureRotation);
    EXPECT_GE(count_true(geometry, pair), 280U);
    EXPECT_LE(geometry.inliers.size(), 302U);
  }
}

TEST(VerifyPair, SeesTurningAboutTheViewingAxis) {
  const SyntheticPair pair = make_pair({.second_from_first = turned(0.6, {0.0, 0.0, 1.0})});
  EXPECT_EQ(pair.verify().kind, TwoViewKind::kPureRotation);
}

TEST(VerifyPair, DoesNotTakeForwardMotionForRotation) {
  const SyntheticPair pair = make_pair(
      {.second_from_first = {Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.0, 0.0, -1.5)}});
  EXPECT_EQ(pair.verify().kind, TwoViewKind::kGeneral);
}

TEST(VerifyPair, CallsTheSamePictureDuplicate) {
  const SyntheticPair pair =
      make_pair({.noise_px = 0.05, .second_from_first = turned(0.0, {0.0, 0.0, 1.0})});
  const TwoViewGeometry geometry = pair.verify();
  EXPECT_EQ(geometry.kind, TwoViewKind::kDuplicate);
  EXPECT_GE(geometry.inliers.size(), 290U);
}

TEST(VerifyPair, DoesNotCallDuplicateWhatMovedByAPixel) {
  SyntheticPair pair =
      make_pair({.noise_px = 0.05, .second_from_first = turned(0.0, {0.0, 0.0, 1.0})});
  for (Eigen::Vector2d& point : pair.second) {
    point.x() += 1.0;
  }
  EXPECT_EQ(pair.verify().kind, TwoViewKind::kPureRotation);
}

TEST(VerifyPair, CallsStillMatchesAtTheBorderWatermark) {
  // 40 letters of a time stamp in the lower right corner; 10 random matches; 1000 keypoints that
  // match nothing.
  SyntheticPair pair;
  pair.calibration.setIdentity();
  Random random(3);
  for (std::size_t i = 0; i < 50; ++i) {
    const double x = random.uniform(1200.0, 1500.0);
    pair.first.emplace_back(x, random.uniform(960.0, 1010.0));
    pair.second.push_back(i < 40 ? pair.first.back()
                                 : Eigen::Vector2d(300.0, 7.0 * static_cast<double>(i)));
    pair.matches.push_back({id_of<FeatureIndex>(i), id_of<FeatureIndex>(i)});
  }
  pair.first.resize(1050, Eigen::Vector2d(5.0, 5.0));
  pair.second.resize(1050, Eigen::Vector2d(5.0, 5.0));
  const TwoViewGeometry geometry = pair.verify();
  EXPECT_EQ(geometry.kind, TwoViewKind::kWatermark);
  EXPECT_EQ(geometry.inliers.size(), 40U);
}

TEST(VerifyPair, RefusesRandomMatches) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const TwoViewGeometry geometry =
        make_pair({.true_count = 0, .outlier_count = 200, .seed = seed}).verify();
    EXPECT_EQ(geometry.kind, TwoViewKind::kNone) << geometry.inliers.size();
    EXPECT_TRUE(geometry.inliers.empty());
    EXPECT_EQ(geometry.candidates, 200U);
  }
}

TEST(VerifyPair, RefusesTooFewMatches) {
  EXPECT_EQ(make_pair({.true_count = 14}).verify().kind, TwoViewKind::kNone);
  EXPECT_EQ(make_pair({.true_count = 0}).verify().kind, TwoViewKind::kNone);
  EXPECT_EQ(make_pair({.true_count = 30}).verify().kind, TwoViewKind::kGeneral);
}

TEST(VerifyPair, RefusesPointsOnOneLineOrInOnePlace) {
  SyntheticPair line = make_pair({.true_count = 100});
  SyntheticPair place = line;
  for (std::size_t i = 0; i < line.first.size(); ++i) {
    line.first[i] = Eigen::Vector2d(3.0 * static_cast<double>(i), 200.0);
    line.second[i] = Eigen::Vector2d(2.0 * static_cast<double>(i) + 5.0, 300.0);
    place.first[i] = Eigen::Vector2d(100.0, 100.0);
    place.second[i] = Eigen::Vector2d(200.0, 300.0);
  }
  // Both agree with any number of geometries.
  EXPECT_EQ(line.verify().kind, TwoViewKind::kNone);
  EXPECT_EQ(place.verify().kind, TwoViewKind::kNone);
}

TEST(VerifyPair, IgnoresPointsThatAreNotFinite) {
  SyntheticPair pair = make_pair({.true_count = 100});
  pair.first[3].x() = std::numeric_limits<double>::quiet_NaN();
  pair.second[7].y() = std::numeric_limits<double>::infinity();
  const TwoViewGeometry geometry = pair.verify();
  EXPECT_EQ(geometry.kind, TwoViewKind::kGeneral);
  EXPECT_GE(geometry.inliers.size(), 95U);
  EXPECT_LE(geometry.inliers.size(), 98U);
}

TEST(VerifyPair, GivesTheSameBitsEveryTime) {
  const SyntheticPair pair = make_pair({.true_count = 200, .outlier_count = 200});
  const TwoViewGeometry once = pair.verify();
  for (int i = 0; i < 3; ++i) {
    const TwoViewGeometry again = pair.verify();
    EXPECT_EQ(again.inliers, once.inliers);
    EXPECT_EQ(again.fundamental, once.fundamental);
    EXPECT_EQ(again.homography_inliers, once.homography_inliers);
  }
}

TEST(RefineFundamental, BringsARoughModelToTheTruth) {
  const SyntheticPair pair = make_pair({.noise_px = 0.0});
  const internal::PointPairs pairs{pair.first, pair.second};
  // Moves the epipolar lines by up to about two pixels.
  Eigen::Matrix3d rough = pair.fundamental.normalized();
  rough.row(2) *= 1.002;
  const Eigen::Matrix3d refined = internal::refine_fundamental(pairs, rough, 4.0);
  double worst_rough = 0.0;
  double worst_refined = 0.0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    worst_rough =
        std::max(worst_rough, internal::sampson_squared(rough, pairs.first[i], pairs.second[i]));
    worst_refined = std::max(worst_refined,
                             internal::sampson_squared(refined, pairs.first[i], pairs.second[i]));
  }
  EXPECT_GT(std::sqrt(worst_rough), 0.5);
  EXPECT_LT(std::sqrt(worst_refined), 1e-3);
}

TEST(FitRotationHomography, RecoversTheRotation) {
  const Rigid3 motion = turned(0.2, {1.0, 1.0, 0.0});
  const SyntheticPair pair =
      make_pair({.outlier_count = 30, .noise_px = 0.0, .second_from_first = motion});
  const Eigen::Matrix3d homography = internal::fit_rotation_homography(
      {pair.first, pair.second}, {pair.calibration, pair.calibration}, 2.0);
  const Eigen::Matrix3d rotation = pair.calibration.inverse() * homography * pair.calibration;
  EXPECT_LT((rotation - motion.rotation.toRotationMatrix()).norm(), 1e-4);
}

TEST(VerificationOptions, RefusesValuesOutOfRange) {
  EXPECT_TRUE(VerificationOptions{}.validate().has_value());
  EXPECT_FALSE(VerificationOptions{.max_error_px = 0.0}.validate().has_value());
  EXPECT_FALSE(VerificationOptions{.min_inliers = 7}.validate().has_value());
  EXPECT_FALSE(VerificationOptions{.min_homography_ratio = 1.1}.validate().has_value());
  EXPECT_FALSE(VerificationOptions{.max_still_px = -1.0}.validate().has_value());
  EXPECT_FALSE(VerificationOptions{.border_ratio = 0.5}.validate().has_value());
  EXPECT_FALSE(VerificationOptions{.max_sampled_matches = 10}.validate().has_value());
  EXPECT_FALSE(VerificationOptions{.max_iterations = 0}.validate().has_value());
}

}  // namespace
}  // namespace trigmesh
