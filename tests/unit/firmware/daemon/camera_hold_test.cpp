#include "firmware/daemon/camera_hold.hpp"

#include <map>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/camera/control_lock.hpp"

namespace trigmesh {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A camera with exposure and gain, each with an automatism; gain counts in hundredths.
class FakeControls final : public CameraControls {
 public:
  DeviceResult<std::vector<ControlRange>> list() override {
    std::vector<ControlRange> ranges;
    for (const auto& [id, value] : values) {
      ranges.push_back({.id = id,
                        .minimum = 0,
                        .maximum = 100'000,
                        .per_unit = id == ControlId::kGain ? 100 : 1});
    }
    return ranges;
  }

  DeviceResult<std::int64_t> get(ControlId id) override { return values.at(id); }

  DeviceResult<std::int64_t> set(ControlId id, std::int64_t value) override {
    if (refuses) {
      return device_fault(FaultKind::kControlRefused, "refused");
    }
    return values[id] = value;
  }

  DeviceResult<std::vector<ControlValue>> lock(const std::vector<ControlValue>& wanted) override {
    return lock_.lock(*this, "fake", wanted);
  }

  DeviceResult<> check_lock() override { return lock_.check(*this, "fake"); }

  std::map<ControlId, std::int64_t> values = {{ControlId::kExposureAuto, 1},
                                              {ControlId::kExposure, 5000},
                                              {ControlId::kGainAuto, 1},
                                              {ControlId::kGain, 400}};
  bool refuses = false;

 private:
  ControlLock lock_;
};

TEST(CameraHold, HoldsWhatTheCameraChoseAndGivesItFreeAgain) {
  FakeControls camera;
  CameraHold hold({});
  EXPECT_THAT(hold.on_camera_start(&camera), IsEmpty());
  EXPECT_THAT(hold.hold(&camera), IsEmpty());
  EXPECT_TRUE(hold.is_holding());
  EXPECT_EQ(camera.values[ControlId::kExposureAuto], 0);
  EXPECT_EQ(camera.values[ControlId::kExposure], 5000);
  EXPECT_THAT(hold.release(&camera), IsEmpty());
  EXPECT_EQ(camera.values[ControlId::kExposureAuto], 1);
  EXPECT_EQ(camera.values[ControlId::kGainAuto], 1);
}

TEST(CameraHold, SetsWhatTheOperatorWantsInUnitsOfTheCamera) {
  FakeControls camera;
  CameraHold hold({{{ControlId::kGain, 2.5}}});
  EXPECT_THAT(hold.on_camera_start(&camera), IsEmpty());
  EXPECT_EQ(camera.values[ControlId::kGain], 250);
  EXPECT_EQ(camera.values[ControlId::kGainAuto], 0);
  EXPECT_THAT(hold.hold(&camera), IsEmpty());
  EXPECT_THAT(hold.release(&camera), IsEmpty());
  EXPECT_EQ(camera.values[ControlId::kGainAuto], 0) << "the operator's value stays";
  EXPECT_EQ(camera.values[ControlId::kExposureAuto], 1);
}

TEST(CameraHold, TellsWhatDrifted) {
  FakeControls camera;
  CameraHold hold({});
  (void)hold.hold(&camera);
  EXPECT_THAT(hold.check(&camera), IsEmpty());
  camera.values[ControlId::kExposure] = 9000;
  EXPECT_THAT(hold.check(&camera), ElementsAre(HasSubstr("exposure")));
}

TEST(CameraHold, TellsWhatTheCameraHasNot) {
  FakeControls camera;
  CameraHold hold({{{ControlId::kFocus, 2.0}}});
  EXPECT_THAT(hold.on_camera_start(&camera), ElementsAre(HasSubstr("focus")));
  EXPECT_THAT(hold.hold(&camera), IsEmpty()) << "the others are held";
}

TEST(CameraHold, ARefusalIsToldAndNoFailure) {
  FakeControls camera;
  camera.refuses = true;
  CameraHold hold({});
  EXPECT_THAT(hold.hold(&camera), ElementsAre(HasSubstr("refused")));
  EXPECT_FALSE(hold.is_holding());
}

TEST(CameraHold, AFreeCameraThatComesBackIsFree) {
  FakeControls camera;
  CameraHold hold({});
  (void)hold.hold(&camera);
  (void)hold.release(nullptr);  // it was unplugged when the session ended
  EXPECT_THAT(hold.on_camera_start(&camera), IsEmpty());
  EXPECT_EQ(camera.values[ControlId::kExposureAuto], 1);
}

TEST(CameraHold, LeavesACameraAloneThatIsNotToBeLocked) {
  FakeControls camera;
  CameraHold hold({{}, /*locks=*/false});
  EXPECT_THAT(hold.hold(&camera), IsEmpty());
  EXPECT_EQ(camera.values[ControlId::kExposureAuto], 1);
  EXPECT_FALSE(hold.is_holding());
}

}  // namespace
}  // namespace trigmesh
