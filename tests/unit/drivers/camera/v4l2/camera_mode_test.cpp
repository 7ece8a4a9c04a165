#include "drivers/camera/v4l2/camera_mode.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/drivers/camera/v4l2/fake_kernel.hpp"

namespace trigmesh {
namespace {

using std::chrono::nanoseconds;
using ::testing::ElementsAre;

const CameraWish kWish{.width_px = 1280, .height_px = 720, .rate_hz = 30.0, .format = {}};

CameraMode mode(PixelFormat format, int width, int height, nanoseconds interval) {
  return {format, width, height, interval};
}

TEST(Fourcc, GoesThereAndBack) {
  for (const PixelFormat format : kFormatOrder) {
    ASSERT_NE(fourcc_of(format), 0U) << to_string(format);
    EXPECT_EQ(format_of_fourcc(fourcc_of(format)), format);
  }
  EXPECT_EQ(fourcc_of(PixelFormat::kPng), 0U);
  EXPECT_EQ(format_of_fourcc(V4L2_PIX_FMT_JPEG), PixelFormat::kJpeg);
  EXPECT_FALSE(format_of_fourcc(V4L2_PIX_FMT_H264));
}

TEST(ListModes, AsksForSizesAndTheNearestRate) {
  test_support::ManualClock time;
  test_support::FakeKernel kernel(time);
  kernel.formats = {{V4L2_PIX_FMT_H264, {{1280, 720, {{1, 30}}}}},
                    {V4L2_PIX_FMT_MJPEG, {{1280, 720, {{1, 60}, {1, 25}}}, {640, 480, {}}}}};
  const int fd = kernel.open("/dev/video0");
  EXPECT_THAT(list_modes(kernel, fd, kWish),
              ElementsAre(mode(PixelFormat::kJpeg, 1280, 720, nanoseconds(40'000'000)),
                          mode(PixelFormat::kJpeg, 640, 480, nanoseconds(0))));
}

TEST(ListModes, TriesTheWishWhereNoSizesAreTold) {
  test_support::ManualClock time;
  test_support::FakeKernel kernel(time);
  kernel.formats = {{V4L2_PIX_FMT_YUYV, {}}};
  const int fd = kernel.open("/dev/video0");
  EXPECT_THAT(list_modes(kernel, fd, kWish),
              ElementsAre(mode(PixelFormat::kYuyv, 1280, 720, nanoseconds(0))));
}

}  // namespace
}  // namespace trigmesh
