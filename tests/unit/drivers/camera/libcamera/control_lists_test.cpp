#include "drivers/camera/libcamera/control_lists.hpp"

#include <array>
#include <limits>

#include <gtest/gtest.h>
#include <libcamera/control_ids.h>
#include <libcamera/controls.h>

namespace trigmesh {
namespace {

namespace controls = libcamera::controls;

libcamera::ControlInfoMap some_camera() {
  return {{
              {&controls::AeEnable, libcamera::ControlInfo(false, true, true)},
              {&controls::ExposureTime,
               libcamera::ControlInfo(std::int32_t{30}, std::int32_t{66'000}, std::int32_t{0})},
              {&controls::AnalogueGain, libcamera::ControlInfo(1.0F, 16.0F, 2.0F)},
              {&controls::ColourGains, libcamera::ControlInfo(0.0F, 32.0F)},
              {&controls::LensPosition, libcamera::ControlInfo(0.0F, 0.0F)},
          },
          controls::controls};
}

TEST(RangeOf, TellsWhatTheCameraHasInOurUnits) {
  const libcamera::ControlInfoMap camera = some_camera();
  const auto automatic = range_of(camera, ControlId::kExposureAuto);
  ASSERT_TRUE(automatic);
  EXPECT_EQ(automatic->maximum, 1);
  EXPECT_EQ(automatic->standard, 1);
  const auto exposure = range_of(camera, ControlId::kExposure);
  ASSERT_TRUE(exposure);
  EXPECT_EQ(exposure->minimum, 30);
  EXPECT_EQ(exposure->maximum, 66'000);
  EXPECT_EQ(exposure->standard, 30) << "a default out of range is put into it";
  EXPECT_EQ(range_of(camera, ControlId::kGain)->maximum, 16'000);
  EXPECT_EQ(range_of(camera, ControlId::kGain)->standard, 2'000);
  EXPECT_EQ(range_of(camera, ControlId::kWhiteBalance)->maximum, 32'000);
}

TEST(RangeOf, HasNothingForWhatTheCameraDoesNotHave) {
  const libcamera::ControlInfoMap camera = some_camera();
  EXPECT_FALSE(range_of(camera, ControlId::kGainAuto)) << "AeEnable is for both";
  EXPECT_FALSE(range_of(camera, ControlId::kWhiteBalanceAuto));
  EXPECT_FALSE(range_of(camera, ControlId::kFocusAuto));
}

TEST(RangeOf, TakesAnEmptyRangeForNoBound) {
  EXPECT_GE(range_of(some_camera(), ControlId::kFocus)->maximum, 1'000'000);
}

TEST(WriteControl, TranslatesEach) {
  libcamera::ControlList request(controls::controls);
  write_control(request, {ControlId::kExposureAuto, 0}, 1.0F);
  write_control(request, {ControlId::kExposure, 8000}, 1.0F);
  write_control(request, {ControlId::kGain, 1500}, 1.0F);
  write_control(request, {ControlId::kWhiteBalanceAuto, 1}, 1.0F);
  write_control(request, {ControlId::kWhiteBalance, 2000}, 1.25F);
  write_control(request, {ControlId::kFocusAuto, 0}, 1.0F);
  write_control(request, {ControlId::kFocus, 500}, 1.0F);
  EXPECT_EQ(request.get(controls::AeEnable), false);
  EXPECT_EQ(request.get(controls::ExposureTime), 8000);
  EXPECT_EQ(request.get(controls::AnalogueGain), 1.5F);
  EXPECT_EQ(request.get(controls::AwbEnable), true);
  const auto gains = request.get(controls::ColourGains);
  ASSERT_TRUE(gains);
  EXPECT_EQ((*gains)[0], 2.0F);
  EXPECT_EQ((*gains)[1], 1.25F);
  EXPECT_EQ(request.get(controls::AfMode), std::int32_t{controls::AfModeManual});
  EXPECT_EQ(request.get(controls::LensPosition), 0.5F);
}

TEST(ReadControls, TellsWhatIsInTheMetadataAndNothingElse) {
  libcamera::ControlList metadata(controls::controls);
  EXPECT_FALSE(read_controls(metadata)[ControlId::kExposure]);
  metadata.set(controls::ExposureTime, std::int32_t{9987});
  metadata.set(controls::AnalogueGain, 2.0F);
  const std::array<float, 2> gains = {1.5F, 1.75F};
  metadata.set(controls::ColourGains, libcamera::Span<const float, 2>(gains));
  const ToldControls told = read_controls(metadata);
  EXPECT_EQ(told[ControlId::kExposure], 9987);
  EXPECT_EQ(told[ControlId::kGain], 2000);
  EXPECT_EQ(told[ControlId::kWhiteBalance], 1500);
  EXPECT_EQ(told.blue_gain, 1.75F);
  EXPECT_FALSE(told[ControlId::kFocus]);
}

}  // namespace
}  // namespace trigmesh
