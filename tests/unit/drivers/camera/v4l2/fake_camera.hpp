#pragma once

#include <cstring>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/camera/v4l2/v4l2_source.hpp"
#include "tests/unit/drivers/camera/v4l2/fake_kernel.hpp"

namespace trigmesh::test_support {

/// A fake USB camera of 8 x 4 grey pixels at 30 and 15 frames a second, with a stable name.
class FakeCameraTest : public ::testing::Test {
 protected:
  FakeCameraTest() {
    std::strcpy(reinterpret_cast<char*>(kernel_->capability.driver), "fakevideo");
    std::strcpy(reinterpret_cast<char*>(kernel_->capability.card), "Fake Camera");
    std::strcpy(reinterpret_cast<char*>(kernel_->capability.bus_info), "usb-fake-1");
    kernel_->capability.capabilities = V4L2_CAP_DEVICE_CAPS;
    kernel_->capability.device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
    kernel_->formats = {{V4L2_PIX_FMT_GREY, {{8, 4, {{1, 30}, {1, 15}}}}}};
    kernel_->links = {{"/dev/v4l/by-id/usb-Fake-index0", "/dev/video0"}};
  }

  ~FakeCameraTest() override {
    EXPECT_TRUE(kernel_->open_fds.empty()) << "a descriptor was left open";
    EXPECT_TRUE(kernel_->mappings.empty()) << "memory was left mapped";
  }

  [[nodiscard]] std::unique_ptr<V4l2Source> make(V4l2Options options = {}) {
    options.buffer_count = 4;
    auto source = V4l2Source::create(std::move(options), kernel_, time_);
    EXPECT_TRUE(source) << source.error().message;
    return *std::move(source);
  }

  /// A frame of the right size, taken `index` thirtieths of a second after the start.
  [[nodiscard]] static FakeFrame grey_frame(std::uint32_t index) {
    return {.bytes = std::vector<std::uint8_t>(32, static_cast<std::uint8_t>(index)),
            .sequence = index,
            .timestamp = std::chrono::milliseconds(50'000 + 33 * std::int64_t{index})};
  }

  [[nodiscard]] static FaultKind fault_of(const FrameEvent& event) {
    const auto* fault = std::get_if<DeviceFault>(&event);
    EXPECT_NE(fault, nullptr);
    return fault != nullptr ? fault->kind : FaultKind::kNotStarted;
  }

  ManualClock time_;
  std::shared_ptr<FakeKernel> kernel_ = std::make_shared<FakeKernel>(time_);
};

}  // namespace trigmesh::test_support
