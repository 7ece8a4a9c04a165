// V4l2Source on a vivid device of a real kernel: the pixels that were fed, and every fault that the
// device can be asked for. Run in the guest by tests/rig; RIG_VIVID names the capture node by its
// stable name, RIG_FEED the file of raw frames that rig_vivid_feeder shows.

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>

#include <gtest/gtest.h>

#include "drivers/camera/v4l2/v4l2_source.hpp"
#include "firmware/base/file_bytes.hpp"
#include "firmware/base/unique_fd.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr std::chrono::nanoseconds kPatience = 20s;
const SteadyClock kClock;

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

std::ptrdiff_t open_descriptors() {
  return std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator());
}

/// A control of the device by the beginning of its name.
void set_control(const std::string& device, const std::string& name, int value) {
  const UniqueFd fd(::open(device.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK));
  ASSERT_TRUE(fd.valid()) << device;
  v4l2_queryctrl query{};
  query.id = V4L2_CTRL_FLAG_NEXT_CTRL;
  while (::ioctl(fd.get(), VIDIOC_QUERYCTRL, &query) == 0) {
    if (std::strncmp(reinterpret_cast<const char*>(query.name), name.c_str(), name.size()) == 0) {
      v4l2_control control{query.id, value};
      ASSERT_EQ(::ioctl(fd.get(), VIDIOC_S_CTRL, &control), 0) << name << ": " << strerror(errno);
      return;
    }
    query.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
  }
  FAIL() << device << " has no control '" << name << "'";
}

void write_to(const std::string& path, const std::string& text) {
  std::ofstream file(path);
  file << text << std::flush;
  ASSERT_TRUE(file.good()) << "cannot write " << text << " to " << path;
}

class VividCamera : public ::testing::Test {
 protected:
  void SetUp() override {
    if (device_.empty()) {
      GTEST_SKIP() << "RIG_VIVID names no device";
    }
    descriptors_ = open_descriptors();
    V4l2Options options;
    options.camera = device_;
    options.wish = {
        .width_px = 320, .height_px = 240, .rate_hz = 60.0, .format = PixelFormat::kYuyv};
    auto source = V4l2Source::create(options, std::make_shared<LinuxKernel>(), kClock);
    ASSERT_TRUE(source) << source.error().message;
    source_ = *std::move(source);
  }

  void TearDown() override {
    source_.reset();
    EXPECT_EQ(open_descriptors(), descriptors_) << "no descriptor is left open";
  }

  void start() {
    const DeviceResult<> started = source_->start();
    ASSERT_TRUE(started) << started.error().message;
  }

  [[nodiscard]] Frame next_frame() {
    FrameEvent event = source_->wait(kPatience);
    if (auto* frame = std::get_if<Frame>(&event)) {
      return std::move(*frame);
    }
    const auto* fault = std::get_if<DeviceFault>(&event);
    ADD_FAILURE() << "no frame: " << (fault != nullptr ? fault->message : "end or stop");
    return {};
  }

  /// Frames are passed over until a fault comes.
  [[nodiscard]] DeviceFault next_fault() {
    for (int i = 0; i < 500; ++i) {
      const FrameEvent event = source_->wait(kPatience);
      if (const auto* fault = std::get_if<DeviceFault>(&event)) {
        return *fault;
      }
    }
    ADD_FAILURE() << "500 frames and no fault";
    return {};
  }

  /// What the owner of a camera does after a fault that ended the stream.
  void expect_recovery() {
    source_->stop();
    start();
    EXPECT_FALSE(next_frame().empty());
  }

  void set(const std::string& control, int value = 0) { set_control(device_, control, value); }

  const std::string device_ = environment("RIG_VIVID");
  std::unique_ptr<V4l2Source> source_;
  std::ptrdiff_t descriptors_ = 0;
};

TEST_F(VividCamera, DeliversTheBytesThatWereFed) {
  const auto feed = read_file_bytes(environment("RIG_FEED"), 256'000'000);
  ASSERT_TRUE(feed) << feed.error().message;
  start();
  const FrameLayout layout = source_->info().layout;
  EXPECT_EQ(layout, (FrameLayout{PixelFormat::kYuyv, 320, 240, 640}));
  const std::size_t frame_bytes = needed_bytes(layout);
  std::vector<bool> seen(feed->size() / frame_bytes);
  // Every frame that is fed has to come by; the feeder shows each for several frames.
  for (int i = 0; i < 2000 && std::find(seen.begin(), seen.end(), false) != seen.end(); ++i) {
    const Frame frame = next_frame();
    ASSERT_EQ(frame.bytes().size(), frame_bytes);
    bool is_known = false;
    for (std::size_t k = 0; k < seen.size() && !is_known; ++k) {
      is_known =
          std::memcmp(frame.bytes().data(), feed->data() + k * frame_bytes, frame_bytes) == 0;
      seen[k] = seen[k] || is_known;
    }
    ASSERT_TRUE(is_known) << "frame " << i << " is none of those that were fed";
  }
  EXPECT_EQ(std::find(seen.begin(), seen.end(), false), seen.end());
}

TEST_F(VividCamera, PassesOverADamagedFrame) {
  start();
  EXPECT_FALSE(next_frame().empty());
  set("Inject V4L2_BUF_FLAG_ERROR");
  EXPECT_EQ(next_fault().kind, FaultKind::kCorruptFrame);
  EXPECT_FALSE(next_frame().empty());
}

