#include "firmware/pipeline/camera_groups.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

ImageFeatures picture(int width_px,
                      int height_px,
                      std::string camera_key = "",
                      double exif_focal_px = 0.0) {
  ImageFeatures image;
  image.width_px = width_px;
  image.height_px = height_px;
  image.camera_key = std::move(camera_key);
  image.exif_focal_px = exif_focal_px;
  return image;
}

Camera given_camera(int width_px, int height_px) {
  Camera camera;
  camera.width_px = width_px;
  camera.height_px = height_px;
  camera.fx_px = 800.0;
  camera.fy_px = 810.0;
  camera.cx_px = 399.5;
  camera.cy_px = 299.5;
  return camera;
}

TEST(GroupCameras, SeparatesBySizeAndCamera) {
  const ImageFeatures a = picture(800, 600, "one");
  const ImageFeatures b = picture(600, 800, "one");
  const ImageFeatures c = picture(800, 600, "two");
  const auto groups =
      group_cameras({{"a", &a}, {"b", &b}, {"c", &c}, {"d", &a}}, {}, GroupingMode::kAuto);
  ASSERT_TRUE(groups);
  EXPECT_THAT(groups->group_of_image,
              ElementsAre(CameraId{0}, CameraId{1}, CameraId{2}, CameraId{0}));
}

TEST(GroupCameras, FollowsFoldersOrImagesWhenAsked) {
  const ImageFeatures a = picture(800, 600);
  const std::vector<GroupingImage> images{{"left/1", &a}, {"left/2", &a}, {"right/1", &a}};
  const auto folders = group_cameras(images, {}, GroupingMode::kPerFolder);
  ASSERT_TRUE(folders);
  EXPECT_THAT(folders->group_of_image, ElementsAre(CameraId{0}, CameraId{0}, CameraId{1}));
  const auto each = group_cameras(images, {}, GroupingMode::kPerImage);
  ASSERT_TRUE(each);
  EXPECT_EQ(each->groups.size(), 3U);
}

TEST(GroupCameras, RefusesOneCameraForTwoSizes) {
  const ImageFeatures a = picture(800, 600);
  const ImageFeatures b = picture(640, 480);
  const auto groups = group_cameras({{"a", &a}, {"b", &b}}, {}, GroupingMode::kSingle);
  ASSERT_FALSE(groups);
  EXPECT_EQ(groups.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(groups.error().message, HasSubstr("640x480"));
}

TEST(GroupCameras, KnowsWhatIsKnown) {
  const ImageFeatures with_exif = picture(800, 600, "one", 900.0);
  const ImageFeatures without = picture(640, 480);
  const auto groups = group_cameras({{"a", &with_exif}, {"b", &without}}, {}, GroupingMode::kAuto);
  ASSERT_TRUE(groups);
  EXPECT_EQ(groups->groups[0].knowledge, IntrinsicsKnowledge::kPrior);
  EXPECT_EQ(groups->groups[0].camera.fx_px, 900.0);
  EXPECT_EQ(groups->groups[1].knowledge, IntrinsicsKnowledge::kUnknown);
  EXPECT_EQ(groups->groups[1].camera.cx_px, 319.5);
  EXPECT_TRUE(groups->groups[1].camera.validate());
}

TEST(GroupCameras, TakesTheGivenCameraOfTheSameSize) {
  const ImageFeatures a = picture(800, 600);
  const auto groups = group_cameras(
      {{"a", &a}}, {given_camera(1234, 600), given_camera(800, 600)}, GroupingMode::kAuto);
  ASSERT_TRUE(groups);
  EXPECT_EQ(groups->groups[0].knowledge, IntrinsicsKnowledge::kGiven);
  EXPECT_EQ(groups->groups[0].camera, given_camera(800, 600));
}

TEST(GroupCameras, ScalesTheGivenCameraAboutTheCornerOfTheImage) {
  const ImageFeatures half = picture(400, 300);
  const auto groups = group_cameras({{"a", &half}}, {given_camera(800, 600)}, GroupingMode::kAuto);
  ASSERT_TRUE(groups);
  const Camera& camera = groups->groups[0].camera;
  EXPECT_DOUBLE_EQ(camera.fx_px, 400.0);
  EXPECT_DOUBLE_EQ(camera.fy_px, 405.0);
  // The middle of the picture stays its middle: (width - 1) / 2 in both.
  EXPECT_DOUBLE_EQ(camera.cx_px, 199.5);
  EXPECT_DOUBLE_EQ(camera.cy_px, 149.5);
}

TEST(GroupCameras, RefusesAGivenCameraOfAnotherShapeAndAChoiceBetweenTwo) {
  const ImageFeatures a = picture(800, 600);
  const auto other = group_cameras({{"a", &a}}, {given_camera(800, 800)}, GroupingMode::kAuto);
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(other.error().message, HasSubstr("800x800"));
  EXPECT_FALSE(group_cameras(
      {{"a", &a}}, {given_camera(800, 600), given_camera(800, 600)}, GroupingMode::kAuto));
}

TEST(GroupCameras, PutsUnreadableImagesAside) {
  const ImageFeatures a = picture(800, 600);
  const auto groups = group_cameras({{"broken", nullptr}, {"a", &a}}, {}, GroupingMode::kAuto);
  ASSERT_TRUE(groups);
  EXPECT_EQ(groups->groups.size(), 1U);
  EXPECT_EQ(groups->group_of_image.size(), 2U);
}

TEST(GroupingMode, IsReadByName) {
  EXPECT_EQ(grouping_mode_from_string("folder"), GroupingMode::kPerFolder);
  EXPECT_EQ(grouping_mode_from_string("Folder"), std::nullopt);
}

}  // namespace
}  // namespace trigmesh
