#include "firmware/pipeline/scale_stage.hpp"

#include <cmath>
#include <stop_token>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "firmware/pipeline/worker_pool.hpp"
#include "sfm/exchange/image_codec.hpp"
#include "sfm/scene/scene_transform.hpp"
#include "tests/support/board_renderer.hpp"
#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr double kSideM = 0.1;
constexpr double kDistanceM = 0.16;      // between the middles of markers 0 and 1
constexpr double kMetresPerUnit = 0.37;  // of the world that mapping chose
constexpr int kViews = 8;

class Silence final : public ProgressListener {
 public:
  void on_progress(const Progress& /*progress*/) override {}
};

Camera small_camera() {
  return {.model = CameraModel::kPinhole,
          .width_px = 480,
          .height_px = 360,
          .fx_px = 450.0,
          .fy_px = 450.0,
          .cx_px = 239.5,
          .cy_px = 179.5};
}

/// Markers 0 and 1 beside each other.
test_support::PlanePattern card_pattern() {
  const auto first = test_support::marker_pattern({}, 0, kSideM);
  const auto second = test_support::marker_pattern({}, 1, kSideM);
  return [=](double x_m, double y_m) {
    return x_m < 0.5 * (kSideM + kDistanceM) ? first(x_m, y_m) : second(x_m - kDistanceM, y_m);
  };
}

/// Pictures of the card, and the true poses in a world of another unit and direction.
struct Photographed {
  std::vector<std::vector<std::uint8_t>> files;
  Scene metric;  ///< x and y along the card, z away from the viewer
  Scene mapped;
};

const Photographed& photographed() {
  static const Photographed kMade = [] {
    Photographed made;
    const Eigen::Vector2d size_m(kDistanceM + kSideM, kSideM);
    made.metric.cameras = {small_camera()};
    const test_support::PlaneRenderer renderer(small_camera());
    for (int i = 0; i < kViews; ++i) {
      const Rigid3 pose = test_support::board_pose(
          size_m, 0.5 + 0.02 * i, {0.02, 0.0}, {i % 2 == 0 ? 25.0 : -20.0, 8.0 * i - 28.0, 0.0});
      View view;
      view.name = std::to_string(i) + ".png";
      view.cam_from_world = pose;
      made.metric.views.push_back(view);
      made.files.push_back(*encode_png(
          renderer.render(card_pattern(), pose, /*noise=*/1.0, static_cast<std::uint64_t>(i + 1))));
    }
    const Sim3 mapped_from_metric{
        1.0 / kMetresPerUnit,
        Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1.0, 2.0, 3.0).normalized())),
        {0.3, -0.2, 0.1}};
    made.mapped = transform_scene(mapped_from_metric, made.metric);
    return made;
  }();
  return kMade;
}

PhotoSet photo_set() {
  PhotoSet photos;
  for (const View& view : photographed().metric.views) {
    photos.names.push_back(view.name);
  }
  photos.read = [](std::size_t i) -> Result<std::vector<std::uint8_t>> {
    return photographed().files[i];
  };
  return photos;
}

Result<ScaledModels> scaled(const PhotoSet& photos,
                            std::vector<Scene> components,
                            const ScaleOptions& options,
                            int threads = 2) {
  const test_support::TemporaryFolder temporary;
  const auto checkpoints = CheckpointFolder::open(temporary.path());
  Silence listener;
  const std::stop_token stop;
  WorkerPool pool(threads, stop);
  return find_metric_scale(
      photos, std::move(components), options, {pool, *checkpoints, listener, stop});
}

Result<ScaledModels> scaled(const ScaleOptions& options, int threads = 2) {
  return scaled(photo_set(), {photographed().mapped}, options, threads);
}

Eigen::Vector3d center_of(const Scene& scene, std::size_t view) {
  return camera_center(*scene.views[view].cam_from_world);
}

TEST(ScaleStage, BringsAModelIntoMetres) {
  const auto models = scaled({.known = {.marker_side_m = kSideM}});
  ASSERT_TRUE(models) << models.error().message;
  ASSERT_THAT(models->scale, SizeIs(1));
  const ScaleSection& section = models->scale[0];
  ASSERT_EQ(section.outcome, ScaleOutcome::kOk) << section.problem;
  EXPECT_THAT(section.lengths, SizeIs(2));
  EXPECT_THAT(section.markers, SizeIs(2));
  EXPECT_LT(std::abs(section.metres_per_unit / kMetresPerUnit - 1.0), 3.0 * section.sd_ratio);
  EXPECT_LT(section.sd_ratio, 0.005);
  const double truth =
      (center_of(photographed().metric, 7) - center_of(photographed().metric, 0)).norm();
  const Scene& scene = models->components[0];
  EXPECT_NEAR((center_of(scene, 7) - center_of(scene, 0)).norm(), truth, 0.005 * truth);
  EXPECT_FALSE(section.z_is_up);
}

TEST(ScaleStage, PutsTheModelOnTheCard) {
  const auto models = scaled({.known = {.marker_side_m = kSideM}, .up = UpSource::kCard});
  ASSERT_TRUE(models) << models.error().message;
  EXPECT_TRUE(models->scale[0].z_is_up);
  EXPECT_LT(models->scale[0].up_sd_deg, 1.0);
  const Eigen::Vector3d middle(0.5 * (kSideM + kDistanceM), 0.5 * kSideM, 0.0);
  for (std::size_t i = 0; i < kViews; ++i) {
    // x stays, y and z of the card point the other way; the origin is between the markers.
    const Eigen::Vector3d on_card = center_of(photographed().metric, i) - middle;
    const Eigen::Vector3d truth(on_card.x(), -on_card.y(), -on_card.z());
    EXPECT_LT((center_of(models->components[0], i) - truth).norm(), 0.01);
  }
}

