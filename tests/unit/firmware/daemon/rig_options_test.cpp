#include "firmware/daemon/rig_options.hpp"

#include <chrono>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

DaemonOptions options_of(const Settings& settings) {
  return options_of_settings(settings, "profile", "1.2.3");
}

TEST(RigOptions, StillModeKeepsTheFramesInWhichAnEdgeMayBeHeardOfLate) {
  Settings settings;
  settings.capture.mode = CaptureSettings::Mode::kStill;
  settings.camera.rate_hz = 30;
  settings.trigger.debounce = milliseconds(100);

  const DaemonOptions options = options_of(settings);

  EXPECT_EQ(options.rig.rig.mode, CaptureMode::kStill);
  EXPECT_EQ(options.storage.store.session.mode, "still");
  EXPECT_EQ(options.capture.stills.history, 9U) << "six frames of 0.2 s and three more";
  EXPECT_GE(options.copies, options.capture.stills.history + options.stream_queue_frames);
}

TEST(RigOptions, TheShelfOfStillsHasABound) {
  Settings settings;
  settings.capture.mode = CaptureSettings::Mode::kStill;
  settings.camera.rate_hz = 240;
  settings.trigger.debounce = milliseconds(1000);

  EXPECT_EQ(options_of(settings).capture.stills.history, 32U);
}

TEST(RigOptions, VideoModeHasNoShelf) {
  Settings settings;
  settings.capture.mode = CaptureSettings::Mode::kVideo;
  settings.capture.video_trigger = CaptureSettings::VideoTrigger::kToggle;
  settings.capture.every_nth_sharp_frame = 7;

  const DaemonOptions options = options_of(settings);

  EXPECT_EQ(options.rig.rig.mode, CaptureMode::kVideo);
  EXPECT_EQ(options.rig.rig.video_trigger, VideoTrigger::kToggle);
  EXPECT_EQ(options.capture.stills.history, 0U);
  EXPECT_EQ(options.capture.group_size, 7U);
}

TEST(RigOptions, OnlyControlsThatAreSetAreWanted) {
  Settings settings;
  EXPECT_THAT(options_of(settings).capture.hold.wanted, IsEmpty());

  settings.camera.exposure = std::chrono::microseconds(4000);
  settings.camera.focus_dioptres = 0.0;  // infinity is a wish, too
  const auto wanted = options_of(settings).capture.hold.wanted;

  ASSERT_THAT(wanted, SizeIs(2));
  EXPECT_EQ(wanted[0].id, ControlId::kExposure);
  EXPECT_DOUBLE_EQ(wanted[0].value, 4000.0);
  EXPECT_EQ(wanted[1].id, ControlId::kFocus);
  EXPECT_DOUBLE_EQ(wanted[1].value, 0.0);
}

TEST(RigOptions, ASlowCameraIsNotTakenForASilentOne) {
  Settings settings;
  settings.camera.rate_hz = 30;
  EXPECT_EQ(options_of(settings).capture.silence, seconds(2));
  settings.camera.rate_hz = 1;
  EXPECT_EQ(options_of(settings).capture.silence, seconds(10));
}

TEST(RigOptions, StorageKnowsLimitsInBytesAndWhatASessionWasMadeWith) {
  Settings settings;
  settings.storage.root = "/somewhere";
  settings.storage.quota_mb = 5;
  settings.storage.reserve_mb = 6;
  settings.storage.remove_old = StorageSettings::Removal::kWhenNeeded;
  settings.reconstruction.seed = 42;

  const StorageOptions storage = options_of(settings).storage;

  EXPECT_EQ(storage.store.store.root, "/somewhere");
  EXPECT_EQ(storage.store.store.limits.quota_bytes, 5'000'000U);
  EXPECT_EQ(storage.store.store.limits.reserve_bytes, 6'000'000U);
  EXPECT_EQ(storage.store.store.retention.removal, RetentionRules::Removal::kWhenNeeded);
  EXPECT_EQ(storage.store.store.software_version, "1.2.3");
  EXPECT_EQ(storage.store.session.camera_profile, "profile");
  EXPECT_EQ(storage.store.session.seed, 42U);
  EXPECT_THAT(storage.store.session.settings, HasSubstr("/somewhere"));
}

}  // namespace
}  // namespace trigmesh
