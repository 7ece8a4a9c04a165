// V4l2Source on a camera of the kernel's own USB video driver: the bytes that the camera sent, and
// what happens when its cable is pulled. Run in the guest by tests/rig, which starts
// rig_uvc_camera; RIG_UVC names the node by its stable name, RIG_FEED the folder of its pictures.

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "drivers/camera/v4l2/v4l2_source.hpp"
#include "firmware/base/file_bytes.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using Bytes = std::string;

constexpr std::size_t kMostBytes = 256'000'000;
const SteadyClock kClock;

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

std::unique_ptr<V4l2Source> make(PixelFormat format) {
  V4l2Options options;
  options.camera = environment("RIG_UVC");
  options.wish = {.width_px = 320, .height_px = 240, .rate_hz = 10.0, .format = format};
  auto source = V4l2Source::create(options, std::make_shared<LinuxKernel>(), kClock);
  EXPECT_TRUE(source) << source.error().message;
  return *std::move(source);
}

/// Every picture of the camera has to come, and nothing else.
void expect_pictures(V4l2Source& source, const std::set<Bytes>& pictures) {
  const DeviceResult<> started = source.start();
  ASSERT_TRUE(started) << started.error().message;
  std::set<Bytes> seen;
  for (int i = 0; i < 200 && seen.size() < pictures.size(); ++i) {
    const FrameEvent event = source.wait(20s);
    const auto* frame = std::get_if<Frame>(&event);
    ASSERT_NE(frame, nullptr) << std::get<DeviceFault>(event).message;
    Bytes bytes(frame->bytes().begin(), frame->bytes().end());
    ASSERT_EQ(pictures.count(bytes), 1U) << "frame " << i << " is none of the camera's";
    seen.insert(std::move(bytes));
  }
  EXPECT_EQ(seen.size(), pictures.size());
}

TEST(UvcCamera, DeliversTheJpegBytesOfTheCamera) {
  std::set<Bytes> pictures;
  for (const fs::directory_entry& entry :
       fs::directory_iterator(fs::path(environment("RIG_FEED")) / "mjpg")) {
    const auto bytes = read_file(entry.path(), kMostBytes);
    ASSERT_TRUE(bytes) << bytes.error().message;
    pictures.insert(*bytes);
  }
  expect_pictures(*make(PixelFormat::kJpeg), pictures);
}

TEST(UvcCamera, DeliversTheRawPixelsOfTheCamera) {
  const auto raw = read_file(fs::path(environment("RIG_FEED")) / "feed.yuyv", kMostBytes);
  ASSERT_TRUE(raw) << raw.error().message;
  constexpr std::ptrdiff_t kFrameBytes = 320 * 240 * 2;
  std::set<Bytes> pictures;
  for (auto at = raw->begin(); at != raw->end(); at += kFrameBytes) {
    pictures.emplace(at, at + kFrameBytes);
  }
  expect_pictures(*make(PixelFormat::kYuyv), pictures);
}

TEST(UvcCamera, SaysThatItIsUnplugged) {
  const auto source = make(PixelFormat::kJpeg);
  ASSERT_TRUE(source->start());
  ASSERT_TRUE(std::holds_alternative<Frame>(source->wait(20s)));
  // The end of the camera's program is the pulled cable.
  ASSERT_EQ(std::system("kill $(cat camera.pid)"), 0);
  for (int i = 0; i < 100; ++i) {
    const FrameEvent event = source->wait(20s);
    if (const auto* fault = std::get_if<DeviceFault>(&event)) {
      EXPECT_EQ(fault->kind, FaultKind::kDisconnected) << fault->message;
      return;
    }
  }
  FAIL() << "frames go on without a camera";
}

}  // namespace
}  // namespace trigmesh