TEST(ScaleStage, DoesNotDependOnTheNumberOfThreads) {
  const ScaleOptions options{.known = {.marker_side_m = kSideM}, .up = UpSource::kCard};
  const auto one = scaled(options, 1);
  const auto three = scaled(options, 3);
  ASSERT_TRUE(one && three);
  EXPECT_EQ(one->scale[0].metres_per_unit, three->scale[0].metres_per_unit);
  EXPECT_EQ(one->scale[0].sd_ratio, three->scale[0].sd_ratio);
  EXPECT_EQ(center_of(one->components[0], 3), center_of(three->components[0], 3));
}

TEST(ScaleStage, LooksAtNoPictureWhenNothingIsKnown) {
  PhotoSet photos = photo_set();
  photos.read = [](std::size_t) -> Result<std::vector<std::uint8_t>> {
    ADD_FAILURE() << "a picture was read";
    return fail(ErrorCode::kIo, "read");
  };
  const auto models = scaled(photos, {photographed().mapped}, {});
  ASSERT_TRUE(models);
  EXPECT_TRUE(models->scale.empty());
  EXPECT_EQ(center_of(models->components[0], 3), center_of(photographed().mapped, 3));
}

TEST(ScaleStage, TellsAMarkerWithAWrongSideAndLeavesTheModelAsItIs) {
  const auto models =
      scaled({.known = {.marker_side_m = kSideM, .distance_m = {{{0, 1}, 1.1 * kDistanceM}}}});
  ASSERT_TRUE(models);
  const ScaleSection& section = models->scale[0];
  EXPECT_EQ(section.outcome, ScaleOutcome::kDisagreement);
  EXPECT_THAT(section.problem, HasSubstr("the known lengths disagree by up to 1"));
  EXPECT_THAT(section.problem, HasSubstr("by markers 0 and 1 (0.176 m) one unit is 0.40"));
  EXPECT_THAT(section.problem, HasSubstr("by marker 0 (0.1 m), marker 1 (0.1 m) one unit is 0.3"));
  EXPECT_EQ(center_of(models->components[0], 3), center_of(photographed().mapped, 3));
}

TEST(ScaleStage, SaysWhyNothingIsMeasured) {
  const auto none = scaled({.known = {.side_of_marker_m = {{7, kSideM}}}});
  ASSERT_TRUE(none);
  EXPECT_EQ(none->scale[0].outcome, ScaleOutcome::kNothingMeasured);
  EXPECT_THAT(none->scale[0].problem, HasSubstr("no registered image shows a marker"));

  Scene few = photographed().mapped;
  for (std::size_t i = 2; i < few.views.size(); ++i) {
    few.views[i].cam_from_world.reset();
  }
  const auto two = scaled(photo_set(), {few}, {.known = {.marker_side_m = kSideM}});
  ASSERT_TRUE(two);
  EXPECT_THAT(two->scale[0].problem,
              HasSubstr("marker 0 is seen in too few registered images: 2 of 3 needed; marker 1"));
}

TEST(ScaleStage, ScalesEachModelByWhatItSees) {
  Scene blind = photographed().mapped;
  for (View& view : blind.views) {
    view.name = "elsewhere/" + view.name;
  }
  const auto models =
      scaled(photo_set(), {photographed().mapped, blind}, {.known = {.marker_side_m = kSideM}});
  ASSERT_TRUE(models);
  ASSERT_THAT(models->scale, SizeIs(2));
  EXPECT_EQ(models->scale[0].outcome, ScaleOutcome::kOk);
  EXPECT_EQ(models->scale[1].outcome, ScaleOutcome::kNothingMeasured);
}

TEST(ScaleStage, PassesOverMaskedMarkers) {
  PhotoSet photos = photo_set();
  cv::Mat right_half(360, 480, CV_8UC1, cv::Scalar(0));
  right_half.colRange(240, 480).setTo(255);
  const std::vector<std::uint8_t> mask = *encode_png(right_half);
  photos.read_mask = [&](std::size_t) {
    return Result<std::optional<std::vector<std::uint8_t>>>(mask);
  };
  const auto models = scaled(photos, {photographed().mapped}, {.known = {.marker_side_m = kSideM}});
  ASSERT_TRUE(models);
  for (const MarkerSection& marker : models->scale[0].markers) {
    EXPECT_EQ(marker.id, 0);
  }
}

TEST(ScaleStage, NamesThePictureThatCannotBeRead) {
  PhotoSet photos = photo_set();
  photos.read = [](std::size_t i) -> Result<std::vector<std::uint8_t>> {
    return i == 5 ? Result<std::vector<std::uint8_t>>(fail(ErrorCode::kIo, "gone"))
                  : photographed().files[i];
  };
  const auto models = scaled(photos, {photographed().mapped}, {.known = {.marker_side_m = kSideM}});
  ASSERT_FALSE(models);
  EXPECT_EQ(models.error().code, ErrorCode::kIo);
  EXPECT_EQ(models.error().message, "cannot look for markers in 5.png: gone");
}

TEST(ScaleOptions, NeedALengthForUp) {
  EXPECT_TRUE(ScaleOptions{}.validate());
  EXPECT_FALSE((ScaleOptions{.up = UpSource::kCard}.validate()));
  const ScaleOptions outside{.dictionary = {.bits = 4, .count = 50},
                             .known = {.side_of_marker_m = {{50, 0.1}}}};
  EXPECT_THAT(outside.validate().error().message, HasSubstr("marker 50"));
}

}  // namespace
}  // namespace trigmesh
