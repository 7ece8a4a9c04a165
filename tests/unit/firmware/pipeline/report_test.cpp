#include "firmware/pipeline/report.hpp"

#include <cmath>
#include <limits>
#include <numeric>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/synthetic_scene.hpp"

namespace trigmesh {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr double kHalfBaseline = 1.0;
constexpr double kDepth = 10.0;

View view_at(std::string name, double x) {
  View view;
  view.name = std::move(name);
  view.cam_from_world = Rigid3{.translation = Eigen::Vector3d(-x, 0.0, 0.0)};
  return view;
}

/// Adds an observation of `landmark` whose keypoint stands `offset_px` beside the projection.
void observe(Scene& scene,
             std::size_t landmark,
             std::size_t view_position,
             const Eigen::Vector2d& offset_px) {
  View& view = scene.views[view_position];
  Landmark& point = scene.landmarks[landmark];
  const Eigen::Vector2d pixel =
      project(scene.cameras[0], *view.cam_from_world * point.position_in_world)
          .value_or(Eigen::Vector2d::Zero());
  point.track.push_back({.view = id_of<ViewId>(view_position),
                         .feature = id_of<FeatureIndex>(view.keypoints_px.size())});
  view.keypoints_px.push_back((pixel + offset_px).cast<float>());
  view.landmarks.push_back(id_of<LandmarkId>(landmark));
}

/// Three cameras in a row look along +z at one point in front of the middle one; the last keypoint
/// is 5 px off.
Scene three_cameras_one_point() {
  Scene scene;
  scene.cameras = {Camera{.width_px = 3600,
                          .height_px = 2400,
                          .fx_px = 5000,
                          .fy_px = 5000,
                          .cx_px = 1800,
                          .cy_px = 1200}};
  scene.views = {
      view_at("a.jpg", -kHalfBaseline), view_at("b.jpg", 0.0), view_at("c.jpg", kHalfBaseline)};
  scene.landmarks.resize(1);
  scene.landmarks[0].position_in_world = {0.0, 0.0, kDepth};
  observe(scene, 0, 0, {0.0, 0.0});
  observe(scene, 0, 1, {0.0, 0.0});
  observe(scene, 0, 2, {3.0, 4.0});
  return scene;
}

std::vector<ImageOutcome> outcomes_of(const Scene& scene, int component) {
  std::vector<ImageOutcome> outcomes;
  for (const View& view : scene.views) {
    ImageOutcome outcome;
    outcome.name = view.name;
    outcome.component = component;
    outcome.reason = component > 0 ? RefusalReason::kOtherComponent : RefusalReason::kNone;
    outcomes.push_back(std::move(outcome));
  }
  return outcomes;
}

ImageOutcome refused(std::string name, RefusalReason reason) {
  ImageOutcome outcome;
  outcome.name = std::move(name);
  outcome.reason = reason;
  outcome.detail = "why it was refused";
  return outcome;
}

ReconstructionReport report_of(const std::vector<Scene>& components,
                               const std::vector<ImageOutcome>& images) {
  ReportInput input;
  input.components = components;
  input.images = images;
  return build_report(input);
}

std::size_t sum(const Histogram& histogram) {
  return std::accumulate(histogram.counts.begin(), histogram.counts.end(), std::size_t{0});
}

TEST(Report, MeasuresReprojectionErrors) {
  const std::vector<Scene> scenes{three_cameras_one_point()};
  const ReconstructionReport report = report_of(scenes, outcomes_of(scenes[0], 0));
  EXPECT_EQ(report.overall.points, 1U);
  EXPECT_EQ(report.overall.observations, 3U);
  EXPECT_THAT(report.overall.mean_track_length, DoubleNear(3.0, 1e-12));
  EXPECT_THAT(report.overall.rmse_px, DoubleNear(std::sqrt(25.0 / 3.0), 1e-6));
  EXPECT_THAT(report.overall.mean_error_px, DoubleNear(5.0 / 3.0, 1e-6));
  EXPECT_THAT(report.overall.median_error_px, DoubleNear(0.0, 1e-6));
  EXPECT_EQ(report.reprojection_error_px.counts.front(), 2U);
  EXPECT_EQ(report.reprojection_error_px.counts.back(), 1U)
      << "5 px lie above the last bin and are counted in it";
}

TEST(Report, GivesEveryImageItsOwnError) {
  const std::vector<Scene> scenes{three_cameras_one_point()};
  const ReconstructionReport report = report_of(scenes, outcomes_of(scenes[0], 0));
  EXPECT_THAT(report.images[0].rmse_px, DoubleNear(0.0, 1e-6));
  EXPECT_THAT(report.images[2].rmse_px, DoubleNear(5.0, 1e-6));
  EXPECT_EQ(report.images[2].observations, 1U);
}

TEST(Report, TakesTheLargestAngleOfATrack) {
  const std::vector<Scene> scenes{three_cameras_one_point()};
  const ReconstructionReport report = report_of(scenes, outcomes_of(scenes[0], 0));
  const double angle_deg = 2.0 * std::atan(kHalfBaseline / kDepth) * 180.0 / M_PI;
  const auto bin = static_cast<std::size_t>(angle_deg / report.triangulation_angle_deg.bin_width);
  EXPECT_EQ(report.triangulation_angle_deg.counts[bin], 1U);
  EXPECT_EQ(sum(report.triangulation_angle_deg), 1U);
  EXPECT_EQ(report.track_length.counts[1], 1U) << "a track of three images";
}

TEST(Report, CountsAnObservationFromBehindWithoutAnError) {
  Scene scene = three_cameras_one_point();
  scene.views[2].cam_from_world->rotation = Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitY());
  scene.views[2].cam_from_world->translation = {1.0, 0.0, 0.0};
  const ReconstructionReport report = report_of({scene}, outcomes_of(scene, 0));
  EXPECT_EQ(report.overall.observations, 3U);
  EXPECT_EQ(sum(report.reprojection_error_px), 2U);
  EXPECT_THAT(report.overall.rmse_px, DoubleNear(0.0, 1e-6));
}

