#include "drivers/camera/v4l2/camera_list.hpp"

#include <cerrno>

#include "tests/unit/drivers/camera/v4l2/fake_camera.hpp"

namespace trigmesh {
namespace {

using ::testing::HasSubstr;

using CameraListTest = test_support::FakeCameraTest;

TEST_F(CameraListTest, NamesACameraByItsLink) {
  kernel_->links["/dev/v4l/by-path/pci-usb-0:1-index0"] = "/dev/video0";
  const auto cameras = list_cameras(*kernel_);
  ASSERT_EQ(cameras.size(), 1U);
  EXPECT_EQ(cameras[0].stable_name, "/dev/v4l/by-id/usb-Fake-index0");
  EXPECT_EQ(cameras[0].path, "/dev/video0");
  EXPECT_EQ(cameras[0].model, "Fake Camera");
  kernel_->links.erase("/dev/v4l/by-id/usb-Fake-index0");
  EXPECT_EQ(list_cameras(*kernel_)[0].stable_name, "/dev/v4l/by-path/pci-usb-0:1-index0");
  kernel_->links.clear();
  EXPECT_EQ(list_cameras(*kernel_)[0].stable_name, "bus:usb-fake-1");
}

TEST_F(CameraListTest, FindsByLinkByPathByBusAndTheFirst) {
  for (const char* name : {"/dev/v4l/by-id/usb-Fake-index0", "/dev/video0", ""}) {
    const auto camera = find_camera(*kernel_, name);
    ASSERT_TRUE(camera) << name;
    EXPECT_EQ(camera->path, "/dev/video0");
    EXPECT_EQ(camera->stable_name, "/dev/v4l/by-id/usb-Fake-index0") << name;
  }
  kernel_->links.clear();
  EXPECT_TRUE(find_camera(*kernel_, "bus:usb-fake-1"));
}

TEST_F(CameraListTest, SaysWhichCamerasThereAre) {
  const auto missing = find_camera(*kernel_, "bus:other");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().kind, FaultKind::kNotFound);
  EXPECT_THAT(missing.error().message, HasSubstr("usb-Fake-index0 (Fake Camera)"));
  EXPECT_EQ(find_camera(*kernel_, "/dev/video7").error().kind, FaultKind::kNotFound);
}

TEST_F(CameraListTest, LeavesOutNodesThatGiveNoPictures) {
  kernel_->capability.device_caps = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  EXPECT_TRUE(list_cameras(*kernel_).empty());
  EXPECT_EQ(find_camera(*kernel_, "/dev/video0").error().kind, FaultKind::kFormatRefused);
}

TEST_F(CameraListTest, TellsNoPermissionFromNotThere) {
  kernel_->open_error = EACCES;
  EXPECT_EQ(find_camera(*kernel_, "/dev/video0").error().kind, FaultKind::kPermission);
  EXPECT_TRUE(list_cameras(*kernel_).empty());
}

}  // namespace
}  // namespace trigmesh
