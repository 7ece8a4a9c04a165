#include "sfm/scale/metric_scale.hpp"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sfm/scene/scene_transform.hpp"
#include "tests/unit/sfm/scale/card_scene.hpp"

namespace trigmesh {
namespace {

using test_support::card_of_four;
using test_support::CardScene;
using test_support::make_card_scene;
using test_support::TrueMarker;
using ::testing::ElementsAre;

constexpr double kMetresPerUnit = 0.1;  // the card's markers have sides of one unit

FittedMarkers fit(const CardScene& card) {
  return fit_markers(card.scene, card.detections);
}

FittedMarkers fit_card(double noise_px = 0.2) {
  return fit(make_card_scene(card_of_four(), {.noise_px = noise_px}));
}

TEST(FitMarkers, FindsEachMarkerOfTheCard) {
  const FittedMarkers markers = fit_card();
  ASSERT_EQ(markers.size(), 4U);
  for (const auto& [id, square] : markers) {
    EXPECT_EQ(square.outcome, SquareOutcome::kOk) << id;
    EXPECT_EQ(square.views_used, 12U) << id;
  }
}

TEST(FitMarkers, PassesOverViewsWithoutPose) {
  CardScene card = make_card_scene(card_of_four());
  for (View& view : card.scene.views) {
    view.cam_from_world.reset();
  }
  EXPECT_TRUE(fit(card).empty());
}

TEST(EstimateScale, IsRightWithinItsStandardDeviations) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const CardScene card = make_card_scene(card_of_four(), {.noise_px = 0.3, .seed = seed});
    const ScaleEstimate scale = estimate_scale(fit(card), {.marker_side_m = kMetresPerUnit});
    ASSERT_EQ(scale.outcome, ScaleOutcome::kOk);
    EXPECT_EQ(scale.lengths.size(), 4U);
    EXPECT_LT(scale.sd_ratio, 0.005);
    EXPECT_GE(scale.sd_ratio, kKnownLengthSdRatio);
    EXPECT_LT(std::abs(scale.metres_per_unit / kMetresPerUnit - 1.0), 3.0 * scale.sd_ratio);
  }
}

TEST(EstimateScale, WeighsByAccuracy) {
  FittedMarkers markers = fit_card();
  markers[0].side = 1.0;
  markers[0].side_sd_ratio = 0.001;
  markers[0].edge_sd_ratio = 0.0005;
  markers[1].side = 1.006;
  markers[1].side_sd_ratio = 0.002;
  markers[1].edge_sd_ratio = 0.001;
  markers.erase(2);
  markers.erase(3);
  const ScaleEstimate scale = estimate_scale(markers, {.marker_side_m = 1.0});
  ASSERT_EQ(scale.outcome, ScaleOutcome::kOk);
  // ln(1.006) = 0.00598; a fifth of it counts: weights of 4 to 1. chi^2 = 0.00598^2 / (0.001^2 +
  // 0.002^2) = 7.16; variance of the mean 0.8e-6, times 7.16, 0.0006 of edges, 0.001 of the card.
  EXPECT_NEAR(std::log(scale.metres_per_unit), -0.2 * 0.005982, 1e-6);
  EXPECT_NEAR(scale.sd_ratio, std::sqrt(0.8e-6 * 7.157 + 0.36e-6 + 1e-6), 1e-6);
}

TEST(EstimateScale, DoesNotBoastWhenMarkersAgreeByChance) {
  FittedMarkers markers = fit_card();
  for (auto& [id, square] : markers) {
    square.side = 1.0;
    square.side_sd_ratio = 0.004;
    square.edge_sd_ratio = 0.0;
  }
  const ScaleEstimate scale = estimate_scale(markers, {.marker_side_m = 1.0});
  EXPECT_NEAR(scale.sd_ratio, std::hypot(0.002, kKnownLengthSdRatio), 1e-12);
}

TEST(EstimateScale, UsesADistanceAlone) {
  const ScaleEstimate scale =
      estimate_scale(fit_card(), {.distance_m = {{{0, 1}, 2.0 * kMetresPerUnit}}});
  ASSERT_EQ(scale.outcome, ScaleOutcome::kOk);
  ASSERT_EQ(scale.lengths.size(), 1U);
  EXPECT_EQ(scale.lengths[0].name, "markers 0 and 1");
  EXPECT_EQ(scale.lengths[0].known_m, 2.0 * kMetresPerUnit);
  EXPECT_LT(std::abs(scale.metres_per_unit / kMetresPerUnit - 1.0), 3.0 * scale.sd_ratio);
}

TEST(EstimateScale, TellsTheMarkerWithAWrongSide) {
  const ScaleEstimate scale = estimate_scale(
      fit_card(),
      {.marker_side_m = kMetresPerUnit, .side_of_marker_m = {{3, 1.2 * kMetresPerUnit}}});
  EXPECT_EQ(scale.outcome, ScaleOutcome::kDisagreement);
  EXPECT_THAT(scale.odd_ones, ElementsAre(3));
  EXPECT_THAT(scale.others, ElementsAre(0, 1, 2));
  EXPECT_NEAR(scale.lengths[3].metres_per_unit, 1.2 * kMetresPerUnit, 0.005 * kMetresPerUnit);
}

TEST(EstimateScale, TellsWhenAllSidesAreWrongAndADistanceIsRight) {
  const ScaleEstimate scale = estimate_scale(
      fit_card(),
      {.marker_side_m = 1.05 * kMetresPerUnit, .distance_m = {{{0, 1}, 2.0 * kMetresPerUnit}}});
  EXPECT_EQ(scale.outcome, ScaleOutcome::kDisagreement);
  EXPECT_THAT(scale.odd_ones, ElementsAre(4));
  EXPECT_THAT(scale.others, ElementsAre(0, 1, 2, 3));
}