TEST(Report, TellsFocalLengthAsPhotographersDo) {
  const std::vector<Scene> scenes{three_cameras_one_point()};
  const ReconstructionReport report = report_of(scenes, outcomes_of(scenes[0], 0));
  ASSERT_EQ(report.cameras.size(), 1U);
  EXPECT_THAT(report.cameras[0].focal_35mm_equivalent, DoubleNear(50.0, 1e-3));
  EXPECT_THAT(report.cameras[0].horizontal_fov_deg,
              DoubleNear(2.0 * std::atan(0.36) * 180.0 / M_PI, 1e-9));
  EXPECT_EQ(report.cameras[0].images, 3U);
}

TEST(Report, SaysHowIntrinsicsCameAbout) {
  Scene scene = three_cameras_one_point();
  scene.cameras.push_back(scene.cameras[0]);
  scene.cameras.push_back(scene.cameras[0]);
  scene.views[1].camera = CameraId{2};
  const std::vector<Scene> scenes{scene};
  const std::vector<ImageOutcome> images = outcomes_of(scene, 0);
  const std::vector<IntrinsicsOrigin> origins{IntrinsicsOrigin::kGiven};
  ReportInput input;
  input.components = scenes;
  input.images = images;
  input.intrinsics_origins = origins;
  const ReconstructionReport report = build_report(input);
  ASSERT_EQ(report.cameras.size(), 2U) << "group 1 has no image and is left out";
  EXPECT_EQ(report.cameras[0].origin, IntrinsicsOrigin::kGiven);
  EXPECT_EQ(report.cameras[1].group, 2U);
  EXPECT_EQ(report.cameras[1].origin, IntrinsicsOrigin::kSolved);
}

TEST(Report, AgreesWithASyntheticScene) {
  const test_support::SyntheticScene scene = test_support::make_synthetic_scene({.noise_px = 0.5});
  const std::vector<Scene> scenes{scene.truth};
  const ReconstructionReport report = report_of(scenes, outcomes_of(scene.truth, 0));
  EXPECT_EQ(report.verdict, Verdict::kComplete);
  EXPECT_EQ(report.overall.points, scene.truth.landmarks.size());
  EXPECT_THAT(report.overall.rmse_px, DoubleNear(0.5 * std::sqrt(2.0), 0.03));
  EXPECT_EQ(sum(report.reprojection_error_px), report.overall.observations);
  EXPECT_EQ(sum(report.track_length), report.overall.points);
}

TEST(ReportVerdict, IsCompleteWhenAllImagesAreInOneModel) {
  const std::vector<Scene> scenes{three_cameras_one_point()};
  const ReconstructionReport report = report_of(scenes, outcomes_of(scenes[0], 0));
  EXPECT_EQ(report.verdict, Verdict::kComplete);
  EXPECT_EQ(report.verdict_sentence, "All 3 images are registered in one model.");
  EXPECT_THAT(report.units_sentence, StartsWith("Up to scale"));
}

