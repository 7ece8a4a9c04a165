// What the exported files say; that independent readers agree is checked in tests/integration.

#include <cstring>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "sfm/exchange/bundler.hpp"
#include "sfm/exchange/nerfstudio.hpp"
#include "sfm/exchange/openmvs.hpp"
#include "tests/unit/sfm/exchange/example_scene.hpp"

namespace trigmesh {
namespace {

using nlohmann::json;
using test_support::example_scene;
using ::testing::HasSubstr;
using ::testing::StartsWith;

Scene single_camera_scene(CameraModel model) {
  Scene scene = example_scene(model, 3, 30);
  scene.cameras.resize(1);
  for (View& view : scene.views) {
    view.camera = CameraId{0};
  }
  return scene;
}

TEST(Nerfstudio, WritesIntrinsicsOnceForOneCamera) {
  const Scene scene = single_camera_scene(CameraModel::kBrownConrady);
  const json file = json::parse(*write_nerfstudio(scene, "images", "sparse.ply"));
  EXPECT_EQ(file["camera_model"], "OPENCV");
  EXPECT_EQ(file["cx"].get<double>(), scene.cameras[0].cx_px + 0.5);
  EXPECT_EQ(file["p2"].get<double>(), scene.cameras[0].distortion[3]);
  EXPECT_EQ(file["ply_file_path"], "sparse.ply");
  EXPECT_EQ(file["frames"].size(), 3U);
  EXPECT_FALSE(file["frames"][0].contains("fl_x"));
  EXPECT_EQ(file["frames"][0]["file_path"], "images/" + scene.views[0].name);
}

TEST(Nerfstudio, WritesIntrinsicsPerFrameForSeveralCameras) {
  const Scene scene = example_scene(CameraModel::kKannalaBrandt, 3, 30);
  const json file = json::parse(*write_nerfstudio(scene, "", "sparse.ply"));
  EXPECT_FALSE(file.contains("camera_model"));
  EXPECT_EQ(file["frames"][1]["camera_model"], "OPENCV_FISHEYE");
  EXPECT_EQ(file["frames"][1]["fl_x"].get<double>(), scene.cameras[1].fx_px);
  EXPECT_EQ(file["frames"][1]["k4"].get<double>(), scene.cameras[1].distortion[3]);
}

TEST(Nerfstudio, TurnsTheCameraFrameToOpenGlAxes) {
  Scene scene = single_camera_scene(CameraModel::kPinhole);
  scene.views[0].cam_from_world = Rigid3{Eigen::Quaterniond::Identity(), {-1.0, -2.0, -3.0}};
  const json matrix =
      json::parse(*write_nerfstudio(scene, "", "p"))["frames"][0]["transform_matrix"];
  EXPECT_EQ(matrix, json({{1, 0, 0, 1}, {0, -1, 0, 2}, {0, 0, -1, 3}, {0, 0, 0, 1}}));
}

TEST(Nerfstudio, RefusesNamesThatAreNoUtf8) {
  Scene scene = single_camera_scene(CameraModel::kPinhole);
  scene.views[0].name = "\xff.jpg";
  EXPECT_EQ(write_nerfstudio(scene, "", "p").error().code, ErrorCode::kUnsupported);
}

TEST(OpenMvs, WritesAVersionSevenArchive) {
  const Scene scene = single_camera_scene(CameraModel::kPinhole);
  const auto bytes = write_openmvs(scene, "images");
  ASSERT_TRUE(bytes.has_value());
  EXPECT_THAT(*bytes, StartsWith(std::string("MVSI\x07\0\0\0\0\0\0\0\x01\0\0\0\0\0\0\0", 20)));
  EXPECT_THAT(*bytes, HasSubstr("images/" + scene.views[2].name));
}

TEST(OpenMvs, RefusesDistortedImagesAndSaysWhatToDo) {
  const auto bytes = write_openmvs(example_scene(CameraModel::kRadial), "images");
  ASSERT_FALSE(bytes.has_value());
  EXPECT_EQ(bytes.error().code, ErrorCode::kUnsupported);
  EXPECT_THAT(bytes.error().message, HasSubstr("image_undistorter"));
}

TEST(OpenMvs, AcceptsALensModelWithoutDistortion) {
  Scene scene = single_camera_scene(CameraModel::kBrownConrady);
  scene.cameras[0].distortion = {};
  EXPECT_TRUE(write_openmvs(scene, "images").has_value());
}

TEST(Bundler, TurnsTheCameraFrameAndMeasuresFromThePrincipalPoint) {
  Scene scene = single_camera_scene(CameraModel::kRadial);
  scene.views[0].cam_from_world = Rigid3{Eigen::Quaterniond::Identity(), {1.0, 2.0, 3.0}};
  const auto text = write_bundler(scene, "images");
  ASSERT_TRUE(text.has_value());
  EXPECT_THAT(text->bundle,
              StartsWith("# Bundle file v0.3\n3 " + std::to_string(scene.landmarks.size()) +
                         "\n700 -0.11 0.023\n1 0 0\n-0 -1 -0\n-0 -0 -1\n1 -2 -3\n"));
  EXPECT_THAT(text->list, StartsWith("images/" + scene.views[0].name + "\n"));
}

TEST(Bundler, NumbersOnlyViewsWithPose) {
  Scene scene = single_camera_scene(CameraModel::kPinhole);
  scene.landmarks.clear();
  scene.views[1].cam_from_world.reset();
  const auto text = write_bundler(scene, "");
  ASSERT_TRUE(text.has_value());
  EXPECT_EQ(text->list, scene.views[0].name + "\n" + scene.views[2].name + "\n");
}

TEST(Bundler, RefusesLensesThatItCannotDescribe) {
  EXPECT_EQ(write_bundler(example_scene(CameraModel::kKannalaBrandt), "").error().code,
            ErrorCode::kUnsupported);
  EXPECT_EQ(write_bundler(example_scene(CameraModel::kBrownConrady), "").error().code,
            ErrorCode::kUnsupported);
  Scene scene = single_camera_scene(CameraModel::kPinhole);
  scene.cameras[0].fy_px *= 1.0001;
  EXPECT_TRUE(write_bundler(scene, "").has_value());
  scene.cameras[0].fy_px *= 1.01;
  EXPECT_THAT(write_bundler(scene, "").error().message, HasSubstr("two focal lengths"));
}

}  // namespace
}  // namespace trigmesh
