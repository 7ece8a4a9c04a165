#include "drivers/camera/v4l2/agreed_format.hpp"

#include <cerrno>

#include "tests/unit/drivers/camera/v4l2/fake_camera.hpp"

namespace trigmesh {
namespace {

using ::testing::HasSubstr;

class AgreedFormatTest : public test_support::FakeCameraTest {
 protected:
  [[nodiscard]] DeviceResult<AgreedFormat> agree(PixelFormat format) {
    const int fd = kernel_->open("/dev/video0");
    auto agreed =
        agree_on_format(*kernel_, fd, {format, 8, 4, std::chrono::milliseconds(40)}, "camera");
    kernel_->close(fd);
    return agreed;
  }
};

TEST_F(AgreedFormatTest, TakesTheStrideOfTheDriver) {
  kernel_->bytes_per_line = 64;
  const auto agreed = agree(PixelFormat::kYuyv);
  ASSERT_TRUE(agreed) << agreed.error().message;
  EXPECT_EQ(agreed->layout, (FrameLayout{PixelFormat::kYuyv, 8, 4, 64}));
  EXPECT_EQ(agreed->frame_interval, std::chrono::milliseconds(40));
  kernel_->bytes_per_line = 0;
  EXPECT_EQ(agree(PixelFormat::kYuyv)->layout.stride_bytes, 16U);
  EXPECT_EQ(agree(PixelFormat::kJpeg)->layout.stride_bytes, 0U);
}

TEST_F(AgreedFormatTest, RefusesWhatWasNotAskedFor) {
  kernel_->forced_fourcc = V4L2_PIX_FMT_H264;
  const auto other = agree(PixelFormat::kGrey);
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().kind, FaultKind::kFormatRefused);
  EXPECT_THAT(other.error().message, HasSubstr("insists on H264"));
  kernel_->forced_fourcc = 0;
  kernel_->forced_field = V4L2_FIELD_INTERLACED;
  EXPECT_EQ(agree(PixelFormat::kGrey).error().kind, FaultKind::kFormatRefused);
  kernel_->forced_field = 0;
  kernel_->bytes_per_line = 7;
  EXPECT_EQ(agree(PixelFormat::kGrey).error().kind, FaultKind::kFormatRefused);
}

TEST_F(AgreedFormatTest, SaysThatAnotherProgramStreams) {
  kernel_->errors[VIDIOC_S_FMT] = EBUSY;
  EXPECT_EQ(agree(PixelFormat::kGrey).error().kind, FaultKind::kBusy);
}

TEST_F(AgreedFormatTest, DoesWithoutRates) {
  kernel_->errors[VIDIOC_S_PARM] = ENOTTY;
  const auto agreed = agree(PixelFormat::kGrey);
  ASSERT_TRUE(agreed);
  EXPECT_EQ(agreed->frame_interval.count(), 0);
}

}  // namespace
}  // namespace trigmesh
