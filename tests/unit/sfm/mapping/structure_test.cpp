#include "sfm/mapping/structure.hpp"

#include <cmath>
#include <numbers>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/sfm/mapping/mapping_test_scenes.hpp"

namespace trigmesh {
namespace {

using test_support::CloudKind;
using test_support::SyntheticScene;
using test_support::SyntheticSceneOptions;

constexpr double kDeg = std::numbers::pi / 180.0;

/// A scene, its tracks and a map whose poses are true.
struct Stage {
  explicit Stage(const SyntheticSceneOptions& scene_options,
                 const MapperOptions& mapper_options = {})
      : scene(test_support::make_synthetic_scene(scene_options)),
        tracks(mapping_test::make_store(scene).tracks),
        map(mapping_test::make_map(tracks, scene.truth)),
        options(mapper_options),
        structure(tracks, options, executor) {
    mapping_test::register_truth(map, scene.truth, 0, scene.truth.views.size());
  }

  /// Largest distance of a landmark from the truth; landmarks are found by their first keypoint.
  [[nodiscard]] double largest_error() const {
    double largest = 0.0;
    for (const LandmarkId id : map.landmarks()) {
      const Observation& seen = map.landmark(id).track.front();
      const LandmarkId in_truth =
          scene.truth.views[index(seen.view)].landmarks[index(seen.feature)];
      largest = std::max(largest,
                         (map.landmark(id).position_in_world -
                          scene.truth.landmarks[index(in_truth)].position_in_world)
                             .norm());
    }
    return largest;
  }

