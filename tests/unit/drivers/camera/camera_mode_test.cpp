#include "drivers/camera/camera_mode.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using std::chrono::nanoseconds;
using ::testing::HasSubstr;

constexpr nanoseconds kThirtieth{33'333'333};
constexpr nanoseconds kTenth{100'000'000};

const CameraWish kWish{.width_px = 1280, .height_px = 720, .rate_hz = 30.0, .format = {}};

CameraMode mode(PixelFormat format, int width, int height, nanoseconds interval = kThirtieth) {
  return {format, width, height, interval};
}

TEST(ChooseMode, TheSizeCounts_ThenTheRate_ThenTheFormat) {
  const CameraMode small_jpeg = mode(PixelFormat::kJpeg, 640, 480);
  const CameraMode slow_raw = mode(PixelFormat::kYuyv, 1280, 720, kTenth);
  const CameraMode fast_raw = mode(PixelFormat::kNv12, 1280, 720);
  const CameraMode jpeg = mode(PixelFormat::kJpeg, 1280, 720);
  const CameraMode first[] = {small_jpeg, slow_raw};
  EXPECT_EQ(*choose_mode(first, kWish, "c"), slow_raw);
  const CameraMode second[] = {slow_raw, fast_raw, small_jpeg};
  EXPECT_EQ(*choose_mode(second, kWish, "c"), fast_raw);
  const CameraMode third[] = {fast_raw, jpeg, slow_raw};
  EXPECT_EQ(*choose_mode(third, kWish, "c"), jpeg);
}

TEST(ChooseMode, ARateThatIsNotToldIsTakenForEnough) {
  const CameraMode modes[] = {mode(PixelFormat::kGrey, 1280, 720, kTenth),
                              mode(PixelFormat::kGrey, 1280, 720, nanoseconds(0))};
  EXPECT_EQ(choose_mode(modes, kWish, "c")->frame_interval, nanoseconds(0));
}

TEST(ChooseMode, KeepsToAFormatThatWasAskedFor) {
  CameraWish wish = kWish;
  wish.format = PixelFormat::kGrey;
  const CameraMode modes[] = {mode(PixelFormat::kJpeg, 1280, 720),
                              mode(PixelFormat::kGrey, 320, 240)};
  EXPECT_EQ(choose_mode(modes, wish, "c")->format, PixelFormat::kGrey);
  wish.format = PixelFormat::kNv12;
  const auto refused = choose_mode(modes, wish, "front");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, FaultKind::kFormatRefused);
  EXPECT_THAT(refused.error().message, HasSubstr("front does not deliver NV12"));
  EXPECT_THAT(refused.error().message, HasSubstr("JPEG, GREY"));
}

TEST(NearestStep, StaysOnTheStepsWithinTheBounds) {
  EXPECT_EQ(nearest_step(640, 16, 4096, 12), 640);
  EXPECT_EQ(nearest_step(641, 16, 4096, 12), 640);
  EXPECT_EQ(nearest_step(5, 16, 4096, 12), 16);
  EXPECT_EQ(nearest_step(9999, 16, 4096, 12), 4096);
  EXPECT_EQ(nearest_step(7, 5, 9, 0), 7) << "a camera that tells no step takes any size";
}

TEST(WishedInterval, IsOneOverTheRate) {
  EXPECT_EQ(wished_interval(kWish), kThirtieth);
}

}  // namespace
}  // namespace trigmesh
