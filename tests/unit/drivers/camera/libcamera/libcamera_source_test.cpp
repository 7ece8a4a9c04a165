#include "drivers/camera/libcamera/libcamera_source.hpp"

#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

const SteadyClock kClock;

/// No camera has this name, also where there are some.
LibcameraOptions no_camera() {
  LibcameraOptions options;
  options.camera = "/base/no/such/sensor@0";
  return options;
}

TEST(LibcameraOptions, SaysWhatIsWrong) {
  LibcameraOptions options;
  EXPECT_TRUE(options.validate());
  options.buffer_count = 2;
  EXPECT_THAT(options.validate().error().message, HasSubstr("buffer_count is 2"));
  options = {};
  options.wish.format = PixelFormat::kPng;
  EXPECT_THAT(options.validate().error().message, HasSubstr("PNG"));
  options = {};
  options.wish.rate_hz = 0.0;
  EXPECT_FALSE(LibcameraSource::create(options, kClock));
}

TEST(LibcameraSource, SaysThatThereIsNoSuchCameraAndWhatToDo) {
  const auto source = LibcameraSource::create(no_camera(), kClock);
  ASSERT_TRUE(source) << source.error().message;
  for (std::uint64_t tries = 1; tries <= 3; ++tries) {
    const auto started = (*source)->start();
    ASSERT_FALSE(started);
    EXPECT_EQ(started.error().kind, FaultKind::kNotFound);
    EXPECT_THAT(started.error().message, HasSubstr("no/such/sensor"));
    EXPECT_THAT(started.error().message, HasSubstr("libcamera-ipa"));
    EXPECT_EQ((*source)->counters().faults.of(FaultKind::kNotFound), tries);
    (*source)->stop();
  }
}

TEST(LibcameraSource, NeedsAStartForFramesAndControls) {
  const auto source = LibcameraSource::create(no_camera(), kClock);
  ASSERT_TRUE(source);
  const FrameEvent event = (*source)->wait(1s);
  EXPECT_EQ(std::get<DeviceFault>(event).kind, FaultKind::kNotStarted);
  EXPECT_EQ((*source)->controls()->list().error().kind, FaultKind::kNotStarted);
  EXPECT_EQ((*source)->controls()->get(ControlId::kGain).error().kind, FaultKind::kNotStarted);
  EXPECT_EQ((*source)->info().stable_name, no_camera().camera);
}

TEST(LibcameraSource, SeveralShareTheOneManager) {
  const auto first = LibcameraSource::create(no_camera(), kClock);
  const auto second = LibcameraSource::create(no_camera(), kClock);
  ASSERT_TRUE(first && second);
  EXPECT_FALSE((*first)->start());
  EXPECT_FALSE((*second)->start());
  EXPECT_TRUE(list_libcamera_cameras());
}

TEST(CameraHub, EndsAndBeginsAgain) {
  for (int round = 0; round < 3; ++round) {
    const auto hub = CameraHub::open();
    ASSERT_TRUE(hub) << hub.error().message;
  }
}

TEST(CameraHub, OpensOnAnyThread) {
  std::vector<std::jthread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([] {
      for (int round = 0; round < 5; ++round) {
        EXPECT_TRUE(CameraHub::open());
      }
    });
  }
}

TEST(ListLibcameraCameras, NamesEachOnce) {
  const auto cameras = list_libcamera_cameras();
  ASSERT_TRUE(cameras) << cameras.error().message;
  for (const LibcameraCamera& camera : *cameras) {
    EXPECT_FALSE(camera.stable_name.empty());
    EXPECT_THAT(describe(camera), HasSubstr(camera.stable_name));
  }
}

}  // namespace
}  // namespace trigmesh