  SyntheticScene scene;
  TrackTable tracks;
  Map map;
  MapperOptions options;
  SerialExecutor executor;
  Structure structure;
};

TEST(Structure, TriangulatesExactlyWithTruePoses) {
  Stage stage({.cloud = CloudKind::kVolume, .points = 300, .views = 6});
  const std::size_t added = stage.structure.triangulate_all(stage.map);
  EXPECT_EQ(added, stage.scene.truth.landmarks.size());
  EXPECT_EQ(stage.map.landmark_count(), added);
  EXPECT_LT(stage.largest_error(), 1e-5);  // keypoints are float
  EXPECT_TRUE(stage.map.compact().validate().has_value());
  EXPECT_EQ(stage.structure.triangulate_all(stage.map), 0U);
}

TEST(Structure, TakesOnlyTheTracksItIsGiven) {
  Stage stage({.cloud = CloudKind::kVolume, .points = 50, .views = 4});
  const std::vector<TrackId> some = {
      mapping_test::track_of(stage.tracks, stage.scene.truth.landmarks[3]),
      mapping_test::track_of(stage.tracks, stage.scene.truth.landmarks[7]),
      mapping_test::track_of(stage.tracks, stage.scene.truth.landmarks[3])};
  EXPECT_EQ(stage.structure.triangulate(stage.map, some), 2U);
  EXPECT_EQ(stage.map.landmark_count(), 2U);
}

TEST(Structure, RefusesPointsSeenUnderTooSmallAnAngle) {
  MapperOptions options;
  options.min_triangulation_angle_deg = 30.0;
  Stage stage({.cloud = CloudKind::kVolume, .points = 50, .views = 3, .arc_deg = 6.0}, options);
  EXPECT_EQ(stage.structure.triangulate_all(stage.map), 0U);
}

TEST(Structure, ViewsWithoutPoseDoNotCount) {
  Stage stage({.cloud = CloudKind::kVolume, .points = 50, .views = 3});
  stage.map.unregister_view(ViewId{0});
  stage.map.unregister_view(ViewId{2});
  EXPECT_EQ(stage.structure.triangulate_all(stage.map), 0U);
}

TEST(Structure, LeavesWrongKeypointsOutOfALandmark) {
  Stage stage({.cloud = CloudKind::kVolume, .points = 200, .views = 8, .outlier_ratio = 0.1});
  EXPECT_GT(stage.structure.triangulate_all(stage.map), 150U);
  for (const LandmarkId id : stage.map.landmarks()) {
    for (const Observation& observation : stage.map.landmark(id).track) {
      EXPECT_LE(reprojection_error_px(stage.map, id, observation),
                stage.options.max_reprojection_px);
    }
  }
}

TEST(Structure, FilterRemovesObservationsThatAreFarOffAndNothingElse) {
  Stage stage({.cloud = CloudKind::kVolume, .points = 100, .views = 6});
  (void)stage.structure.triangulate_all(stage.map);
  Scene& scene = stage.map.scene_for_adjustment();
  const LandmarkId spoilt{5};
  const Observation wrong = scene.landmarks[index(spoilt)].track[2];
  scene.views[index(wrong.view)].keypoints_px[index(wrong.feature)].x() += 9.0F;
  const Structure::FilterReport report = stage.structure.filter(stage.map, 4.0);
  EXPECT_EQ(report.removed_observations, 1U);
  EXPECT_EQ(report.removed_landmarks, 0U);
  EXPECT_EQ(stage.map.scene().views[index(wrong.view)].landmarks[index(wrong.feature)],
            kNoLandmark);
  EXPECT_TRUE(stage.map.compact().validate().has_value());
}

TEST(Structure, FilterRemovesPointsBehindTheCameras) {
  Stage stage({.cloud = CloudKind::kVolume, .points = 100, .views = 4});
  const std::size_t all = stage.structure.triangulate_all(stage.map);
  stage.map.set_position(LandmarkId{3}, {0.0, 0.0, -100.0});
  const Structure::FilterReport report = stage.structure.filter(stage.map, 4.0);
  EXPECT_EQ(report.removed_landmarks, 1U);
  EXPECT_FALSE(stage.map.exists(LandmarkId{3}));
  EXPECT_EQ(stage.map.landmark_count(), all - 1);
}

TEST(Structure, FilterRemovesLandmarksWhoseRaysAreNearlyParallel) {
  Stage stage({.cloud = CloudKind::kVolume, .points = 100, .views = 3, .arc_deg = 6.0});
  ASSERT_GT(stage.structure.triangulate_all(stage.map), 0U);
  stage.options.min_triangulation_angle_deg = 30.0;
  (void)stage.structure.filter(stage.map, 4.0);
  EXPECT_EQ(stage.map.landmark_count(), 0U);
}

TEST(Structure, CompleteAddsTheKeypointsOfViewsThatCameLater) {
  Stage stage({.cloud = CloudKind::kVolume, .points = 100, .views = 6});
  for (unsigned i = 3; i < 6; ++i) {
    stage.map.unregister_view(ViewId{i});
  }
  (void)stage.structure.triangulate_all(stage.map);
  mapping_test::register_truth(stage.map, stage.scene.truth, 3, 6);
  EXPECT_GT(stage.structure.complete(stage.map), 250U);
  for (const LandmarkId id : stage.map.landmarks()) {
    EXPECT_EQ(stage.map.landmark(id).track.size(),
              stage.tracks.observations(stage.map.track_of(id)).size());
  }
  EXPECT_TRUE(stage.map.compact().validate().has_value());
  EXPECT_EQ(stage.structure.complete(stage.map), 0U);
}

TEST(Structure, RepositionBringsLandmarksBackToWhereTheRaysMeet) {
  Stage stage({.cloud = CloudKind::kVolume, .points = 100, .views = 6});
  (void)stage.structure.triangulate_all(stage.map);
  for (const LandmarkId id : stage.map.landmarks()) {
    const Eigen::Vector3d position = stage.map.landmark(id).position_in_world;
    stage.map.set_position(id, position + Eigen::Vector3d(0.2, -0.1, 0.3));
  }
  stage.structure.reposition(stage.map);
  EXPECT_LT(stage.largest_error(), 1e-5);
}

TEST(Structure, AnglesAndErrorsAreThoseOfTheGeometry) {
  Stage stage({.cloud = CloudKind::kVolume,
               .points = 20,
               .path = test_support::PathKind::kLine,
               .views = 3});
  (void)stage.structure.triangulate_all(stage.map);
  // Cameras at (-1.5, 0, -5) and (1.5, 0, -5).
  const LandmarkId id{0};
  stage.map.set_position(id, Eigen::Vector3d::Zero());
  ASSERT_EQ(stage.map.landmark(id).track.size(), 3U);
  EXPECT_NEAR(largest_triangulation_angle(stage.map, id), 2.0 * std::atan(0.3), 1e-9);
  const Observation& middle = stage.map.landmark(id).track[1];
  const Camera& camera = stage.scene.truth.cameras[0];
  const Eigen::Vector2d expected(camera.cx_px, camera.cy_px);
  EXPECT_NEAR(reprojection_error_px(stage.map, id, middle),
              (stage.map.pixel(middle) - expected).norm(),
              1e-9);
  stage.map.set_position(id, {0.0, 0.0, -6.0});
  EXPECT_TRUE(std::isinf(reprojection_error_px(stage.map, id, middle)));
  EXPECT_GT(largest_triangulation_angle(stage.map, id), 90.0 * kDeg);
}

}  // namespace
}  // namespace trigmesh
