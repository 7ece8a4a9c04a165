#include "firmware/daemon/light.hpp"

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

RigState well() {
  RigState state;
  state.camera_present = true;
  return state;
}

TEST(LightPattern, AFaultComesFirst) {
  RigState state = well();
  state.session_open = true;
  state.camera_present = false;
  EXPECT_EQ(pattern_of(state, LastOutcome::kNone), IndicatorPattern::kFailed);
  state = well();
  state.storage = StorageLevel::kFull;
  EXPECT_EQ(pattern_of(state, LastOutcome::kDone), IndicatorPattern::kFailed);
}

TEST(LightPattern, ThenWhatTheRigDoes) {
  RigState state = well();
  EXPECT_EQ(pattern_of(state, LastOutcome::kNone), IndicatorPattern::kIdle);
  state.job = JobState::kRunning;
  EXPECT_EQ(pattern_of(state, LastOutcome::kFailed), IndicatorPattern::kWorking);
  state.session_open = true;
  EXPECT_EQ(pattern_of(state, LastOutcome::kNone), IndicatorPattern::kCapturing);
  state.storage = StorageLevel::kLow;
  EXPECT_EQ(pattern_of(state, LastOutcome::kNone), IndicatorPattern::kStorageLow);
}

TEST(LightPattern, ThenHowTheLastModelEnded) {
  EXPECT_EQ(pattern_of(well(), LastOutcome::kDone), IndicatorPattern::kDone);
  EXPECT_EQ(pattern_of(well(), LastOutcome::kFailed), IndicatorPattern::kFailed);
}

}  // namespace
}  // namespace trigmesh