TEST_F(VividCamera, ReportsARefusedStartAndStartsTheNextTime) {
  for (const char* fault : {"Inject VIDIOC_REQBUFS Error",
                            "Inject VIDIOC_QBUF Error",
                            "Inject VIDIOC_STREAMON Error"}) {
    set(fault);
    const DeviceResult<> started = source_->start();
    EXPECT_FALSE(started) << fault;
    EXPECT_EQ(open_descriptors(), descriptors_ + 1) << "only the wake event stays: " << fault;
    start();
    EXPECT_FALSE(next_frame().empty()) << fault;
    source_->stop();
  }
}

TEST_F(VividCamera, GoesOnAfterABufferWasNotTaken) {
  start();
  EXPECT_FALSE(next_frame().empty());
  set("Inject VIDIOC_QBUF Error");
  for (int i = 0; i < 20; ++i) {
    EXPECT_FALSE(next_frame().empty());
  }
}

TEST_F(VividCamera, ReportsAFatalErrorAndComesBack) {
  start();
  EXPECT_FALSE(next_frame().empty());
  set("Inject Fatal Streaming Error");
  const DeviceFault fault = next_fault();
  EXPECT_EQ(fault.kind, FaultKind::kIo) << fault.message;
  expect_recovery();
}

TEST_F(VividCamera, CountsDroppedFrames) {
  set("Percentage of Dropped Buffers", 60);
  start();
  for (int i = 0; i < 30; ++i) {
    EXPECT_FALSE(next_frame().empty());
  }
  set("Percentage of Dropped Buffers", 0);
  EXPECT_GT(source_->counters().missed, 10U);
}

TEST_F(VividCamera, KeepsOrderAcrossTheWrapOfSequenceAndTime) {
  set("Wrap Sequence Number", 1);
  for (const int wrap : {1, 2}) {
    set("Wrap Timestamp", wrap);
    start();
    std::optional<std::chrono::nanoseconds> last_time;
    std::uint64_t last_sequence = 0;
    // The device places the wrap within the first seconds of a stream.
    for (int i = 0; i < 150; ++i) {
      const Frame frame = next_frame();
      ASSERT_FALSE(frame.empty());
      EXPECT_TRUE(!last_time || *last_time < *frame.info().timestamp) << i;
      EXPECT_LE(*frame.info().timestamp, kClock.now()) << i;
      EXPECT_TRUE(i == 0 || last_sequence < frame.info().sequence) << i;
      EXPECT_LT(frame.info().missed_before, 1000U) << i;
      last_time = frame.info().timestamp;
      last_sequence = frame.info().sequence;
    }
    source_->stop();
  }
  set("Wrap Timestamp", 0);
  set("Wrap Sequence Number", 0);
}

TEST_F(VividCamera, SaysThatThereIsNoSignalAndComesBackWithIt) {
  set("DV Timings Signal Mode", 1);
  const DeviceResult<> started = source_->start();
  EXPECT_FALSE(started);
  EXPECT_TRUE(started || started.error().kind == FaultKind::kNoSignal) << started.error().message;
  set("DV Timings Signal Mode", 0);
  expect_recovery();
  set("DV Timings Signal Mode", 1);
  const DeviceFault fault = next_fault();
  EXPECT_EQ(fault.kind, FaultKind::kNoSignal) << fault.message;
  set("DV Timings Signal Mode", 0);
  expect_recovery();
}

TEST_F(VividCamera, SaysThatTheDeviceIsBusy) {
  start();
  EXPECT_FALSE(next_frame().empty());
  V4l2Options options;
  options.camera = device_;
  auto second = V4l2Source::create(options, std::make_shared<LinuxKernel>(), kClock);
  ASSERT_TRUE(second);
  const DeviceResult<> started = (*second)->start();
  ASSERT_FALSE(started);
  EXPECT_EQ(started.error().kind, FaultKind::kBusy) << started.error().message;
  EXPECT_FALSE(next_frame().empty()) << "the first goes on";
}

TEST_F(VividCamera, IsUnpluggedAndComesBackUnderItsName) {
  start();
  const Frame held = next_frame();
  const std::vector<std::uint8_t> copy(held.bytes().begin(), held.bytes().end());
  write_to("/sys/bus/platform/drivers/vivid/unbind", "vivid.0");
  const DeviceFault fault = next_fault();
  EXPECT_EQ(fault.kind, FaultKind::kDisconnected) << fault.message;
  EXPECT_TRUE(std::equal(copy.begin(), copy.end(), held.bytes().begin(), held.bytes().end()));
  source_->stop();
  const DeviceResult<> early = source_->start();
  ASSERT_FALSE(early);
  EXPECT_EQ(early.error().kind, FaultKind::kNotFound) << early.error().message;
  write_to("/sys/bus/platform/drivers/vivid/bind", "vivid.0");
  // udev makes the link of the stable name when it gets to it: what the policy's retries are for.
  DeviceResult<> started;
  for (int i = 0; i < 100; ++i) {
    started = source_->start();
    if (started) {
      break;
    }
    ASSERT_EQ(std::system("udevadm settle"), 0);
  }
  ASSERT_TRUE(started) << started.error().message;
  EXPECT_FALSE(next_frame().empty());
}

TEST_F(VividCamera, SeesADisconnectInTheMiddleOfAStream) {
  start();
  EXPECT_FALSE(next_frame().empty());
  set("Disconnect");
  EXPECT_EQ(next_fault().kind, FaultKind::kDisconnected);
}

}  // namespace
}  // namespace trigmesh
