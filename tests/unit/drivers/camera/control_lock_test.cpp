#include "drivers/camera/control_lock.hpp"

#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// A camera whose exposure automatism steers the gain too, and forgets both when it goes off.
class OneAutomatism final : public CameraControls {
 public:
  [[nodiscard]] DeviceResult<std::vector<ControlRange>> list() override {
    std::vector<ControlRange> ranges;
    for (const auto& [id, value] : values) {
      ranges.push_back({.id = id, .minimum = 0, .maximum = 100'000, .step = 1, .standard = 0});
    }
    return ranges;
  }

  [[nodiscard]] DeviceResult<std::int64_t> get(ControlId id) override { return values.at(id); }

  [[nodiscard]] DeviceResult<std::int64_t> set(ControlId id, std::int64_t value) override {
    if (id == ControlId::kExposureAuto && value == 0) {
      values[ControlId::kExposure] = 1;
      values[ControlId::kGain] = 1;
    }
    values[id] = value / step * step;
    return values[id];
  }

  [[nodiscard]] DeviceResult<std::vector<ControlValue>> lock(
      const std::vector<ControlValue>& wanted) override {
    return lock_.lock(*this, "test", wanted);
  }

  [[nodiscard]] DeviceResult<> check_lock() override { return lock_.check(*this, "test"); }

  [[nodiscard]] DeviceResult<> restore_lock() { return lock_.restore(*this, "test"); }

  std::map<ControlId, std::int64_t> values = {
      {ControlId::kExposureAuto, 1}, {ControlId::kExposure, 8000}, {ControlId::kGain, 1500}};
  std::int64_t step = 1;

 private:
  ControlLock lock_;
};

TEST(ControlLock, HoldsAllThatOneAutomatismChose) {
  OneAutomatism camera;
  const auto held = camera.lock({});
  ASSERT_TRUE(held) << held.error().message;
  EXPECT_THAT(*held,
              ElementsAre(ControlValue{ControlId::kExposureAuto, 0},
                          ControlValue{ControlId::kExposure, 8000},
                          ControlValue{ControlId::kGain, 1500}));
  EXPECT_EQ(camera.values[ControlId::kGain], 1500);
}

TEST(ControlLock, AWishReplacesWhatTheCameraChose) {
  OneAutomatism camera;
  ASSERT_TRUE(camera.lock({{ControlId::kGain, 2000}}));
  EXPECT_EQ(camera.values[ControlId::kGain], 2000);
  EXPECT_EQ(camera.values[ControlId::kExposure], 8000);
}

TEST(ControlLock, FindsDriftAndRestores) {
  OneAutomatism camera;
  ASSERT_TRUE(camera.lock({}));
  camera.values[ControlId::kGain] = 1;
  EXPECT_THAT(camera.check_lock().error().message, HasSubstr("'gain': held at 1500, now 1"));
  ASSERT_TRUE(camera.restore_lock());
  EXPECT_TRUE(camera.check_lock());
  camera.step = 1000;
  EXPECT_EQ(camera.restore_lock().error().kind, FaultKind::kControlRefused);
}

}  // namespace
}  // namespace trigmesh
