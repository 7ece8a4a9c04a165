#include <algorithm>
#include <chrono>
#include <string>

#include <gtest/gtest.h>

#include "firmware/daemon/logging.hpp"
#include "tests/support/manual_clock.hpp"

namespace trigmesh {
namespace {

using std::chrono::seconds;

TEST(Faults, TellWhatDoesNotWorkUntilItDoes) {
  const test_support::ManualClock clock;
  Faults faults(clock, seconds(60));
  EXPECT_EQ(faults.text(), "");
  faults.report("storage", "the disk is full");
  faults.report("camera", "unplugged");
  EXPECT_EQ(faults.text(), "camera: unplugged; storage: the disk is full");
  faults.report("camera", "busy");
  EXPECT_EQ(faults.text_of("camera"), "busy");
  faults.clear("camera");
  faults.clear("camera");
  EXPECT_EQ(faults.text_of("camera"), "");
  EXPECT_EQ(faults.text(), "storage: the disk is full");
}

TEST(Faults, AreLoggedWhenTheyBeginWhenTheyEndAndInBetweenOnceInAnInterval) {
  test_support::ManualClock clock;
  Faults faults(clock, seconds(60));
  testing::internal::CaptureStderr();
  faults.report("camera", "gone");
  for (int i = 0; i < 119; ++i) {
    clock.time += seconds(1);
    faults.report("camera", "gone");
  }
  faults.clear("camera");
  const std::string lines = testing::internal::GetCapturedStderr();
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '\n'), 3) << lines;
}

}  // namespace
}  // namespace trigmesh
