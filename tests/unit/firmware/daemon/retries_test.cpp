#include "firmware/daemon/retries.hpp"

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using std::chrono::milliseconds;

TEST(Retries, DelaysDoubleUpToTheLongest) {
  Retries retries;
  EXPECT_EQ(retries.delay_after(FaultKind::kDisconnected), milliseconds(250));
  EXPECT_EQ(retries.delay_after(FaultKind::kDisconnected), milliseconds(500));
  EXPECT_EQ(retries.delay_after(FaultKind::kDisconnected), milliseconds(1000));
  for (int i = 0; i < 100; ++i) {
    (void)retries.delay_after(FaultKind::kDisconnected);
  }
  EXPECT_EQ(retries.delay_after(FaultKind::kDisconnected), milliseconds(2000))
      << "a cable may come back in an hour";
}

TEST(Retries, BeginAnewWhenTheDeviceWorked) {
  Retries retries;
  (void)retries.delay_after(FaultKind::kDisconnected);
  retries.reset();
  EXPECT_EQ(retries.delay_after(FaultKind::kDisconnected), milliseconds(250));
}

TEST(Retries, SlowlyAfterTheTableGivesUp) {
  Retries retries;
  EXPECT_EQ(retries.delay_after(FaultKind::kFormatRefused), Retries::kAfterGivingUp);
  Retries permission;
  const int tries = fault_policy(FaultKind::kPermission).max_tries;
  for (int i = 0; i < tries; ++i) {
    EXPECT_LT(permission.delay_after(FaultKind::kPermission), Retries::kAfterGivingUp);
  }
  EXPECT_EQ(permission.delay_after(FaultKind::kPermission), Retries::kAfterGivingUp);
}

}  // namespace
}  // namespace trigmesh
