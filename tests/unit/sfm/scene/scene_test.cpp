#include "sfm/scene/scene.hpp"

#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using ::testing::HasSubstr;

Camera plain_camera() {
  Camera camera;
  camera.width_px = 640;
  camera.height_px = 480;
  camera.fx_px = camera.fy_px = 500.0;
  camera.cx_px = 319.5;
  camera.cy_px = 239.5;
  return camera;
}

/// Two posed views that share one landmark, and a third without a pose.
Scene small_scene() {
  Scene scene;
  scene.cameras.push_back(plain_camera());
  for (int i = 0; i < 3; ++i) {
    View view;
    view.name = "view" + std::to_string(i) + ".jpg";
    view.keypoints_px = {{10.0F, 20.0F}, {30.0F, 40.0F}};
    view.landmarks = {kNoLandmark, kNoLandmark};
    if (i < 2) {
      view.cam_from_world = Rigid3{};
      view.landmarks[1] = LandmarkId{0};
    }
    scene.views.push_back(view);
  }
  Landmark landmark;
  landmark.position_in_world = {0.0, 0.0, 5.0};
  landmark.track = {{ViewId{0}, FeatureIndex{1}}, {ViewId{1}, FeatureIndex{1}}};
  scene.landmarks.push_back(landmark);
  return scene;
}

TEST(Scene, AcceptsAConsistentScene) {
  const Result<> valid = small_scene().validate();
  EXPECT_TRUE(valid.has_value()) << valid.error().message;
}

TEST(Scene, AcceptsAnEmptyScene) {
  EXPECT_TRUE(Scene{}.validate().has_value());
}

TEST(Scene, CountsOnlyViewsWithAPose) {
  EXPECT_EQ(small_scene().registered_count(), 2U);
  EXPECT_EQ(Scene{}.registered_count(), 0U);
}

struct Damage {
  const char* name;
  std::function<void(Scene&)> apply;
  const char* expected_text;
};

class DamagedScene : public ::testing::TestWithParam<Damage> {};

TEST_P(DamagedScene, IsReportedAsCorruptWithItsCause) {
  Scene scene = small_scene();
  GetParam().apply(scene);
  const Result<> valid = scene.validate();
  ASSERT_FALSE(valid.has_value());
  EXPECT_EQ(valid.error().code, ErrorCode::kCorruptData);
  EXPECT_THAT(valid.error().message, HasSubstr(GetParam().expected_text));
}

const double kNan = std::numeric_limits<double>::quiet_NaN();

INSTANTIATE_TEST_SUITE_P(
    All,
    DamagedScene,
    ::testing::Values(
        Damage{"BadCamera", [](Scene& s) { s.cameras[0].fx_px = -1.0; }, "camera 0"},
        Damage{"CameraOutOfRange", [](Scene& s) { s.views[1].camera = CameraId{1}; }, "camera 1"},
        Damage{"LengthsDiffer", [](Scene& s) { s.views[2].landmarks.pop_back(); }, "2 keypoints"},
        Damage{"PoseNotFinite",
               [](Scene& s) { s.views[0].cam_from_world->translation.x() = kNan; },
               "no rigid motion"},
        Damage{"RotationNotUnit",
               [](Scene& s) { s.views[0].cam_from_world->rotation.w() = 2.0; },
               "no rigid motion"},
        Damage{"KeypointNotFinite",
               [](Scene& s) { s.views[2].keypoints_px[0].y() = std::nanf(""); },
               "keypoint 0"},
        Damage{"PointNotFinite",
               [](Scene& s) { s.landmarks[0].position_in_world.z() = kNan; },
               "not finite"},
        Damage{"TrackTooShort", [](Scene& s) { s.landmarks[0].track.pop_back(); }, "at least 2"},
        Damage{"TrackUnsorted",
               [](Scene& s) { std::swap(s.landmarks[0].track[0], s.landmarks[0].track[1]); },
               "not sorted"},
        Damage{"ViewTwiceInTrack",
               [](Scene& s) {
                 s.landmarks[0].track[1] = {ViewId{0}, FeatureIndex{1}};
               },
               "view twice"},
        Damage{"TrackNamesMissingView",
               [](Scene& s) { s.landmarks[0].track[1].view = ViewId{9}; },
               "view 9"},
        Damage{"TrackNamesMissingKeypoint",
               [](Scene& s) { s.landmarks[0].track[1].feature = FeatureIndex{7}; },
               "keypoint 7"},
        Damage{"ViewDoesNotKnowTheLandmark",
               [](Scene& s) { s.views[1].landmarks[1] = kNoLandmark; },
               "does not know"},
        Damage{"KeypointClaimsMoreThanTheTracksHold",
               [](Scene& s) { s.views[1].landmarks[0] = LandmarkId{0}; },
               "3 keypoints"},
        Damage{"SeenByAViewWithoutPose",
               [](Scene& s) { s.views[1].cam_from_world.reset(); },
               "no pose"}),
    [](const ::testing::TestParamInfo<Damage>& param) { return std::string(param.param.name); });

}  // namespace
}  // namespace trigmesh
