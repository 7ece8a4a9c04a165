#include "sfm/geometry/epipolar.hpp"

#include <vector>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <gtest/gtest.h>

#include "tests/unit/sfm/geometry/two_view.hpp"

namespace trigmesh {
namespace {

using synthetic::make_two_view;
using synthetic::Random;
using synthetic::Structure;
using synthetic::TwoViewMatches;

/// Distance of two matrices that are defined up to scale and sign.
double projective_distance(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  const Eigen::Matrix3d na = a / a.norm();
  const Eigen::Matrix3d nb = b / b.norm();
  return std::min((na - nb).norm(), (na + nb).norm());
}

Eigen::Matrix3d true_fundamental(const TwoViewMatches& m) {
  const Eigen::Matrix3d k = m.camera.calibration_matrix();
  return fundamental_from_essential(essential_from_pose(m.second_from_first), k, k);
}

double mean_sampson(const Eigen::Matrix3d& f, const TwoViewMatches& m) {
  double sum = 0.0;
  for (std::size_t i = 0; i < m.first_px.size(); ++i) {
    sum += sampson_error_squared(f, m.first_px[i], m.second_px[i]);
  }
  return sum / static_cast<double>(m.first_px.size());
}

TEST(EstimateFundamental, ExactMatchesGiveTheExactMatrix) {
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    const TwoViewMatches m = make_two_view(random, {.count = i % 2 == 0 ? 8U : 60U});
    const FundamentalEstimate fit = estimate_fundamental(m.first_px, m.second_px);
    ASSERT_EQ(fit.outcome, FundamentalOutcome::kOk);
    EXPECT_LT(mean_sampson(fit.fundamental, m), 1e-12);
    EXPECT_NEAR(fit.fundamental.norm(), 1.0, 1e-12);
    EXPECT_NEAR(fit.fundamental.determinant(), 0.0, 1e-15);
    if (m.first_px.size() > 8) {
      EXPECT_LT(projective_distance(fit.fundamental, true_fundamental(m)), 1e-7);
    }
  }
}

TEST(EstimateFundamental, NoiseMovesItGently) {
  const auto error_at = [](double noise_px) {
    Random random(2);
    double sum = 0.0;
    for (int i = 0; i < 20; ++i) {
      const TwoViewMatches m = make_two_view(random, {.count = 200, .noise_px = noise_px});
      TwoViewMatches clean = m;
      const Eigen::Matrix3d f = estimate_fundamental(m.first_px, m.second_px).fundamental;
      sum += projective_distance(f, true_fundamental(m));
    }
    return sum;
  };
  EXPECT_LT(error_at(0.1), error_at(0.5));
  EXPECT_LT(error_at(0.5), error_at(2.0));
}

TEST(EstimateFundamental, PlaneIsDegenerate) {
  Random random(3);
  const TwoViewMatches m = make_two_view(random, {.structure = Structure::kPlane});
  EXPECT_EQ(estimate_fundamental(m.first_px, m.second_px).outcome, FundamentalOutcome::kDegenerate);
}

TEST(EstimateFundamental, PureRotationIsDegenerate) {
  Random random(4);
  const TwoViewMatches m = make_two_view(random, {.baseline = 0.0});
  EXPECT_EQ(estimate_fundamental(m.first_px, m.second_px).outcome, FundamentalOutcome::kDegenerate);
}

TEST(EstimateFundamental, EqualPointsAreDegenerateAndSevenTooFew) {
  Random random(5);
  const std::vector<Eigen::Vector2d> same(12, Eigen::Vector2d(3.0, 4.0));
  EXPECT_EQ(estimate_fundamental(same, same).outcome, FundamentalOutcome::kDegenerate);
  const TwoViewMatches m = make_two_view(random, {.count = 7});
  EXPECT_EQ(estimate_fundamental(m.first_px, m.second_px).outcome,
            FundamentalOutcome::kTooFewPoints);
  EXPECT_EQ(estimate_fundamental({}, {}).outcome, FundamentalOutcome::kTooFewPoints);
}

TEST(EnforceRank, SingularValuesAreWhatTheNamesSay) {
  Random random(6);
  Eigen::Matrix3d m;
  m << random.in_box(1.0), random.in_box(1.0), random.in_box(1.0);
  const Eigen::JacobiSVD<Eigen::Matrix3d> two(enforce_rank_two(m));
  EXPECT_NEAR(two.singularValues()[2], 0.0, 1e-15);
  EXPECT_GT(two.singularValues()[1], 0.0);
  const Eigen::JacobiSVD<Eigen::Matrix3d> essential(enforce_essential(m));
  EXPECT_NEAR((essential.singularValues() - Eigen::Vector3d(1.0, 1.0, 0.0)).norm(), 0.0, 1e-14);
}

TEST(EssentialAndFundamental, ConvertIntoEachOther) {
  Random random(7);
  const TwoViewMatches m = make_two_view(random, {});
  const Eigen::Matrix3d e = essential_from_pose(m.second_from_first);
  const Eigen::Matrix3d k1 = m.camera.calibration_matrix();
  const Eigen::Matrix3d k2 = synthetic::fisheye().calibration_matrix();
  const Eigen::Matrix3d f = fundamental_from_essential(e, k1, k2);
  EXPECT_NEAR((essential_from_fundamental(f, k1, k2) - e).norm(), 0.0, 1e-12);
  for (std::size_t i = 0; i < m.first.size(); ++i) {
    const Eigen::Vector3d x1 = m.first[i].homogeneous();
    const Eigen::Vector3d x2 = m.second[i].homogeneous();
    EXPECT_NEAR(x2.dot(e * x1), 0.0, 1e-12);
    EXPECT_NEAR((k2 * x2).dot(f * (k1 * x1)), 0.0, 1e-12);
  }
}

TEST(EssentialFromPose, NoTranslationGivesZero) {
  EXPECT_EQ(essential_from_pose({}).norm(), 0.0);
}

TEST(SampsonError, IsTheDistanceToTheEpipolarLineForSidewaysMotion) {
  // Pure motion along x of a camera with K = 1: lines are rows, F = [ex]x.
  Eigen::Matrix3d f;
  f << 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0;
  // Rows differ by 2: each point moves by 1, together sqrt(2).
  EXPECT_NEAR(sampson_error_squared(f, {5.0, 1.0}, {9.0, 3.0}), 2.0, 1e-14);
  EXPECT_EQ(sampson_error_squared(f, {5.0, 1.0}, {9.0, 1.0}), 0.0);
  EXPECT_EQ(sampson_error_squared(Eigen::Matrix3d::Zero(), {5.0, 1.0}, {9.0, 3.0}), 0.0);
}

TEST(RefineFundamental, LowersTheSampsonErrorAndKeepsRankTwo) {
  Random random(8);
  for (int i = 0; i < 20; ++i) {
    const TwoViewMatches m = make_two_view(random, {.count = 80, .noise_px = 1.0});
    const Eigen::Matrix3d start = estimate_fundamental(m.first_px, m.second_px).fundamental;
    const Eigen::Matrix3d refined =
        refine_fundamental(start, m.first_px, m.second_px, {}, {.loss_scale = 100.0});
    EXPECT_LE(mean_sampson(refined, m), mean_sampson(start, m));
    EXPECT_LE(mean_sampson(refined, m), mean_sampson(true_fundamental(m), m));
    EXPECT_NEAR(refined.determinant(), 0.0, 1e-14);
  }
}

TEST(RefineFundamental, LeavesMaskedMatchesAlone) {
  Random random(9);
  TwoViewMatches m = make_two_view(random, {.count = 80});
  const Eigen::Matrix3d truth = true_fundamental(m);
  std::vector<std::uint8_t> mask(80, 1);
  for (std::size_t i = 0; i < 20; ++i) {
    m.second_px[i] += Eigen::Vector2d(40.0, 25.0);
    mask[i] = 0;
  }
  Eigen::Matrix3d start = truth / truth.norm();
  start(2, 2) *= 1.002;
  const Eigen::Matrix3d refined =
      refine_fundamental(enforce_rank_two(start), m.first_px, m.second_px, mask, {});
  EXPECT_LT(projective_distance(refined, truth), 1e-6);
}

TEST(RefineRelativePose, FindsTheTruthFromNearby) {
  Random random(10);
  for (int i = 0; i < 50; ++i) {
    const TwoViewMatches m = make_two_view(random, {.count = 40});
    const Rigid3 nudge{Eigen::Quaterniond(Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitY())),
                       Eigen::Vector3d(0.05, -0.05, 0.02)};
    const Eigen::Matrix3d k = m.camera.calibration_matrix();
    const Rigid3 refined = refine_relative_pose(nudge * m.second_from_first,
                                                {k, k},
                                                m.first_px,
                                                m.second_px,
                                                {},
                                                {.loss_scale = 100.0, .max_iterations = 50});
    EXPECT_LT(synthetic::rotation_distance_rad(refined.rotation, m.second_from_first.rotation),
              1e-7);
    EXPECT_LT(
        synthetic::direction_distance_rad(refined.translation, m.second_from_first.translation),
        1e-6);
    EXPECT_NEAR(refined.translation.norm(), 1.0, 1e-12);
  }
}

TEST(RefineRelativePose, EndsWhereNoSmallMotionIsBetter) {
  Random random(11);
  const TwoViewMatches m = make_two_view(random, {.count = 60, .noise_px = 1.0});
  const Eigen::Matrix3d k = m.camera.calibration_matrix();
  const Rigid3 best = refine_relative_pose(m.second_from_first,
                                           {k, k},
                                           m.first_px,
                                           m.second_px,
                                           {},
                                           {.loss_scale = 1e4, .max_iterations = 50});
  const auto cost = [&](const Rigid3& pose) {
    return mean_sampson(fundamental_from_essential(essential_from_pose(pose), k, k), m);
  };
  for (int axis = 0; axis < 3; ++axis) {
    for (const double step : {-1e-3, 1e-3}) {
      Rigid3 turned = best;
      turned.rotation =
          Eigen::Quaterniond(Eigen::AngleAxisd(step, Eigen::Vector3d::Unit(axis))) * best.rotation;
      EXPECT_GT(cost(turned), cost(best));
    }
  }
}

}  // namespace
}  // namespace trigmesh
