#include "sfm/exchange/colmap_text.hpp"

#include <cmath>
#include <cstdint>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/random.hpp"
#include "tests/unit/sfm/exchange/example_scene.hpp"

namespace trigmesh {
namespace {

using test_support::example_scene;
using test_support::expect_same_scene;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Two images that see one point with their only keypoint, and what COLMAP leaves out.
ColmapText tiny_text() {
  return {"# comment\n7 SIMPLE_PINHOLE 640 480 500 320 240\n",
          "# comment\n"
          "3 1 0 0 0 0 0 0 7 first image.jpg\n10.5 20.5 42 1 2 -1\n"
          "9 1 0 0 0 -1 0 0 7 second.jpg\r\n\r\n"
          "4 2 0 0 0 1 0 0 7 b.jpg\n30.5 40.5 42\n",
          "42 1 2 3 10 20 30 0.5 4 0 3 0\n"};
}

class ColmapTextModel : public ::testing::TestWithParam<CameraModel> {};

TEST_P(ColmapTextModel, ReadsBackExactlyWhatWasWritten) {
  const Scene scene = example_scene(GetParam());
  const auto text = write_colmap_text(scene);
  ASSERT_TRUE(text.has_value());
  const auto read = read_colmap_text(*text);
  ASSERT_TRUE(read.has_value()) << read.error().message;
  expect_same_scene(*read, scene);
}

TEST_P(ColmapTextModel, WritesTheSameBytesAgainAfterReading) {
  const auto text = write_colmap_text(example_scene(GetParam()));
  ASSERT_TRUE(text.has_value());
  const auto again = write_colmap_text(*read_colmap_text(*text));
  ASSERT_TRUE(again.has_value());
  EXPECT_EQ(again->cameras, text->cameras);
  EXPECT_EQ(again->images, text->images);
  EXPECT_EQ(again->points, text->points);
}

INSTANTIATE_TEST_SUITE_P(AllModels,
                         ColmapTextModel,
                         ::testing::Values(CameraModel::kPinhole,
                                           CameraModel::kRadial,
                                           CameraModel::kBrownConrady,
                                           CameraModel::kKannalaBrandt),
                         [](const ::testing::TestParamInfo<CameraModel>& param) {
                           return std::string(to_string(param.param));
                         });

TEST(ColmapText, PutsTheFirstPixelCentreAtOneHalf) {
  Scene scene = example_scene(CameraModel::kPinhole, 2, 20);
  scene.cameras.resize(1);
  scene.cameras[0] = {CameraModel::kPinhole, 640, 480, 500.25, 501, 319.5, 239.5, {}};
  scene.views[0].camera = scene.views[1].camera = CameraId{0};
  scene.views[0].keypoints_px[0] = {0.0F, 100.25F};
  const auto text = write_colmap_text(scene);
  ASSERT_TRUE(text.has_value());
  EXPECT_THAT(text->cameras, HasSubstr("\n1 PINHOLE 640 480 500.25 501 320 240\n"));
  EXPECT_THAT(text->images, HasSubstr("\n0.5 100.75 "));
}

TEST(ColmapText, NeedsOpencvWhenARadialLensHasTwoFocalLengths) {
  Camera camera{CameraModel::kRadial, 640, 480, 500, 500, 319.5, 239.5, {0.1, 0.01, 0, 0}};
  EXPECT_EQ(colmap_from_camera(camera).model->name, "RADIAL");
  camera.fy_px = 501;
  const ColmapParameters parameters = colmap_from_camera(camera);
  EXPECT_EQ(parameters.model->name, "OPENCV");
  EXPECT_THAT(parameters.values, ElementsAre(500, 501, 320, 240, 0.1, 0.01, 0, 0));
}

TEST(ColmapText, KeepsEveryFloatKeypoint) {
  test_support::Random random(3);
  Scene scene = example_scene(CameraModel::kPinhole, 2, 20);
  View& view = scene.views[0];
  for (int i = 0; i < 20000; ++i) {
    const double scale = std::pow(10.0, random.uniform(-4.0, 5.0));
    view.keypoints_px.emplace_back(static_cast<float>(random.uniform(-1.0, 1.0) * scale),
                                   static_cast<float>(random.uniform() * 8000.0));
    view.landmarks.push_back(kNoLandmark);
  }
  const auto read = read_colmap_text(*write_colmap_text(scene));
  ASSERT_TRUE(read.has_value()) << read.error().message;
  EXPECT_EQ(read->views[0].keypoints_px, view.keypoints_px);
}

TEST(ColmapText, LeavesOutViewsWithoutPoseButKeepsTheNumbers) {
  Scene scene = example_scene(CameraModel::kPinhole, 3, 30);
  scene.landmarks.clear();
  for (View& view : scene.views) {
    view.landmarks.assign(view.keypoints_px.size(), kNoLandmark);
  }
  scene.views[1].cam_from_world.reset();
  const auto poses = read_colmap_poses(write_colmap_text(scene)->images);
  ASSERT_TRUE(poses.has_value());
  ASSERT_EQ(poses->size(), 2U);
  EXPECT_EQ((*poses)[1].name, scene.views[2].name);
  EXPECT_THAT(write_colmap_text(scene)->images, HasSubstr("\n3 "));
}

TEST(ColmapText, WritesAViewWithoutKeypointsAsAnEmptyLine) {
  Scene scene = example_scene(CameraModel::kPinhole, 2, 20);
  scene.landmarks.clear();
  for (View& view : scene.views) {
    view.keypoints_px.clear();
    view.landmarks.clear();
  }
  const auto text = write_colmap_text(scene);
  ASSERT_TRUE(text.has_value());
  EXPECT_TRUE(text->images.ends_with(scene.views[1].name + "\n\n"));
  EXPECT_TRUE(read_colmap_text(*text).has_value());
}

TEST(ColmapText, KeepsBlanksInNames) {
  Scene scene = example_scene(CameraModel::kPinhole, 2, 20);
  scene.views[0].name = " a  folder/with blanks .jpg";
  const auto read = read_colmap_text(*write_colmap_text(scene));
  ASSERT_TRUE(read.has_value()) << read.error().message;
  EXPECT_EQ(read->views[0].name, scene.views[0].name);
}

TEST(ColmapText, RefusesToWriteNamesWithLineBreaks) {
  Scene scene = example_scene(CameraModel::kPinhole, 2, 20);
  for (const std::string name : {"", "a\nb.jpg", "a\r.jpg"}) {
    scene.views[0].name = name;
    const auto text = write_colmap_text(scene);
    ASSERT_FALSE(text.has_value());
    EXPECT_EQ(text.error().code, ErrorCode::kUnsupported);
  }
}

TEST(ColmapText, ReadsForeignIdentifiersOrderAndLineEnds) {
  const auto scene = read_colmap_text(tiny_text());
  ASSERT_TRUE(scene.has_value()) << scene.error().message;
  ASSERT_EQ(scene->views.size(), 3U);
  EXPECT_EQ(scene->views[0].name, "first image.jpg");
  EXPECT_EQ(scene->views[1].name, "b.jpg");
  EXPECT_EQ(scene->views[2].name, "second.jpg");
  EXPECT_EQ(scene->views[0].keypoints_px[0], Eigen::Vector2f(10.0F, 20.0F));
  EXPECT_DOUBLE_EQ(scene->views[1].cam_from_world->rotation.w(), 1.0);
  ASSERT_EQ(scene->landmarks.size(), 1U);
  EXPECT_THAT(scene->landmarks[0].track,
              ElementsAre(Observation{ViewId{0}, FeatureIndex{0}},
                          Observation{ViewId{1}, FeatureIndex{0}}));
  EXPECT_EQ(scene->cameras[0].cx_px, 319.5);
}

TEST(ColmapText, KeepsTheFirstOfTwoKeypointsOfOneImageInATrack) {
  ColmapText text = tiny_text();
  text.images.replace(text.images.find("1 2 -1"), 6, "1 2 42");
  text.points = "42 1 2 3 10 20 30 0.5 3 1 4 0 3 0\n";
  const auto scene = read_colmap_text(text);
  ASSERT_TRUE(scene.has_value()) << scene.error().message;
  EXPECT_THAT(scene->views[0].landmarks, ElementsAre(LandmarkId{0}, kNoLandmark));
}

TEST(ColmapText, DropsAPointThatOnlyOneImageSees) {
  ColmapText text = tiny_text();
  text.images.replace(text.images.find("30.5 40.5 42"), 12, "30.5 40.5 -1");
  text.points = "42 1 2 3 10 20 30 0.5 3 0\n";
  const auto scene = read_colmap_text(text);
  ASSERT_TRUE(scene.has_value()) << scene.error().message;
  EXPECT_TRUE(scene->landmarks.empty());
  EXPECT_THAT(scene->views[0].landmarks, ElementsAre(kNoLandmark, kNoLandmark));
}

TEST(ColmapText, ReadsPosesWhoseLastLineOfKeypointsIsMissing) {
  const auto poses = read_colmap_poses("1 1 0 0 0 1 2 3 1 a.jpg\n\n2 1 0 0 0 1 2 3 1 b.jpg");
  ASSERT_TRUE(poses.has_value());
  EXPECT_EQ(poses->size(), 2U);
}

struct Foreign {
  const char* line;
  CameraModel model;
  std::array<double, 8> intrinsics;
};

TEST(ColmapText, UnderstandsTheLensModelsOfColmap) {
  using M = CameraModel;
  for (const Foreign& foreign : {
           Foreign{"1 SIMPLE_PINHOLE 64 48 50 32 24", M::kPinhole, {50, 50, 31.5, 23.5}},
           Foreign{"1 PINHOLE 64 48 50 51 32 24", M::kPinhole, {50, 51, 31.5, 23.5}},
           Foreign{"1 SIMPLE_RADIAL 64 48 50 32 24 .1", M::kRadial, {50, 50, 31.5, 23.5, .1}},
           Foreign{"1 RADIAL 64 48 50 32 24 .1 .2", M::kRadial, {50, 50, 31.5, 23.5, .1, .2}},
           Foreign{"1 OPENCV 64 48 50 51 32 24 .1 .2 .3 .4",
                   M::kBrownConrady,
                   {50, 51, 31.5, 23.5, .1, .2, .3, .4}},
           Foreign{"1 OPENCV_FISHEYE 64 48 50 51 32 24 .1 .2 .3 .4",
                   M::kKannalaBrandt,
                   {50, 51, 31.5, 23.5, .1, .2, .3, .4}},
       }) {
    const auto cameras = read_colmap_cameras(foreign.line);
    ASSERT_TRUE(cameras.has_value()) << cameras.error().message;
    EXPECT_EQ((*cameras)[0].second.model, foreign.model);
    EXPECT_EQ((*cameras)[0].second.intrinsics(), IntrinsicsVector(foreign.intrinsics.data()));
  }
}

TEST(ColmapText, NamesALensModelThatItCannotRepresent) {
  const auto cameras = read_colmap_cameras("1 FOV 64 48 50 51 32 24 0.9\n");
  ASSERT_FALSE(cameras.has_value());
  EXPECT_EQ(cameras.error().code, ErrorCode::kUnsupported);
  EXPECT_THAT(cameras.error().message, HasSubstr("FOV"));
}

struct Hostile {
  const char* name;
  ColmapText text;
  const char* expected_text;
};

class HostileColmapText : public ::testing::TestWithParam<Hostile> {};

TEST_P(HostileColmapText, IsCorruptDataAndSaysWhere) {
  const auto scene = read_colmap_text(GetParam().text);
  ASSERT_FALSE(scene.has_value());
  EXPECT_EQ(scene.error().code, ErrorCode::kCorruptData) << scene.error().message;
  EXPECT_THAT(scene.error().message, HasSubstr(GetParam().expected_text));
}

ColmapText with_cameras(const char* cameras) {
  ColmapText text = tiny_text();
  text.cameras = cameras;
  return text;
}

ColmapText with_images(const char* images) {
  ColmapText text = tiny_text();
  text.images = images;
  return text;
}

ColmapText with_points(const char* points) {
  ColmapText text = tiny_text();
  text.points = points;
  return text;
}

INSTANTIATE_TEST_SUITE_P(
    All,
    HostileColmapText,
    ::testing::Values(
        Hostile{"NoNumber", with_cameras("7 PINHOLE 640 x 1 2 3 4\n"), "cameras.txt, line 1: 'x'"},
        Hostile{
            "TooFew", with_cameras("\n7 PINHOLE 640 480 1 2 3\n"), "line 2: a camera parameter"},
        Hostile{"TooMany", with_cameras("7 PINHOLE 640 480 1 2 3 4 5\n"), "here are more"},
        Hostile{"NegativeSize", with_cameras("7 PINHOLE -640 480 1 2 3 4\n"), "'-640'"},
        Hostile{"HugeSize", with_cameras("7 PINHOLE 99999999999 480 1 2 3 4\n"), "no image is"},
        Hostile{"NotFinite", with_cameras("7 PINHOLE 640 480 nan 2 3 4\n"), "'nan'"},
        Hostile{"NoFocal", with_cameras("7 PINHOLE 640 480 0 2 3 4\n"), "line 1"},
        Hostile{"SameCameraTwice",
                with_cameras("7 PINHOLE 9 9 1 2 3 4\n7 PINHOLE 9 9 1 2 3 4\n"),
                "camera 7 stands twice"},
        Hostile{"NoCamera", with_cameras(""), "camera 7, which is not"},
        Hostile{"ZeroQuaternion", with_images("3 0 0 0 0 0 0 0 7 a\n\n"), "images.txt, line 1"},
        Hostile{"HugeQuaternion", with_images("3 1e308 1e308 0 0 0 0 0 7 a\n\n"), "rigid motion"},
        Hostile{"NoName", with_images("3 1 0 0 0 0 0 0 7 \n\n"), "name is missing"},
        Hostile{"KeypointCut", with_images("3 1 0 0 0 0 0 0 7 a\n1 2\n"), "line 2: a point id"},
        Hostile{"KeypointHuge", with_images("3 1 0 0 0 0 0 0 7 a\n1e300 2 -1\n"), "out of range"},
        Hostile{"PointIdNegative", with_images("3 1 0 0 0 0 0 0 7 a\n1 2 -5\n"), "negative"},
        Hostile{"PointUnknown", with_images("3 1 0 0 0 0 0 0 7 a\n1 2 5\n"), "sees point 5"},
        Hostile{"ImageUnknown", with_points("42 1 2 3 1 2 3 0 4 0 8 0\n"), "seen by image 8"},
        Hostile{"KeypointUnknown", with_points("42 1 2 3 1 2 3 0 4 0 3 9\n"), "keypoint 9"},
        Hostile{"TrackContradicts", with_points("42 1 2 3 1 2 3 0 4 0 3 1\n"), "keypoint 1"},
        Hostile{"TrackTooShort", with_points("42 1 2 3 1 2 3 0 4 0\n"), "2 keypoints name"},
        Hostile{"ColourRange", with_points("42 1 2 3 1 256 3 0 4 0 3 0\n"), "'256'"},
        Hostile{"SamePointTwice",
                with_points("42 1 2 3 1 2 3 0 4 0 3 0\n42 1 2 3 1 2 3 0 4 0 3 0\n"),
                "point 42 stands twice"},
        Hostile{"TerminalCodes", with_points("\x1b[2J 1 2 3 1 2 3 0\n"), "'?[2J'"}),
    [](const ::testing::TestParamInfo<Hostile>& param) { return std::string(param.param.name); });

TEST(ColmapText, SurvivesEveryTruncation) {
  const auto whole = write_colmap_text(example_scene(CameraModel::kBrownConrady, 3, 15));
  ASSERT_TRUE(whole.has_value());
  for (std::size_t length = 0; length < whole->images.size(); length += 7) {
    ColmapText cut = *whole;
    cut.images.resize(length);
    (void)read_colmap_text(cut);  // any answer is right, a crash is not
  }
}

}  // namespace
}  // namespace trigmesh
