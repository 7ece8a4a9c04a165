#include "drivers/camera/v4l2/v4l2_controls.hpp"

#include <cerrno>

#include "tests/unit/drivers/camera/v4l2/fake_camera.hpp"

namespace trigmesh {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class V4l2ControlsTest : public test_support::FakeCameraTest {
 protected:
  V4l2ControlsTest() {
    kernel_->controls[V4L2_CID_EXPOSURE_AUTO] = {
        .maximum = 3, .standard = 3, .value = 3, .menu = {1, 3}};
    kernel_->controls[V4L2_CID_EXPOSURE_ABSOLUTE] = {
        .minimum = 3, .maximum = 2047, .standard = 250, .value = 80};
    kernel_->controls[V4L2_CID_GAIN] = {.maximum = 100, .step = 10, .value = 30};
    kernel_->controls[V4L2_CID_AUTO_WHITE_BALANCE] = {.maximum = 1, .standard = 1, .value = 1};
    kernel_->controls[V4L2_CID_WHITE_BALANCE_TEMPERATURE] = {
        .minimum = 2000, .maximum = 6500, .standard = 4000, .value = 4321};
    source_ = make();
    EXPECT_TRUE(source_->start());
  }

  [[nodiscard]] CameraControls& controls() { return *source_->controls(); }

  std::unique_ptr<V4l2Source> source_;
};

TEST_F(V4l2ControlsTest, ListsWhatTheCameraHasInOurUnits) {
  const auto ranges = controls().list();
  ASSERT_TRUE(ranges) << ranges.error().message;
  ASSERT_EQ(ranges->size(), 5U);
  EXPECT_EQ((*ranges)[0].id, ControlId::kExposureAuto);
  EXPECT_EQ((*ranges)[0].maximum, 1);
  EXPECT_EQ((*ranges)[0].standard, 1);
  EXPECT_EQ((*ranges)[1].id, ControlId::kExposure);
  EXPECT_EQ((*ranges)[1].minimum, 300) << "microseconds";
  EXPECT_EQ((*ranges)[1].maximum, 204'700);
}

TEST_F(V4l2ControlsTest, SetsAndReadsBackWhatWasTaken) {
  EXPECT_EQ(*controls().set(ControlId::kGain, 37), 30) << "steps of 10";
  EXPECT_EQ(*controls().get(ControlId::kGain), 30);
  EXPECT_EQ(*controls().get(ControlId::kExposureAuto), 1);
  EXPECT_EQ(*controls().set(ControlId::kExposureAuto, 0), 0);
  EXPECT_EQ(kernel_->controls[V4L2_CID_EXPOSURE_AUTO].value, 1) << "1 is manual";
  EXPECT_EQ(*controls().set(ControlId::kExposureAuto, 1), 1);
  EXPECT_EQ(kernel_->controls[V4L2_CID_EXPOSURE_AUTO].value, 3) << "this camera has no 0";
}

TEST_F(V4l2ControlsTest, RefusesWhatTheCameraDoesNotHaveOrTake) {
  EXPECT_EQ(controls().get(ControlId::kFocus).error().kind, FaultKind::kControlRefused);
  const auto beyond = controls().set(ControlId::kExposure, 1'000'000);
  ASSERT_FALSE(beyond);
  EXPECT_EQ(beyond.error().kind, FaultKind::kControlRefused);
  EXPECT_THAT(beyond.error().message, HasSubstr("300 to 204700"));
}

TEST_F(V4l2ControlsTest, HoldsWhatTheCameraChose) {
  const auto held = controls().lock({});
  ASSERT_TRUE(held) << held.error().message;
  EXPECT_THAT(*held,
              ElementsAre(ControlValue{ControlId::kExposureAuto, 0},
                          ControlValue{ControlId::kExposure, 8000},
                          ControlValue{ControlId::kGain, 30},
                          ControlValue{ControlId::kWhiteBalanceAuto, 0},
                          ControlValue{ControlId::kWhiteBalance, 4321}));
  EXPECT_TRUE(controls().check_lock());
  kernel_->controls[V4L2_CID_EXPOSURE_ABSOLUTE].value = 90;
  const auto drifted = controls().check_lock();
  ASSERT_FALSE(drifted);
  EXPECT_THAT(drifted.error().message, HasSubstr("held at 8000, now 9000"));
}

TEST_F(V4l2ControlsTest, HoldsWhatWasAskedForAndTellsItWithEachFrame) {
  ASSERT_TRUE(controls().lock({{ControlId::kExposure, 10'000}}));
  EXPECT_EQ(kernel_->controls[V4L2_CID_EXPOSURE_ABSOLUTE].value, 100);
  kernel_->frames.push_back(grey_frame(0));
  const FrameEvent event = source_->wait(std::chrono::seconds(1));
  EXPECT_EQ(std::get<Frame>(event).info().exposure, std::chrono::milliseconds(10));
}

TEST_F(V4l2ControlsTest, RefusesALockThatDoesNotHold) {
  EXPECT_EQ(controls().lock({{ControlId::kFocus, 1}}).error().kind, FaultKind::kControlRefused);
  EXPECT_EQ(controls().lock({{ControlId::kExposureAuto, 0}}).error().kind,
            FaultKind::kControlRefused);
  kernel_->controls[V4L2_CID_AUTO_WHITE_BALANCE].is_stuck = true;
  const auto stuck = controls().lock({});
  ASSERT_FALSE(stuck);
  EXPECT_THAT(stuck.error().message, HasSubstr("'white balance automatic' off"));
}

TEST_F(V4l2ControlsTest, ACameraThatComesBackIsSetToTheLock) {
  ASSERT_TRUE(controls().lock({}));
  source_->stop();
  kernel_->controls[V4L2_CID_EXPOSURE_AUTO].value = 3;
  kernel_->controls[V4L2_CID_EXPOSURE_ABSOLUTE].value = 500;
  ASSERT_TRUE(source_->start());
  EXPECT_EQ(kernel_->controls[V4L2_CID_EXPOSURE_AUTO].value, 1);
  EXPECT_EQ(kernel_->controls[V4L2_CID_EXPOSURE_ABSOLUTE].value, 80);
  source_->stop();
  kernel_->controls[V4L2_CID_EXPOSURE_ABSOLUTE].is_stuck = true;
  kernel_->controls[V4L2_CID_EXPOSURE_ABSOLUTE].value = 81;
  EXPECT_EQ(source_->start().error().kind, FaultKind::kControlRefused);
}

TEST_F(V4l2ControlsTest, NeedsACameraThatRuns) {
  source_->stop();
  EXPECT_EQ(controls().get(ControlId::kGain).error().kind, FaultKind::kNotStarted);
}

TEST_F(V4l2ControlsTest, AnUnpluggedCameraIsNotARefusal) {
  kernel_->is_plugged = false;
  EXPECT_EQ(controls().lock({}).error().kind, FaultKind::kDisconnected);
}

}  // namespace
}  // namespace trigmesh
