#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <utility>

#include <gtest/gtest.h>

#ifdef TRIGMESH_WITH_LIBCAMERA
#include "drivers/camera/libcamera/libcamera_source.hpp"
#endif
#include "drivers/camera/mock/mock_source.hpp"
#include "drivers/camera/replay/replay_source.hpp"
#include "drivers/camera/v4l2/v4l2_source.hpp"
#include "tests/conformance/camera_backend.hpp"
#include "tests/support/temporary_folder.hpp"

namespace trigmesh::conformance {
namespace {

const SteadyClock kClock;

std::vector<std::uint8_t> some_bytes(std::size_t i) {
  return std::vector<std::uint8_t>(50 + i % 7, static_cast<std::uint8_t>(i));
}

std::chrono::nanoseconds some_time(std::size_t i) {
  return std::chrono::milliseconds(1000 + 33 * static_cast<std::int64_t>(i));
}

std::unique_ptr<FrameSource> make_mock(const CameraWish& wish) {
  MockScript script;
  script.info.stable_name = "mock";
  for (std::size_t i = 0; i < wish.frame_count; ++i) {
    script.steps.emplace_back(MockFrame{
        .bytes = some_bytes(i), .layout = {}, .timestamp = some_time(i), .lost_before = 0});
  }
  return std::make_unique<MockFrameSource>(std::move(script), kClock);
}

/// One folder for all recordings of this run; each is written once for its length.
std::unique_ptr<FrameSource> make_replay(const CameraWish& wish) {
  static const test_support::TemporaryFolder folder;
  const auto path = folder.path() / std::to_string(wish.frame_count);
  if (!std::filesystem::exists(path)) {
    std::filesystem::create_directories(path / "images");
    std::ofstream table(path / "timestamps.csv");
    table << "name,timestamp_ns\n";
    // Behind the frames of the wish stands one that is not due for a year: neither frame nor end.
    for (std::size_t i = 0; i <= wish.frame_count; ++i) {
      const std::string name = std::to_string(100'000 + i) + ".jpg";
      const std::vector<std::uint8_t> bytes = some_bytes(i);
      std::ofstream(path / "images" / name, std::ios::binary)
          .write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
      const auto late =
          i == wish.frame_count ? std::chrono::hours(24 * 365) : std::chrono::hours(0);
      table << name << ',' << (std::chrono::nanoseconds(i) + late).count() << '\n';
    }
  }
  auto recording = Recording::open(path);
  EXPECT_TRUE(recording) << recording.error().message;
  auto source = ReplaySource::create(
      *std::move(recording), {.pace = ReplayPace::kRecordedSpeed, .buffer_count = 4}, kClock);
  EXPECT_TRUE(source) << source.error().message;
  return *std::move(source);
}

void add_v4l2(CameraBackends& backends) {
  const char* device = std::getenv("TRIGMESH_TEST_V4L2");
  if (device == nullptr) {
    backends.skipped.emplace_back("v4l2: TRIGMESH_TEST_V4L2 names no device");
    return;
  }
  const auto make = [name = std::string(device)](const CameraWish&) {
    V4l2Options options;
    options.camera = name;
    auto source = V4l2Source::create(options, std::make_shared<LinuxKernel>(), kClock);
    EXPECT_TRUE(source) << source.error().message;
    return std::unique_ptr<FrameSource>(*std::move(source));
  };
  backends.running.push_back(
      {.name = "v4l2", .is_scripted = false, .loses_frames = true, .make = make});
}

#ifdef TRIGMESH_WITH_LIBCAMERA
void add_libcamera(CameraBackends& backends) {
  const char* camera = std::getenv("TRIGMESH_TEST_LIBCAMERA");
  if (camera == nullptr) {
    backends.skipped.emplace_back("libcamera: TRIGMESH_TEST_LIBCAMERA names no camera");
    return;
  }
  const std::string name = std::string_view(camera) == "first" ? "" : camera;
  const auto make = [name](const CameraWish&) {
    LibcameraOptions options;
    options.camera = name;
    options.wish = {.width_px = 640, .height_px = 480, .rate_hz = 30.0, .format = {}};
    auto source = LibcameraSource::create(options, kClock);
    EXPECT_TRUE(source) << source.error().message;
    return std::unique_ptr<FrameSource>(*std::move(source));
  };
  backends.running.push_back(
      {.name = "libcamera", .is_scripted = false, .loses_frames = true, .make = make});
}
#else
void add_libcamera(CameraBackends& backends) {
  backends.skipped.emplace_back("libcamera: not in this build (TRIGMESH_WITH_LIBCAMERA)");
}
#endif

CameraBackends find_backends() {
  CameraBackends backends;
  backends.running.push_back(
      {.name = "replay", .is_scripted = true, .loses_frames = false, .make = make_replay});
  backends.running.push_back(
      {.name = "mock", .is_scripted = true, .loses_frames = true, .make = make_mock});
  add_v4l2(backends);
  add_libcamera(backends);
  return backends;
}

}  // namespace

const CameraBackends& camera_backends() {
  static const CameraBackends backends = find_backends();
  return backends;
}

}  // namespace trigmesh::conformance
