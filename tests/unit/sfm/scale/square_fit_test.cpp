#include "sfm/scale/square_fit.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/matchers.hpp"
#include "tests/unit/sfm/scale/card_scene.hpp"

namespace trigmesh {
namespace {

using test_support::CardScene;
using test_support::CardSceneOptions;
using test_support::make_card_scene;
using test_support::TrueMarker;

TrueMarker tilted_marker() {
  return {{Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d(0.5, -0.3, 0.8).normalized())),
           {0.7, -0.4, 0.3}},
          1.3};
}

std::vector<MarkerSighting> sightings_of(const CardScene& card, int id = 0) {
  std::vector<MarkerSighting> sightings;
  for (std::size_t i = 0; i < card.detections.size(); ++i) {
    for (const MarkerDetection& detection : card.detections[i]) {
      if (detection.id == id) {
        sightings.push_back({id_of<ViewId>(i), detection.corners_px});
      }
    }
  }
  return sightings;
}

SquareFit fit_tilted(const CardSceneOptions& options) {
  const CardScene card = make_card_scene({{0, tilted_marker()}}, options);
  return fit_square(card.scene, sightings_of(card));
}

void move_corners(MarkerSighting& sighting, const Eigen::Vector2d& by_px) {
  for (Eigen::Vector2d& corner : sighting.corners_px) {
    corner += by_px;
  }
}

TEST(SquareFit, IsExactWithoutNoise) {
  const SquareFit fit = fit_tilted({});
  ASSERT_EQ(fit.outcome, SquareOutcome::kOk);
  const TrueMarker truth = tilted_marker();
  EXPECT_NEAR(fit.side, truth.side, 1e-9);
  EXPECT_LT((fit.world_from_marker.translation - truth.world_from_marker.translation).norm(), 1e-9);
  EXPECT_LT(test_support::rotation_distance_rad(fit.world_from_marker.rotation,
                                                truth.world_from_marker.rotation),
            1e-9);
  EXPECT_EQ(fit.views_used, 12U);
  EXPECT_LT(fit.rms_px, 1e-6);
}

/// The stated standard deviations against the errors of many noisy scenes.
TEST(SquareFit, StatesItsAccuracy) {
  constexpr int kTrials = 60;
  const TrueMarker truth = tilted_marker();
  double side = 0.0;
  double normal = 0.0;
  double center = 0.0;
  for (int i = 0; i < kTrials; ++i) {
    const SquareFit fit =
        fit_tilted({.noise_px = 0.3, .seed = static_cast<std::uint64_t>(100 + i)});
    ASSERT_EQ(fit.outcome, SquareOutcome::kOk);
    side += std::pow(std::log(fit.side / truth.side) / fit.side_sd_ratio, 2) / kTrials;
    const Eigen::Vector3d in_marker = truth.world_from_marker.rotation.conjugate() *
                                      (fit.world_from_marker.rotation * Eigen::Vector3d::UnitZ());
    normal += in_marker.head<2>().squaredNorm() / std::pow(fit.normal_sd_rad, 2) / (2 * kTrials);
    const Eigen::Vector3d moved =
        fit.world_from_marker.translation - truth.world_from_marker.translation;
    center += moved.squaredNorm() / fit.center_covariance.trace() / kTrials;
  }
  // Means of squares of what should be unit variances: 60 trials know them to about 0.2.
  for (const double mean_square : {side, normal, center}) {
    EXPECT_GT(mean_square, 0.35);
    EXPECT_LT(mean_square, 1.6);
  }
}