TEST(EstimateScale, ADifferenceThatIsSignificantButSmallIsNoError) {
  FittedMarkers markers = fit_card(0.02);
  const ScaleEstimate scale = estimate_scale(
      markers,
      {.marker_side_m = kMetresPerUnit, .side_of_marker_m = {{3, 1.008 * kMetresPerUnit}}});
  ASSERT_EQ(scale.outcome, ScaleOutcome::kOk);
  EXPECT_GT(scale.sd_ratio, 0.0015);  // the scatter counts
}

TEST(EstimateScale, ALargeDifferenceThatIsNoiseIsNoError) {
  FittedMarkers markers = fit_card();
  markers[3].side = 1.1;
  markers[3].side_sd_ratio = 0.05;
  EXPECT_EQ(estimate_scale(markers, {.marker_side_m = 1.0}).outcome, ScaleOutcome::kOk);
}

TEST(EstimateScale, HasNothingToSayOfUnknownMarkers) {
  const FittedMarkers markers = fit_card();
  EXPECT_EQ(estimate_scale(markers, {}).outcome, ScaleOutcome::kNothingMeasured);
  EXPECT_EQ(estimate_scale(markers, {.side_of_marker_m = {{7, 0.1}}}).outcome,
            ScaleOutcome::kNothingMeasured);
  EXPECT_EQ(estimate_scale(markers, {.distance_m = {{{0, 7}, 0.1}}}).outcome,
            ScaleOutcome::kNothingMeasured);
  EXPECT_EQ(estimate_scale({}, {.marker_side_m = 0.1}).outcome, ScaleOutcome::kNothingMeasured);
}

TEST(EstimateUp, IsTheNormalOfTheCard) {
  const CardScene card = make_card_scene(card_of_four(), {.noise_px = 0.2});
  const Sim3 other_world{
      .scale = 3.0,
      .rotation = Eigen::Quaterniond(Eigen::AngleAxisd(2.0, Eigen::Vector3d::Ones().normalized())),
      .translation = {5.0, -4.0, 3.0}};
  const CardScene moved{transform_scene(other_world, card.scene), card.detections};
  const KnownLengths known{.marker_side_m = kMetresPerUnit};
  const UpEstimate up = estimate_up(fit(moved), known);
  ASSERT_EQ(up.outcome, UpOutcome::kOk);
  const Eigen::Vector3d found = up.card_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d truth = other_world.rotation * Eigen::Vector3d::UnitZ();
  EXPECT_LT(std::acos(std::min(1.0, found.dot(truth))), 5.0 * up.sd_rad);
  EXPECT_LT(up.sd_rad, 0.01);
  EXPECT_GT(up.sd_rad, 0.0);
}

TEST(EstimateUp, TellsWhenMarkersDoNotLieFlat) {
  auto markers = card_of_four();
  markers[2].world_from_marker.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX()));
  const FittedMarkers fitted = fit(make_card_scene(markers, {.noise_px = 0.1}));
  const UpEstimate up = estimate_up(fitted, {.marker_side_m = 0.1});
  EXPECT_EQ(up.outcome, UpOutcome::kDisagreement);
  EXPECT_NEAR(up.largest_angle_rad, 0.5, 0.05);
  // The one that stands askew is of no account when nothing of it is known.
  EXPECT_EQ(estimate_up(fitted, {.side_of_marker_m = {{0, 0.1}, {3, 0.1}}}).outcome,
            UpOutcome::kOk);
}

TEST(EstimateUp, NeedsAMarker) {
  EXPECT_EQ(estimate_up({}, {.marker_side_m = 0.1}).outcome, UpOutcome::kNoMarker);
  EXPECT_EQ(estimate_up(fit_card(), {}).outcome, UpOutcome::kNoMarker);
}

TEST(MetricFromWorld, ScalesAndPutsTheCardOnTheGround) {
  const CardScene card = make_card_scene(card_of_four());
  const Sim3 other_world{
      .scale = 3.0,
      .rotation = Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitY())),
      .translation = {5.0, -4.0, 3.0}};
  const CardScene moved{transform_scene(other_world, card.scene), card.detections};
  const KnownLengths known{.marker_side_m = kMetresPerUnit};
  const FittedMarkers markers = fit(moved);
  const ScaleEstimate scale = estimate_scale(markers, known);
  const Scene metric = transform_scene(
      metric_from_world(scale.metres_per_unit, estimate_up(markers, known)), moved.scene);
  // The axes of the card are those of the scene that was made, and its middle is the origin.
  for (std::size_t i = 0; i < metric.views.size(); ++i) {
    const Eigen::Vector3d center = camera_center(*metric.views[i].cam_from_world);
    const Eigen::Vector3d truth =
        kMetresPerUnit * camera_center(*card.scene.views[i].cam_from_world);
    EXPECT_LT((center - truth).norm(), 1e-6);
  }
}

TEST(MetricFromWorld, WithoutUpOnlyScales) {
  const Sim3 metric = metric_from_world(0.25);
  EXPECT_EQ(metric.scale, 0.25);
  EXPECT_EQ(metric * Eigen::Vector3d(4.0, 8.0, -4.0), Eigen::Vector3d(1.0, 2.0, -1.0));
}

}  // namespace
}  // namespace trigmesh