TEST(Report, CarriesSectionsAndScale) {
  const std::vector<ScaleSection> scale{{.outcome = ScaleOutcome::kOk, .metres_per_unit = 0.5}};
  ReportInput input;
  input.scale = scale;
  input.dense = DenseSection{.views = 3};
  input.texture = TextureSection{.pages = 2};
  const ReconstructionReport report = build_report(input);
  EXPECT_THAT(report.units_sentence, StartsWith("Metric: lengths are in metres"));
  EXPECT_EQ(report.metres_per_unit, 1.0);
  ASSERT_EQ(report.scale.size(), 1U);
  EXPECT_EQ(report.scale[0].metres_per_unit, 0.5);
  EXPECT_EQ(report.dense->views, 3U);
  EXPECT_FALSE(report.surface.has_value());
  EXPECT_EQ(report.texture->pages, 2U);
}

TEST(ReportVerdict, IsPartialWhenSomeImagesAreRefused) {
  const std::vector<Scene> scenes{three_cameras_one_point()};
  std::vector<ImageOutcome> images = outcomes_of(scenes[0], 0);
  images.push_back(refused("d.jpg", RefusalReason::kNoOverlap));
  const ReconstructionReport report = report_of(scenes, images);
  EXPECT_EQ(report.verdict, Verdict::kPartial);
  EXPECT_EQ(report.verdict_sentence, "3 of 4 images are registered, 1 is refused.");
  EXPECT_EQ(report.images[3].advice, advice(RefusalReason::kNoOverlap));
  EXPECT_EQ(report.images_refused, 1U);
}

TEST(ReportVerdict, KeepsSeparateModelsApart) {
  Scene side = three_cameras_one_point();
  for (View& view : side.views) {
    view.name = "side/" + view.name;
  }
  const std::vector<Scene> scenes{three_cameras_one_point(), side};
  std::vector<ImageOutcome> images = outcomes_of(scenes[0], 0);
  const std::vector<ImageOutcome> others = outcomes_of(side, 1);
  images.insert(images.end(), others.begin(), others.end());
  const ReconstructionReport report = report_of(scenes, images);
  EXPECT_EQ(report.images_registered, 3U);
  EXPECT_EQ(report.images_in_other_components, 3U);
  EXPECT_EQ(report.images_refused, 0U);
  EXPECT_EQ(report.images[4].component, 1U);
  EXPECT_THAT(report.verdict_sentence, HasSubstr("3 are in 1 separate model"));
  EXPECT_EQ(report.overall.points, 2U);
  EXPECT_EQ(report.components[1].points, 1U);
}

TEST(ReportVerdict, IsNotReadyBelowHalfOfTheImages) {
  const std::vector<Scene> scenes{three_cameras_one_point()};
  std::vector<ImageOutcome> images = outcomes_of(scenes[0], 0);
  for (const char* name : {"d.jpg", "e.jpg", "f.jpg", "g.jpg"}) {
    images.push_back(refused(name, RefusalReason::kTooFewFeatures));
  }
  const ReconstructionReport report = report_of(scenes, images);
  EXPECT_EQ(report.verdict, Verdict::kNotReady);
  EXPECT_THAT(report.verdict_sentence, StartsWith("Not ready: only 3 of 7 images"));
}

TEST(ReportVerdict, IsNotReadyWithoutAModel) {
  EXPECT_EQ(report_of({}, {}).verdict, Verdict::kNotReady);
  EXPECT_THAT(report_of({}, {refused("a.jpg", RefusalReason::kNoOverlap)}).verdict_sentence,
              HasSubstr("at least two"));
  const ReconstructionReport report = report_of({},
                                                {refused("a.jpg", RefusalReason::kPureRotation),
                                                 refused("b.jpg", RefusalReason::kPureRotation)});
  EXPECT_EQ(report.verdict_sentence, "Not ready: none of the 2 images could be registered.");
  EXPECT_EQ(report.overall.rmse_px, 0.0);
}

TEST(Report, SortsPairsAndPutsSevereNotesFirst) {
  const std::vector<Scene> scenes{three_cameras_one_point()};
  const std::vector<ImageOutcome> images = outcomes_of(scenes[0], 0);
  const std::vector<PairEvidence> pairs{{.pair = {ViewId{1}, ViewId{2}}, .inliers = 7},
                                        {.pair = {ViewId{0}, ViewId{2}}, .inliers = 8}};
  ReportInput input;
  input.components = scenes;
  input.images = images;
  input.pairs = pairs;
  input.notes = {{NoteSeverity::kInfo, "first"},
                 {NoteSeverity::kError, "second"},
                 {NoteSeverity::kInfo, "third"}};
  const ReconstructionReport report = build_report(input);
  EXPECT_EQ(report.pairs[0].inliers, 8U);
  EXPECT_THAT(
      (std::vector<std::string>{report.notes[0].text, report.notes[1].text, report.notes[2].text}),
      ElementsAre("second", "first", "third"));
}

}  // namespace
}  // namespace trigmesh