/// As poses with errors do it: all corners of a view are moved together.
TEST(SquareFit, StatesItsAccuracyWhenViewsErrAsAWhole) {
  constexpr int kTrials = 60;
  const CardScene card = make_card_scene({{0, tilted_marker()}}, {.noise_px = 0.02});
  test_support::Random random(5);
  double mean_square = 0.0;
  for (int i = 0; i < kTrials; ++i) {
    std::vector<MarkerSighting> sightings = sightings_of(card);
    for (MarkerSighting& sighting : sightings) {
      move_corners(sighting, 0.4 * Eigen::Vector2d(random.normal(), random.normal()));
    }
    const SquareFit fit = fit_square(card.scene, sightings);
    ASSERT_EQ(fit.outcome, SquareOutcome::kOk);
    const Eigen::Vector3d moved =
        fit.world_from_marker.translation - tilted_marker().world_from_marker.translation;
    mean_square += moved.squaredNorm() / fit.center_covariance.trace() / kTrials;
  }
  EXPECT_LT(mean_square, 1.8);  // 3.4 when the corners are taken to err one by one
}

TEST(SquareFit, LeavesOutAViewThatDisagrees) {
  const CardScene card = make_card_scene({{0, tilted_marker()}}, {.noise_px = 0.1});
  std::vector<MarkerSighting> sightings = sightings_of(card);
  move_corners(sightings[2], {60.0, -25.0});
  move_corners(sightings[7], {1.5, 1.5});
  const SquareFit fit = fit_square(card.scene, sightings);
  ASSERT_EQ(fit.outcome, SquareOutcome::kOk);
  EXPECT_EQ(fit.views_seen, 12U);
  EXPECT_EQ(fit.views_used, 10U);
  EXPECT_NEAR(fit.side, tilted_marker().side, 3.0 * fit.side_sd_ratio * tilted_marker().side);
  EXPECT_LT(fit.rms_px, 0.2);
}

TEST(SquareFit, NeedsThreeViewsWithAPose) {
  CardScene card = make_card_scene({{0, tilted_marker()}}, {.views = 4});
  card.scene.views[1].cam_from_world.reset();
  EXPECT_EQ(fit_square(card.scene, sightings_of(card)).outcome, SquareOutcome::kOk);
  card.scene.views[3].cam_from_world.reset();
  const SquareFit fit = fit_square(card.scene, sightings_of(card));
  EXPECT_EQ(fit.outcome, SquareOutcome::kTooFewViews);
  EXPECT_EQ(fit.views_seen, 2U);
  EXPECT_EQ(fit_square(card.scene, {}).outcome, SquareOutcome::kTooFewViews);
}

TEST(SquareFit, NeedsParallax) {
  EXPECT_EQ(fit_tilted({.arc_deg = 1.0, .noise_px = 0.2}).outcome, SquareOutcome::kSmallAngle);
  EXPECT_EQ(fit_tilted({.arc_deg = 0.0, .noise_px = 0.2}).outcome, SquareOutcome::kSmallAngle);
  EXPECT_EQ(fit_tilted({.arc_deg = 0.0}).outcome, SquareOutcome::kSmallAngle);
}

TEST(SquareFit, RefusesWhatIsInTwoPlaces) {
  const CardScene here = make_card_scene({{0, tilted_marker()}});
  TrueMarker other = tilted_marker();
  other.world_from_marker.translation += Eigen::Vector3d(-1.5, 1.0, 0.0);
  const std::vector<MarkerSighting> there = sightings_of(make_card_scene({{0, other}}));
  std::vector<MarkerSighting> sightings = sightings_of(here);
  for (std::size_t i = 0; i < sightings.size(); i += 2) {
    sightings[i] = there[i];
  }
  EXPECT_EQ(fit_square(here.scene, sightings).outcome, SquareOutcome::kInconsistent);
}

TEST(SquareFit, NamesItsOutcomes) {
  EXPECT_EQ(to_string(SquareOutcome::kOk), "ok");
  EXPECT_EQ(to_string(SquareOutcome::kTooFewViews), "too_few_views");
  EXPECT_EQ(to_string(SquareOutcome::kSmallAngle), "small_angle");
  EXPECT_EQ(to_string(SquareOutcome::kInconsistent), "inconsistent");
}

}  // namespace
}  // namespace trigmesh
