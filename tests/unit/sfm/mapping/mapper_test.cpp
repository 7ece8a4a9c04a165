#include "sfm/mapping/mapper.hpp"

#include <algorithm>
#include <cstring>
#include <functional>
#include <limits>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/matchers.hpp"
#include "tests/unit/sfm/mapping/bundle_test_scenes.hpp"
#include "tests/unit/sfm/mapping/mapping_test_scenes.hpp"

namespace trigmesh {
namespace {

using mapping_test::make_mapper;
using mapping_test::map_scene;
using mapping_test::ReversedExecutor;
using mapping_test::step_to_the_end;
using test_support::CloudKind;
using test_support::make_synthetic_scene;
using test_support::PathKind;
using test_support::ReconstructionNear;
using test_support::SyntheticScene;
using test_support::SyntheticSceneOptions;
using ::testing::Each;
using ::testing::Field;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// What half a pixel of noise leaves, with some room: a camera that turns a little to one side and
// moves a little to the other sees nearly the same. Distance from the scene 5, extent 2.
constexpr double kRotationRad = 0.02;
constexpr double kPosition = 0.03;

bool same_bits(const Scene& a, const Scene& b) {
  const auto same_view = [](const View& v, const View& w) {
    return v.cam_from_world.has_value() == w.cam_from_world.has_value() &&
           (!v.cam_from_world || bundle_test::same_bits(*v.cam_from_world, *w.cam_from_world)) &&
           v.landmarks == w.landmarks;
  };
  const auto same_landmark = [](const Landmark& l, const Landmark& m) {
    return std::memcmp(
               l.position_in_world.data(), m.position_in_world.data(), 3 * sizeof(double)) == 0 &&
           l.track == m.track;
  };
  return a.cameras == b.cameras &&
         std::equal(a.views.begin(), a.views.end(), b.views.begin(), b.views.end(), same_view) &&
         std::equal(a.landmarks.begin(),
                    a.landmarks.end(),
                    b.landmarks.begin(),
                    b.landmarks.end(),
                    same_landmark);
}

void expect_one_model_near_truth(const Mapper& mapper,
                                 const SyntheticScene& scene,
                                 double rotation_rad,
                                 double position) {
  const std::vector<Scene> components = mapper.components();
  ASSERT_THAT(components, SizeIs(1));
  EXPECT_TRUE(components[0].validate().has_value());
  EXPECT_THAT(components[0], ReconstructionNear(scene.truth, rotation_rad, position));
  EXPECT_EQ(mapper.registered_count(), scene.truth.views.size());
  EXPECT_THAT(mapper.outcomes(), Each(Field(&ImageOutcome::reason, RefusalReason::kNone)));
}

// ---------------------------------------------------------------------------------------------------------------------
// Whole scenes with given intrinsics.

struct WholeSceneCase {
  const char* name;
  SyntheticSceneOptions options;
};

class WholeScene : public ::testing::TestWithParam<WholeSceneCase> {};

TEST_P(WholeScene, ComesOutAsItIs) {
  const SyntheticScene scene = make_synthetic_scene(GetParam().options);
  expect_one_model_near_truth(map_scene(scene), scene, kRotationRad, kPosition);
}

INSTANTIATE_TEST_SUITE_P(
    Mapper,
    WholeScene,
    ::testing::Values(
        WholeSceneCase{"Arc", {.points = 400, .noise_px = 0.5}},
        WholeSceneCase{"Orbit",
                       {.points = 500, .path = PathKind::kOrbit, .views = 16, .noise_px = 0.5}},
        WholeSceneCase{"Line",
                       {.cloud = CloudKind::kVolume,
                        .points = 300,
                        .path = PathKind::kLine,
                        .views = 6,
                        .noise_px = 0.5}},
        WholeSceneCase{"Plane",
                       {.cloud = CloudKind::kPlane, .points = 300, .views = 8, .noise_px = 0.5}},
        WholeSceneCase{"WrongMatches",
                       {.points = 400,
                        .noise_px = 0.5,
                        .dropout_ratio = 0.2,
                        .clutter_ratio = 0.5,
                        .outlier_ratio = 0.2}},
        WholeSceneCase{"WrongMatchesOnEpipolarLines",
                       {.points = 400,
                        .path = PathKind::kRandom,
                        .noise_px = 0.5,
                        .dropout_ratio = 0.2,
                        .clutter_ratio = 0.5,
                        .outlier_ratio = 0.15,
                        .outlier_kind = test_support::OutlierKind::kNearEpipolarLine}},
        WholeSceneCase{"TwoCameraGroups", {.points = 400, .camera_groups = 2, .noise_px = 0.5}}),
    [](const auto& test_case) { return test_case.param.name; });

TEST(Mapper, GivenIntrinsicsStayAsTheyAre) {
  const SyntheticScene scene = make_synthetic_scene({.points = 300, .views = 6, .noise_px = 0.5});
  EXPECT_EQ(map_scene(scene).components().at(0).cameras, scene.truth.cameras);
}

TEST(Mapper, LandmarksLieOnTheTruthWithoutNoise) {
  const SyntheticScene scene = make_synthetic_scene({.points = 300, .views = 6});
  const Mapper mapper = map_scene(scene);
  expect_one_model_near_truth(mapper, scene, 1e-5, 1e-5);
  const Scene model = mapper.components()[0];
  EXPECT_GT(model.landmarks.size(), scene.truth.landmarks.size() * 95 / 100);
  for (const Landmark& landmark : model.landmarks) {
    EXPECT_LT(landmark.error_px, 0.01);
  }
}

// ---------------------------------------------------------------------------------------------------------------------
// Intrinsics that are not known.

TEST(Mapper, SolvesAnUnknownFocalLength) {
  SyntheticSceneOptions options{
      .cloud = CloudKind::kVolume, .points = 300, .path = PathKind::kRandom, .noise_px = 0.5};
  options.camera.fx_px = options.camera.fy_px = 700.0;
  options.camera.cx_px = 399.5;
  options.camera.cy_px = 299.5;
  const SyntheticScene scene = make_synthetic_scene(options);
  const Mapper mapper = map_scene(scene, IntrinsicsKnowledge::kUnknown);
  expect_one_model_near_truth(mapper, scene, 5e-3, 0.02);
  EXPECT_NEAR(mapper.components()[0].cameras[0].fx_px, 700.0, 7.0);
}

TEST(Mapper, CorrectsAFocalLengthThatExifRounds) {
  SyntheticScene scene = make_synthetic_scene(
      {.cloud = CloudKind::kVolume, .points = 300, .path = PathKind::kRandom, .noise_px = 0.5});
  const double truth_px = scene.truth.cameras[0].fx_px;
  SyntheticScene given = scene;
  given.truth.cameras[0].fx_px *= 1.05;
  given.truth.cameras[0].fy_px *= 1.05;
  const Mapper mapper = map_scene(given, IntrinsicsKnowledge::kPrior);
  expect_one_model_near_truth(mapper, scene, 5e-3, 0.02);
  EXPECT_NEAR(mapper.components()[0].cameras[0].fx_px, truth_px, 0.01 * truth_px);
}

// ---------------------------------------------------------------------------------------------------------------------
// What cannot be mapped.

TEST(Mapper, ATurnOnTheSpotGivesNoModelAndSaysWhy) {
  const SyntheticScene scene =
      make_synthetic_scene({.points = 300, .path = PathKind::kPureRotation, .views = 5});
  const Mapper mapper = map_scene(scene);
  EXPECT_THAT(mapper.components(), IsEmpty());
  EXPECT_EQ(mapper.registered_count(), 0U);
  EXPECT_THAT(mapper.outcomes(), SizeIs(5));
  EXPECT_THAT(mapper.outcomes(), Each(Field(&ImageOutcome::reason, RefusalReason::kPureRotation)));
}

TEST(Mapper, TooLittleParallaxGivesNoModelAndSaysWhy) {
  const SyntheticScene scene = make_synthetic_scene(
      {.cloud = CloudKind::kVolume, .points = 300, .views = 3, .arc_deg = 6.0});
  MapperOptions options;
  options.min_triangulation_angle_deg = 30.0;
  const Mapper mapper = map_scene(scene, IntrinsicsKnowledge::kGiven, options);
  EXPECT_THAT(mapper.components(), IsEmpty());
  EXPECT_THAT(mapper.outcomes(), Each(Field(&ImageOutcome::reason, RefusalReason::kNoParallax)));
}

TEST(Mapper, AModelOfLittleParallaxAsAWholeIsNone) {
  const SyntheticScene scene = make_synthetic_scene(
      {.cloud = CloudKind::kVolume, .points = 300, .views = 5, .arc_deg = 20.0});
  const Mapper good = map_scene(scene);
  EXPECT_THAT(good.components(), SizeIs(1));
  MapperOptions options;
  options.min_model_parallax_deg = 29.0;
  const Mapper mapper = map_scene(scene, IntrinsicsKnowledge::kGiven, options);
  EXPECT_THAT(mapper.components(), IsEmpty());
  EXPECT_EQ(mapper.registered_count(), 0U);
  for (const ImageOutcome& outcome : mapper.outcomes()) {
    EXPECT_EQ(outcome.reason, RefusalReason::kNoParallax);
    EXPECT_THAT(outcome.detail, ::testing::HasSubstr("29.0 are needed"));
  }
}

TEST(Mapper, NothingGivesNothing) {
  SerialExecutor executor;
  Mapper mapper = Mapper::create({}, executor).value();
  EXPECT_EQ(mapper.step().kind, StepKind::kNothing);
  mapper.finish();
  EXPECT_THAT(mapper.components(), IsEmpty());
  EXPECT_THAT(mapper.outcomes(), IsEmpty());
}

TEST(Mapper, AnImageThatOverlapsWithNothingIsLeftOut) {
  SyntheticScene scene = make_synthetic_scene({.points = 800, .views = 6, .noise_px = 0.5});
  std::erase_if(scene.pairs, [](const auto& made) { return made.pair.second == ViewId{5}; });
  const Mapper mapper = map_scene(scene);
  EXPECT_EQ(mapper.registered_count(), 5U);
  EXPECT_EQ(mapper.outcomes()[5].reason, RefusalReason::kNoOverlap);
  EXPECT_EQ(mapper.outcomes()[4].reason, RefusalReason::kNone);
}

// ---------------------------------------------------------------------------------------------------------------------
// Components.

TEST(Mapper, ScenesThatDoNotSeeEachOtherStayApart) {
  const SyntheticScene scene =
      make_synthetic_scene({.points = 300, .views = 6, .noise_px = 0.5, .components = 2});
  const Mapper mapper = map_scene(scene);
  const std::vector<Scene> components = mapper.components();
  ASSERT_THAT(components, SizeIs(2));
  const bool swapped = !components[0].views[0].cam_from_world.has_value();
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(components[i].registered_count(), 6U);
    EXPECT_THAT(
        components[i],
        ReconstructionNear(
            mapping_test::truth_of_component(scene, swapped ? 1 - i : i), kRotationRad, kPosition));
  }
  for (std::size_t i = 0; i < scene.truth.views.size(); ++i) {
    const ImageOutcome outcome = mapper.outcomes()[i];
    EXPECT_EQ(outcome.reason,
              outcome.component == 0 ? RefusalReason::kNone : RefusalReason::kOtherComponent);
  }
}

TEST(Mapper, ComponentsJoinWhenLaterPairsLinkThem) {
  const SyntheticScene scene = make_synthetic_scene(
      {.cloud = CloudKind::kVolume, .points = 200, .views = 10, .noise_px = 0.5});
  const auto links = [](const auto& made) {
    return index(made.pair.first) < 5 && index(made.pair.second) >= 5;
  };
  SyntheticScene halves = scene;
  std::erase_if(halves.pairs, links);
  SerialExecutor executor;
  Mapper mapper = make_mapper(halves, IntrinsicsKnowledge::kGiven, executor);
  step_to_the_end(mapper);
  ASSERT_THAT(mapper.components(), SizeIs(2));
  for (const auto& made : scene.pairs) {
    if (links(made)) {
      mapper.add_pair(made.pair, made.geometry);
    }
  }
  step_to_the_end(mapper);
  mapper.finish();
  expect_one_model_near_truth(mapper, scene, kRotationRad, kPosition);
}

// ---------------------------------------------------------------------------------------------------------------------
// The order of things.

TEST(Mapper, GrowsWhileImagesArrive) {
  const SyntheticScene scene = make_synthetic_scene({.points = 400, .views = 10, .noise_px = 0.5});
  SerialExecutor executor;
  Mapper mapper = Mapper::create({}, executor).value();
  mapping_test::add_cameras(mapper, scene.truth, IntrinsicsKnowledge::kGiven);
  std::size_t registered = 0;
  for (const View& view : scene.truth.views) {
    const ViewId id = mapper.add_image(mapping_test::mapper_image(view));
    for (const auto& made : scene.pairs) {
      if (made.pair.second == id) {
        mapper.add_pair(made.pair, made.geometry);
      }
    }
    step_to_the_end(mapper);
    EXPECT_GE(mapper.registered_count(), registered);
    registered = mapper.registered_count();
  }
  EXPECT_EQ(registered, scene.truth.views.size());
  mapper.finish();
  expect_one_model_near_truth(mapper, scene, kRotationRad, kPosition);
}

TEST(Mapper, GoesOnAfterFinish) {
  const SyntheticScene scene = make_synthetic_scene({.points = 300, .views = 6, .noise_px = 0.5});
  SerialExecutor executor;
  Mapper mapper = Mapper::create({}, executor).value();
  mapping_test::add_cameras(mapper, scene.truth, IntrinsicsKnowledge::kGiven);
  for (const View& view : scene.truth.views) {
    const ViewId id = mapper.add_image(mapping_test::mapper_image(view));
    for (const auto& made : scene.pairs) {
      if (made.pair.second == id) {
        mapper.add_pair(made.pair, made.geometry);
      }
    }
    step_to_the_end(mapper);
    mapper.finish();
  }
  expect_one_model_near_truth(mapper, scene, kRotationRad, kPosition);
}

TEST(Mapper, StepsTellWhatTheyDid) {
  const SyntheticScene scene = make_synthetic_scene({.points = 300, .views = 4});
  SerialExecutor executor;
  Mapper mapper = make_mapper(scene, IntrinsicsKnowledge::kGiven, executor);
  const StepReport seeded = mapper.step();
  EXPECT_EQ(seeded.kind, StepKind::kSeeded);
  EXPECT_GE(seeded.landmarks, 50U);
  EXPECT_EQ(mapper.registered_count(), 2U);
  const StepReport third = mapper.step();
  EXPECT_EQ(third.kind, StepKind::kRegistered);
  EXPECT_GE(third.inliers, 20U);
  EXPECT_TRUE(mapper.components()[0].views[index(third.view)].cam_from_world.has_value());
  EXPECT_EQ(mapper.step().kind, StepKind::kRegistered);
  EXPECT_EQ(mapper.step().kind, StepKind::kNothing);
}

TEST(Mapper, GivesTheSameBitsWhateverTheOrderOfParallelWork) {
  const SyntheticScene scene = make_synthetic_scene(
      {.points = 300, .views = 8, .noise_px = 0.5, .clutter_ratio = 0.3, .outlier_ratio = 0.1});
  SerialExecutor forward;
  ReversedExecutor backward;
  Mapper one = make_mapper(scene, IntrinsicsKnowledge::kPrior, forward);
  Mapper other = make_mapper(scene, IntrinsicsKnowledge::kPrior, backward);
  for (Mapper* mapper : {&one, &other}) {
    step_to_the_end(*mapper);
    mapper->finish();
  }
  ASSERT_THAT(one.components(), SizeIs(1));
  ASSERT_THAT(other.components(), SizeIs(1));
  EXPECT_TRUE(same_bits(one.components()[0], other.components()[0]));
}

// ---------------------------------------------------------------------------------------------------------------------
// Frames one by one.

TEST(Mapper, TrackRegistersWhatFitsAndBeginsNothing) {
  const SyntheticScene scene = make_synthetic_scene({.points = 300, .views = 8, .noise_px = 0.5});
  SerialExecutor executor;
  Mapper mapper = make_mapper(scene, IntrinsicsKnowledge::kGiven, executor);
  EXPECT_EQ(mapper.track(), 0U) << "there is no map";
  ASSERT_EQ(mapper.step().kind, StepKind::kSeeded);
  EXPECT_EQ(mapper.track(), 6U);
  EXPECT_EQ(mapper.registered_count(), 8U);
  EXPECT_TRUE(mapper.is_registered(ViewId{7}));
  EXPECT_EQ(mapper.track(), 0U);
  mapper.finish();
  expect_one_model_near_truth(mapper, scene, kRotationRad, kPosition);
}

TEST(Mapper, TellsHowFarAPairLiesFromWhereTheMapExpectsIt) {
  const SyntheticScene scene = make_synthetic_scene({.points = 300, .views = 8, .noise_px = 0.5});
  SerialExecutor executor;
  Mapper mapper = make_mapper(scene, IntrinsicsKnowledge::kGiven, executor);
  const auto& right = scene.pairs.back();
  EXPECT_FALSE(mapper.disagreement_deg(right.pair, right.geometry.inliers)) << "no map yet";
  step_to_the_end(mapper);
  const auto agreement = mapper.disagreement_deg(right.pair, right.geometry.inliers);
  ASSERT_TRUE(agreement);
  EXPECT_LT(*agreement, 0.5);
  // The same keypoints, each matched with that of another point.
  std::vector<FeatureMatch> wrong = right.geometry.inliers;
  for (std::size_t i = 0; i < wrong.size(); ++i) {
    wrong[i].second = right.geometry.inliers[(i + wrong.size() / 2) % wrong.size()].second;
  }
  const auto disagreement = mapper.disagreement_deg(right.pair, wrong);
  ASSERT_TRUE(disagreement);
  EXPECT_GT(*disagreement, 5.0);
  EXPECT_FALSE(mapper.disagreement_deg(right.pair, std::vector(wrong.begin(), wrong.begin() + 3)))
      << "too few can tell nothing";
}

// ---------------------------------------------------------------------------------------------------------------------
// Options.

TEST(MapperOptions, DefaultsAreValid) {
  EXPECT_TRUE(MapperOptions{}.validate().has_value());
}

TEST(MapperOptions, EveryFieldIsHeldToItsRangeAndNamed) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto expect_refused = [](const char* field,
                                 const std::function<void(MapperOptions&)>& spoil) {
    MapperOptions options;
    spoil(options);
    SerialExecutor executor;
    const auto mapper = Mapper::create(options, executor);
    ASSERT_FALSE(mapper.has_value()) << field;
    EXPECT_EQ(mapper.error().code, ErrorCode::kInvalidArgument);
    EXPECT_THAT(mapper.error().message, ::testing::HasSubstr(field));
  };
  expect_refused("min_pose_inliers", [](auto& o) { o.min_pose_inliers = 5; });
  expect_refused("min_seed_landmarks", [](auto& o) { o.min_seed_landmarks = 1001; });
  expect_refused("min_triangulation_angle_deg", [](auto& o) { o.min_triangulation_angle_deg = 0; });
  expect_refused("max_reprojection_px", [=](auto& o) { o.max_reprojection_px = nan; });
  expect_refused("final_reprojection_px", [](auto& o) { o.final_reprojection_px = 0.0; });
  expect_refused("max_pose_error_px", [](auto& o) { o.max_pose_error_px = 101.0; });
  expect_refused("loss_scale_px", [](auto& o) { o.loss_scale_px = -1.0; });
  expect_refused("min_supported_landmarks", [](auto& o) { o.min_supported_landmarks = 5; });
  expect_refused("min_model_parallax_deg", [](auto& o) { o.min_model_parallax_deg = 0.0; });
  expect_refused("min_view_parallax_deg", [=](auto& o) { o.min_view_parallax_deg = nan; });
  expect_refused("global_growth_ratio", [](auto& o) { o.global_growth_ratio = 1.0; });
  expect_refused("landmarks_per_view", [](auto& o) { o.landmarks_per_view = 19; });
}

}  // namespace
}  // namespace trigmesh
