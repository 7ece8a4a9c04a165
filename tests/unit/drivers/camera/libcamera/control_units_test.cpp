#include "drivers/camera/libcamera/control_units.hpp"

#include <limits>

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

TEST(ControlUnits, CountsFractionsInThousandths) {
  EXPECT_EQ(to_our_unit(ControlId::kGain, 1.5), 1500);
  EXPECT_EQ(to_our_unit(ControlId::kFocus, 0.3333), 333);
  EXPECT_EQ(to_our_unit(ControlId::kExposure, 8000.0), 8000) << "microseconds on both sides";
  EXPECT_DOUBLE_EQ(to_their_unit(ControlId::kWhiteBalance, 2125), 2.125);
}

TEST(ControlUnits, StaysWithinWhatANumberHolds) {
  EXPECT_GT(to_our_unit(ControlId::kGain, std::numeric_limits<double>::infinity()), 0);
}

TEST(ControlUnits, ASensorsStepIsStillTheValue) {
  EXPECT_TRUE(is_taken(ControlId::kExposure, 10'000, 9'987));
  EXPECT_FALSE(is_taken(ControlId::kExposure, 10'000, 9'000));
  EXPECT_TRUE(is_taken(ControlId::kFocus, 0, 1));
  EXPECT_FALSE(is_taken(ControlId::kExposureAuto, 0, 1)) << "on is not nearly off";
}

}  // namespace
}  // namespace trigmesh
