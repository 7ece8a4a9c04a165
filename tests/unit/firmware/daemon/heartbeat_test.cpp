#include "firmware/daemon/heartbeat.hpp"

#include <gtest/gtest.h>

#include "tests/support/manual_clock.hpp"

namespace trigmesh {
namespace {

using std::chrono::seconds;

TEST(Heartbeats, NameTheThreadThatHangs) {
  test_support::ManualClock clock;
  Heartbeats beats(clock);
  Heartbeat& camera = beats.add("camera");
  Heartbeat& storage = beats.add("storage");
  clock.time += seconds(10);
  camera.beat();
  storage.beat();
  EXPECT_FALSE(beats.hung(seconds(5)));
  clock.time += seconds(6);
  camera.beat();
  EXPECT_EQ(beats.hung(seconds(5)), "storage");
}

TEST(ProgressWatch, LooksAtTheCountOnlyWhileWorkIsDone) {
  ProgressWatch watch(seconds(10));
  EXPECT_TRUE(watch.gets_on(false, 0, seconds(100)));
  EXPECT_TRUE(watch.gets_on(true, 0, seconds(200)));
  EXPECT_TRUE(watch.gets_on(true, 0, seconds(210)));
  EXPECT_FALSE(watch.gets_on(true, 0, seconds(211)));
  EXPECT_TRUE(watch.gets_on(true, 1, seconds(212)));
  EXPECT_TRUE(watch.gets_on(true, 1, seconds(222)));
  EXPECT_TRUE(watch.gets_on(false, 1, seconds(300)));
  EXPECT_TRUE(watch.gets_on(true, 1, seconds(400))) << "the next work has its own time";
}

}  // namespace
}  // namespace trigmesh
